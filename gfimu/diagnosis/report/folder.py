"""The folder of a diagnosis: verdict, extended twin, report and picture, all or none."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gfimu.diagnosis.report.page import write_report
from gfimu.diagnosis.report.picture import write_picture
from gfimu.diagnosis.report.rig import DrawnRig
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.files.atomic_file import atomic_folder
from gfimu.files.outputs import OutputFolder, check_outputs

__all__ = ["FILES", "check_folder", "write_diagnosis"]

FILES: Mapping[str, str] = {
    "verdict.json": "verdict",
    "twin.toml": "extended twin",
    "report.html": "report",
    "diagnosis.rrd": "rerun recording",
}
"""What the folder holds and what it is called."""


def check_folder(directory: str | Path) -> Path:
    """Return the folder if results can be written to it, before any work is done; nothing is made yet.

    Raises
    ------
    InputError
        If it is a file, or the folder above it does not exist or can't be written to.
    """
    folder = Path(directory)
    check_outputs([("out", folder, OutputFolder(tuple(FILES)))])
    return folder


def write_diagnosis(
    directory: str | Path,
    diagnosis: Diagnosis,
    *,
    twin_toml: str | None = None,
    more: Mapping[str, str] | None = None,
    rig: DrawnRig | None = None,
) -> dict[str, Path]:
    """Write all files of a diagnosis; what stands in the folder already is replaced only when all are made.

    Parameters
    ----------
    directory : str or Path
        Folder; made if it isn't there, in one that is.
    diagnosis : Diagnosis
        The diagnosis.
    twin_toml : str, optional
        Text of the twin file; the diagnosis's own twin by default.
    more : mapping of str to str, optional
        Further text files that the twin file names, by file name.
    rig : DrawnRig, optional
        How the array stood on its table, for the pictures.

    Returns
    -------
    dict of str to Path
        What was written, by its meaning.
    """
    folder = check_folder(directory)
    with atomic_folder(folder) as made:
        diagnosis.write(made)
        if twin_toml is not None:
            (made / "twin.toml").write_text(twin_toml, encoding="utf-8")
        # Part files of the user's are named by the twin or its array, and looked up beside them.
        for name, text in {**diagnosis.twin.array.part_files, **(more or {})}.items():
            (made / name).write_text(text, encoding="utf-8")
        write_report(made / "report.html", diagnosis, rig)
        write_picture(made / "diagnosis.rrd", diagnosis, rig=rig)
    return {meaning: folder / name for name, meaning in FILES.items()}
