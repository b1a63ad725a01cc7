"""Write docs/reference/files.md, the reference of the files that a user writes by hand, from their schemas.

The JSON schemas of all kinds, and that of a certificate, which `gfimu certificate` writes, are published with it.

Run ``python docs/scripts/make_files_reference.py``.
"""

from __future__ import annotations

from pathlib import Path

from file_tables import TableRows, table_rows

from gfimu.base.files.schema import json_schema
from gfimu.calibration.certificate.schema import SCHEMA_FILE, certificate_schema
from gfimu.commands.file_kinds import FILE_KINDS, file_schema

PAGE = Path(__file__).resolve().parents[1] / "reference" / "files.md"
SCHEMAS = PAGE.parent / "schemas"

INTRODUCTION = """\
# Files key by key
<!-- made by make_files_reference.py; edit the schemas that are named below -->
Arrays, parts, column maps, twins, scenarios, frames, stages, plans and briefs are TOML files. `gfimu list arrays` lists
the shipped ones, `gfimu show cube12` prints one, and `gfimu new array --out my_array.toml` writes a commented
one to edit. A key that is not on this page is refused, and the message names the nearest valid one. Part files may hold
further keys, which are ignored.

Editors with [taplo](https://taplo.tamasfe.dev) (Even Better TOML in VS Code) complete and check these files by a JSON
schema. `gfimu new array --out my_array.toml --schema array.schema.json` writes the file, the schema, and the line
`#:schema ./array.schema.json` that connects the two. The schemas are also here:
SCHEMA_LINKS.

Units stand at the end of a key. Frames and signs are in [Conventions](conventions.md), recordings in
[Formats](recording-format.md).
"""

AFTER = {
    "array": """\
`part` names a shipped part, or a part file of your own beside the array file or in the current directory. A recording
carries the text of both.

A chip's own `supply_V` and `output_data_rate_hz` override those of a scenario: the simulation takes offset, gain,
noise, last bit and bandwidth of that chip from them, and estimation its noise. The firmware on the emulated board sets
the output data rate of all chips itself. `own_clock` is stored with the array and shown; the simulation samples all
chips by the board's clock unless an effect (`channel_skew`) changes that.
""",
    "part": """\
In the shipped parts each figure has a mark. `[1]` is the first source at the head of the file. `[1*]` was
taken from it earlier and not read again. `[derived]` follows from another key. `[unchecked]` is a usual figure for
which no source was read.
""",
    "scenario": """\
A segment may stand on one line: `segment = [{ kind = "hold", duration_s = 3.0 }, …]` under `[motion]`.
""",
}


def files_page() -> str:
    """Return the text of the page."""
    links = ", ".join(f"[{name}](schemas/{name})" for name in schema_files())
    parts = [INTRODUCTION.replace("SCHEMA_LINKS", links)]
    for kind, schema in FILE_KINDS.items():
        parts.append(f"## {kind.capitalize()}\n")
        parts += [_table(rows) for rows in table_rows(file_schema(kind))]
        if kind in AFTER:
            parts.append(AFTER[kind])
        parts.append(f"Schema: `{schema}`.\n")
    return "\n".join(parts)


def schema_files() -> dict[str, str]:
    """Return the JSON schema of every kind by the name of its file."""
    return {f"{kind}.schema.json": json_schema(file_schema(kind), kind) for kind in FILE_KINDS}


def _table(rows: TableRows) -> str:
    lines = [f"### {rows.heading}\n"] if rows.heading else []
    lines.append(f"{rows.text}\n")
    if not rows.keys:
        return "\n".join(lines)
    lines += ["| key | type | unit | without it | meaning |", "|---|---|---|---|---|"]
    lines += [f"| `{row.name}` | {row.kind} | {row.unit} | {row.default} | {_cell(row.meaning)} |" for row in rows.keys]
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    return text.replace("<", "&lt;").replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(files_page(), encoding="utf-8")
    SCHEMAS.mkdir(exist_ok=True)
    for name, text in schema_files().items():
        (SCHEMAS / name).write_text(text, encoding="utf-8")
    SCHEMA_FILE.write_text(certificate_schema(), encoding="utf-8")
