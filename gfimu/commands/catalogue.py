"""Under `gfimu list`, `gfimu show` and `gfimu new`: what comes with gfimu, and files to start from."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from gfimu.files.outputs import TOML_FILE, writes

__all__ = ["KINDS", "TEMPLATES", "catalogue", "new", "show"]

KINDS = ("arrays", "parts", "maps", "twins", "scenarios", "effects", "formats")
"""What can be listed."""

TEMPLATES = ("array", "part", "map", "twin", "scenario")
"""What can be begun."""

_FILES = ("arrays", "parts", "maps", "twins", "scenarios")


def catalogue(kind: str) -> dict[str, str]:
    """Return what comes with gfimu of one kind: name and what it is, one line each.

    Parameters
    ----------
    kind : str
        One of `KINDS`.

    Raises
    ------
    InputError
        If the kind is unknown.
    """
    from gfimu.errors import unknown_name

    if kind not in KINDS:
        raise unknown_name("kind", kind, KINDS)
    if kind == "effects":
        from sim.effects import EFFECTS, FURTHER_EFFECTS, added_effects

        return {name: family.summary for name, family in {**EFFECTS, **FURTHER_EFFECTS, **added_effects()}.items()}
    if kind == "formats":
        from gfimu.importing.readers import readers
        from gfimu.recording.formats import formats

        whole = {name: one.summary for name, one in formats().items()}
        return whole | {name: one.summary for name, one in readers().items()}
    return dict(_described(kind))


def show(name: str) -> str:
    """Return the file of an array, part, map, twin or scenario that comes with gfimu, or the description of an effect.

    Raises
    ------
    InputError
        If nothing has that name.
    """
    from gfimu.errors import unknown_name
    from gfimu.files.model_files import find_model, list_models

    for kind in _FILES:
        if name in list_models(kind):
            return find_model(kind, name).read_text(encoding="utf-8")
    effects = catalogue("effects")
    if name in effects:
        return f"{name}: {effects[name]}\n"
    raise unknown_name("name", name, [one for kind in (*_FILES, "effects") for one in catalogue(kind)])


@writes(out=TOML_FILE)
def new(kind: str, *, out: str | Path | None = None) -> str:
    """Return a commented file to edit: an array, a part, a column map, a twin or a scenario.

    Parameters
    ----------
    kind : str
        One of `TEMPLATES`.
    out : str or Path, optional
        File to write, ``.toml``; one that is there is not replaced.

    Raises
    ------
    InputError
        If the kind is unknown, or the file is there already.
    """
    from gfimu.errors import InputError, unknown_name
    from gfimu.files.atomic_file import write_text
    from gfimu.files.model_files import find_model

    if kind not in TEMPLATES:
        raise unknown_name("kind", kind, TEMPLATES)
    text = find_model("templates", kind).read_text(encoding="utf-8")
    if out is not None:
        if Path(out).exists():
            raise InputError(f"{out}: is there already; choose another name")
        write_text(out, text)
    return text


def _described(kind: str) -> Iterator[tuple[str, str]]:
    """Yield names and descriptions of model files; the first comment where a file has no description."""
    from gfimu.files.model_files import find_model, list_models, read_toml

    for name in list_models(kind):
        path = find_model(kind, name)
        content = read_toml(path)
        comment = next(
            (line.lstrip("# ") for line in path.read_text(encoding="utf-8").splitlines() if line[:1] == "#"), ""
        )
        yield name, str(content.get("description") or content.get("summary") or comment)
