"""The monitor of channels: finds the faulty one, takes it out, goes on, and takes it in again when it behaves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.geometry.array import AccelerometerArray
from gfimu.integrity.block_noise import BlockNoise, block_noise
from gfimu.integrity.blocks import Blocks, scatter
from gfimu.integrity.fault import ChannelFault
from gfimu.integrity.isolation import Explanation, deflate, explanations, strongest
from gfimu.integrity.policy import MonitorPolicy
from gfimu.integrity.prediction import omega_products, prediction_row
from gfimu.integrity.recursion import MonitorState, MonitorTables, MonitorTuning, advance, model_errors
from gfimu.rate.sensing import ChannelTables, SensorErrors

__all__ = ["MARGIN", "ChannelMonitor"]

_RAN_AWAY = 1e9  # numerical: rate, score and information of a filter that follows stay far below
_LARGEST_FAULT = 100.0  # m/s², prior standard deviation of a fault's size: a limit that no fault reaches
_LEAST_AGE = 3  # blocks, of an onset from which a fault is isolated: it may be later still
_TRIED = 4  # sets of each kind of which it is tried whether they explain a fault
_FIRST_BLOCK = 0.25  # of one block's evidence, which an onset in the middle of the block spoils at most
MARGIN = 2
"""Blocks before the onset of a fault, from which on its channels are not used."""


_SOUND_SCATTER = 2.0  # of the stated variance, up to which a channel counts as quiet again


@dataclass
class _Suspicion:
    """A fault that is seen and not isolated yet."""

    since: int  # block
    next_trial: int  # block
    unexplained: bool = False


class ChannelMonitor:
    """Watches the channels of an array block by block.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions, with c channels.
    errors : SensorErrors
        Errors of its channels; ``scale_std`` and ``placement_std`` say how well it is calibrated.
    period : float
        Sample period, s.
    omega0 : array_like, shape (3,)
        Angular rate at the start, rad/s.
    omega0_std : float
        Its standard deviation, rad/s.
    policy : MonitorPolicy, optional
        Thresholds.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.
    """

    def __init__(
        self,
        array: AccelerometerArray,
        errors: SensorErrors,
        period: float,
        *,
        omega0: ArrayLike = (0.0, 0.0, 0.0),
        omega0_std: float = 1e-3,
        policy: MonitorPolicy | None = None,
    ) -> None:
        self.array = array
        self.policy = policy or MonitorPolicy()
        self.samples = self.policy.samples(period)
        self._period = self.samples * period
        self._errors = errors
        self._tables = ChannelTables(array, errors)
        c = array.n_channels
        policy = self.policy
        self.threshold = policy.threshold(c, self._period)
        self._tuning = MonitorTuning(
            samples=self.samples,
            period=self._period,
            threshold=self.threshold,
            oldest=policy.oldest_s / self._period,
            walk=policy.bias_walk,
            forget=min(1.0, self._period / policy.range_memory_s),
            scale_std=errors.scale_std,
            placement_std=errors.placement_std,
            floor=policy.bias_std,
        )
        covariance = np.zeros((3 + c, 3 + c))
        covariance[range(3), range(3)] = omega0_std**2
        covariance[range(3, 3 + c), range(3, 3 + c)] = np.maximum(errors.bias_std, policy.bias_std) ** 2
        slots = policy.slots
        history = int(2.0 * self._tuning.oldest) + MARGIN + 1
        self._state = MonitorState(
            omega=np.array(omega0, dtype=float),
            bias=np.zeros(c),
            covariance=covariance,
            last=np.zeros(c),
            low=np.zeros(c),
            high=np.zeros(c),
            ages=np.zeros(slots),
            signature=np.zeros((slots, 3 + c, c)),
            information=np.zeros((slots, c, c)),
            score=np.zeros((slots, c)),
            started=np.zeros(1, dtype=np.bool_),
            largest=np.zeros(1),
            past_rate=np.zeros((history, 3)),
            past_bias=np.zeros((history, c)),
            past_covariance=np.zeros((history, 3 + c, 3 + c)),
            past_means=np.zeros((history, 3, c)),
        )
        self._length_scale = np.array([array.length_unit] * 3 + [1.0] * 3)
        self.watched = np.ones(c, dtype=np.bool_)
        self.faults: list[ChannelFault] = []
        self._noise: dict[int, BlockNoise] = {}
        self._open: dict[int, tuple[int, int]] = {}  # channel: its fault's number, block from which it is judged
        self._patience = np.full(c, policy.readmission_s)
        self._suspicion: _Suspicion | None = None

    @property
    def block_s(self) -> float:
        """Length of a block, s."""
        return self._period

    @property
    def noise_of_means(self) -> NDArray[np.float64]:
        """Standard deviation that white noise gives the mean of a block, shape (c,), m/s²."""
        return np.asarray(self._errors.noise_std / np.sqrt(self.samples))

    @property
    def null_count(self) -> int:
        """Directions of the null space with all channels."""
        return self._tables.n_null

    @property
    def largest_statistic(self) -> float:
        """Largest statistic of a channel so far; those far below the threshold are not followed."""
        return float(self._state.largest[0])

    def run(self, blocks: Blocks) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """Take all blocks; returns ω (m, 3), its std (m, 3) and where a fault was seen that nothing explains (m,)."""
        count = len(blocks)
        omega = np.full((count, 3), np.nan)
        std = np.full((count, 3), np.nan)
        nis = np.zeros(count)
        unexplained = np.zeros(count, dtype=np.bool_)
        steps = np.diff(blocks.t, prepend=blocks.t[0] - self._period) if count else np.zeros(0)
        place = 0
        while place < count:
            sets = self._sets(blocks, self.watched, slice(None))
            tables = self._compiled_tables()
            noise = self._noise_of(blocks)
            noisy, channel = noise.first_from(place)
            end = min(count, noisy + 1)
            if self._open:
                end = min(end, place + max(1, round(1.0 / self._period)))
            place, slot = advance(
                tables, self._tuning, self._state, blocks.means, steps, sets, noise.levels, self.watched,
                omega, std, nis, place, end,
            )  # fmt: skip
            if _lost(self._state):
                unexplained[place - 1 :] = True
                break
            back = place
            if slot >= 0:
                back, unexplained[place - 1] = self._judge(blocks, place)
            elif place == noisy + 1:
                back = self._exclude_noisy(blocks, place, channel)
            else:
                self._suspicion = None
            if back < place:  # again from before the onset, without the channels
                place = back
                self._state.go_back(place)
            else:
                self._readmit(blocks, place, omega)
        return omega, std, unexplained

    def innovations(self, blocks: Blocks) -> NDArray[np.float64]:
        """Return the normalised innovation squared per degree of freedom of each block, without looking for faults."""
        count = len(blocks)
        state = self._state.copy()
        nis = np.zeros(count)
        sets = self._sets(blocks, self.watched, slice(None))
        steps = np.diff(blocks.t, prepend=blocks.t[0] - self._period) if count else np.zeros(0)
        tables = self._compiled_tables()
        advance(
            tables, self._tuning._replace(threshold=np.inf), state, blocks.means, steps, sets, np.ones(count),
            self.watched, np.empty((count, 3)), np.empty((count, 3)), nis, 0, count,
        )  # fmt: skip
        return np.asarray(nis / np.maximum(tables.null_count[sets], 1))

    def _sets(self, blocks: Blocks, watched: NDArray[np.bool_], rows: slice) -> NDArray[np.int64]:
        """Return the set of channels of each block in ``rows``, in the tables."""
        bits = np.int64(1) << np.arange(self.array.n_channels, dtype=np.int64)
        masks = ((blocks.missing[rows] | ~watched) * bits).sum(axis=1)
        unique, inverse = np.unique(masks, return_inverse=True)
        return np.array([self._tables.index(int(mask)) for mask in unique], dtype=np.int64)[inverse]

    def _compiled_tables(self) -> MonitorTables:
        tables = self._tables
        return MonitorTables(
            tables.alpha_rows, tables.alpha_leak, tables.null_rows, tables.null_sensitivity,
            tables.null_count, tables.alpha_noise,
        )  # fmt: skip

    def _excluded_bits(self) -> int:
        return sum(1 << int(channel) for channel in np.flatnonzero(~self.watched))

    def _noise_of(self, blocks: Blocks) -> BlockNoise:
        """Return the noise of all blocks with the channels that are watched now; kept per set of channels."""
        missing = self._excluded_bits()
        if missing not in self._noise:
            null_rows = self._tables.null_rows[self._tables.index(missing)]
            self._noise[missing] = block_noise(blocks, null_rows, self.block_s, self.threshold, self.policy)
        return self._noise[missing]

    def _judge(self, blocks: Blocks, place: int) -> tuple[int, bool]:
        """Isolate the fault that is seen, or wait; returns the block to go on with, and whether nothing explains it."""
        if self._suspicion is None:
            self._suspicion = _Suspicion(place, place + _LEAST_AGE - 1)
        suspicion = self._suspicion
        if place < suspicion.next_trial:
            return place, suspicion.unexplained
        waited = place - suspicion.since
        suspicion.next_trial = place + max(1, waited // 4)
        used, information, score = self._evidence(self._state)
        late = waited * self._period >= self.policy.wait_s
        for kind in explanations(information, score, self.watched, self.array.chip_of_channel, _TRIED):
            passing = [entry for entry in kind if self._explains(blocks, place, used, entry)]
            if not passing:
                continue
            best = passing[0]
            age = float(self._state.ages[used[best.slot]])
            needed = max(self.policy.isolation, (self.policy.relative + _FIRST_BLOCK / age) * best.statistic)
            several = len(best.channels) > 1  # two equal faults may look exactly like two others at first
            rivals = [entry for entry in passing if several or entry.statistic > best.statistic - needed]
            if len(rivals) > 1 and not late:
                return place, False
            blamed = np.unique(np.concatenate([entry.channels for entry in rivals]))
            if not self._may_exclude(blamed, fewest=None if len(rivals) == 1 else 0):
                break
            chosen = Explanation(blamed, best.statistic, best.slot)
            return self._exclude(blocks, place, used, chosen, len(rivals) == 1, information, score), False
        suspicion.unexplained = True
        return place, True

    def _evidence(self, state: MonitorState) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the slots in use, and C (s, c, c) and d (s, c) of each with the errors of the model taken out."""
        std = np.empty(self.array.n_channels)
        model_errors(state, self._tuning, std)
        used = np.flatnonzero(state.ages >= 1.0)
        cleaned = [deflate(state.information[s], state.score[s], std) for s in used]
        return used, np.stack([pair[0] for pair in cleaned]), np.stack([pair[1] for pair in cleaned])

    def _explains(self, blocks: Blocks, place: int, used: NDArray[np.int64], entry: Explanation) -> bool:
        """Whether nothing is left to explain if these channels had not been used since before their onset."""
        age = int(self._state.ages[used[entry.slot]])
        if age < _LEAST_AGE or not self._may_exclude(entry.channels, fewest=1):
            return False
        first = max(0, place - age - MARGIN)
        watched = self.watched.copy()
        watched[entry.channels] = False
        state = self._state.copy()
        state.go_back(first)
        rows = slice(first, place)
        sets = self._sets(blocks, watched, rows)
        count = place - first
        steps = np.diff(blocks.t[rows], prepend=blocks.t[first] - self._period)
        advance(
            self._compiled_tables(), self._tuning._replace(threshold=np.inf), state, blocks.means[rows], steps, sets,
            np.ones(count), watched, np.empty((count, 3)), np.empty((count, 3)), np.empty(count), 0, count,
        )  # fmt: skip
        if _lost(state):
            return False
        _, information, score = self._evidence(state)
        rest = max(strongest(*pair, watched)[1] for pair in zip(information, score, strict=True))
        return bool(rest < self.policy.unexplained)

    def _may_exclude(self, channels: NDArray[np.int64], fewest: int | None = None) -> bool:
        """Whether the rest sees all six motions and can still check itself."""
        kept = self.watched.copy()
        kept[channels] = False
        rank = np.linalg.matrix_rank(self.array.regression_matrix[kept] / self._length_scale, tol=1e-6)
        return bool(rank == 6 and kept.sum() - 6 >= (self.policy.fewest_null if fewest is None else fewest))

    def _exclude(
        self,
        blocks: Blocks,
        place: int,
        used: NDArray[np.int64],
        chosen: Explanation,
        isolated: bool,
        information: NDArray[np.float64],
        score: NDArray[np.float64],
    ) -> int:
        """Take channels out; returns the block before their fault began, from which to go on."""
        state, channels = self._state, chosen.channels
        slot = used[chosen.slot]
        block = information[chosen.slot][np.ix_(channels, channels)]
        spread = np.linalg.inv(block + np.eye(len(channels)) / _LARGEST_FAULT**2)
        sizes = spread @ score[chosen.slot][channels]
        onset = float(blocks.t[place - 1] - (state.ages[slot] - 0.5) * self._period)
        self._add(
            blocks, place, channels,
            ChannelFault(
                tuple(self.array.channels[i] for i in channels), "unknown", isolated, onset,
                float(blocks.t[place - 1] + 0.5 * self._period), np.inf,
                tuple(sizes.tolist()), tuple(np.sqrt(np.diag(spread)).tolist()), chosen.statistic,
            ),
        )  # fmt: skip
        return max(0, place - int(state.ages[slot]) - MARGIN)

    def _exclude_noisy(self, blocks: Blocks, place: int, channel: int) -> int:
        """Take a noisy channel out; returns the block from which to go on."""
        channels = np.array([channel])
        if not self._may_exclude(channels):
            return place
        found = float(blocks.t[place - 1] + 0.5 * self._period)
        first = self._noise_of(blocks).onset(channel, place - 1)
        onset = float(blocks.t[first] - 0.5 * self._period)
        self._add(
            blocks, place, channels,
            ChannelFault(
                (self.array.channels[channel],), "noise", True, onset, found, np.inf, (np.nan,), (np.nan,), np.nan
            ),
        )  # fmt: skip
        return max(0, first - MARGIN)

    def _add(self, blocks: Blocks, place: int, channels: NDArray[np.int64], fault: ChannelFault) -> None:
        self.watched[channels] = False
        self._suspicion = None
        for channel in channels:
            self._open[int(channel)] = (len(self.faults), place)
        self.faults.append(fault)

    def _readmit(self, blocks: Blocks, place: int, omega: NDArray[np.float64]) -> None:
        """Take channels in again that have agreed with the others for long enough."""
        for channel, (number, since) in list(self._open.items()):
            length = round(self._patience[channel] / self._period)
            if place - since < length or not self._behaves(blocks, slice(place - length, place), omega, channel):
                continue
            self._patience[channel] *= 2.0
            del self._open[channel]
            self.watched[channel] = True
            self._state.ages[:] = 0.0
            if not any(other == number for other, _ in self._open.values()):
                end = float(blocks.t[place - 1] + 0.5 * self._period)
                self.faults[number] = replace(self.faults[number], end_s=end)

    def _behaves(self, blocks: Blocks, rows: slice, omega: NDArray[np.float64], channel: int) -> bool:
        """Whether an excluded channel has the readings that the others predict."""
        if blocks.missing[rows].any():
            return False
        row = prediction_row(self.array, channel, self.watched)
        state = self._state
        centred = blocks.means[rows] - state.bias
        residual = centred @ row - omega_products(omega[rows]) @ (row @ self.array.centripetal_matrix)
        samples = blocks.samples
        noise = float(np.sum(row**2 * self._errors.noise_std**2))
        std = np.empty(self.array.n_channels)
        model_errors(state, self._tuning, std)
        bias = float(row @ state.covariance[3:, 3:] @ row) + std[channel] ** 2
        second = max(1, round(1.0 / self._period))
        means = residual[: len(residual) // second * second].reshape(-1, second).mean(axis=1)
        near = np.abs(means) < 3.0 * np.sqrt(noise / (samples * second) + bias)
        ratios, _ = scatter(blocks, rows, row[None] / np.sqrt(noise))
        return bool(near.all() and ratios[:, channel].mean() < _SOUND_SCATTER)


def _lost(state: MonitorState) -> bool:
    """Whether the filter ran away: too few channels, or none of them as stated."""
    used = state.ages >= 1.0
    parts = (state.omega, state.score[used], state.information[used])
    return not all(np.all(np.abs(part) < _RAN_AWAY) for part in parts)  # NaN is not smaller either
