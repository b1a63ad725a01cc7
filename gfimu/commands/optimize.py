"""Under `gfimu optimize`: search array geometries."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.errors import InputError
from gfimu.files.outputs import ARRAY_FILE, writes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

    from gfimu.geometry.search import SearchResult

__all__ = ["optimize"]

_MOST_CHIPS, _MOST_RESTARTS = 200, 100_000  # more take days


@writes(out=ARRAY_FILE)
def optimize(
    chips: int | None = None,
    *,
    axes_per_chip: int = 3,
    box_m: ArrayLike = (0.1, 0.1, 0.1),
    min_spacing_m: float = 0.005,
    non_recursive: bool = False,
    restarts: int = 40,
    seed: int = 0,
    out: str | Path | None = None,
    rng: np.random.Generator | None = None,
    part: str = "adxl345",
    name: str = "",
    report: Callable[[int], None] | None = None,
    n_chips: int | None = None,
) -> SearchResult:
    """Search the geometry of least GDOP inside a box centred at the body origin.

    Parameters
    ----------
    chips, n_chips : int
        Number of chips; two names of one argument.
    axes_per_chip : int
        Sensing axes of a chip: 1, 2 or 3.
    box_m : array_like, shape (3,)
        Edges of the box along body x, y, z, m; zero makes it flat.
    min_spacing_m : float
        Least distance between two chips, m.
    non_recursive : bool
        Accept only geometries whose angular acceleration is free of ω².
    restarts : int
        Number of starts to polish.
    seed : int
        Seed of the random starts.
    out : str or Path, optional
        Array file to write, ``.toml``.
    rng : numpy.random.Generator, optional
        Source of the random starts in place of ``seed``.
    part : str
        Part of the chips in the result.
    name : str
        Name of the result; the file's by default.
    report : callable, optional
        Called with the number of starts done.

    Raises
    ------
    GeometryError
        If no geometry of these chips in this box sees all six motions, or none is free of ω² where that is asked.
    InputError
        If an argument is out of range, the chips don't fit, or the output can't be written where it is asked for.
    """
    import numpy as np

    from gfimu.files.atomic_file import write_text
    from gfimu.geometry.search import optimize as search

    number = n_chips if chips is None else chips
    if number is None:
        raise InputError("no number of chips: give chips")
    if number > _MOST_CHIPS or restarts > _MOST_RESTARTS:
        raise InputError(f"at most {_MOST_CHIPS} chips and {_MOST_RESTARTS} restarts are searched; give fewer")
    if seed < 0:
        raise InputError(f"seed {seed}: must be zero or positive")
    result = search(
        number,
        rng=np.random.default_rng(seed) if rng is None else rng,
        axes_per_chip=axes_per_chip,
        box_m=box_m,
        min_spacing_m=min_spacing_m,
        non_recursive=non_recursive,
        restarts=restarts,
        part=part,
        name=name or (Path(out).stem if out is not None else ""),
        report=report,
    )
    if out is not None:
        write_text(out, result.array.to_toml())
    return result
