"""Under `gfimu optimize`: search accelerometer arrays for a volume, a number of chips and an objective."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gfimu.errors import InputError
from gfimu.files.outputs import ARRAY_FILE, PICTURE, OutputFolder, writes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

    from gfimu.array_search.brief import BriefFile
    from gfimu.array_search.front import Front
    from gfimu.array_search.problem import Problem, Sites
    from gfimu.array_search.search import SearchResult

__all__ = ["optimize"]

_MOST_CHIPS, _MOST_RESTARTS = 200, 100_000  # more take days
_MORE_CHIPS = 4  # of a front over chips, beyond the least number, unless the largest is given


@writes(
    reads=("brief",),
    out=ARRAY_FILE,
    picture=PICTURE,
    front=OutputFolder(("front.json", "front.png"), needs=("matplotlib",)),
)
def optimize(
    chips: int | None = None,
    *,
    brief: str | Path | None = None,
    axes_per_chip: int | None = None,
    box_m: ArrayLike | None = None,
    min_spacing_m: float | None = None,
    non_recursive: bool = False,
    objective: str | None = None,
    pareto: tuple[str, str] | None = None,
    most_chips: int | None = None,
    restarts: int | None = None,
    seed: int | None = None,
    out: str | Path | None = None,
    picture: str | Path | None = None,
    front: str | Path | None = None,
    rng: np.random.Generator | None = None,
    part: str | None = None,
    name: str = "",
    report: Callable[[Any], None] | None = None,
    n_chips: int | None = None,
) -> SearchResult | Front:
    """Search the array of chips in a volume that minimises an objective, or the front of two objectives.

    Parameters
    ----------
    chips, n_chips : int
        Number of chips; two names of one argument.
    brief : str or Path, optional
        Design brief (``gfimu new brief``); the other arguments replace its values.
    axes_per_chip : int, optional
        Sensing axes of a chip: 1, 2 or 3 (the default).
    box_m : array_like, shape (3,), optional
        Edges of a box around the body origin along body x, y, z, m; zero makes it flat; 0.1 m each by default.
    min_spacing_m : float, optional
        Least distance between two chips, m; 5 mm by default.
    non_recursive : bool
        Accept only arrays whose angular acceleration is free of ω².
    objective : str, optional
        What is to be small (`gfimu.array_search.objectives.OBJECTIVES`); GDOP by default.
    pareto : tuple of str, optional
        Two objectives, or one and ``chips`` or ``size``: their front is searched.
    most_chips : int, optional
        Of a front over chips: the largest number of chips; four more than ``chips`` by default.
    restarts : int, optional
        Most starts; 40 by default, fewer once ten agree.
    seed : int, optional
        Seed of the random starts; 0 by default.
    out : str or Path, optional
        Array file to write, ``.toml``.
    picture : str or Path, optional
        Picture of the array in its volume to write.
    front : str or Path, optional
        Folder of the front: ``front.json``, ``front.png`` and an array file per point.
    rng : numpy.random.Generator, optional
        Source of the random starts in place of ``seed``.
    part : str, optional
        Part of the chips in the result.
    name : str
        Name of the result; the file's by default.
    report : callable, optional
        Called with the number of starts done; of a front, with the share of the work.

    Returns
    -------
    SearchResult or Front
        The best array; with ``pareto`` the front.

    Raises
    ------
    GeometryError
        If no such array sees all six motions, or none is free of ω² where that is asked.
    InputError
        If an argument or the brief is wrong, the chips don't fit, or an output can't be written where it is asked for.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.optimize(4, restarts=2, seed=1)
    >>> print(f"GDOP {found.score.gdop:.4f}")
    GDOP 1.0607
    """
    import numpy as np

    from gfimu.array_search.brief import problem_of
    from gfimu.array_search.objectives import objective as named
    from gfimu.array_search.search import search
    from gfimu.files.atomic_file import write_text

    if (pareto is None) != (front is None):
        raise InputError("--pareto A B and --front DIR go together: the two objectives, and the folder of their front")
    if most_chips is not None and "chips" not in (pareto or ()):
        raise InputError("--most-chips is of a front over chips; give --pareto chips OBJECTIVE --front DIR too")
    if pareto is not None and (out is not None or picture is not None):
        raise InputError("a front has many arrays, which --front takes; leave out --out and --picture")
    number = n_chips if chips is None else chips
    _require_in_range(number, restarts, seed)
    wanted = _changed(
        brief,
        {
            "chips": number,
            "axes_per_chip": axes_per_chip,
            "min_spacing_m": min_spacing_m,
            "non_recursive": non_recursive or None,
            "starts": restarts,
            "seed": seed,
            "part": part,
        },
        box_m,
        objective,
    )
    problem, conditions = problem_of(wanted, _sites(wanted, brief))
    source = np.random.default_rng(wanted.seed) if rng is None else rng
    if pareto is not None and front is not None:
        from gfimu.array_search.front import find_front

        found = find_front(
            problem,
            conditions,
            pareto,
            source,
            most_chips=most_chips or problem.n_chips + _MORE_CHIPS,
            starts=wanted.starts,
            report=report,
        )
        _write_front(Path(front), found)
        return found
    result = search(
        problem,
        named(wanted.objective.name, problem, conditions),
        source,
        starts=wanted.starts,
        part=wanted.part,
        name=name or (Path(out).stem if out is not None else ""),
        report=report,
    )
    if out is not None:
        write_text(out, result.array.to_toml())
    if picture is not None:
        _draw(picture, result, problem)
    return result


def _require_in_range(chips: int | None, restarts: int | None, seed: int | None) -> None:
    if (chips or 0) > _MOST_CHIPS or (restarts or 0) > _MOST_RESTARTS:
        raise InputError(f"at most {_MOST_CHIPS} chips and {_MOST_RESTARTS} restarts are searched; give fewer")
    if seed is not None and seed < 0:
        raise InputError(f"seed {seed}: must be zero or positive")


def _changed(
    brief: str | Path | None, changes: dict[str, Any], box_m: ArrayLike | None, objective: str | None
) -> BriefFile:
    """Return the brief, or the default one, with the values that were given besides."""
    import msgspec
    import numpy as np

    from gfimu.array_search.brief import BoxTable, BriefFile, load_brief
    from gfimu.array_search.shapes import box

    found = BriefFile() if brief is None else load_brief(brief)
    given = {key: value for key, value in changes.items() if value is not None}
    if box_m is not None:
        edges = np.asarray(box_m, dtype=float)
        box(edges)  # refuses what is no box
        given["volume"] = BoxTable((float(edges[0]), float(edges[1]), float(edges[2])))
    if objective is not None:
        given["objective"] = msgspec.structs.replace(found.objective, name=objective)
    return msgspec.structs.replace(found, **given)


def _sites(wanted: BriefFile, brief: str | Path | None) -> Sites | None:
    """Read the candidate sites of a brief, beside it or from the current directory."""
    from gfimu.array_search.brief import SitesTable, sites_of_array, sites_of_csv

    table = wanted.volume
    if not isinstance(table, SitesTable):
        return None
    beside = Path(brief).parent / table.file if brief is not None else Path(table.file)
    path = beside if beside.is_file() else Path(table.file)
    if path.suffix == ".xml":
        from sim.rigs.mjcf_array import array_from_mjcf

        return sites_of_array(array_from_mjcf(path, sites=table.names), str(path))
    if path.suffix == ".toml":
        from gfimu.geometry.array import AccelerometerArray

        return sites_of_array(AccelerometerArray.load(path), str(path))
    if path.suffix != ".csv":
        raise InputError(
            f"[volume] file = {table.file!r}: candidate sites come from .xml, .toml or .csv; use one of them"
        )
    return sites_of_csv(path)


def _draw(path: str | Path, result: SearchResult, problem: Problem) -> None:
    from gfimu.array_search.pictures import array_picture

    array_picture(path, result.array, problem)


def _write_front(folder: Path, found: Front) -> None:
    import json

    from gfimu.array_search.pictures import front_picture
    from gfimu.files.atomic_file import write_text

    folder.mkdir(exist_ok=True)
    for point in found.points:
        write_text(folder / f"{point.array.name}.toml", point.array.to_toml())
    write_text(folder / "front.json", json.dumps(found.to_dict(), indent=2) + "\n")
    front_picture(folder / "front.png", found)
    written = {f"{point.array.name}.toml" for point in found.points}
    for file in folder.glob("front_[0-9][0-9].toml"):  # of the front that this one replaces, which had more points
        if file.name not in written:
            file.unlink()
