"""Distinguishability: how surely data of a given motion could separate one effect from another.

With the normal equations G of the effects' signatures (noise whitened, drive marginalised;
`gfimu.diagnosis.fit.posterior`), an effect of sizes z leaves, after the best explanation by a rival with sizes y, the
residual energy

    E_ij = min_y  zᵀG_ii z − 2 zᵀG_ij y + yᵀG_jj y + |y|²/k²,        D_ij = E_ij / 2,

the expected log likelihood by which the effect beats its rival, in nats: the quantitative isolability of Eriksson,
Frisk & Krysander (Automatica 49(6), 2013, eq. 17) for Gaussian noise. No data are needed, only the motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.optimize import lsq_linear

from gfimu.base.errors import InputError, unknown_name
from gfimu.base.short_repr import short_repr
from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.design.planned_run import PlannedRun, planned, recorded_stretches
from gfimu.diagnosis.fit.evidence import SCALES
from gfimu.diagnosis.fit.linear import Point, linearise
from gfimu.diagnosis.fit.posterior import Posterior
from gfimu.diagnosis.search.screening import Signature, columns_of_run
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.library import family_columns
from gfimu.model.world_model import Effect, EffectFamily, WorldModel

__all__ = [
    "Contender",
    "Distinguishability",
    "PlannedRun",
    "distinguishability",
    "energy_left",
    "gained_log_likelihood",
    "normal_equations",
    "plan_contenders",
    "predict_distinguishability",
]

_RIVAL_SHAPES = 5


@dataclass(frozen=True)
class Contender:
    """An effect in the normal equations: as what may be there, and as what may explain another away.

    Parameters
    ----------
    name : str
        Contract name.
    columns : ndarray, shape (m,)
        Its columns.
    directions : ndarray, shape (m, r)
        Independent sizes in units of the prior; energies add over them.
    alternatives : tuple of ndarray, each (m,)
        Columns of every shape that it can take as a rival.
    positive : ndarray of bool, shape (m,)
        Sizes that physics allows one sign only.
    signed : bool
        Whether the directions are meant with the sign that they have: where the sizes are given, not merely usual.
    """

    name: str
    columns: NDArray[np.intp]
    directions: NDArray[np.float64]
    alternatives: tuple[NDArray[np.intp], ...]
    positive: NDArray[np.bool_]
    signed: bool = False

    def beside(self, other: Contender) -> Contender:
        """Return this effect and another one as one contender that may be both at once, each in any shape."""
        shapes = product(self.alternatives, other.alternatives)
        return Contender(
            f"{self.name} + {other.name}",
            np.concatenate([self.columns, other.columns]),
            block_diag(self.directions, other.directions),
            tuple(np.concatenate(pair) for pair in shapes),
            np.concatenate([self.positive, other.positive]),
        )


@dataclass(frozen=True)
class Distinguishability:
    """How surely each of k effects is separated from each other one.

    Parameters
    ----------
    effects : tuple of str
        Names.
    detectability : ndarray, shape (k,)
        d′ of each effect: its size in standard deviations, drive unknown.
    energy : ndarray, shape (k, k)
        Energy of effect i left after its best explanation by effect j; zero on the diagonal.
    """

    effects: tuple[str, ...]
    detectability: NDArray[np.float64]
    energy: NDArray[np.float64]

    __repr__ = short_repr

    @property
    def nats(self) -> NDArray[np.float64]:
        """D_ij: expected log likelihood of effect i over rival j, shape (k, k)."""
        return self.energy / 2.0

    @property
    def unexplained(self) -> NDArray[np.float64]:
        """Fraction of effect i that effect j cannot explain, shape (k, k); 0: inseparable, NaN: not visible."""
        visible = np.where(self.detectability > 0, self.detectability, np.nan)
        return self.energy / visible[:, None] ** 2

    def weakest(self) -> tuple[int, int]:
        """Return effect and rival (i, j) of the smallest D_ij."""
        off_diagonal = np.where(np.eye(len(self.effects), dtype=bool), np.inf, self.energy)
        i, j = np.unravel_index(int(np.argmin(off_diagonal)), off_diagonal.shape)
        return int(i), int(j)

    @property
    def least_nats(self) -> float:
        """The smallest D_ij."""
        return float(self.nats[self.weakest()])


def distinguishability(
    gram: NDArray[np.float64], contenders: Sequence[Contender], *, largest_rival: float = SCALES[-1]
) -> Distinguishability:
    """Compute detectability and distinguishability from normal equations.

    Parameters
    ----------
    gram : ndarray, shape (P, P)
        G in units of the effects' priors.
    contenders : sequence of Contender
        The effects.
    largest_rival : float
        k: how many times its usual size a rival may easily take; infinity for a pure projection.
    """
    count = len(contenders)
    detectability = np.zeros(count)
    energy = np.zeros((count, count))
    for i, one in enumerate(contenders):
        own = gram[np.ix_(one.columns, one.columns)]
        detectability[i] = np.sqrt(max(np.einsum("ar,ab,br->", one.directions, own, one.directions), 0.0))
        others = np.arange(count) != i
        rivals = [rival for rival, other in zip(contenders, others, strict=True) if other]
        energy[i, others] = energy_left(gram, one, rivals, largest_rival=largest_rival)
    return Distinguishability(tuple(contender.name for contender in contenders), detectability, energy)


def energy_left(
    gram: NDArray[np.float64], one: Contender, rivals: Sequence[Contender], *, largest_rival: float = SCALES[-1]
) -> NDArray[np.float64]:
    """Return the energy of an effect that each of the rivals, at its best, does not explain, shape (k,)."""
    return np.array(
        [min(_left(gram, one, rival, shape, largest_rival) for shape in rival.alternatives) for rival in rivals]
    )


def _left(
    gram: NDArray[np.float64], one: Contender, rival: Contender, shape: NDArray[np.intp], largest_rival: float
) -> float:
    """Energy of an effect that the rival in one shape does not explain."""
    cross = gram[np.ix_(shape, one.columns)] @ one.directions  # (k, r)
    precision = np.eye(len(shape)) / largest_rival**2
    values, vectors = np.linalg.eigh(gram[np.ix_(shape, shape)] + precision)
    kept = values > 1e-12 * max(values[-1], 1e-300)
    root = vectors[:, kept] * np.sqrt(values[kept])  # G_jj + I/k² = root rootᵀ
    target = (vectors[:, kept] / np.sqrt(values[kept])).T @ cross  # (kept, r)
    explained = np.sum(target**2, axis=0)
    if rival.positive.any():
        both_signs = not (one.signed or one.positive.all())
        explained = _explained_by_one_sign(root, target, rival.positive, both_signs=both_signs)
    own = gram[np.ix_(one.columns, one.columns)]
    energy = np.einsum("ar,ab,br->r", one.directions, own, one.directions)
    return float(np.maximum(energy - explained, 0.0).sum())


def _explained_by_one_sign(
    root: NDArray[np.float64], target: NDArray[np.float64], positive: NDArray[np.bool_], *, both_signs: bool
) -> NDArray[np.float64]:
    """Energy explained, shape (r,), by a rival some of whose sizes can't be negative; mean over signs of the effect."""
    lower = np.where(positive, 0.0, -np.inf)
    signs = (1.0, -1.0) if both_signs else (1.0,)
    explained = np.zeros(target.shape[1])
    for index, wanted in enumerate(target.T):
        for sign in signs:
            best = lsq_linear(root.T, sign * wanted, (lower, np.inf))
            explained[index] += (wanted @ wanted - 2.0 * best.cost) / len(signs)
    return explained


def plan_contenders(
    model: WorldModel, effects: Sequence[str | Effect], *, duration: float, sample_rate: float, runs: int = 1
) -> tuple[list[Signature], list[Contender]]:
    """Lay out the columns of effects in the normal equations of several runs.

    Parameters
    ----------
    model : WorldModel
        The simulation.
    effects : sequence of str or Effect
        A name stands for the effect wherever it can occur, in every size that would surprise nobody; an effect for
        its own sizes and shape.
    duration, sample_rate : float
        Length, s, and sample rate, Hz, from which shapes (time constants, frequencies) follow.
    runs : int
        Number of runs; effects of the mounting have sizes of their own in each.

    Raises
    ------
    InputError
        For an unknown name, a repeated one, or an effect without a size (wiring, lost samples).
    """
    array, families = model.array, model.families()
    signatures: list[Signature] = []
    contenders: list[Contender] = []
    columns = 0
    for request in effects:
        name = request if isinstance(request, str) else str(request.name)
        family = _sized_family(families, name, model)
        if any(contender.name == name for contender in contenders):
            raise InputError(f"effect {name!r} is named twice; name different effects")
        sizes = family.sizes(array)
        blocks = runs if family.per_run else 1
        own, grid = _shapes(family, request, duration, sample_rate)
        places = []
        for shape in (own, *grid):
            places.append(np.arange(columns, columns + len(sizes) * blocks))
            signatures.append(Signature(family, shape, places[-1], 1.0))
            columns += len(sizes) * blocks
        if isinstance(request, str):
            direction = np.eye(len(sizes))
        else:
            direction = (request.size_values(array) / np.array([size.prior_std for size in sizes]))[:, None]
        contenders.append(
            Contender(
                name,
                places[0],
                block_diag(*[direction] * blocks),
                tuple(places),
                np.tile([size.positive for size in sizes], blocks),
                signed=not isinstance(request, str),
            )
        )
    return signatures, contenders


def _sized_family(families, name: str, model: WorldModel) -> EffectFamily:  # type: ignore[no-untyped-def]
    sized = [key for key, family in families.items() if len(family.sizes(model.array))]
    if name not in sized:
        if name in families:
            raise InputError(
                f"effect {name!r} has no size that a motion could make larger; it shows in any run. "
                f"Valid: {', '.join(sized)}"
            )
        raise unknown_name("effect", name, sized)
    return families[name]


def _shapes(
    family: EffectFamily, request: str | Effect, duration: float, sample_rate: float
) -> tuple[dict[str, float], list[dict[str, float]]]:
    """Return the shape of the effect itself and the other ones that it may take as a rival."""
    grid = family.shapes(duration, sample_rate)
    own = dict(grid[len(grid) // 2])
    if not isinstance(request, str):
        own |= request.shape_values()
    spread = np.unique(np.linspace(0, len(grid) - 1, min(len(grid), _RIVAL_SHAPES)).astype(int))
    return own, [dict(grid[place]) for place in spread if dict(grid[place]) != own]


def normal_equations(
    stretches: Sequence[Stretch], point: Point, signatures: Sequence[Signature]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return G (P, P) and b (P,) of signatures over all stretches, the drive marginalised."""
    count = 1 + max(int(signature.columns[-1]) for signature in signatures)
    if not stretches:
        return np.zeros((count, count)), np.zeros(count)
    array = stretches[0].model.array

    def columns(stretch: Stretch, at: Posterior) -> Columns:
        parts = [family_columns(stretch, at.observed, at.drive, (), s.family, s.shape) for s in signatures]
        numbers = np.concatenate([columns_of_run(s, array, stretch.index) for s in signatures])
        return Columns.together(parts).among(numbers, count)

    linear = linearise(stretches, point, columns)
    return 0.5 * (linear.gram + linear.gram.T), linear.score


def predict_distinguishability(
    model: WorldModel, effects: Sequence[str | Effect], runs: Sequence[PlannedRun]
) -> Distinguishability:
    """Predict how surely planned runs, taken together, would distinguish effects; no data needed.

    Parameters
    ----------
    model : WorldModel
        The simulation.
    effects : sequence of str or Effect
        At least one; see `plan_contenders`.
    runs : sequence of PlannedRun
        The recordings.
    """
    signatures, contenders = plan_contenders(
        model,
        effects,
        duration=max(run.duration for run in runs),
        sample_rate=min(run.sample_rate for run in runs),
        runs=len(runs),
    )
    return distinguishability(normal_equations(*planned(model, runs), signatures)[0], contenders)


def gained_log_likelihood(
    model: WorldModel, effects: Sequence[str | Effect], runs: Sequence[Run]
) -> NDArray[np.float64]:
    """Return what the best fit of each kind of effect gains on recordings, shape (k,), nats.

    The difference of two entries is the margin that `Distinguishability.nats` predicts, if the effect with the larger
    one is there; it scatters with variance 2D, and a rival of m sizes fits noise worth about m/2 nats. Effects are
    taken as linear in their sizes, and as of either sign.

    Parameters
    ----------
    model : WorldModel
        The simulation.
    effects : sequence of str or Effect
        Effects; of one that is given with its sizes only the kind and shape count.
    runs : sequence of Run
        The recordings.
    """
    duration, period = max(run.duration for run in runs), min(run.sample_period for run in runs)
    signatures, contenders = plan_contenders(
        model, effects, duration=duration, sample_rate=1.0 / period, runs=len(runs)
    )
    gram, score = normal_equations(*recorded_stretches(model, runs), signatures)
    gains = []
    for contender in contenders:
        mine = contender.columns
        precision = gram[np.ix_(mine, mine)] + np.eye(len(mine)) / SCALES[-1] ** 2
        gains.append(0.5 * float(score[mine] @ np.linalg.solve(precision, score[mine])))
    return np.array(gains)
