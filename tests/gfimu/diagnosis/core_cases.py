"""Short stretches for tests of the diagnosis, and the dense Gaussian that its algebra has to equal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import block_diag, cho_factor, cho_solve

from gfimu import AccelerometerArray
from gfimu.diagnosis import Cause, Columns, Drive, NoiseLevels, State, make_stretches, prepare_run
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.model.world_model import Effect, Spin
from sim import SplineSpin
from sim.effects import EFFECTS
from sim.motions.motion import SpinMotion
from sim.trials import Measurement, measure
from sim.twin import Twin


def small_twin(array: str = "p2_face_centres", rate: float = 50.0, **changes) -> Twin:
    """Six channels at 50 Hz, or the twelve of ``cube12``."""
    return Twin(array=AccelerometerArray.load(array), array_name=array, sample_rate=rate, **changes)


def lively(duration: float = 20.0) -> SplineSpin:
    """A motion that turns and swings from the first sample on, so that every term of the readings is there."""
    t = np.arange(-2.0, duration + 2.0, 0.02)
    return SplineSpin(CubicSpline(t, 3.0 + 2.0 * np.sin(2.0 * t) + 1.5 * np.sin(0.7 * t + 0.3)))


def stretches_of(
    twin: Twin,
    effects: Sequence[Effect] = (),
    *,
    seed: int = 1,
    duration: float = 8.0,
    motion: SpinMotion | None = None,
    **setting: float,
) -> tuple[Stretch, ...]:
    """Measure a world and cut the recording into stretches."""
    how = Measurement(duration, twin.sample_rate, **setting)
    recording = measure(np.random.default_rng(seed), twin, effects, how, motion=motion)
    return make_stretches(twin, [prepare_run(recording, twin)], [[]])


def part_of(stretch: Stretch, samples: int) -> Stretch:
    """Return the first samples of a stretch."""
    return replace(stretch, run=stretch.run.rows(0, samples))


def cause_of(name: str, array: AccelerometerArray, sizes: Sequence[float] | None = None, **shape: float) -> Cause:
    """Return the freest cause of a name, with sizes in units of their prior (zero by default)."""
    family = EFFECTS[name]
    pattern = family.patterns(array)[0]
    mine = shape or family.shapes(60.0, 50.0)[0]
    values = np.zeros(pattern.mixing.shape[1]) if sizes is None else np.asarray(sizes, dtype=float)
    return Cause(family, pattern.name, pattern.mixing, mine, values)


def dense(columns: Columns) -> NDArray[np.float64]:
    """Return columns as a full array (n, c, P)."""
    out = np.zeros((len(columns.parts[0]), len(columns.places), columns.count))
    for c, (at, part) in enumerate(zip(columns.places, columns.parts, strict=True)):
        out[:, c, at] = part
    return out


@dataclass(frozen=True)
class Bent:
    """A motion with a polynomial of the fourth order in each interval added, from a time on."""

    spin: Spin
    since: float
    until: float
    power: int
    size: float

    def at(self, t):
        """Add size · ((t − since)₊ᵖ − (t − until)₊ᵖ)/p!."""
        state, p = self.spin.at(t), self.power
        parts = [state.angle, state.rate, state.acceleration]
        factorial = 1.0
        for order in range(p + 1):
            if order:
                factorial *= order
        for derivative in range(3):
            power = p - derivative
            if power < 0:
                continue
            scale = self.size * np.prod(np.arange(power + 1, p + 1)) / factorial
            for edge, sign in ((self.since, 1.0), (self.until, -1.0)):
                passed = np.maximum(np.asarray(t) - edge, 0.0)
                there = np.asarray(t) > edge
                parts[derivative] = parts[derivative] + sign * scale * there * passed**power
        return State(*parts)


def response(stretch: Stretch, drive: Drive, effects: Sequence[Effect], since: float, until: float, power: int):
    """Return the derivative (n, c + 1) of the observations by such a polynomial, by central differences."""
    # As large a step as moves the angle by some 1e-5 rad at the end of the stretch.
    span = float(stretch.run.t[-1]) - since + 1.0
    step = 1e-5 / max(span, 1e-2) ** power if power else 1e-5
    there, back = (stretch.predict(effects, Bent(drive.spin, since, until, power, s)) for s in (step, -step))
    return (there - back) / (2.0 * step)


@dataclass(frozen=True)
class DenseGaussian:
    """Normal equations of columns, misfit and volume with everything else integrated out of one Gaussian."""

    gram: NDArray[np.float64]
    score: NDArray[np.float64]
    objective: float
    log_volume: float


def cosines(n: int, count: int) -> NDArray[np.float64]:
    """Return the first orthonormal cosines (n, count)."""
    out = np.sqrt(2.0 / n) * np.cos(np.pi * np.outer(np.arange(n) + 0.5, np.arange(count)) / n)
    out[:, 0] = np.sqrt(1.0 / n)
    return out


def dense_gaussian(
    stretch: Stretch,
    drive: Drive,
    effects: Sequence[Effect],
    levels: NoiseLevels,
    columns: NDArray[np.float64],
    *,
    modes: int,
    residual: NDArray[np.float64] | None = None,
    weight: NDArray[np.float64] | None = None,
    prior: NDArray[np.float64] | None = None,
) -> DenseGaussian:
    """Integrate out drive, slow noise and some columns by the covariance of all observations.

    The drive is no spline here: a fourth derivative N(0, ρ²) in each interval, and a free polynomial of third order.

    Parameters
    ----------
    columns : ndarray, shape (n, c + 1, P)
        Columns, not weighed.
    modes : int
        Cosines of slow noise.
    residual, weight : ndarray, shape (n, c + 1), optional
        Of coarse readings: equivalent unrounded ones have noise white / weight.
    prior : ndarray, shape (n, c + 1, q), optional
        Columns with unit normal prior.
    """
    mask = stretch.mask if weight is None else stretch.mask & (weight > 0.0)
    n, count = mask.shape
    off = stretch.measured - stretch.predict(effects, drive.spin) if residual is None else residual
    scale = np.ones((n, count)) if weight is None else np.where(mask, weight, 1.0)
    variances = stretch.basis.variances(levels, modes)  # fewer where the basis has no more
    basis = cosines(n, len(variances))
    noise = block_diag(
        *[
            np.diag((white / scale[mask[:, c], c]) ** 2) + (basis * variances[:, c])[mask[:, c]] @ basis[mask[:, c]].T
            for c, white in enumerate(levels.white)
        ]
    )

    def flat(values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Put (n, c + 1, …) in the order of the covariance."""
        return np.concatenate([values[mask[:, c], c] for c in range(count)])

    begin, edges = drive.spline.start, drive.spline.knots
    bends = np.stack([flat(response(stretch, drive, effects, a, b, 4)) for a, b in pairwise(edges)], axis=1)
    poly = np.stack([flat(response(stretch, drive, effects, begin, np.inf, p)) for p in range(4)], axis=1)
    right, unknown = flat(off), flat(columns)
    if np.isfinite(drive.angle_std):  # one more observation: the angle at first
        since = drive.since
        passed = np.maximum(since - edges, 0.0) ** 4 / 24.0
        bends = np.vstack([bends, passed[:-1] - passed[1:]])
        poly = np.vstack([poly, [1.0, since - begin, (since - begin) ** 2 / 2.0, (since - begin) ** 3 / 6.0]])
        angle = float(drive.spin.at(np.array([since])).angle[0])
        right = np.append(right, drive.angle - angle)
        unknown = np.vstack([unknown, np.zeros((1, columns.shape[2]))])
        noise = block_diag(noise, drive.angle_std**2)
    # The middle of each interval gives the fourth derivative that the drive has already.
    bent = drive.spline.bend(drive.coefficients)
    right = right + bends @ bent
    whole = noise + (bends * drive.roughness**2) @ bends.T
    if prior is not None:
        mine = flat(prior)
        mine = np.vstack([mine, np.zeros((len(whole) - len(mine), prior.shape[2]))])
        whole = whole + mine @ mine.T
    factor = cho_factor(whole, lower=True)
    solved = cho_solve(factor, poly)
    inner = poly.T @ solved

    def inverse(values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance's inverse times values, the polynomial projected out."""
        first = cho_solve(factor, values)
        return first - solved @ np.linalg.solve(inner, solved.T @ values)

    log_volume = -float(np.log(np.diag(factor[0])).sum()) - 0.5 * float(np.linalg.slogdet(inner)[1])
    log_volume += 0.5 * float(np.linalg.slogdet(noise)[1])
    return DenseGaussian(
        unknown.T @ inverse(unknown), unknown.T @ inverse(right), float(right @ inverse(right)), log_volume
    )
