"""A simulation of one's own as a world model: a function from motion and parameters to readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import tomli_w
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.model.located.effect import LocatedEffect
from gfimu.model.located.rig_state import RigState
from gfimu.model.own_rig.cause import Cause, Moment, Presence
from gfimu.model.world_model import Effect, EffectFamily, ExpectedNoise, Spin, SpinState, WorldModel

__all__ = ["Simulate", "SimulatorModel"]

Simulate = Callable[
    [SpinState, NDArray[np.float64], Mapping[str, float]], tuple[NDArray[np.float64], NDArray[np.float64]]
]
"""From the motion at n times, the times (n,), s, and the parameters to readings (n, c), m/s², and reference (n,)."""

_SOURCES = ("tacho", "angle", "command")
_USUAL_RATE = 100.0  # Hz: that the noise is stated for


@dataclass(frozen=True)
class SimulatorModel:
    """A rig with one turning axis that a function simulates.

    The motion is that of the axis: its angle, rate and acceleration. The diagnosis finds it from the reference and
    the readings; how the array moves with it is the function's.

    Parameters
    ----------
    array : AccelerometerArray
        Channels, with the geometry of the array in its own frame.
    simulate : callable
        Called as ``simulate(state, t, parameters)`` with the motion ``state.angle`` (rad), ``state.rate`` (rad/s) and
        ``state.acceleration`` (rad/s²), each (n,), the times t (n,), s, and all parameters of all causes by key, zero
        where the simulation is right. Returns noise-free readings (n, c), m/s², and the reference (n,): rad/s, or
        rad where the reference is an angle. It depends on the arguments alone, and smoothly.
    causes : tuple of Cause
        What it may have wrong; `gfimu.model.own_rig.bias_cause` and `gain_cause` are those that any array has.
    noise_std : float or ndarray, shape (c,)
        White noise of the readings at 100 Hz without quantisation, m/s².
    quantum : float
        Size of one count, m/s²; of readings that are not rounded, much less than their noise.
    full_scale : float
        Largest reading, m/s².
    drive_source : {"tacho", "angle", "command"}
        Which reference of the recording it is driven by.
    effects : tuple of Presence
        What it has already, such as what a diagnosis found.
    source : str
        Where `gfimu.model.own_rig.load_model` finds it again.

    Raises
    ------
    InputError
        If a name or a key is there twice, a number is not positive, or the source of the drive is unknown.
    """

    array: AccelerometerArray
    simulate: Simulate
    causes: tuple[Cause, ...]
    noise_std: float | NDArray[np.float64] = 0.02
    quantum: float = 1e-3
    full_scale: float = 16.0 * 9.80665
    drive_source: str = "tacho"
    effects: tuple[Presence | LocatedEffect, ...] = ()
    source: str = ""

    def __post_init__(self) -> None:
        names = [cause.name for cause in self.causes]
        keys = [parameter.key for cause in self.causes if not cause.of_channels for parameter in cause.parameters]
        for what, all_of in (("causes", names), ("parameters", keys)):
            twice = sorted({one for one in all_of if all_of.count(one) > 1})
            if twice:
                raise InputError(f"simulator: two {what} are called {twice[0]!r}; give each a name of its own")
        numbers = {"noise_std": self.noise_std, "quantum": self.quantum, "full_scale": self.full_scale}
        for name, value in numbers.items():
            if not np.all((np.asarray(value) > 0) & np.isfinite(value)):
                raise InputError(f"simulator: {name} = {value} must be positive and finite")
        if self.drive_source not in _SOURCES:
            raise InputError(f"simulator: unknown drive source {self.drive_source!r}; valid: {', '.join(_SOURCES)}")

    def families(self) -> Mapping[str, EffectFamily]:
        """Return the causes by name."""
        return {cause.name: cause for cause in self.causes}

    def described(self, parameters: Mapping[str, object]) -> LocatedEffect:
        """Return an error without a name as an effect, from its parameters."""
        return LocatedEffect.of_parameters(parameters, self.array)

    def placed(self, mounting: NDArray[np.float64] | None = None) -> None:
        """Return None: only the simulation knows how its array stands."""
        del mounting

    def predict(
        self,
        spin: Spin,
        t: NDArray[np.float64],
        *,
        effects: Sequence[Effect] = (),
        temperature: NDArray[np.float64] | None = None,
        mounting: NDArray[np.float64] | None = None,
        start: float | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Predict noise-free channels (n, c), m/s², and the reference (n,) for a motion, with more effects added.

        Raises
        ------
        InputError
            If the simulation returns arrays of another shape, or an effect is of another model.
        """
        present = (*self.effects, *_own(effects))
        parameters = {one.key: 0.0 for cause in self.causes if not cause.of_channels for one in cause.parameters}
        causes = [one for one in present if isinstance(one, Presence)]
        for one in causes:
            for key, value in one.parameters.items():
                if key in parameters:
                    parameters[key] += float(value)
        moment = Moment(spin.at(t), t - (t[0] if start is None else start))
        readings, reference = self.simulate(moment.state, t, parameters)
        self._check(readings, reference, len(t))
        for one in causes:
            values = one.size_values(self.array)
            readings = one.cause.on_readings(readings, values, moment)
            reference = one.cause.on_reference(reference, values, moment)
        period = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
        state = RigState(moment.since_start, moment.state, readings, temperature, period, None)
        for other in present:
            if isinstance(other, LocatedEffect):
                added = other.added(state)
                readings, reference = readings + added[:, :-1], reference + added[:, -1]
        return readings, reference

    def _check(self, readings: NDArray[np.float64], reference: NDArray[np.float64], n: int) -> None:
        for name, got, wanted in (
            ("readings", np.shape(readings), (n, self.array.n_channels)),
            ("the reference", np.shape(reference), (n,)),
        ):
            if got != wanted:
                raise InputError(f"simulator: {name} have shape {got} for {n} times; return {wanted}")

    def sample_times(self, t: NDArray[np.float64], effects: Sequence[Effect] = ()) -> NDArray[np.float64]:
        """Return the times of each chip's readings and, last, of the reference, (n, k + 1): the stamps themselves."""
        return np.repeat(t[:, None], len(self.array.chips) + 1, axis=1)

    def reference_gain(self, effects: Sequence[Effect] = ()) -> float:
        """Return one: what changes the reference is the simulation's own."""
        return 1.0

    def expected_noise(self, sample_rate: float) -> ExpectedNoise:
        """Return the noise at a sample rate: white noise over the band, and quantisation."""
        white = np.broadcast_to(np.asarray(self.noise_std, dtype=float), self.array.n_channels)
        white = white * np.sqrt(max(sample_rate, _USUAL_RATE) / _USUAL_RATE)
        return ExpectedNoise(np.hypot(white, self.quantum / np.sqrt(12.0)), self.quantum, self.full_scale)

    def extended(self, effects: Sequence[Effect]) -> SimulatorModel:
        """Return the model with these effects added to its own."""
        return replace(self, effects=(*self.effects, *_own(effects)))

    def with_array(self, array: AccelerometerArray) -> SimulatorModel:
        """Return the model of another array with the same channels; the function's own geometry stays as it is."""
        return replace(self, array=array)

    def to_toml(self) -> str:
        """Return a twin file: where the simulation is, and the effects that it has."""
        effects = [{"name": effect.name, "parameters": effect.parameters} for effect in self.effects]
        return tomli_w.dumps({"simulator": self.source, "effect": effects})


if TYPE_CHECKING:

    def _proof(model: SimulatorModel) -> WorldModel:
        """Let the type checker prove that it is a world model."""
        return model


def _own(effects: Sequence[Effect]) -> list[Presence | LocatedEffect]:
    own = [effect for effect in effects if isinstance(effect, Presence | LocatedEffect)]
    if len(own) < len(effects):
        foreign = ", ".join(effect.name for effect in effects if not isinstance(effect, Presence | LocatedEffect))
        raise InputError(f"not causes of this simulation: {foreign}; build them with its families")
    return own
