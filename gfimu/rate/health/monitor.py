"""The monitor of channels: finds the faulty one, takes it out, goes on, and takes it in again when it behaves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.rate.health.fault import ChannelFault
from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.health.readmission import behaves
from gfimu.rate.health.recursion.blocks import Blocks
from gfimu.rate.health.recursion.isolation import Explanation, explanations
from gfimu.rate.health.recursion.monitor_filter import MonitorFilter
from gfimu.rate.health.recursion.noise import BlockNoise
from gfimu.rate.health.residue import moving_seconds
from gfimu.rate.sensing import SensorErrors

__all__ = ["ChannelMonitor"]

_LARGEST_FAULT = 100.0  # numerical: m/s², prior standard deviation of a fault's size, which no fault reaches


@dataclass
class _Suspicion:
    """A fault that is seen and not isolated yet."""

    since: int  # block
    next_trial: int  # block
    unexplained: bool = False
    doubtful: ChannelFault | None = None  # seen in channels that can't be separated, and not excluded


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

    Attributes
    ----------
    blocks : Blocks
        The blocks that are kept, m of them; `forget` drops the oldest.
    omega, omega_std : ndarray, shape (m, 3)
        Angular rate in them and its standard deviation, rad/s.
    unexplained : ndarray of bool, shape (m,)
        Where a fault was seen that nothing explains.
    watched : ndarray of bool, shape (c,)
        Channels in use.
    faults : list of ChannelFault
        What was excluded.
    noise_in_motion : bool
        Whether a channel may be excluded for noise while the array moves.
    doubtful : list of ChannelFault
        What was seen in channels that can't be separated, and stayed in use.

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
        self.follower = MonitorFilter(array, errors, period, omega0=omega0, omega0_std=omega0_std, policy=self.policy)
        self.samples, self.block_s = self.follower.samples, self.follower.block_s
        self.threshold = self.follower.threshold
        c = array.n_channels
        self._length_scale = np.array([array.length_unit] * 3 + [1.0] * 3)
        self.blocks = Blocks(
            self.samples, np.zeros(0), np.zeros((0, c)), np.zeros((0, c), dtype=np.bool_),
            np.zeros((0, self.samples, c)),
        )  # fmt: skip
        self.omega, self.omega_std = np.zeros((0, 3)), np.zeros((0, 3))
        self.unexplained = np.zeros(0, dtype=np.bool_)
        self.watched = np.ones(c, dtype=np.bool_)
        self.faults: list[ChannelFault] = []
        self._past_doubts: list[ChannelFault] = []
        self._base = 0  # number of the oldest block that is kept; all numbers of blocks below are of the whole run
        self._place = 0  # next block
        self._changed = 0  # block from which on the channels in use are those of now
        self._noise: dict[bytes, BlockNoise] = {}
        self._open: dict[int, tuple[int, int]] = {}  # channel: its fault's number, block from which it is judged
        self._patience = np.full(c, self.policy.readmission_s)
        self._suspicion: _Suspicion | None = None
        self._lost = False
        self._refuses = False
        self.noise_in_motion = True

    @property
    def largest_statistic(self) -> float:
        """Largest statistic of a channel so far; those far below the threshold are not followed."""
        return float(self.follower.state.largest[0])

    @property
    def lost(self) -> bool:
        """Whether the filter ran away; nothing is watched from then on."""
        return self._lost

    @property
    def doubtful(self) -> list[ChannelFault]:
        """Faults in channels that can't be separated and are used."""
        now = [] if self._suspicion is None or self._suspicion.doubtful is None else [self._suspicion.doubtful]
        return self._past_doubts + now

    def refuse(self, refuses: bool) -> None:
        """Exclude nothing from now on, or do so again: for channels whose contradictions no errors explain."""
        if refuses and not self._refuses and len(self.blocks):
            end = float(self.blocks.t[-1] + 0.5 * self.block_s)
            for number in {number for number, _ in self._open.values()}:
                self.faults[number] = replace(self.faults[number], end_s=end)
            self._open.clear()
            self.watched[:] = True
            self._changed = self.total_blocks
            self.follower.state.forget_onsets()
        self._refuses = refuses

    @property
    def kept_blocks(self) -> int:
        """Blocks that must be kept for what may still come."""
        return self.follower.history + round(self.policy.longest_readmission_s / self.block_s)

    def extend(self, blocks: Blocks) -> None:
        """Take further blocks."""
        count = len(blocks)
        self.blocks = self.blocks.joined(blocks) if len(self.blocks) else blocks
        self.omega, self.omega_std = (
            np.concatenate([rates, np.full((count, 3), np.nan)]) for rates in (self.omega, self.omega_std)
        )
        self.unexplained = np.concatenate([self.unexplained, np.zeros(count, dtype=np.bool_)])
        if self._lost:
            self.unexplained[-count:] = True
            return
        self._run()

    def forget(self) -> None:
        """Drop blocks of the distant past, some at once."""
        count = len(self.blocks) - self.kept_blocks
        if count < self.kept_blocks // 8:
            return
        self.blocks = self.blocks.rows(slice(count, None))
        self.omega, self.omega_std = self.omega[count:].copy(), self.omega_std[count:].copy()
        self.unexplained = self.unexplained[count:].copy()
        self._noise = {key: noise for key, noise in self._noise.items() if len(noise) >= count}
        for noise in self._noise.values():
            noise.drop(count)
        self._base += count

    @property
    def total_blocks(self) -> int:
        """Blocks so far, those that were forgotten included."""
        return self._base + len(self.blocks)

    def recent_innovations(self, errors: SensorErrors) -> tuple[Blocks, NDArray[np.float64]]:
        """Return the last blocks, and their normalised innovation squared per degree of freedom.

        The channels are those in use now; gains, axes and positions have the errors given.
        """
        count = min(len(self.blocks), self.follower.history - 1)
        first = self.total_blocks - count
        recent = self.blocks.rows(slice(first - self._base, None))
        return recent, self.follower.innovations(recent, self.watched, errors, base=first)

    def innovations(self, blocks: Blocks) -> NDArray[np.float64]:
        """Return the normalised innovation squared per degree of freedom of each block, without looking for faults."""
        return self.follower.innovations(blocks)

    def _run(self) -> None:
        """Go on to the last block."""
        follower, base = self.follower, self._base
        last = base + len(self.blocks)
        while self._place < last:
            noise = self._noise_of()
            noisy, channel = noise.first_from(self._place - base)
            end = min(last, base + noisy + 1)
            if self._open:
                end = min(end, self._place + max(1, round(1.0 / self.block_s)))
            reached, slot = follower.advance(
                self.blocks, slice(self._place - base, end - base), self.watched, noise.levels,
                (self.omega, self.omega_std), base=base,
            )  # fmt: skip
            place = base + reached
            self._place = place
            if follower.lost:
                self.unexplained[reached - 1 :] = True
                self._lost = True
                return
            back = place
            if slot >= 0:
                back, self.unexplained[reached - 1] = self._judge(place)
            elif reached == noisy + 1:
                back = self._exclude_noisy(place, channel)
            else:
                self._end_suspicion(place)
            if back < place:  # again from before the onset, without the channels
                self._place = self._changed = back
                follower.state.go_back(back)
            else:
                self._readmit(place)

    def _noise_of(self) -> BlockNoise:
        """Return the noise of all blocks with the channels that are watched now; kept per set of channels."""
        key = self.watched.tobytes()
        if key not in self._noise:
            rows = self.follower.null_rows(self.watched)
            self._noise[key] = BlockNoise(rows, self.block_s, self.threshold, self.policy)
        noise = self._noise[key]
        if len(noise) < len(self.blocks):
            noise.extend(self.blocks, slice(len(noise), len(self.blocks)))
        return noise

    def _judge(self, place: int) -> tuple[int, bool]:
        """Isolate the fault that is seen, or wait; returns the block to go on with, and whether nothing explains it."""
        policy = self.policy
        if self._refuses:
            return place, True
        if self._suspicion is None:
            self._suspicion = _Suspicion(place, place + policy.least_age - 1)
        suspicion = self._suspicion
        if place < suspicion.next_trial:
            return place, suspicion.unexplained
        waited = place - suspicion.since
        suspicion.next_trial = place + max(1, waited // 4)
        used, information, score = self.follower.evidence()
        late = waited * self.block_s >= policy.wait_s
        kinds = list(explanations(information, score, self.watched, self.array.chip_of_channel, policy.tried))
        for index, kind in enumerate(kinds):
            # What more channels would explain beyond it, a set leaves unexplained.
            more = max((entry.statistic for other in kinds[index + 1 :] for entry in other), default=0.0)
            explains = [
                more - entry.statistic < max(policy.unexplained, self._inexact(used, entry) * more)
                and self._explains(place, used, entry)
                for entry in kind
            ]
            if not any(explains):
                continue
            best = kind[explains.index(True)]
            needed = max(policy.isolation, self._inexact(used, best) * best.statistic)
            several = len(best.channels) > 1  # two equal faults may look exactly like two others at first
            rivals = [
                entry
                for entry, fits in zip(kind, explains, strict=True)
                if (fits and several) or (entry.statistic > best.statistic - needed and (fits or several))
            ]
            if len(rivals) > 1 and not late:
                return place, False
            blamed = np.unique(np.concatenate([entry.channels for entry in rivals]))
            alone = len(rivals) == 1
            chosen = Explanation(blamed, best.statistic, best.slot)
            fault = self._fault(place, used, chosen, information, score)
            if not alone:
                sets = tuple(tuple(self.array.channels[i] for i in entry.channels) for entry in rivals)
                fault = replace(fault, isolated=False, alternatives=sets)
            if self._may_exclude(blamed):
                back, fault = self._since_when(
                    place, self._before(place - self.follower.span(int(used[best.slot]))), fault
                )
                self._add(place, blamed, fault)
                return back, False
            if alone:
                break
            suspicion.doubtful, suspicion.unexplained = replace(fault, excluded=False), False
            return place, False
        suspicion.unexplained = suspicion.doubtful is None
        return place, suspicion.unexplained

    def _inexact(self, used: NDArray[np.int64], entry: Explanation) -> float:
        """Return the share by which the statistic of a large fault is off, by its onset within a block among others."""
        return self.policy.relative + self.policy.first_block / float(self.follower.state.ages[used[entry.slot]])

    def _end_suspicion(self, place: int) -> None:
        """Keep a fault that was not isolated and is not seen any longer."""
        if self._suspicion is not None and self._suspicion.doubtful is not None:
            end = float(self.blocks.t[place - 1 - self._base])
            self._past_doubts.append(replace(self._suspicion.doubtful, end_s=end))
        self._suspicion = None

    def _explains(self, place: int, used: NDArray[np.int64], entry: Explanation) -> bool:
        """Whether nothing is left to explain if these channels had not been used since before their onset."""
        age = int(self.follower.state.ages[used[entry.slot]])
        if age < self.policy.least_age or not self._may_exclude(entry.channels, fewest=1):
            return False
        watched = self.watched.copy()
        watched[entry.channels] = False
        rows = slice(self._before(place - self.follower.span(int(used[entry.slot]))) - self._base, place - self._base)
        levels = self._noise_of().levels
        rest = self.follower.unexplained_without(self.blocks, rows, watched, levels, base=self._base)
        return rest < self.policy.unexplained

    def _since_when(self, place: int, back: int, fault: ChannelFault) -> tuple[int, ChannelFault]:
        """Return the block to go on from, and the fault with its onset, at or before those given.

        A fault that grows, as a wrong gain does when the reading changes, may be seen at a later step of it. Of a
        channel that is at fault less evidence suffices: what may not remain unexplained after an exclusion.
        """
        first = max(self._base, self._changed, place - round(self.policy.oldest_s / self.block_s))
        if back <= first:
            return back, fault
        found = self.follower.first_contradiction(
            self.blocks, slice(first - self._base, back - self._base), self.watched, self._noise_of().levels,
            base=self._base, suspects=np.isin(self.array.channels, fault.channels), threshold=self.policy.unexplained,
        )  # fmt: skip
        if found is None:
            return back, fault
        onset, before = found
        earlier = replace(fault, onset_s=float(self.blocks.t[onset] - 0.5 * self.block_s))
        return max(first, self._before(self._base + before)), earlier

    def _before(self, block: int) -> int:
        """Return the block from which to go on if a fault began at this one."""
        return max(self._base, block - self.policy.margin)

    def _may_exclude(self, channels: NDArray[np.int64], fewest: int | None = None) -> bool:
        """Whether the rest sees all six motions and can still check itself."""
        kept = self.watched.copy()
        kept[channels] = False
        rank = np.linalg.matrix_rank(self.array.regression_matrix[kept] / self._length_scale, tol=1e-6)
        return bool(rank == 6 and kept.sum() - 6 >= (self.policy.fewest_null if fewest is None else fewest))

    def _fault(
        self,
        place: int,
        used: NDArray[np.int64],
        chosen: Explanation,
        information: NDArray[np.float64],
        score: NDArray[np.float64],
    ) -> ChannelFault:
        """Return the fault of these channels, with the sizes that explain most."""
        channels = chosen.channels
        age = float(self.follower.state.ages[used[chosen.slot]])
        block = information[chosen.slot][np.ix_(channels, channels)]
        spread = np.linalg.inv(block + np.eye(len(channels)) / _LARGEST_FAULT**2)
        sizes = spread @ score[chosen.slot][channels]
        now = float(self.blocks.t[place - 1 - self._base])
        return ChannelFault(
            tuple(self.array.channels[i] for i in channels), "unknown", True,
            now - (age - 0.5) * self.block_s, now + 0.5 * self.block_s, np.inf,
            tuple(sizes.tolist()), tuple(np.sqrt(np.diag(spread)).tolist()), chosen.statistic,
        )  # fmt: skip

    def _exclude_noisy(self, place: int, channel: int) -> int:
        """Take a noisy channel out; returns the block from which to go on."""
        channels = np.array([channel])
        last = self.blocks.rows(
            slice(max(0, place - self._base - max(1, round(1.0 / self.block_s))), place - self._base)
        )
        calm = self.noise_in_motion or not moving_seconds(self.follower, last, self.policy).any()
        if self._refuses or not calm or not self._may_exclude(channels):
            return place
        found = float(self.blocks.t[place - 1 - self._base] + 0.5 * self.block_s)
        oldest = max(0, place - self.follower.history + self.policy.margin - self._base)
        first = max(oldest, self._noise_of().onset(channel, place - 1 - self._base))
        onset = float(self.blocks.t[first] - 0.5 * self.block_s)
        self._add(
            place, channels,
            ChannelFault(
                (self.array.channels[channel],), "noise", True, onset, found, np.inf, (np.nan,), (np.nan,), np.nan
            ),
        )  # fmt: skip
        return self._before(self._base + first)

    def _add(self, place: int, channels: NDArray[np.int64], fault: ChannelFault) -> None:
        self.watched[channels] = False
        self._suspicion = None
        for channel in channels:
            self._open[int(channel)] = (len(self.faults), place)
        self.faults.append(fault)

    def _readmit(self, place: int) -> None:
        """Take channels in again that have agreed with the others for long enough."""
        for channel, (number, since) in list(self._open.items()):
            length = round(self._patience[channel] / self.block_s)
            if place - since < length:
                continue
            rows = slice(place - length - self._base, place - self._base)
            part = self.blocks.rows(rows)
            if not behaves(self.follower, part, self.omega[rows], channel, self.watched, self.policy):
                continue
            self._patience[channel] = min(2.0 * self._patience[channel], self.policy.longest_readmission_s)
            del self._open[channel]
            self.watched[channel] = True
            self._changed = place
            self.follower.state.forget_onsets()
            if not any(other == number for other, _ in self._open.values()):
                end = float(self.blocks.t[place - 1 - self._base] + 0.5 * self.block_s)
                self.faults[number] = replace(self.faults[number], end_s=end)
