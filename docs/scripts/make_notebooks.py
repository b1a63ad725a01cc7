"""Make the notebooks (``docs/notebooks/*.ipynb``) from their scripts, with outputs.

A notebook's source is a script in the percent format, which is read in reviews and runs without Jupyter:
``# %%`` begins a cell of code, ``# %% [markdown]`` one of text. The notebook is made from it, so that pages and viewers
show its pictures.

Run ``python docs/scripts/make_notebooks.py [NAME ...]``; it needs nbclient and ipykernel
(``pip install 'gfimu[test]'``).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
LONGEST_S = 300
MARKDOWN = "# %% [markdown]"


def cells_of(script: str) -> list[tuple[str, str]]:
    """Return the cells of a script: ``code`` or ``markdown``, and their text."""
    cells: list[tuple[str, list[str]]] = []
    for line in script.splitlines():
        if line.startswith("# %%"):
            cells.append(("markdown" if line.startswith(MARKDOWN) else "code", []))
        elif cells:
            cells[-1][1].append(line)
        elif line.strip():
            raise ValueError(f"{line!r} stands before the first cell")
    return [(kind, _text(kind, lines)) for kind, lines in cells]


def cells_of_notebook(notebook: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the cells of a notebook's JSON in the same form."""
    return [(cell["cell_type"], "".join(cell["source"])) for cell in notebook["cells"]]


def _text(kind: str, lines: list[str]) -> str:
    if kind == "markdown":
        lines = [line.removeprefix("#").removeprefix(" ") for line in lines]
    return "\n".join(lines).strip("\n")


def make(script: Path) -> Path:
    """Write the notebook of a script, executed; raises where a cell fails."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.v4.new_notebook()
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    for number, (kind, text) in enumerate(cells_of(script.read_text(encoding="utf-8")), start=1):
        new = nbformat.v4.new_markdown_cell if kind == "markdown" else nbformat.v4.new_code_cell
        cell = new(text)
        cell["id"] = f"{script.stem.replace('_', '-')}-{number}"
        notebook.cells.append(cell)
    NotebookClient(notebook, timeout=LONGEST_S, resources={"metadata": {"path": FOLDER}}).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # when it ran
    notebook.metadata["language_info"] = {"name": "python"}
    path = script.with_suffix(".ipynb")
    nbformat.write(notebook, path)
    return path


def main(names: list[str]) -> list[Path]:
    """Make the notebooks of some scripts, of all by default."""
    scripts = [FOLDER / f"{name}.py" for name in names] or sorted(FOLDER.glob("*.py"))
    return [make(script) for script in scripts]


if __name__ == "__main__":
    for made in main(sys.argv[1:]):
        print(made)
