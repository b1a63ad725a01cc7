"""A run of a free body linearised about given effects, its specific force and slow noise marginalised.

For a sample with readings y, sensing axes A and specific force p the twin predicts y = A p + h(ω, ω̇; effects). Nothing
is known of p, so that only combinations N y with N A = 0 count; at rest |p| = g is known as well and adds one row. The
angular acceleration is ω̇ of the gyro plus an unknown part of known variance, which widens the three rows that feel it.
Bias instability, the gyro's bias and an unknown time over which readings are averaged are columns with Gaussian priors,
eliminated from the normal equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, solve_triangular

from gfimu.diagnosis.coloured_noise import CosineBasis
from gfimu.diagnosis.free_body.noise import (
    BodyNoise,
    Projection,
    change_of_readings,
    learn_motion_noise,
    white_from_rows,
)
from gfimu.diagnosis.free_body.run import BodyRun
from gfimu.motion.body_drive import BodyDrive
from gfimu.world_model import BodyModel, Effect

__all__ = ["BodyLine", "BodySegment", "Nuisances"]

_REST_GROUP = 32
_MODES = 10
_REST_FLOOR = 5e-3  # m/s²: what "at rest" may leave in the magnitude of the specific force
_GYRO_BIAS = (0.005, 0.1)  # rad/s: uncertain after a rest, without one
_SLOW_SHARE = 0.6  # of bias instability that a run shows about its mean
_UNTRUE = 0.1
_BLOCK_S, _MOST_BLOCKS = 0.5, 128
_SEEN = 1e-9
_AVERAGING = 1.5  # sample periods: how long chips or gyro may average
_FORCE_STEPS = 6
_FORCE_DONE = 0.02
_FLICKER_GRID = 9.80665e-3 * np.geomspace(0.02, 3.0, 22)
_FLICKER_PRIOR, _FLICKER_SPREAD = 9.80665e-3 * 0.2, np.log(3.3)


@dataclass(frozen=True)
class Nuisances:
    """The errors of the motion (columns) and the bias instability (its rms), with the factor that eliminates both."""

    bias: NDArray[np.float64]
    flicker: float
    factor: NDArray[np.float64]


@dataclass(frozen=True)
class BodyLine:
    """A linearisation: residual rows about effects, nuisances not yet eliminated.

    Parameters
    ----------
    drive : BodyDrive
        With the specific force that goes with the effects.
    residual : ndarray, shape (n, c)
        Measured minus predicted, m/s².
    rows : ndarray, shape (m, c − 2)
        Whitened residual, the row of rest last.
    """

    drive: BodyDrive
    residual: NDArray[np.float64]
    rows: NDArray[np.float64]


class BodySegment:
    """A run of a free body, or stretches of it.

    Parameters
    ----------
    model : BodyModel
        The simulation.
    body : BodyRun
        The run.
    index : int
        Its number.
    """

    def __init__(self, model: BodyModel, body: BodyRun, index: int) -> None:
        self.model, self.body, self.index = model, body, index
        self.run = body.run
        self.alive = self.run.valid.mean(axis=0) > 0.5
        self.use = self.run.valid[:, self.alive].all(axis=1) & body.gyro_valid
        self.use[[0, -1]] = False
        white = np.where(self.alive, model.expected_noise(1.0 / self.run.sample_period).white, np.inf)
        array = model.array
        stacked = np.hstack([array.axes, array.regression_matrix[:, :3] / array.length_unit]) * self.alive[:, None]
        self._projector = (np.eye(len(white)) - stacked @ np.linalg.pinv(stacked)) * self.alive
        self.change = change_of_readings(self.run.bridged, self.run.sample_period, white)
        self.drive = BodyDrive(self.run.t, body.rate, self._first_force())
        self.starts = self._groups()
        self.count = np.add.reduceat(self.use.astype(float), self.starts)
        self.at_rest = np.add.reduceat((body.rest & self.use).astype(float), self.starts) > 0
        self.basis = CosineBasis(max(len(self.run.t), 64), self.run.sample_period)
        self.stretch = np.ones(len(self.starts), dtype=bool)
        self.set_noise(BodyNoise(white, flicker=_FLICKER_PRIOR / 4))

    def _first_force(self) -> NDArray[np.float64]:
        return np.asarray(self.run.bridged @ np.linalg.pinv(self.model.array.axes * self.alive[:, None]).T)

    def _groups(self) -> NDArray[np.intp]:
        """Return where each group of samples begins: many at rest, one in motion."""
        rest = self.body.rest & self.use
        edge = np.ones(len(rest), dtype=bool)
        edge[1:] = ~(rest[1:] & rest[:-1])
        run = np.arange(len(rest)) - np.maximum.accumulate(np.where(edge, np.arange(len(rest)), 0))
        return np.flatnonzero(run % _REST_GROUP == 0)

    def only(self, stretch: NDArray[np.bool_]) -> BodySegment:
        """Return the same segment with only some of its groups in use."""
        other = object.__new__(BodySegment)
        other.__dict__.update(self.__dict__)
        other.stretch = stretch
        return other

    # -- noise ---------------------------------------------------------------------------------------------------

    def set_noise(self, noise: BodyNoise) -> None:
        """Take new noise levels and compute the weights of every row."""
        self.noise = noise
        self.projection = Projection(self.model.array, noise.white)
        rest = self.body.rest
        variance = self.projection.variance(noise, np.where(rest, 0.0, self.change))
        first = variance[self.starts]  # groups have one variance: they are at rest, or single samples
        self.weight = np.sqrt(
            np.where(self.stretch & (self.count > 0), 1.0, 0.0)[:, None] * self.count[:, None] / first
        )
        middle = np.add.reduceat(np.where(self.use, self.run.t, 0.0), self.starts) / np.maximum(self.count, 1)
        phase = np.pi * (middle - self.run.t[0]) / max(self.run.duration, 1e-9)
        modes = np.arange(_MODES)
        self._cosines = np.sqrt(2.0 / len(self.run.t)) * np.cos(np.outer(phase, modes))  # (m, K)
        self._cosines[:, 0] /= np.sqrt(2.0)
        self._cosines *= np.sqrt(self.basis.flicker_spectrum[:_MODES])
        self._slow: NDArray[np.float64] | None = None

    def learn_noise(self, line: BodyLine) -> None:
        """Learn white noise and what grows with the motion from the residual, then the bias instability."""
        expected = self.model.expected_noise(1.0 / self.run.sample_period)
        white = white_from_rows(line.residual @ self._projector, self._projector, self.change, self.use, expected.white)
        floor = expected.quantum / np.sqrt(12)
        white = np.where(self.alive, np.maximum(white, floor), np.inf)
        projection = Projection(self.model.array, white)
        rows = line.residual @ projection.rows.T
        noise = learn_motion_noise(white, projection, rows, self.change, self.use, self.body.acceleration_error)
        self.set_noise(replace(noise, flicker=self.noise.flicker))

    def learn_flicker(self, line: BodyLine, columns: NDArray[np.float64]) -> None:
        """Pick the bias instability by marginal likelihood, the causes' columns (m · (c − 2), k) projected out."""
        right = line.rows.ravel()
        gram, score = self.slow_gram(), self.slow_cross(right[:, None])[:, 0]
        if columns.shape[1]:
            inner = columns.T @ columns
            inner[np.diag_indices_from(inner)] += 1e-9 * (1.0 + inner.diagonal().max())
            cross = self.slow_cross(columns)
            gain = np.linalg.solve(inner, np.column_stack([cross.T, columns.T @ right]))
            gram, score = gram - cross @ gain[:, :-1], score - cross @ gain[:, -1]
        values, turn = np.linalg.eigh(gram)
        power, values = (turn.T @ score) ** 2, np.maximum(values, 0.0)
        likelihood = [
            0.5 * np.sum(level**2 * power / (1 + level**2 * values))
            - 0.5 * np.sum(np.log1p(level**2 * values))
            - 0.5 * ((np.log(level) - np.log(_FLICKER_PRIOR)) / _FLICKER_SPREAD) ** 2
            for level in _FLICKER_GRID
        ]
        self.noise = replace(self.noise, flicker=float(_FLICKER_GRID[int(np.argmax(likelihood))]))

    # -- prediction -----------------------------------------------------------------------------------------------

    def predict(self, effects: Sequence[Effect], drive: BodyDrive | None = None) -> NDArray[np.float64]:
        """Predict the channels, shape (n, c), m/s²."""
        return self.model.predict_body(
            self.drive if drive is None else drive,
            self.run.t,
            effects=effects,
            temperature=self.run.temperature,
            start=float(self.run.t[0]),
        )

    def _sensed(self, effects: Sequence[Effect]) -> NDArray[np.float64]:
        """Return what the channels read per specific force under effects, shape (c, 3)."""
        n, white = len(self.run.t), self.drive
        base = self.predict(effects, white)
        slopes = []
        for axis in range(3):
            moved = white.force + np.eye(3)[axis]
            slopes.append((self.predict(effects, white.with_force(moved)) - base)[n // 4 : -n // 4].mean(axis=0))
        return np.stack(slopes, axis=1)

    def settle(self, effects: Sequence[Effect]) -> BodyDrive:
        """Return the drive with the specific force that fits best under effects."""
        drive, last = self.drive, np.inf
        for _ in range(_FORCE_STEPS):
            left = np.where(self.run.valid, self.run.readings - self.predict(effects, drive), 0.0)
            step = left @ self.projection.to_force.T
            size = float(np.sqrt(np.mean(step[self.use] ** 2)))
            if size > last:  # effects this large leave no specific force that fits: the misfit will tell
                break
            drive, last = drive.with_force(drive.force + step), size
            if size < _FORCE_DONE * self.noise.typical:
                break
        return drive

    def lost_acceleration(self, residual: NDArray[np.float64]) -> NDArray[np.float64]:
        """Posterior mean of the angular acceleration that the gyro's samples don't hold, shape (n, 3), rad/s².

        It takes no part in the normal equations: estimated from the same readings, it would explain itself by longer
        arms.
        """
        noise, strength = self.noise, self.projection.strength
        change = np.where(self.body.rest, 0.0, self.change)
        prior = noise.acceleration**2 + (noise.acceleration_slope * change) ** 2
        common = 1.0 + (noise.agitation * change / noise.typical) ** 2
        rows = residual @ self.projection.rows[:3].T  # (n, 3)
        share = prior[:, None] * strength / (common[:, None] + np.outer(prior, strength**2))
        return np.where(self.use[:, None], (rows * share) @ self.projection.turn, 0.0)

    # -- normal equations -------------------------------------------------------------------------------------------

    def linearise(self, effects: Sequence[Effect]) -> BodyLine:
        """Settle the drive under effects and return the residual rows."""
        if effects:
            self.projection = Projection(self.model.array, self.noise.white, self._sensed(effects))
        self._slow = None
        self.drive = drive = self.settle(effects)
        residual = np.where(self.run.valid, self.run.readings - self.predict(effects, drive), 0.0)
        rows = self._rows(residual)
        force = self._grouped(drive.force)
        size = np.linalg.norm(force, axis=1)
        self._up = force / np.maximum(size, 1e-9)[:, None]
        spread = np.einsum("mi,ij,mj->m", self._up, self.projection.force_covariance, self._up)
        active = self.at_rest & self.stretch & (self.count > 0)
        self._rest_weight = np.where(active, 1 / np.sqrt(spread / np.maximum(self.count, 1) + _REST_FLOOR**2), 0.0)
        self._rest_mix = (self._up @ self.projection.to_force) * -self._rest_weight[:, None]  # (m, c)
        rows[:, -1] = (self.model.local_gravity - size) * self._rest_weight
        return BodyLine(drive, residual, rows)

    def motion_removed(self, line: BodyLine) -> NDArray[np.float64]:
        """Return the residual less the angular acceleration that the gyro's samples don't hold, shape (n, c), m/s²."""
        arms = self.model.array.regression_matrix[:, :3]
        left = line.residual - self.lost_acceleration(line.residual) @ arms.T
        return np.where(self.run.valid, left - (left @ self.projection.to_force.T) @ self.model.array.axes.T, 0.0)

    @property
    def noise_floor(self) -> float:
        """Rms of the sensors' own noise in a residual whose specific force is fitted, m/s²."""
        white = self.noise.white[self.alive]
        power = np.mean(white**2) + _SLOW_SHARE * self.noise.flicker**2
        return float(np.sqrt(power * (1.0 - 3.0 / self.alive.sum())))

    @property
    def in_stretch(self) -> NDArray[np.bool_]:
        """Samples of the groups in use, shape (n,)."""
        return np.repeat(self.stretch, np.diff(np.append(self.starts, len(self.run.t))))

    @property
    def observations(self) -> int:
        """Number of rows that count."""
        return int((self.weight[:, self.projection.alive] > 0).sum() + (self._rest_weight > 0).sum())

    def _grouped(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        total = np.add.reduceat(np.where(self.use[:, None], values, 0.0), self.starts, axis=0)
        return np.asarray(total / np.maximum(self.count, 1)[:, None])

    def _rows(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return whitened rows (m, c − 2) of values of the channels (n, c); the last, of rest, still empty."""
        grouped = self._grouped(values)
        out = np.zeros((len(grouped), len(self.projection.rows) + 1))
        out[:, :-1] = (grouped @ self.projection.rows.T) * self.weight
        return out

    def grouped(self, change: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the means of a change of the prediction (n, c) over each group, shape (m, c), m/s²."""
        return self._grouped(change)

    def signature(self, grouped: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the column (m · (c − 2),) of a change of the prediction in groups (m, c), m/s²."""
        out = np.empty((len(grouped), len(self.projection.rows) + 1))
        out[:, :-1] = (grouped @ self.projection.rows.T) * self.weight
        # The specific force takes back what a change of the prediction along gravity would add.
        along = np.einsum("mi,mi->m", self._up, grouped @ self.projection.to_force.T)
        out[:, -1] = -along * self._rest_weight
        return out.ravel()

    # -- nuisances: slow noise per channel, in K cosines of unit rms 1 m/s², and errors of the motion ---------------

    def slow_gram(self) -> NDArray[np.float64]:
        """Return NᵀN of the slow columns, shape (c · K, c · K)."""
        c = len(self.noise.white)
        gram = np.zeros((c, _MODES, c, _MODES))
        for row, mix in enumerate(self.projection.rows):
            part = self._cosines * self.weight[:, [row]]
            gram += np.einsum("i,j,kl->ikjl", mix, mix, part.T @ part)
        rest = np.flatnonzero(self._rest_weight)
        mixed = self._rest_mix[rest, :, None] * self._cosines[rest, None, :]  # (rest, c, K)
        flat = mixed.reshape(len(rest), c * _MODES)
        return np.asarray(gram.reshape(c * _MODES, -1) + flat.T @ flat)

    def slow_cross(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return NᵀX of the slow columns with columns (m · (c − 2), k), shape (c · K, k)."""
        out = np.empty((len(self.noise.white) * _MODES, columns.shape[1]))
        for place, column in enumerate(columns.T):
            rows = column.reshape(len(self.starts), -1)
            mixed = (rows[:, :-1] * self.weight) @ self.projection.rows  # (m, c)
            mixed += self._rest_mix * rows[:, [-1]]
            out[:, place] = (self._cosines.T @ mixed).T.ravel()
        return out

    def motion_errors(self, effects: Sequence[Effect], line: BodyLine) -> list[NDArray[np.float64]]:
        """Return what errors of the motion change in the prediction, in units of their prior, each (n, c), m/s²."""
        base = self.predict(effects, line.drive)
        prior = _GYRO_BIAS[0 if self.body.rest.any() else 1]
        changes = []
        for axis in range(3):
            moved = line.drive.rate.copy()
            moved[:, axis] += prior
            drive = BodyDrive(line.drive.t, moved, line.drive.force)
            changes.append(self.predict(effects, drive) - base)
        # A mean over a time τ adds τ²/24 of the second derivative; whether chips or gyro average is unknown.
        rigid = self.predict(effects, line.drive.with_force(np.zeros_like(line.drive.force)))
        bend = np.zeros_like(rigid)
        bend[1:-1] = _AVERAGING**2 / 24.0 * np.diff(rigid, 2, axis=0)
        changes.append(bend)
        if self.noise.acceleration_slope > 0:
            # Where its samples miss much of the angular acceleration, what they hold need not be to scale either.
            arms = self.model.array.regression_matrix
            changes += [_UNTRUE * np.outer(line.drive.acceleration[:, axis], arms[:, axis]) for axis in range(3)]
        return changes

    def motion_columns(self, effects: Sequence[Effect], line: BodyLine) -> NDArray[np.float64]:
        """Return the columns of the errors of the motion in units of their prior, shape (m · (c − 2), 4 or 7)."""
        columns = [self.signature(self.grouped(change)) for change in self.motion_errors(effects, line)]
        return np.stack(columns, axis=1)

    def motion_corrected(self, effects: Sequence[Effect], line: BodyLine, nuisances: Nuisances) -> NDArray[np.float64]:
        """Return the residual less the most probable errors of the motion, shape (n, c), m/s²."""
        right = line.rows.ravel()
        score = np.concatenate([nuisances.flicker * self.slow_cross(right[:, None])[:, 0], nuisances.bias.T @ right])
        changes = self.motion_errors(effects, line)
        sizes = cho_solve((nuisances.factor, True), score)[-len(changes) :]
        change = sum((size * one for size, one in zip(sizes, changes, strict=True)), np.zeros_like(line.residual))
        return np.asarray(line.residual - change + (change @ self.projection.to_force.T) @ self.model.array.axes.T)

    def nuisances(self, effects: Sequence[Effect], line: BodyLine) -> Nuisances:
        """Return slow noise and the errors of the motion, in units of their prior, ready to be eliminated."""
        bias = self.motion_columns(effects, line)
        if self._slow is None:
            self._slow = self.slow_gram()
        scale = self.noise.flicker
        cross = scale * self.slow_cross(bias)
        slow = scale**2 * self._slow
        inner = np.block([[slow, cross], [cross.T, bias.T @ bias]])
        inner[np.diag_indices_from(inner)] += 1.0
        return Nuisances(bias, scale, np.linalg.cholesky(inner))

    def products(
        self, columns: NDArray[np.float64], line: BodyLine, nuisances: Nuisances
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Return G, b and the objective of columns (m · (c − 2), k) with the nuisances eliminated."""
        right = line.rows.ravel()
        eliminated = self.eliminated(columns, nuisances)
        forward = self.eliminated(right[:, None], nuisances)[:, 0]
        return (
            columns.T @ columns - eliminated.T @ eliminated,
            columns.T @ right - eliminated.T @ forward,
            float(right @ right - forward @ forward),
        )

    def misfit(self, columns: NDArray[np.float64], line: BodyLine, nuisances: Nuisances) -> float:
        """Return how much more than white noise the residual scatters along columns (m · (c − 2), k); at least 1.

        Block by block of time the products of columns and residual have the variance that white noise gives them, were
        the noise all that is left. Vibration that the chips do not share, or filters unlike, leave more: every block
        then weighs for one observation, whatever the number of its samples (the information-matrix test of White,
        Econometrica 50, 1982, in the directions of the columns).
        """
        if not columns.shape[1]:
            return 1.0
        right = self._left(line, nuisances)
        width = len(self.projection.rows) + 1
        length = max(int(_BLOCK_S / self.run.sample_period), len(self.starts) // _MOST_BLOCKS, 1)
        starts = np.arange(0, len(self.starts), length) * width
        scores = np.add.reduceat(columns * right[:, None], starts, axis=0)  # (blocks, k)
        strength, turn = np.linalg.eigh(columns.T @ columns)
        seen = strength > _SEEN * strength[-1]
        if not seen.any():
            return 1.0
        scatter = np.sum((scores @ turn[:, seen]) ** 2 / strength[seen])
        return max(float(scatter) / int(seen.sum()), 1.0)

    def _left(self, line: BodyLine, nuisances: Nuisances) -> NDArray[np.float64]:
        """Return the residual rows (m · (c − 2),) less the most probable nuisances."""
        right = line.rows.ravel()
        slow = nuisances.flicker * self.slow_cross(right[:, None])[:, 0]
        sizes = cho_solve((nuisances.factor, True), np.concatenate([slow, nuisances.bias.T @ right]))
        drift = nuisances.flicker * self._cosines @ sizes[: len(slow)].reshape(-1, _MODES).T  # (m, c)
        rows = np.empty_like(line.rows)
        rows[:, :-1] = (drift @ self.projection.rows.T) * self.weight
        rows[:, -1] = np.sum(drift * self._rest_mix, axis=1)
        return np.asarray(right - rows.ravel() - nuisances.bias @ sizes[len(slow) :])

    def eliminated(self, columns: NDArray[np.float64], nuisances: Nuisances) -> NDArray[np.float64]:
        """Return what the nuisances take of columns: E, so that XᵀY − E(X)ᵀE(Y) is their product without them."""
        cross = np.vstack([nuisances.flicker * self.slow_cross(columns), nuisances.bias.T @ columns])
        return np.asarray(solve_triangular(nuisances.factor, cross, lower=True, check_finite=False))
