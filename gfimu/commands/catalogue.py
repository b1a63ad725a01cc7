"""Under `gfimu list`, `gfimu show` and `gfimu new`: what comes with gfimu, and files to start from."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from gfimu.commands.file_kinds import FILE_KINDS
from gfimu.files.outputs import JSON_SCHEMA, TOML_FILE, OutputFolder, writes

__all__ = ["KINDS", "SENDER", "TEMPLATES", "catalogue", "new", "show"]

KINDS = ("arrays", "parts", "maps", "twins", "scenarios", "frames", "effects", "formats")
"""What can be listed."""

TEMPLATES = tuple(FILE_KINDS)
"""Files that can be begun."""

SENDER = "sender"
"""The folder that can be begun: C files with which a board of one's own sends frames."""

_FILES = ("arrays", "parts", "maps", "twins", "scenarios", "frames")


def catalogue(kind: str) -> dict[str, str]:
    """List what gfimu ships of one kind: name and description, one line each.

    Parameters
    ----------
    kind : str
        One of `KINDS`.

    Raises
    ------
    InputError
        If the kind is unknown.

    Examples
    --------
    >>> import gfimu
    >>> sorted(gfimu.catalogue("twins"))
    ['cube12_turntable', 'linear_axis', 'mimu4444_free', 'pendulum', 'wheel_pair']
    """
    from gfimu.errors import unknown_name

    if kind not in KINDS:
        raise unknown_name("kind", kind, KINDS)
    if kind == "effects":
        from sim.effects import added_effects
        from sim.effects.catalogue import every_effect

        return {name: family.summary for name, family in (every_effect() | added_effects()).items()}
    if kind == "formats":
        from gfimu.importing.readers import readers
        from gfimu.recording.formats import formats

        whole = {name: one.summary for name, one in formats().items()}
        return whole | {name: one.summary for name, one in readers().items()}
    return dict(_described(kind))


def show(name: str) -> str:
    """Return the text of a shipped file, of a file of your own, of the array in a recording, or of an effect.

    Parameters
    ----------
    name : str
        Name of an array, part, map, twin, scenario, frame or effect; path of such a file, which is checked; or path of
        a recording, whose array file is returned.

    Raises
    ------
    InputError
        If nothing has that name, the file is wrong, or the recording carries no array.

    Examples
    --------
    >>> import gfimu
    >>> print(gfimu.show("rest").splitlines()[0])
    # The unit at rest: noise, biases, drift. Turned on its side with: --set 'mounting_rotvec_rad=[1.5708, 0, 0]'.
    """
    from gfimu.errors import unknown_name
    from gfimu.files.model_files import find_model, list_models

    if Path(name).suffix in {".toml", ".csv", ".parquet"}:
        return _shown_file(name)
    for kind in _FILES:
        if name in list_models(kind):
            return find_model(kind, name).read_text(encoding="utf-8")
    if name in catalogue("effects"):
        return _shown_effect(name)
    raise unknown_name("name", name, [one for kind in (*_FILES, "effects") for one in catalogue(kind)])


def _shown_effect(name: str) -> str:
    """Return what an effect is, its formula, parameters, rivals, and the experiment that separates it."""
    from sim.effects import added_effects
    from sim.effects.catalogue import essence, every_effect

    return essence((every_effect() | added_effects())[name])


def _shown_file(name: str) -> str:
    """Return the text of a file after a check by its schema, or the array file that a recording carries."""
    from gfimu.commands.file_kinds import check_file
    from gfimu.commands.opened import array_of
    from gfimu.errors import InputError
    from gfimu.files.model_files import read_toml
    from gfimu.recording import Recording

    if not Path(name).is_file():
        raise InputError(f"{name}: no such file; give its path, or a name of gfimu list arrays")
    if not name.endswith(".toml"):
        return array_of(Recording.read(name)).to_toml()
    check_file(read_toml(Path(name)), name)
    return Path(name).read_text(encoding="utf-8")


@writes(folder=OutputFolder(()), out=TOML_FILE, schema=JSON_SCHEMA)
def new(
    kind: str,
    folder: str | Path | None = None,
    *,
    out: str | Path | None = None,
    schema: str | Path | None = None,
) -> str:
    """Return a commented file to edit: an array, part, column map, twin, scenario, frame, stage, plan or brief.

    Parameters
    ----------
    kind : str
        One of `TEMPLATES`, or `SENDER`: then what is returned says what to do with the C files.
    folder : str or Path, optional
        Of `SENDER`: folder to write, with the C files for a board of one's own. One that holds files is not touched.
    out : str or Path, optional
        File to write, ``.toml``; one that is there is not replaced.
    schema : str or Path, optional
        JSON schema to write, ``.json``, by which an editor with taplo (Even Better TOML) completes the keys; the first
        line of the file names it.

    Raises
    ------
    InputError
        If the kind is unknown, the file or folder is there already, or a file is asked for where a folder is written.

    Examples
    --------
    >>> import gfimu
    >>> print(gfimu.new("array").splitlines()[0])
    #:schema ./array.schema.json
    """
    from gfimu.commands.file_kinds import file_schema
    from gfimu.errors import InputError, unknown_name
    from gfimu.files.atomic_file import write_text
    from gfimu.files.model_files import find_model
    from gfimu.files.schema_keys import json_schema

    if kind == SENDER:
        if out is not None or schema is not None:
            raise InputError(
                "a sender is a folder of C files, without schema; name the folder: gfimu new sender FOLDER"
            )
        return _new_sender(folder)
    if kind not in TEMPLATES:
        raise unknown_name("kind", kind, (*TEMPLATES, SENDER))
    if folder is not None:
        raise InputError(f"a new {kind} is one file; name it with --out")
    text = find_model("templates", kind).read_text(encoding="utf-8")
    if out is not None and Path(out).exists():
        raise InputError(f"{out}: is there already; choose another name")
    if schema is not None:
        write_text(schema, json_schema(file_schema(kind), kind))
        near = os.path.relpath(schema, Path() if out is None else Path(out).parent).replace(os.sep, "/")
        text = text.replace(f"./{kind}.schema.json", near if near.startswith(".") else f"./{near}", 1)
    if out is not None:
        write_text(out, text)
    return text


def _new_sender(folder: str | Path | None) -> str:
    from firmware_bridge.sender.project import readme, write_project

    if folder is not None:
        write_project(folder)
    return readme(SENDER if folder is None else Path(folder).resolve().name)


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
