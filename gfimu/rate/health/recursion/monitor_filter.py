"""The filter under the monitor of channels, with the matrices of every set of channels."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.health.recursion.blocks import Blocks
from gfimu.rate.health.recursion.isolation import deflate, strongest
from gfimu.rate.health.recursion.state import MonitorState, MonitorTables, MonitorTuning
from gfimu.rate.health.recursion.steps import advance, model_errors
from gfimu.rate.health.recursion.turning import turning_of
from gfimu.rate.sensing import SensorErrors

__all__ = ["MonitorFilter"]

_RAN_AWAY = 1e9  # numerical: rate, score and information of a filter that follows stay far below


class MonitorFilter:
    """Follows ω, the biases, and the signatures of faults, block by block.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions, with c channels.
    errors : SensorErrors
        Errors of its channels.
    period : float
        Sample period, s.
    omega0 : array_like, shape (3,)
        Angular rate at the start, rad/s.
    omega0_std : float
        Its standard deviation, rad/s.
    policy : MonitorPolicy
        Block length, onsets, threshold.

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
        omega0: ArrayLike,
        omega0_std: float,
        policy: MonitorPolicy,
    ) -> None:
        self.array, self.errors = array, errors
        self.samples = policy.samples(period)
        self.block_s = self.samples * period
        self.sets = ChannelSets(array, errors.noise_std)
        c, slots = array.n_channels, policy.slots + 1  # one may be held beside the others
        self.threshold = policy.threshold(c, self.block_s)
        self._tuning = MonitorTuning(
            follow=True,
            samples=self.samples,
            period=self.block_s,
            threshold=self.threshold,
            screen=policy.screen,
            sharp=policy.sharp,
            oldest=policy.oldest_s / self.block_s,
            walk=policy.bias_walk,
            forget=min(1.0, self.block_s / policy.range_memory_s),
            range_share=policy.range_share,
            scale_std=errors.gain_std,
            placement_std=errors.placement_std,
            floor=policy.bias_std,
        )
        covariance = np.zeros((3 + c, 3 + c))
        covariance[range(3), range(3)] = omega0_std**2
        covariance[range(3, 3 + c), range(3, 3 + c)] = np.maximum(errors.bias_std, policy.bias_std) ** 2
        self.history = int(2.0 * self._tuning.oldest) + policy.margin + 1
        self.state = MonitorState(
            x=np.concatenate([np.asarray(omega0, dtype=float), np.zeros(c)]),
            covariance=covariance,
            last=np.zeros(c),
            low=np.zeros(c),
            high=np.zeros(c),
            ages=np.zeros(slots),
            leading=np.full(1, -1),
            held=np.full(1, -1),
            signature=np.zeros((slots, 3 + c, c)),
            information=np.zeros((slots, c, c)),
            score=np.zeros((slots, c)),
            started=np.zeros(1, dtype=np.bool_),
            largest=np.zeros(1),
            past_x=np.zeros((self.history, 3 + c)),
            past_covariance=np.zeros((self.history, 3 + c, 3 + c)),
            past_means=np.zeros((self.history, 3, c)),
        )

    @property
    def noise_of_means(self) -> NDArray[np.float64]:
        """Standard deviation that white noise gives the mean of a block, shape (c,), m/s²."""
        return np.asarray(self.errors.noise_std / np.sqrt(self.samples))

    @property
    def lost(self) -> bool:
        """Whether the filter ran away: too few channels, or none of them as stated."""
        return _lost(self.state)

    def null_rows(self, watched: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return the whitened null space of these channels, shape (d, c)."""
        return self.sets.sets[self.sets.index(watched)].null_rows

    def advance(
        self,
        blocks: Blocks,
        rows: slice,
        watched: NDArray[np.bool_],
        levels: NDArray[np.float64],
        out: tuple[NDArray[np.float64], NDArray[np.float64]],
        *,
        base: int,
    ) -> tuple[int, int]:
        """Take some rows of the blocks; stop behind one in which a fault is seen.

        Parameters
        ----------
        blocks : Blocks
            The blocks, m of them.
        rows : slice
            Those to take.
        watched : ndarray of bool, shape (c,)
            Channels in use.
        levels : ndarray, shape (m,)
            Measured variance of the null space over the stated one.
        out : tuple of ndarray, shape (m, 3) each
            Filled with ω and its standard deviation, rad/s.
        base : int
            Number of block 0 since the start of the run.

        Returns
        -------
        tuple of (int, int)
            The next row, and the slot of the fault; −1 if none was seen.
        """
        omega, std = out
        place, slot = self._run(
            self.state, blocks, rows, watched, self._tuning, base=base,
            levels=levels[rows], omega=omega[rows], std=std[rows], nis=np.empty(rows.stop - rows.start),
        )  # fmt: skip
        return rows.start + place, slot

    def innovations(
        self,
        blocks: Blocks,
        watched: NDArray[np.bool_] | None = None,
        errors: SensorErrors | None = None,
        *,
        base: int | None = None,
    ) -> NDArray[np.float64]:
        """Return the normalised innovation squared per degree of freedom of each block, without looking for faults.

        Parameters
        ----------
        blocks : Blocks
            The blocks, m of them.
        watched : ndarray of bool, shape (c,), optional
            Channels in use; all by default.
        errors : SensorErrors, optional
            Errors of gains, axes and positions; by default those that are reckoned with.
        base : int, optional
            Number of the first block since the start of the run, among the last `history`; by default the blocks are
            what comes next.
        """
        count = len(blocks)
        everything = slice(0, count)
        if watched is None:
            watched = np.ones(self.array.n_channels, dtype=np.bool_)
        state, tuning = self.state.copy(), self._blind()._replace(follow=False)
        if base is not None:
            state.go_back(base)
        state.forget_onsets()
        if errors is not None:
            tuning = tuning._replace(scale_std=errors.gain_std, placement_std=errors.placement_std)
        nis = np.zeros(count)
        self._run(
            state, blocks, everything, watched, tuning, base=base or 0,
            levels=np.ones(count), omega=np.empty((count, 3)), std=np.empty((count, 3)), nis=nis,
        )  # fmt: skip
        counts = self._tables().null_count[self._places(blocks, watched, everything)]
        return np.asarray(nis / np.maximum(counts, 1))

    def reckon_with(self, errors: SensorErrors) -> None:
        """Reckon with other errors of gains, axes and positions from now on; onsets begin anew."""
        self.errors = errors
        self._tuning = self._tuning._replace(scale_std=errors.gain_std, placement_std=errors.placement_std)
        self.state.forget_onsets()

    def evidence(
        self, state: MonitorState | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the slots in use, and C (s, c, c) and d (s, c) of each with the errors of the model taken out."""
        state = self.state if state is None else state
        std = self.model_errors(state)
        used = np.flatnonzero(state.ages >= 1.0)
        cleaned = [deflate(state.information[s], state.score[s], std) for s in used]
        return used, np.stack([pair[0] for pair in cleaned]), np.stack([pair[1] for pair in cleaned])

    def model_errors(self, state: MonitorState | None = None) -> NDArray[np.float64]:
        """Return the size of a fault that errors of gain, axes and position resemble on each channel, m/s²."""
        std = np.empty(self.array.n_channels)
        model_errors(self.state if state is None else state, self._tuning, std)
        return std

    def unexplained_without(
        self, blocks: Blocks, rows: slice, watched: NDArray[np.bool_], levels: NDArray[np.float64], *, base: int
    ) -> float:
        """Return the largest statistic that remains had only these channels been used in ``rows``; ∞ where it ran away.

        The parameters are those of `advance`.
        """
        state, _, _ = self._again(blocks, rows, watched, levels, base=base, tuning=self._blind())
        if _lost(state):
            return np.inf
        try:
            _, information, score = self.evidence(state)
        except np.linalg.LinAlgError:  # as good as lost
            return np.inf
        return float(max(strongest(*pair, watched)[1] for pair in zip(information, score, strict=True)))

    def first_contradiction(
        self,
        blocks: Blocks,
        rows: slice,
        watched: NDArray[np.bool_],
        levels: NDArray[np.float64],
        *,
        base: int,
        suspects: NDArray[np.bool_],
        threshold: float,
    ) -> tuple[int, int] | None:
        """Return the row from which one of some channels contradicts the others, and that of the onset before it.

        The parameters are those of `advance`, the ``suspects`` among the watched channels, shape (c,), and the
        statistic from which they contradict. None where they don't.
        """
        tuning = self._tuning._replace(threshold=threshold)
        state, place, slot = self._again(blocks, rows, watched, levels, base=base, tuning=tuning, suspects=suspects)
        if slot < 0 or _lost(state):
            return None
        return rows.start + place - int(state.ages[slot]), rows.start + place - _span(state, slot)

    def span(self, slot: int) -> int:
        """Return how many blocks ago a fault of a slot in use may have begun: after the onset before it."""
        return _span(self.state, slot)

    def _again(
        self,
        blocks: Blocks,
        rows: slice,
        watched: NDArray[np.bool_],
        levels: NDArray[np.float64],
        *,
        base: int,
        tuning: MonitorTuning,
        suspects: NDArray[np.bool_] | None = None,
    ) -> tuple[MonitorState, int, int]:
        """Run over ``rows`` as if only these channels had been used; returns the state, and what `_run` returns."""
        state = self.state.copy()
        state.go_back(base + rows.start)
        count = rows.stop - rows.start
        place, slot = self._run(
            state, blocks, rows, watched, tuning, base=base, suspects=suspects,
            levels=levels[rows], omega=np.empty((count, 3)), std=np.empty((count, 3)), nis=np.empty(count),
        )  # fmt: skip
        return state, place, slot

    def _blind(self) -> MonitorTuning:
        return self._tuning._replace(threshold=np.inf)

    def _run(
        self,
        state: MonitorState,
        blocks: Blocks,
        rows: slice,
        watched: NDArray[np.bool_],
        tuning: MonitorTuning,
        *,
        base: int,
        suspects: NDArray[np.bool_] | None = None,
        **arrays: NDArray[np.float64],
    ) -> tuple[int, int]:
        """Run the recursion over some rows; ``arrays`` are levels, omega, std and nis of them.

        Faults are looked for on the ``suspects``, by default all channels in use.
        """
        times = blocks.t[rows]
        before = blocks.t[rows.start - 1] if rows.start else blocks.t[0] - self.block_s
        sets = self._places(blocks, watched, slice(max(rows.start - 1, 0), rows.stop))
        tables = self._tables()
        turning = turning_of(blocks, rows, tables.alpha, sets, self.block_s / self.samples)
        sets = sets[len(sets) - len(times) :]
        looked_at = watched if suspects is None else suspects
        try:
            place, slot = advance(
                tables, tuning, state, blocks.means[rows], turning, np.diff(times, prepend=before),
                sets, arrays["levels"], looked_at, arrays["omega"], arrays["std"], arrays["nis"], base + rows.start,
            )  # fmt: skip
        except np.linalg.LinAlgError:  # the filter ran away
            state.x[:3] = np.nan
            return len(times), -1
        return int(place), int(slot)

    def _places(self, blocks: Blocks, watched: NDArray[np.bool_], rows: slice) -> NDArray[np.int64]:
        """Return the set of channels of each block in ``rows``."""
        return self.sets.indices(~blocks.missing[rows] & watched)

    def _tables(self) -> MonitorTables:
        """Return the matrices of the sets met so far."""
        sets = self.sets.sets
        return MonitorTables(
            np.stack([one.alpha_rows for one in sets]),
            np.stack([one.leak for one in sets]),
            np.stack([one.null_rows for one in sets]),
            np.stack([one.null_sensitivity for one in sets]),
            np.array([one.nulls for one in sets]),
            np.stack([one.alpha_noise for one in sets]),
        )


def _span(state: MonitorState, slot: int) -> int:
    return int(state.ages[slot - 1]) - 1 if slot else int(state.ages[0])


def _lost(state: MonitorState) -> bool:
    used = state.ages >= 1.0
    parts = (state.x[:3], state.score[used], state.information[used])
    return not all(np.all(np.abs(part) < _RAN_AWAY) for part in parts)  # NaN is not smaller either
