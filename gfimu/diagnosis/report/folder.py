"""The folder of a diagnosis: verdict, extended twin, report and picture, all or none."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

from gfimu.base.errors import OmittedFileWarning, warn
from gfimu.base.files.atomic_file import atomic_folder
from gfimu.base.files.outputs import OutputFolder, check_outputs
from gfimu.base.optional_packages import install_command, missing, packages_of
from gfimu.diagnosis.report.rig import DrawnRig
from gfimu.diagnosis.verdict.verdict import Diagnosis

__all__ = ["FILES", "check_folder", "files_of", "files_to_write", "warn_of_omitted", "write_diagnosis"]

FILES: Mapping[str, str] = {
    "verdict.json": "verdict",
    "twin.toml": "extended twin",
    "report.html": "report",
    "diagnosis.rrd": "rerun recording",
}
"""What the folder holds and what it is called."""

_NEEDS = {"report.html": "matplotlib", "diagnosis.rrd": "rerun"}
"""Optional packages that draw files of the folder; without one its file is left out."""


def files_to_write() -> dict[str, str]:
    """Return what the folder will hold with the packages that are installed, as `FILES`."""
    absent = missing(*_NEEDS.values())
    return {name: meaning for name, meaning in FILES.items() if _NEEDS.get(name) not in absent}


def files_of(diagnosis: Diagnosis, more: Collection[str] = ()) -> dict[str, str]:
    """Return all files of a diagnosis's folder, as `FILES`: with those that its twin file names.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis.
    more : collection of str
        Names of the text files that `write_diagnosis` writes besides.
    """
    parts = {name: f"part {Path(name).stem}" for name in diagnosis.twin.array.part_files}
    return files_to_write() | parts | {name: FILES.get(name, Path(name).stem) for name in more}


def warn_of_omitted() -> None:
    """Warn of files that will not be written, as the packages that draw them are not installed."""
    absent = missing(*_NEEDS.values())
    if absent:
        names = " and ".join(name for name in FILES if _NEEDS.get(name) in absent)
        warn(
            f"{names} not written: {packages_of(absent)} not installed; run: {install_command(absent)}",
            OmittedFileWarning,
        )


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
    more: Mapping[str, str] | None = None,
    rig: DrawnRig | None = None,
) -> dict[str, Path]:
    """Write all files of a diagnosis; what stands in the folder already is replaced only when all are made.

    The report needs matplotlib and the rerun recording rerun-sdk: where one is not installed, its file is left out.

    Parameters
    ----------
    directory : str or Path
        Folder; made if it isn't there, in one that is.
    diagnosis : Diagnosis
        The diagnosis.
    more : mapping of str to str, optional
        Further text files, by file name: those that the twin file names, and the twin file that names them.
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
        # Part files of the user's are named by the twin or its array, and looked up beside them.
        for name, text in {**diagnosis.twin.array.part_files, **(more or {})}.items():
            (made / name).write_text(text, encoding="utf-8")
        files = files_of(diagnosis, more or ())
        if "report.html" in files:
            from gfimu.diagnosis.report.page import write_report

            write_report(made / "report.html", diagnosis, rig)
        if "diagnosis.rrd" in files:
            from gfimu.diagnosis.report.picture import write_picture

            write_picture(made / "diagnosis.rrd", diagnosis, rig=rig)
    return {meaning: folder / name for name, meaning in files.items()}
