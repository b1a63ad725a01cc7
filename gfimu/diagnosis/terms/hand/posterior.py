"""A run of a free body linearised, its drive, slow noise and the errors of its gyro integrated out.

For a sample with readings y, sensing axes A and specific force p the twin predicts y = A p + h(ω, ω̇; effects). Nothing
is known of p, so that it takes three combinations of the channels whole; at rest |p| = g is known as well and adds one
row. The angular acceleration is ω̇ of the gyro plus an unknown part of known variance, which takes a share of three more
combinations; about a known axis the noise δ of the rate Ω, as 2 Ω δ, takes a share of one more. The combinations of all
samples are the same (`Projection`), so that with V what is taken of columns,

    G = AᵀWA − VᵀV + (row of rest),

block by block. Bias instability, the gyro's bias and an unknown time over which readings are averaged are columns with
Gaussian priors, eliminated from the normal equations after that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, solve_triangular

from gfimu.diagnosis.data.body.run import AVERAGING, REST_FLOOR
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.hand.drive import HandDrive
from gfimu.diagnosis.terms.hand.noise import LEAST_POWER, BodyNoise, Projection
from gfimu.model.world_model import Effect
from gfimu.motion.body_drive import BodyDrive

__all__ = ["HandPosterior", "condition_hand"]

_FORCE_STEPS = 6  # numerical
_FORCE_DONE = 0.02  # numerical: of the white noise
_BLOCK_S, _MOST_BLOCKS = 0.5, 128  # numerical: block of time, s, of the test of the noise
_TAKEN = 7  # numerical: combinations of the channels that the drive takes: force, angular acceleration, rate


@dataclass(frozen=True)
class HandObserved:
    """A prediction with the weights of its rows.

    Parameters
    ----------
    prediction : ndarray, shape (m, c + 1)
        f.
    residual : ndarray, shape (m, c + 1)
        r, weighed.
    weight : ndarray, shape (m, c + 1)
        Root of the number of samples over the factor by which their variance grows.
    weights : ndarray, shape (c + 1,)
        One over the white variance of each channel.
    levels : BodyNoise
        The noise.
    log_noise : float
        −½ log det of the noise covariance.
    """

    prediction: NDArray[np.float64]
    residual: NDArray[np.float64]
    weight: NDArray[np.float64]
    weights: NDArray[np.float64]
    levels: BodyNoise
    log_noise: float


@dataclass(frozen=True)
class HandPosterior:
    """A linearised stretch of a free body.

    Parameters
    ----------
    stretch : BodyStretch
        The data.
    effects : tuple of Effect
        About which.
    levels : BodyNoise
        The noise.
    given, drive : HandDrive
        The drive, and that with the specific force which fits best.
    jacobian : Projection
        What the channels read per specific force and angular acceleration.
    residual : ndarray, shape (n, c)
        Measured minus predicted, m/s².
    observed : HandObserved
        The same by groups, weighed.
    """

    stretch: BodyStretch
    effects: tuple[Effect, ...]
    levels: BodyNoise
    given: HandDrive
    drive: HandDrive
    jacobian: Projection
    residual: NDArray[np.float64]
    observed: HandObserved

    # -- what the drive takes -------------------------------------------------------------------------------------

    @cached_property
    def _weight(self) -> NDArray[np.float64]:
        """Weight of each group, shape (m,)."""
        return np.asarray(self.observed.weight.max(axis=1))

    @cached_property
    def _mix(self) -> NDArray[np.float64]:
        """The combinations that the drive enters, shape (7, c)."""
        return np.vstack([self.jacobian.force_rows, self.jacobian.rows[:3], self.jacobian.rate_row])

    @cached_property
    def _spread(self) -> NDArray[np.float64]:
        """Variance of what angular acceleration and rate add to four of them, in units of their noise, shape (4, m)."""
        first = self.stretch.starts  # of groups, which have one change: they are at rest, or single samples
        change, rate = self.stretch.change_in_motion[first], self.stretch.rate_error[first]
        ratio = np.outer(self.jacobian.strength**2, self.levels.lost(change))
        return np.vstack([ratio, (self.jacobian.rate_strength * rate) ** 2]) / self.levels.common(change)

    @cached_property
    def _share(self) -> NDArray[np.float64]:
        """Root of the share of each combination that the drive takes, shape (7, m)."""
        return np.vstack([np.ones((3, len(self._weight))), np.sqrt(self._spread / (1.0 + self._spread))])

    @cached_property
    def _rest(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The row of rest by channel (m, c) and its residual (m,): |p| is gravity's."""
        force = self.stretch.grouped(self.drive.spin.force)
        size = np.linalg.norm(force, axis=1)
        up = force / np.maximum(size, 1e-9)[:, None]
        count = np.maximum(self.stretch.count, 1)
        spread = np.einsum("mi,ij,mj->m", up, self.jacobian.force_covariance, up) / count
        weight = np.where(self.stretch.resting, 1.0 / np.sqrt(spread + REST_FLOOR**2), 0.0)
        # The specific force takes back what a change of the prediction along gravity would add.
        row = (up @ self.jacobian.to_force) * -weight[:, None]
        return row, (self.stretch.model.local_gravity - size) * weight

    @cached_property
    def _rest_of_weighed(self) -> NDArray[np.float64]:
        """The row of rest for columns that are weighed already, shape (m, c)."""
        return self._rest[0] / np.where(self._weight > 0.0, self._weight, 1.0)[:, None]

    def _taken(self, columns: Columns) -> NDArray[np.float64]:
        """Return V of columns, and last what the row of rest has of them, shape (8, m, P)."""
        out = np.zeros((_TAKEN + 1, len(self._weight), columns.count))
        for c, (at, part) in enumerate(zip(columns.places[:-1], columns.parts[:-1], strict=True)):
            if len(at):
                out[:_TAKEN, :, at] += self._mix[:, c, None, None] * part
                out[_TAKEN][:, at] += self._rest_of_weighed[:, [c]] * part
        out[:_TAKEN] *= self._share[:, :, None]
        return out

    @cached_property
    def _taken_of_residual(self) -> NDArray[np.float64]:
        """The same of the residual, shape (8, m)."""
        taken = (self._mix @ self.observed.residual[:, :-1].T) * self._share
        return np.vstack([taken, self._rest[1]])

    def _driveless(
        self, columns: Columns, taken: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return G and b with the drive eliminated."""
        gram, score = np.zeros((columns.count,) * 2), np.zeros(columns.count)
        for c, (at, part) in enumerate(zip(columns.places[:-1], columns.parts[:-1], strict=True)):
            weight = self.observed.weights[c]
            gram[np.ix_(at, at)] += weight * (part.T @ part)
            score[at] += weight * (part.T @ self.observed.residual[:, c])
        lost, rest = np.concatenate(taken[:_TAKEN]), taken[_TAKEN]
        right = self._taken_of_residual
        gram += rest.T @ rest - lost.T @ lost
        score += rest.T @ right[_TAKEN] - lost.T @ right[:_TAKEN].ravel()
        return gram, score

    # -- slow noise per channel, in K cosines, and errors of the motion ---------------------------------------------

    @cached_property
    def _cosines(self) -> NDArray[np.float64]:
        """Cosines with the weights of the groups, for the bias instability that was learnt, shape (m, K)."""
        return self.stretch.cosines * (self._weight * self.levels.instability)[:, None]

    def slow_gram(self) -> NDArray[np.float64]:
        """Return NᵀN of slow noise, the drive eliminated, shape (c · K, c · K)."""
        cosines, (channels, modes) = self._cosines, (len(self.levels.white) - 1, self._cosines.shape[1])
        gram = np.zeros((channels, modes, channels, modes))
        whole = cosines.T @ cosines
        for c, weight in enumerate(self.observed.weights[:-1]):
            gram[c, :, c, :] += weight * whole
        for mix, share in zip(self._mix, self._share, strict=True):
            part = cosines * share[:, None]
            gram -= np.einsum("i,j,kl->ikjl", mix, mix, part.T @ part)
        rest = np.flatnonzero(self.stretch.resting)
        mixed = (self._rest_of_weighed[rest, :, None] * cosines[rest, None, :]).reshape(len(rest), channels * modes)
        return np.asarray(gram.reshape(channels * modes, -1) + mixed.T @ mixed)

    def slow_cross(self, columns: Columns, taken: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return NᵀX of slow noise with columns, the drive eliminated, shape (c · K, P)."""
        cosines, count = self._cosines, columns.count
        out = np.zeros((len(self.levels.white) - 1, cosines.shape[1], count))
        for c, (at, part) in enumerate(zip(columns.places[:-1], columns.parts[:-1], strict=True)):
            out[c][:, at] += self.observed.weights[c] * (cosines.T @ part)
        return self._slow_of(out, taken)

    def _slow_of(self, out: NDArray[np.float64], taken: NDArray[np.float64]) -> NDArray[np.float64]:
        cosines = self._cosines
        for mix, share, lost in zip(self._mix, self._share, taken[:_TAKEN], strict=True):
            out -= mix[:, None, None] * (cosines.T @ (share[:, None] * lost))
        rest = np.flatnonzero(self.stretch.resting)
        mixed = self._rest_of_weighed[rest, :, None] * cosines[rest, None, :]  # (rest, c, K)
        out += np.tensordot(mixed, taken[_TAKEN][rest], axes=(0, 0))
        return np.concatenate(out)

    @cached_property
    def slow_score(self) -> NDArray[np.float64]:
        """Nᵀr of slow noise, the drive eliminated, shape (c · K,)."""
        weighed = self.observed.residual[:, :-1] * self.observed.weights[:-1]
        out = (self._cosines.T @ weighed).T[:, :, None].copy()
        return self._slow_of(out, self._taken_of_residual[:, :, None])[:, 0]

    @cached_property
    def motion_errors(self) -> list[NDArray[np.float64]]:
        """What errors of the motion change in the prediction, in units of their prior, each (n, c), m/s²."""
        stretch, spin = self.stretch, self.drive.spin
        base = stretch.channels(self.effects, spin)
        prior = stretch.run.gyro_bias_std
        changes = []
        for axis in range(3):
            moved = spin.rate.copy()
            moved[:, axis] += prior
            changes.append(stretch.channels(self.effects, BodyDrive(spin.t, moved, spin.force)) - base)
        # A mean over a time τ adds τ²/24 of the second derivative; whether chips or gyro average is unknown.
        rigid = stretch.channels(self.effects, spin.with_force(np.zeros_like(spin.force)))
        bend = np.zeros_like(rigid)
        bend[1:-1] = AVERAGING**2 / 24.0 * np.diff(rigid, 2, axis=0)
        changes.append(bend)
        if self.levels.acceleration_slope > 0:
            # Where its samples miss much of the angular acceleration, what they hold need not be to scale either.
            arms = stretch.model.array.regression_matrix
            changes += [Policy.small * np.outer(spin.acceleration[:, axis], arms[:, axis]) for axis in range(3)]
        return changes

    @cached_property
    def motion(self) -> Columns:
        """Columns of the errors of the motion, in units of their prior."""
        return self.columns_of(self.motion_errors)

    def columns_of(self, changes: Sequence[NDArray[np.float64]]) -> Columns:
        """Return changes of the prediction, each (n, c), m/s², as columns."""
        grouped = np.stack([self.stretch.grouped(change) for change in changes], axis=2)  # (m, c, k)
        values = np.concatenate([grouped, np.zeros((len(grouped), 1, grouped.shape[2]))], axis=1)
        return Columns.of(values, self.observed.weight)

    @cached_property
    def _nuisances(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The factor that eliminates slow noise and the errors of the motion, and their score."""
        taken = self._taken(self.motion)
        gram, score = self._driveless(self.motion, taken)
        cross = self.slow_cross(self.motion, taken)
        inner = np.block([[self.slow_gram(), cross], [cross.T, gram]])
        inner[np.diag_indices_from(inner)] += 1.0
        return np.linalg.cholesky(inner), np.concatenate([self.slow_score, score])

    @cached_property
    def _forward(self) -> NDArray[np.float64]:
        factor, score = self._nuisances
        return np.asarray(solve_triangular(factor, score, lower=True, check_finite=False))

    @cached_property
    def nuisance_sizes(self) -> NDArray[np.float64]:
        """Most probable slow noise (c · K) and errors of the motion, in units of their prior."""
        return np.asarray(cho_solve((self._nuisances[0], True), self._nuisances[1]))

    # -- the residual of every sample ------------------------------------------------------------------------------

    @cached_property
    def without_motion(self) -> NDArray[np.float64]:
        """Residual less the angular acceleration and rate that the gyro's samples don't hold, shape (n, c), m/s².

        That takes no part in the normal equations: estimated from the same readings, it would explain itself by longer
        arms.
        """
        stretch, strength = self.stretch, self.jacobian.strength
        prior = self.levels.lost(stretch.change_in_motion)[:, None]
        common = self.levels.common(stretch.change_in_motion)[:, None]
        rows = self.residual @ self.jacobian.rows[:3].T  # (n, 3)
        lost = (rows * prior * strength / (common + prior * strength**2)) @ self.jacobian.turn
        change = np.where(stretch.use[:, None], lost, 0.0) @ stretch.model.array.regression_matrix[:, :3].T
        force, spread = self.jacobian.rate_strength, stretch.rate_error**2
        squared = (self.residual @ self.jacobian.rate_row) * spread * force / (common[:, 0] + spread * force**2)
        change += np.outer(np.where(stretch.use, squared, 0.0), self.jacobian.squared_rate)
        return np.where(stretch.run.valid, self.beside_force(self.residual - change), 0.0)

    @cached_property
    def without_errors(self) -> NDArray[np.float64]:
        """Residual less the most probable errors of the motion, shape (n, c), m/s²."""
        sizes = self.nuisance_sizes[-len(self.motion_errors) :]
        change = sum((size * one for size, one in zip(sizes, self.motion_errors, strict=True)), 0.0 * self.residual)
        return np.asarray(self.residual - self.beside_force(change))

    def beside_force(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return changes of the readings (n, c) less what the best specific force takes of each, m/s²."""
        return np.asarray(values - (values @ self.jacobian.to_force.T) @ self.stretch.model.array.axes.T)

    # -- what a fit asks for ----------------------------------------------------------------------------------------

    @cached_property
    def squares(self) -> NDArray[np.float64]:
        """Whitened squares of each group, the drive eliminated, shape (m,)."""
        right = self._taken_of_residual
        power = self.observed.residual**2 @ self.observed.weights
        return np.asarray(power + right[_TAKEN] ** 2 - np.sum(right[:_TAKEN] ** 2, axis=0))

    @cached_property
    def objective(self) -> float:
        """Sum of squares, drive and nuisance parameters eliminated, over the misfit of the noise."""
        return (float(self.squares.sum()) - float(self._forward @ self._forward)) / self.levels.misfit

    @property
    def energy(self) -> float:
        """The same: the drive is always at its best."""
        return self.objective

    @cached_property
    def log_volume(self) -> float:
        """What the freedom of the nuisance parameters costs."""
        on = self.stretch.on
        return -float(np.log(self._nuisances[0].diagonal()).sum()) - 0.5 * float(np.log1p(self._spread[:, on]).sum())

    @property
    def step(self) -> NDArray[np.float64]:
        """Step of the drive to its best, shape (3 n,)."""
        return np.asarray((self.drive.spin.force - self.given.spin.force).ravel())

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Of parameters of the drive's prior, of which it has none."""
        return np.zeros((0, 0))

    @property
    def whitened(self) -> NDArray[np.float64]:
        """Residual less drive and nuisances, (m, c + 1): its product with any column is that column's score."""
        return self._whitened_beside(Columns.none(len(self.levels.white), len(self._weight)))

    def _whitened_beside(self, columns: Columns) -> NDArray[np.float64]:
        """Return the same less the best fit of columns as well."""
        seen, split = self.observed, self.slow_score.size
        gram, score, cross = self._beside(columns)
        gram[np.diag_indices_from(gram)] += 1e-9 * (1.0 + gram.diagonal().max(initial=0.0))  # numerical
        sizes = np.asarray(np.linalg.solve(gram, score), dtype=np.float64)
        nuisances = cho_solve((self._nuisances[0], True), self._nuisances[1] - cross @ sizes)
        drift, motion = nuisances[:split], nuisances[split:]
        taken_away = self._cosines @ drift.reshape(-1, self._cosines.shape[1]).T
        taken_away += (self.motion.times(motion) + columns.times(sizes))[:, :-1]
        left = seen.residual[:, :-1] - taken_away
        rest = self._taken_of_residual[_TAKEN] - np.sum(self._rest_of_weighed * taken_away, axis=1)
        out = left * seen.weights[:-1] - ((left @ self._mix.T) * self._share.T**2) @ self._mix
        out += self._rest_of_weighed * rest[:, None]
        return np.column_stack([out, np.zeros(len(out))])

    def slow_beside(self, columns: Columns) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return G and b of slow noise, the drive eliminated and columns projected out."""
        both = Columns.together([self.motion, columns])
        taken = self._taken(both)
        inner, right = self._driveless(both, taken)
        inner[np.diag_indices_from(inner)] += 1e-9 * (1.0 + inner.diagonal().max())  # numerical
        cross = self.slow_cross(both, taken)
        gain = np.linalg.solve(inner, np.column_stack([cross.T, right]))
        return self.slow_gram() - cross @ gain[:, :-1], self.slow_score - cross @ gain[:, -1]

    def misfit(self, columns: Columns, beside: Columns | None = None) -> float:
        """Return how much more than white noise the residual scatters along columns; at least 1.

        The residual is that beside the best fit of other columns, which may yet prove to be causes.

        Block by block of time the products of columns and residual have the variance that white noise gives them, were
        the noise all that is left. Vibration that the chips do not share, or filters unlike, leave more: every block
        then weighs for one observation, whatever the number of its samples (the information-matrix test of White,
        Econometrica 50, 1982, in the directions of the columns).
        """
        strength, turn = np.linalg.eigh(self._driveless(columns, self._taken(columns))[0])
        seen = strength > LEAST_POWER * max(strength[-1], 1e-300) if len(strength) else np.zeros(0, dtype=bool)
        if not seen.any():
            return 1.0
        products, left = (
            np.zeros((len(self._weight), columns.count)),
            self.whitened if beside is None else self._whitened_beside(beside),
        )
        for c, (at, part) in enumerate(zip(columns.places, columns.parts, strict=True)):
            products[:, at] += part * left[:, [c]]
        length = max(int(_BLOCK_S / self.stretch.run.sample_period), len(products) // _MOST_BLOCKS, 1)
        scores = np.add.reduceat(products, np.arange(0, len(products), length), axis=0)  # (blocks, k)
        scatter = np.sum((scores @ turn[:, seen]) ** 2 / strength[seen])
        return max(float(scatter) / int(seen.sum()), 1.0)

    def products(self, columns: Columns) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return G (P, P), b (P,) and how the specific force follows columns, shape (3 m, P)."""
        gram, score, _ = self._beside(columns)
        return gram / self.levels.misfit, score / self.levels.misfit, self._force_of(columns)

    def _beside(self, columns: Columns) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return G, b and the products of the nuisances with columns."""
        count = self.motion.count
        both = Columns.together([self.motion, columns])
        taken = self._taken(both)
        gram, score = self._driveless(both, taken)
        cross = np.vstack([self.slow_cross(both, taken)[:, count:], gram[:count, count:]])
        eliminated = solve_triangular(self._nuisances[0], cross, lower=True, check_finite=False)
        gram = gram[count:, count:] - eliminated.T @ eliminated
        return gram, score[count:] - eliminated.T @ self._forward, cross

    def _force_of(self, columns: Columns) -> NDArray[np.float64]:
        """Return the specific force that columns stand for, m/s², shape (3 m, P)."""
        out = np.zeros((len(self._weight), 3, columns.count))
        over = 1.0 / np.where(self._weight > 0.0, self._weight, np.inf)
        for c, (at, part) in enumerate(zip(columns.places[:-1], columns.parts[:-1], strict=True)):
            out[:, :, at] += self.jacobian.to_force[:, c, None] * (part * over[:, None])[:, None, :]
        return out.reshape(3 * len(out), columns.count)

    def response(self, across: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how the drive follows each unknown, shape (3 n, P)."""
        sizes = np.diff(np.append(self.stretch.starts, len(self.stretch.run.t)))
        each = -across.reshape(len(sizes), 3, across.shape[1])
        return np.concatenate(np.repeat(each, sizes, axis=0))


def condition_hand(
    stretch: BodyStretch,
    drive: HandDrive,
    effects: Sequence[Effect],
    levels: BodyNoise,
    projection: Projection | None = None,
) -> HandPosterior:
    """Linearise a stretch of a free body about effects, at the specific force that fits best.

    Raises
    ------
    NoPredictionError
        If the prediction is not finite.
    """
    if projection is None:
        sensed = _sensed(stretch, drive.spin, effects) if effects or stretch.known else None
        projection = Projection(stretch.model.array, levels.white[:-1], sensed)
    settled = _settled(stretch, drive, effects, levels, projection)
    channels = stretch.channels(effects, settled.spin)
    residual = np.where(stretch.run.valid, stretch.run.readings - channels, 0.0)
    change = stretch.change_in_motion[stretch.starts]
    common = levels.common(change)
    weight = np.where(stretch.mask, np.sqrt(stretch.count / common)[:, None], 0.0)
    prediction = np.column_stack([stretch.grouped(channels), np.zeros(len(weight))])
    rows = np.column_stack([stretch.grouped(residual), np.zeros(len(weight))]) * weight
    alive, on = stretch.alive, stretch.on
    each = np.log(levels.white[:-1][alive]).sum() + 0.5 * alive.sum() * np.log(common[on] / stretch.count[on])
    log_noise = -(1.0 - 3.0 / float(alive.sum())) * float(each.sum())
    observed = HandObserved(prediction, rows, weight, 1.0 / levels.white**2, levels, log_noise)
    return HandPosterior(stretch, tuple(effects), levels, drive, settled, projection, residual, observed)


def _sensed(stretch: BodyStretch, spin: BodyDrive, effects: Sequence[Effect]) -> NDArray[np.float64]:
    """Return what the channels read per specific force under effects, shape (c, 3)."""
    n = len(stretch.run.t)
    base = stretch.channels(effects, spin)
    slopes = []
    for axis in range(3):
        moved = spin.with_force(spin.force + np.eye(3)[axis])
        slopes.append((stretch.channels(effects, moved) - base)[n // 4 : -n // 4].mean(axis=0))
    return np.stack(slopes, axis=1)


def _settled(
    stretch: BodyStretch, drive: HandDrive, effects: Sequence[Effect], levels: BodyNoise, projection: Projection
) -> HandDrive:
    """Return the drive with the specific force that fits best under effects."""
    last = np.inf
    for _ in range(_FORCE_STEPS):
        left = np.where(stretch.run.valid, stretch.run.readings - stretch.channels(effects, drive.spin), 0.0)
        step = left @ projection.to_force.T
        size = float(np.sqrt(np.mean(step[stretch.use] ** 2)))
        if not size <= last:  # effects this large leave no specific force that fits: the misfit will show it
            break
        drive, last = replace(drive, spin=drive.spin.with_force(drive.spin.force + step)), size
        if size < _FORCE_DONE * levels.typical:
            break
    return drive
