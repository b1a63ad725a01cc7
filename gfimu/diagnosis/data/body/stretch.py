"""A run of a free body with its model. What is observed are means over groups: one sample in motion, many at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from gfimu.diagnosis.data.body.run import BodyRun
from gfimu.diagnosis.data.cosine_basis import CosineBasis
from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.data.stretch import Stretch, finite_prediction
from gfimu.model.located.rig_state import RigState, split
from gfimu.model.world_model import BodyModel, Effect, WorldModel, is_of_wiring
from gfimu.motion.body_drive import BodyDrive

__all__ = ["BodyStretch", "make_body_stretches"]

_REST_GROUP = 32  # numerical: samples at rest whose mean is one observation
_MODES = 10  # numerical: cosines of slow noise
_PARTS = 16  # numerical: parts of a run, of which every other one is held out
_ALIVE = 0.5  # numerical: share of samples with a value


@dataclass(frozen=True)
class BodyStretch(Stretch):
    """A run of a free body, or some of its groups of samples.

    Rows have the c channels and, as those of a table have the reference, one more entry, which never counts.

    Parameters
    ----------
    model : BodyModel
        The simulation.
    run : BodyRun
        The samples.
    part : ndarray of bool, shape (m,), optional
        Which groups count; all by default.
    """

    model: BodyModel
    run: BodyRun
    part: NDArray[np.bool_] | None = None

    @cached_property
    def alive(self) -> NDArray[np.bool_]:
        """Channels with values, shape (c,)."""
        return np.asarray(self.run.valid.mean(axis=0) > _ALIVE)

    @cached_property
    def use(self) -> NDArray[np.bool_]:
        """Samples with a value of every such channel and of the gyro, shape (n,)."""
        use = self.run.valid[:, self.alive].all(axis=1) & self.run.gyro_valid
        use[[0, -1]] = False
        return use

    @cached_property
    def starts(self) -> NDArray[np.intp]:
        """First sample of each group, shape (m,)."""
        rest = self.run.rest & self.use
        edge = np.ones(len(rest), dtype=bool)
        edge[1:] = ~(rest[1:] & rest[:-1])
        run = np.arange(len(rest)) - np.maximum.accumulate(np.where(edge, np.arange(len(rest)), 0))
        return np.flatnonzero(run % _REST_GROUP == 0)

    @cached_property
    def count(self) -> NDArray[np.float64]:
        """Samples that count in each group, shape (m,)."""
        return np.add.reduceat(self.use.astype(float), self.starts)

    @cached_property
    def on(self) -> NDArray[np.bool_]:
        """Groups that count, shape (m,)."""
        return (self.count > 0) if self.part is None else self.part & (self.count > 0)

    @cached_property
    def resting(self) -> NDArray[np.bool_]:
        """Groups that count and are at rest, shape (m,)."""
        return (np.add.reduceat((self.run.rest & self.use).astype(float), self.starts) > 0) & self.on

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Samples of the groups that count, shape (n,)."""
        return self.use & np.repeat(self.on, np.diff(np.append(self.starts, len(self.run.t))))

    @cached_property
    def change(self) -> NDArray[np.float64]:
        """How fast the readings change, shape (n,), m/s³: rms over the channels, noise taken off."""
        readings, period = self.run.bridged[:, self.alive], self.run.sample_period
        white = self.model.expected_noise(self.run.output_data_rate).white[self.alive]
        step = np.zeros_like(readings)
        step[1:-1] = readings[2:] - readings[:-2]
        power = np.mean(step**2, axis=1) - 2 * np.mean(white**2)
        return np.asarray(np.sqrt(np.maximum(uniform_filter1d(power, 5), 0.0)) / (2 * period))

    @property
    def change_in_motion(self) -> NDArray[np.float64]:
        """The same, but zero at rest, shape (n,), m/s³."""
        return np.where(self.run.rest, 0.0, self.change)

    @cached_property
    def rate_error(self) -> NDArray[np.float64]:
        """Error of the squared rate by the noise of the reference, 2 Ω σ, shape (n,), rad²/s²; 0 without a known axis.

        A smoothed reference keeps the density of its noise at the frequencies that it passes: white noise of the
        samples' σ is no smaller than that anywhere.
        """
        axis = self.model.array.turning_axis
        if axis is None:
            return np.zeros(len(self.run.t))
        direction = axis.direction / np.linalg.norm(axis.direction)
        noise = float(np.abs(direction) @ self.run.smooth.noise)  # of a tachometer the same on all axes of the gyro
        return np.asarray(2.0 * noise * np.abs(self.run.rate @ direction))

    @cached_property
    def cosines(self) -> NDArray[np.float64]:
        """Cosines of slow noise at the groups, for bias instability of unit rms, shape (m, K)."""
        run = self.run
        middle = np.add.reduceat(np.where(self.use, run.t, 0.0), self.starts) / np.maximum(self.count, 1)
        phase = np.pi * (middle - run.t[0]) / max(run.duration, 1e-9)
        cosines = np.sqrt(2.0 / len(run.t)) * np.cos(np.outer(phase, np.arange(_MODES)))
        cosines[:, 0] /= np.sqrt(2.0)
        spectrum = CosineBasis(max(len(run.t), 64), run.sample_period).flicker_spectrum
        return np.asarray(cosines * np.sqrt(spectrum[:_MODES]))

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """Which observations count, shape (m, c + 1)."""
        return np.outer(self.on, np.append(self.alive, False))

    @cached_property
    def observations(self) -> int:
        """How many observations count beside the specific force."""
        return int(self.on.sum() * (self.alive.sum() - 3) + self.resting.sum())

    @cached_property
    def at_rest(self) -> bool:
        """Whether nothing of the motion could be seen; a body is moved about."""
        return False

    def grouped(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the means of values (n, k) over the samples of each group that count, shape (m, k)."""
        total = np.add.reduceat(np.where(self.use[:, None], values, 0.0), self.starts, axis=0)
        return np.asarray(total / np.maximum(self.count, 1)[:, None])

    def channels(self, effects: Sequence[Effect], drive: BodyDrive) -> NDArray[np.float64]:
        """Predict the channels of every sample, shape (n, c), m/s²; raises as `predict`."""
        return finite_prediction(lambda: self._at_times([*self.known, *effects], drive))

    def _at_times(self, effects: Sequence[Effect], drive: BodyDrive) -> NDArray[np.float64]:
        run, (own, added) = self.run, split(effects)
        channels = self.model.predict_body(drive, run.t, effects=own, temperature=run.temperature, start=self.start)
        if not added:
            return channels
        state = self._of_body(drive, channels)
        return np.asarray(channels + np.sum([effect.added(state)[:, :-1] for effect in added], axis=0))

    def _of_body(self, drive: BodyDrive, channels: NDArray[np.float64]) -> RigState:
        run = self.run
        return RigState.of_body(self.model.array, drive, run.t - self.start, channels, run.temperature)

    def state(self, effects: Sequence[Effect], drive: object) -> RigState:
        """Return what the body does at the samples, as the simulation has it with some effects of its own."""
        assert isinstance(drive, BodyDrive)
        return self._of_body(drive, self.channels(split(effects)[0], drive))

    def observed(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return values at the samples (n, k) as the observations have them, (m, k)."""
        return self.grouped(values)

    def predict(self, effects: Sequence[Effect], drive: object) -> NDArray[np.float64]:
        """Predict the observations, shape (m, c + 1), for a drive and effects besides the known ones."""
        assert isinstance(drive, BodyDrive)
        channels = self.grouped(self.channels(effects, drive))
        return np.column_stack([channels, np.zeros(len(channels))])

    def times(self, effects: Sequence[Effect] = ()) -> NDArray[np.float64]:
        """Return the times of the samples, s: a drive of samples reaches no further."""
        return self.run.t

    def halves(self) -> tuple[BodyStretch, BodyStretch]:
        """Return the odd and the even parts of the run."""
        turn = (np.arange(len(self.starts)) * _PARTS // len(self.starts)) % 2
        one, other = (replace(self, part=turn == index) for index in range(2))
        return one, other


def make_body_stretches(
    model: WorldModel, runs: Sequence[Run], known: Sequence[Sequence[Effect]]
) -> tuple[BodyStretch, ...]:
    """Return one stretch for each run; ``known`` holds the faults found in each."""
    return tuple(
        BodyStretch(model, run, index, float(run.t[0]), tuple(fault for fault in faults if is_of_wiring(fault)))
        for index, (run, faults) in enumerate(zip(runs, known, strict=True))
        if isinstance(model, BodyModel) and isinstance(run, BodyRun)
    )
