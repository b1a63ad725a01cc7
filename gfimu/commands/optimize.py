"""Search the array of chips in a volume that minimises an objective, or the front of two objectives.

Examples
--------
gfimu optimize --chips 5 --non-recursive --out best5.toml
# By a design brief
gfimu new brief --out brief.toml
gfimu optimize brief.toml --picture best.png
# What each further chip gains
gfimu optimize --chips 4 --most-chips 10 --pareto chips gdop --front by_chips
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.errors import InputError
from gfimu.base.files.outputs import OutputFile, OutputFolder
from gfimu.commands import given
from gfimu.commands.opened import as_array
from gfimu.commands.shell import completion, options
from gfimu.commands.shell.declare import Option, command

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

    from gfimu.array_search.brief import BriefFile
    from gfimu.array_search.front import Front
    from gfimu.array_search.problem import Sites
    from gfimu.array_search.search import SearchResult

__all__ = ["optimize"]

_MOST_CHIPS, _MOST_RESTARTS = 200, 100_000  # more take days
_MORE_CHIPS = 4  # of a front over chips, beyond the least number, unless the largest is given
_FRONT = OutputFolder(("front.json", "front.png"), needs=("matplotlib",))

_OUT = Option("Array file to write (.toml).", writes=OutputFile("an array file", (".toml",)), what="array")
_FRONT_OUT = Option("Folder to write: the front as picture, table and array files.", writes=_FRONT)
_RNG = Option("Random number generator in place of the seed.", shell=False)
_BRIEF = Option(
    "Design brief (.toml; gfimu new brief); options replace its values.", "[BRIEF]", argument=True, reads=True
)
_BOX = Option(
    "Edges of a box around the body origin, m; 0.1 0.1 0.1 by default, zero makes it flat.",
    kind=tuple[float, float, float],
)
_OBJECTIVE = Option(
    "What is to be small: gdop (default), gdop_joint, kappa, sigma_alpha, sigma_p, rate, drift, fault; with _worst at "
    "the end over the brief's tolerances.",
    "NAME",
    offers=completion.objectives,
)
_PARETO = Option("Search the front of two objectives, or of one and chips or size; with --front.")
_MOST = Option("Of a front over chips: the largest number of them; by default four more than the least.")


@command(doing="searching arrays")
def optimize(
    chips: Annotated[int | None, options.CHIPS] = None,
    *,
    brief: Annotated["str | Path | None", _BRIEF] = None,
    axes_per_chip: Annotated[int | None, Option("Sensing axes of a chip: 1, 2 or 3; 3 by default.")] = None,
    box_m: Annotated["ArrayLike | None", _BOX] = None,
    min_spacing_m: Annotated[float | None, Option("Least distance between chips, m; 0.005 by default.")] = None,
    non_recursive: Annotated[bool, Option("Only arrays whose angular acceleration is free of ω².")] = False,
    objective: Annotated[str | None, _OBJECTIVE] = None,
    pareto: Annotated[tuple[str, str] | None, _PARETO] = None,
    most_chips: Annotated[int | None, _MOST] = None,
    restarts: Annotated[int | None, Option("Most random starts; 40 by default, fewer once ten agree.")] = None,
    seed: Annotated[int | None, options.SEED.also("; by default that of the brief, or 0")] = None,
    out: Annotated["str | Path | None", _OUT] = None,
    picture: Annotated[given.Picture, options.PICTURE.also(": the array in its volume")] = None,
    front: Annotated["str | Path | None", _FRONT_OUT] = None,
    rng: Annotated["np.random.Generator | None", _RNG] = None,
    part: Annotated[str | None, Option("Part of the chips; by default that of the brief.", shell=False)] = None,
    name: Annotated[str, Option("Name of the array; by default that of its file.", shell=False)] = "",
    progress: Annotated[Callable[[float], None] | None, options.PROGRESS] = None,
) -> "SearchResult | Front":
    """Search the array of chips in a volume that minimises an objective, or the front of two objectives.

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
    import msgspec
    import numpy as np

    from gfimu.array_search.brief import BoxTable, BriefFile, load_brief, problem_of
    from gfimu.array_search.front import find_front
    from gfimu.array_search.objectives import objective as named
    from gfimu.array_search.search import search
    from gfimu.base.files.atomic_file import write_text

    if (pareto is None) != (front is None):
        raise InputError("--pareto A B and --front DIR go together: the two objectives, and the folder of their front")
    if most_chips is not None and "chips" not in (pareto or ()):
        raise InputError("--most-chips is of a front over chips; give --pareto chips OBJECTIVE --front DIR too")
    if pareto is not None and (out is not None or picture is not None):
        raise InputError("a front has many arrays, which --front takes; leave out --out and --picture")
    if (chips or 0) > _MOST_CHIPS or (restarts or 0) > _MOST_RESTARTS:
        raise InputError(f"at most {_MOST_CHIPS} chips and {_MOST_RESTARTS} restarts are searched; give fewer")
    changes: dict[str, Any] = {
        "chips": chips,
        "axes_per_chip": axes_per_chip,
        "volume": None if box_m is None else BoxTable(tuple(np.asarray(box_m, dtype=float).ravel().tolist())),
        "min_spacing_m": min_spacing_m,
        "non_recursive": non_recursive or None,
        "starts": restarts,
        "seed": seed,
        "part": part,
    }
    asked = BriefFile() if brief is None else load_brief(brief)
    if objective is not None:
        changes["objective"] = msgspec.structs.replace(asked.objective, name=objective)
    wanted = msgspec.structs.replace(asked, **{key: value for key, value in changes.items() if value is not None})
    problem, conditions = problem_of(wanted, _sites(wanted, brief))
    source = np.random.default_rng(wanted.seed) if rng is None else rng
    starts = wanted.starts
    if pareto is not None and front is not None:
        from gfimu.array_search.pictures import write_front

        most = most_chips or problem.n_chips + _MORE_CHIPS
        arrays = find_front(problem, conditions, pareto, source, most_chips=most, starts=starts, report=progress)
        write_front(front, arrays)
        return arrays
    goal = named(wanted.objective.name, problem, conditions)
    name = name or ("" if out is None else Path(out).stem)
    result = search(problem, goal, source, starts=starts, part=wanted.part, name=name, report=progress)
    if out is not None:
        write_text(out, result.array.to_toml())
    if picture is not None:
        from gfimu.array_search.pictures import array_picture

        array_picture(picture, result.array, problem)
    return result


def _sites(wanted: "BriefFile", brief: str | Path | None) -> "Sites | None":
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
        return sites_of_array(as_array(path), str(path))
    if path.suffix != ".csv":
        raise InputError(
            f"[volume] file = {table.file!r}: candidate sites come from .xml, .toml or .csv; use one of them"
        )
    return sites_of_csv(path)
