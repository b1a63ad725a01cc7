"""A stretch of a run: data and the model that is to explain them. Nothing of it ever changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from gfimu.base.difference_noise import difference_noise
from gfimu.base.errors import GfimuError
from gfimu.diagnosis.data.cosine_basis import CosineBasis, NoiseLevels
from gfimu.diagnosis.data.rounding import COARSE, NO_STEPS, Steps
from gfimu.diagnosis.data.run import Run, smooth_rate
from gfimu.diagnosis.data.table.spins import JoinedSpin, ScaledSpin, State
from gfimu.diagnosis.data.table.start_angle import gravity_angle
from gfimu.diagnosis.time_limit import check_time
from gfimu.model.located.operators import moved
from gfimu.model.located.rig_state import RigState, split
from gfimu.model.world_model import Effect, Spin, WorldModel, is_linear, is_of_wiring, reads_place

__all__ = ["NoPredictionError", "RunUp", "Stretch", "finite_prediction", "make_stretches"]

_DURATION = 64.0  # s, about: one drive's normal equations grow with its square
_LOST_ANGLE_STD = 3.0  # rad: the table's angle after a gap of the reference
_LEAST_GAIN = 0.05  # of the reference
_FINEST_ANGLE = 2e-5  # rad
_FINEST_RATE = 1e-4  # rad/s, and of the spread of the rate
_REST_FACTOR = 1.3


class NoPredictionError(np.linalg.LinAlgError):
    """A simulation that has no finite answer, as at a trial point of a fit that is too far away."""


def finite_prediction(predict: Callable[[], NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return what a simulation predicts.

    Raises
    ------
    NoPredictionError
        If its answer is not finite, or it has none.
    KeyboardInterrupt
        If the time of the diagnosis is over.
    """
    check_time()
    try:
        with np.errstate(all="ignore"):
            predicted = predict()
    except GfimuError:
        raise
    except (ArithmeticError, ValueError) as error:  # of splines, filters, equations, and simulations of one's own
        raise NoPredictionError(f"the simulation has no answer: {error}") from error
    if not np.isfinite(predicted).all():
        raise NoPredictionError("the simulation's answer is not finite")
    return predicted


@dataclass(frozen=True)
class RunUp:
    """What came before a block that is cut from a run: backlash, a mode or a filter remember it.

    Parameters
    ----------
    t : ndarray, shape (m,)
        Times, s.
    temperature : ndarray, shape (m,), optional
        Temperature of the board.
    drive : Spin
        The drive there.
    """

    t: NDArray[np.float64]
    temperature: NDArray[np.float64] | None
    drive: Spin


@dataclass(frozen=True)
class Stretch:
    """One stretch of a run with its model.

    Parameters
    ----------
    model : WorldModel
        The simulation.
    run : Run
        The samples.
    index : int
        Number of the run it belongs to.
    start : float
        Time at which the whole run began, s.
    known : tuple of Effect
        Faults of the data that were found before: they are part of every prediction.
    steps : Steps
        Steps that observations are rounded to, where these are coarse.
    start_angle, start_angle_std : float
        Table angle at the first sample and its standard deviation, rad.
    stretches : int
        How many such stretches the run is cut into.
    run_up : RunUp, optional
        What came before it in the run, where it is a block of one.
    """

    model: WorldModel
    run: Run
    index: int
    start: float
    known: tuple[Effect, ...] = ()
    steps: Steps = NO_STEPS
    start_angle: float = 0.0
    start_angle_std: float = 1e-4
    stretches: int = 1
    run_up: RunUp | None = None

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """Which observations count, shape (n, c + 1)."""
        return np.column_stack([self.run.valid, self.run.reference_valid])

    @cached_property
    def counted(self) -> NDArray[np.bool_]:
        """In which samples (n,) anything counts; all where nothing does."""
        counted = np.asarray(self.mask.any(axis=1))
        return counted if counted.any() else ~counted

    @cached_property
    def observations(self) -> int:
        """How many observations count."""
        return int(self.mask.sum())

    @cached_property
    def measured(self) -> NDArray[np.float64]:
        """Channels and reference, shape (n, c + 1); zero where they do not count."""
        return np.where(self.mask, np.column_stack([self.run.readings, self.run.reference]), 0.0)

    @cached_property
    def basis(self) -> CosineBasis:
        """The cosines of slow noise."""
        run = self.run
        return CosineBasis(len(run.t), run.sample_period, float(run.t[0] - self.start), stretches=self.stretches)

    @property
    def is_angle(self) -> bool:
        """Whether the reference is an angle, or a place."""
        return reads_place(self.model)

    @cached_property
    def reference_spread(self) -> float:
        """Standard deviation of the reference's values."""
        known = self.run.reference_valid
        return float(np.std(self.run.reference[known])) if known.any() else 0.0

    @property
    def finest(self) -> float:
        """Noise below which a spline can't follow the reference, and which no part keeps to, rad/s or rad.

        Of a linear axis, m/s or m, it is what such an angle is at the length unit of the array.
        """
        length = self.model.array.length_unit if is_linear(self.model) else 1.0
        return length * (_FINEST_ANGLE if self.is_angle else _FINEST_RATE * (1.0 + self.reference_spread))

    @cached_property
    def first_levels(self) -> NoiseLevels:
        """Noise to begin with: the data sheet's, and of the reference what its third differences show."""
        expected = self.model.expected_noise(self.run.output_data_rate)
        reference = self.run.reference[self.run.reference_valid]
        _, noise = Steps.of_reference(reference, difference_noise(reference))
        channels = expected.analogue if self.steps.channels else expected.white
        white = np.append(channels, max(noise, self.finest))
        return NoiseLevels(white, np.append(np.full(len(expected.white), 2e-3), 0.0), _known_walk(self.model))

    @cached_property
    def at_rest(self) -> bool:
        """Whether the reference shows no more than its noise."""
        noise = self.steps.reference_noise(float(self.first_levels.white[-1]))
        return self.reference_spread < _REST_FACTOR * noise

    def predict(self, effects: Sequence[Effect], drive: Spin) -> NDArray[np.float64]:
        """Predict channels and reference, shape (n, c + 1), for a drive and effects besides the known ones.

        Raises
        ------
        NoPredictionError
            If the simulation has no finite answer there.
        """
        return finite_prediction(lambda: self._corrected(effects, drive))

    def _corrected(self, effects: Sequence[Effect], drive: Spin) -> NDArray[np.float64]:
        """Predict channels and reference, each moved to the time at which it was read."""
        predicted = self._at_samples(effects, drive)
        period = self.run.sample_period
        if self.run.late is not None:
            predicted[:, -1] = moved(predicted[:, -1], self.run.late / period)
        if self.run.conversions is not None:
            after = self.run.conversions.after[:, self.model.array.chip_of_channel]  # (n, c)
            predicted[:, :-1] = moved(predicted[:, :-1], after / period)
        return predicted

    def _at_samples(self, effects: Sequence[Effect], drive: Spin) -> NDArray[np.float64]:
        """Predict channels and reference at the times of the samples."""
        every = [*self.known, *effects]
        if self.run_up is None:
            return self._predict(every, drive, self.run.t, self.run.temperature)
        before = self.run_up
        joined = JoinedSpin(before.drive, drive, 0.5 * float(before.t[-1] + self.run.t[0]))
        temperature = None
        if self.run.temperature is not None and before.temperature is not None:
            temperature = np.concatenate([before.temperature, self.run.temperature])
        return self._predict(every, joined, np.concatenate([before.t, self.run.t]), temperature)[len(before.t) :]

    def _predict(
        self, effects: Sequence[Effect], drive: Spin, t: NDArray[np.float64], temperature: NDArray[np.float64] | None
    ) -> NDArray[np.float64]:
        own, added = split(effects)
        motion = self.motion(own, drive)
        channels, reference = self.model.predict(
            motion, t, effects=own, temperature=temperature, mounting=self.run.mounting, start=self.start
        )
        predicted = np.column_stack([channels, reference])
        if added:
            state = self._state(motion, t, channels, temperature)
            predicted += np.sum([effect.added(state) for effect in added], axis=0)
        return predicted

    def state(self, effects: Sequence[Effect], drive: Spin) -> RigState:
        """Return what the rig does at the samples, as the simulation has it with some effects of its own."""
        own, _ = split(effects)
        motion = self.motion(own, drive)
        return self._state(motion, self.run.t, self.predict(own, drive)[:, :-1], self.run.temperature)

    def observed(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return values at the samples (n, k) as the observations have them: a table's are the samples."""
        return values

    def _state(
        self,
        motion: Spin,
        t: NDArray[np.float64],
        readings: NDArray[np.float64],
        temperature: NDArray[np.float64] | None,
    ) -> RigState:
        placed = None if is_linear(self.model) else self.model.placed(self.run.mounting)
        return RigState(t - self.start, motion.at(t), readings, temperature, self.run.sample_period, placed)

    def motion(self, effects: Sequence[Effect], drive: Spin) -> Spin:
        """Return the table's motion for a drive under effects.

        The drive is held in units of the reference: where effects change the reference's gain, the motion is the drive
        over that gain. In true units a gain would shrink the drive and its prior energy with it.
        """
        gain = self.gain(effects)
        return drive if gain == 1.0 else ScaledSpin(drive, gain)

    def gain(self, effects: Sequence[Effect]) -> float:
        """Return what the reference reads of the motion under effects, kept away from zero."""
        gain = self.model.reference_gain(split(effects)[0])
        return float(np.copysign(max(abs(gain), _LEAST_GAIN), gain))

    def times(self, effects: Sequence[Effect] = ()) -> NDArray[np.float64]:
        """Return all true times that readings belong to, s."""
        # The clocks agree when the run begins, whatever the board's shows then.
        own, _ = split([*self.known, *effects])
        times = self.start + self.model.sample_times(self.run.t - self.start, own)
        if self.run.late is not None:
            times[:, -1] += self.run.late
        if self.run.conversions is not None:
            times[:, :-1] += self.run.conversions.after
        return times

    def counted_times(self, effects: Sequence[Effect] = ()) -> NDArray[np.float64]:
        """Return the true times of the samples in which anything counts, s: beyond them no motion is known."""
        return self.times(effects)[self.counted]

    @property
    def since(self) -> float:
        """Time of the first sample in which anything counts, s."""
        return float(self.run.t[int(np.argmax(self.counted))])

    def parts(self, count: int) -> list[int]:
        """Return the edges of parts in which as many samples count; what is left out at the ends is with the outermost.

        Parameters
        ----------
        count : int
            How many parts.
        """
        return _parts(self.counted, 0, len(self.counted), count)

    def of_reference(self) -> Stretch:
        """Return the stretch with the reference alone."""
        return replace(self, run=replace(self.run, valid=np.zeros_like(self.run.valid)))


def make_stretches(model: WorldModel, runs: Sequence[Run], known: Sequence[Sequence[Effect]]) -> tuple[Stretch, ...]:
    """Cut runs into stretches that are short enough for one drive, and where the reference was lost.

    ``known`` holds the faults found in each run; of these a coarse resolution says what readings are rounded to.
    """
    stretches: list[Stretch] = []
    for index, (run, faults) in enumerate(zip(runs, known, strict=True)):
        rate = smooth_rate(run, is_angle=reads_place(model))
        turned = cumulative_trapezoid(rate, run.t, initial=0.0)
        noise = difference_noise(run.reference[run.reference_valid])
        steps, _ = Steps.of_reference(run.reference[run.reference_valid], noise)
        steps = replace(steps, channels=_coarse_step(model, run, faults))
        acting = tuple(fault for fault in faults if is_of_wiring(fault))
        counted = run.valid.any(axis=1) | run.reference_valid
        # Before the reference comes for the first time nothing is known: that is no stretch of its own.
        resumed = [place for place in run.resumed if counted[:place].any()]
        pieces: list[tuple[int, int, bool]] = []
        for first, end in pairwise([0, *resumed, len(run.t)]):
            there = np.flatnonzero(counted[first:end])
            duration = (np.ptp(there) + 1 if len(there) else end - first) * run.sample_period
            edges = _parts(counted, first, end, max(1, round(duration / _DURATION)))
            lost = first > 0 or len(resumed) < len(run.resumed)
            pieces += [(start, stop, lost) for start, stop in pairwise(edges)]
        for start, stop, lost in pieces:
            drift = noise * np.sqrt(run.sample_period * (run.t[start] - run.t[0]))
            angle, angle_std = float(turned[start]), _LOST_ANGLE_STD if lost else float(np.hypot(1e-4, 2.0 * drift))
            piece, part = run.rows(start, stop), slice(start, stop)
            motion = State(turned[part], rate[part], np.gradient(rate[part], run.sample_period))
            angle, angle_std = gravity_angle(model, piece, motion, acting) or (angle, angle_std)
            stretches.append(
                Stretch(
                    model,
                    piece,
                    index,
                    float(run.t[0]),
                    acting,
                    steps,
                    angle,
                    angle_std,
                    len(pieces),
                )
            )
    return tuple(stretches)


def _parts(counted: NDArray[np.bool_], first: int, end: int, count: int) -> list[int]:
    """Return the edges of equal parts of the samples from the first to the last that count, in a span of samples."""
    known = first + np.flatnonzero(counted[first:end])
    low, high = (int(known[0]), int(known[-1]) + 1) if len(known) else (first, end)
    edges = np.linspace(low, high, count + 1).astype(int).tolist()
    return [first, *edges[1:-1], end]


def _coarse_step(model: WorldModel, run: Run, faults: Sequence[Effect]) -> float:
    """Return the step of the readings where it is coarse, m/s²; 0 where it is finer than their noise."""
    expected = model.expected_noise(run.output_data_rate)
    found = [float(fault.parameters["step_m_s2"]) for fault in faults if fault.name == "coarse_resolution"]
    quantum = found[-1] if found else expected.quantum
    return quantum if quantum > COARSE * float(np.median(expected.analogue)) else 0.0


def _known_walk(model: WorldModel) -> float:
    """Return the random walk of the biases that the model has already, m/s² per √s."""
    walks = [float(one.parameters["strength_m_s2_rts"]) for one in model.effects if one.name == "bias_random_walk"]
    return float(np.linalg.norm(walks))
