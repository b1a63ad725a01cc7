"""Further effects of a rig on its table: a slow tachometer, slow or late chips, a bearing and a bench that move."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from gfimu.array.array import AccelerometerArray
from gfimu.model.parameter_units import NUMBER, RATIO
from gfimu.model.world_model import SpinState
from sim.effects.base import Effect, Pattern, Size, chip_patterns
from sim.effects.low_pass import low_pass
from sim.world import SampleContext, World

__all__ = ["BearingShake", "BenchSway", "ChipLag", "TachoLag"]

_LEAST_RATIO, _MOST_RATIO = 0.2, 20.0  # cycles per revolution
_RARE = 30.0  # times rarer than the effects that every rig may have, by choice
_GRID = 2e-3  # s, on which a mode is simulated


class TachoLag(Effect):
    """A tachometer that is filtered: a first-order lag of its own.

    The reference passes through a low pass: the smoothing of a tachogenerator or a moving average of a counter.

    Notes
    -----
    :formula: τ·Ω̇′ + Ω′ = Ω
    :symbols: τ = time_constant_s
    :size: 10 ms, by choice.
    :example: time_constant_s = 0.015
    :experiment: Rock the table with a chirp up to 1/(2πτ): the reference loses amplitude against the channels, which a
        delay does not do.
    """

    name = "tacho_lag"
    summary = "the reference has a first-order low pass of its own"
    place = "reference"
    rarity = _RARE
    separated_by = "a fast chirp of the rate"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One time constant, never negative."""
        return (Size("time_constant_s", "s", 1e-2, positive=True, step=0.5),)

    def apply(self, world: World) -> World:
        """Pass the reference through the low pass."""
        tau = self.value("time_constant_s")

        def step(reading: NDArray[np.float64], spin: SpinState, t: NDArray[np.float64]) -> NDArray[np.float64]:
            return low_pass(reading[:, None], t, tau)[:, 0]

        return world.changed(reference_steps=(*world.reference_steps, step)) if tau > 0.0 else world


class ChipLag(Effect):
    """Chips with a limited bandwidth, each of its own.

    One chip is set to another output data rate than the others, so that its own low pass is slower.

    Notes
    -----
    :formula: τ·ẏ + y = f
    :symbols: τ = {chip}_s
    :size: 5 ms: half an output data rate of 64 Hz.
    :example: a2_s = 0.008
    :experiment: Read back the rate register of each chip. From data: a chirp, in which one chip alone loses amplitude.
    """

    name = "chip_lag"
    summary = "chips have first-order lags of their own (another output data rate)"
    place = "sensing"
    rarity = _RARE
    separated_by = "faster changes of the specific force"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One time constant per chip, never negative."""
        return tuple(Size(f"{chip.name}_s", "s", 5e-3, positive=True, step=0.5) for chip in array.chips)

    @classmethod
    def reach(cls, array: AccelerometerArray) -> NDArray[np.bool_]:
        """Return the channels of each chip."""
        return np.arange(len(array.chips))[:, None] == array.chip_of_channel

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Return one chip: what all share is the lag of the sensing chain."""
        return chip_patterns(array, 1)[1:]

    def apply(self, world: World) -> World:
        """Pass each chip's readings through its low pass."""
        taus = self.vector([f"{chip.name}_s" for chip in world.array.chips])
        chip = world.array.chip_of_channel

        def step(readings: NDArray[np.float64], context: SampleContext) -> NDArray[np.float64]:
            readings = readings.copy()
            for number in np.flatnonzero(taus > 0.0):
                mine = chip == number
                readings[:, mine] = low_pass(readings[:, mine], context.t, float(taus[number]))
            return readings

        return world.changed(sensing_steps=(*world.sensing_steps, step)) if (taus > 0.0).any() else world


class BearingShake(Effect):
    """The table shakes up and down so many times per revolution, as balls of a bearing or gear teeth make it.

    Balls that pass a flaw of a bearing, or the teeth of a gear, lift table and array; the acceleration grows with the
    rate.

    Notes
    -----
    :formula: y = f + A·abs(ω)·sin(n·θ + φ)·a·z
    :symbols: A = amplitude_m_s2_per_rad_s; n = order; φ = phase_rad
    :size: 5 mm/s² per rad/s, by choice.
    :example: amplitude_m_s2_per_rad_s = 0.02, order = 7.3, phase_rad = 0.0
    :experiment: Turn steadily, slow and fast. The line in the vertical channels follows the rate at the same number of
        cycles per revolution, whole or not; an interference keeps its frequency.
    :rivals: A diagnosis describes it by a function of the angle at the bench.
    """

    name = "bearing_shake"
    summary = "the table shakes up and down so many times per revolution, in proportion to the rate"
    place = "geometry"
    rarity = _RARE
    separated_by = "slow and fast steady rotation: the frequency of the shaking follows the rate"
    other_units: ClassVar = {"amplitude_m_s2_per_rad_s": "m/s²/(rad/s)", "order": NUMBER, "phase_rad": "rad"}
    shape_limits: ClassVar = {"order": (_LEAST_RATIO, _MOST_RATIO)}

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Sine and cosine amplitudes per rate."""
        return tuple(Size(f"{wave}_m_s2_per_rad_s", "m/s²/(rad/s)", 5e-3) for wave in ("sine", "cosine"))

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return one order; the scan over orders finds it."""
        return ({"order": 7.3},)

    @classmethod
    def from_sizes(cls, array, values, shape) -> Effect:  # type: ignore[no-untyped-def]
        """Turn sine and cosine into amplitude and phase."""
        sine, cosine = (float(v) for v in values)
        amplitude = {"amplitude_m_s2_per_rad_s": float(np.hypot(sine, cosine))}
        return cls({**amplitude, "phase_rad": float(np.arctan2(cosine, sine)), **shape})

    def size_values(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return sine and cosine amplitudes."""
        amplitude, phase = self.value("amplitude_m_s2_per_rad_s"), self.value("phase_rad")
        return amplitude * np.array([np.cos(phase), np.sin(phase)])

    @classmethod
    def parameter_units(cls, array: AccelerometerArray) -> dict[str, str]:
        """Return the units of amplitude and phase instead of the sizes."""
        return dict(cls.other_units)

    def apply(self, world: World) -> World:
        """Shake the rig by amplitude · |ω| · sin(order·θ + phase)."""
        amplitude, order = self.value("amplitude_m_s2_per_rad_s"), self.value("order", 1.0)
        phase = self.value("phase_rad")

        def shake(spin: SpinState, t: NDArray[np.float64]) -> NDArray[np.float64]:
            up = amplitude * np.abs(spin.rate) * np.sin(order * spin.angle + phase)
            return np.outer(up, [0.0, 0.0, 1.0])

        return world.changed(shakes=(*world.shakes, shake))


class BenchSway(Effect):
    """The bench sways at a mode of its own, driven by an unbalance that turns with the table.

    A mass off the axis turns with the table and drives the bench, which sways at a mode of its own; c and s are its
    responses to the two parts of the rotating force, p and q the sizes along the room's x and y.

    Notes
    -----
    :formula: c̈ + 2·ζ·ω₀·ċ + ω₀²·c = ω²·cos(θ) + α·sin(θ);
        s̈ + 2·ζ·ω₀·ṡ + ω₀²·s = ω²·sin(θ) − α·cos(θ);
        y = f + a·turn(c̈·p + s̈·q, −θ)
    :symbols: ω₀ = 2π·frequency_hz; ζ = damping_ratio; p = {x,y}_cosine_m; q = {x,y}_sine_m
    :size: 1 mm far above the mode, by choice: 100 g at 100 mm on a bench of 10 kg.
    :example: x_cosine_m = 0.001, y_sine_m = 0.001, frequency_hz = 1.5, damping_ratio = 0.05
    :experiment: Pass slowly through the speed at which the bench sways most. Balance the table, or clamp the bench: the
        sway disappears.
    :rivals: A diagnosis describes it by a mode at the bench.
    """

    name = "bench_sway"
    summary = "the bench sways at a mode of its own under a rotating unbalance"
    place = "geometry"
    rarity = _RARE
    separated_by = "slow steady rotation through the speed at which the bench sways most"
    acts_back = False
    other_units: ClassVar = {"frequency_hz": "Hz", "damping_ratio": RATIO}
    shape_limits: ClassVar = {"damping_ratio": (5e-3, 0.3), "frequency_hz": (0.3, 100.0)}
    _KEYS = ("x_cosine_m", "x_sine_m", "y_cosine_m", "y_sine_m")

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """How far the bench sways far above its mode, along the room's x and y."""
        return tuple(Size(key, "m", 1e-3) for key in cls._KEYS)

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return one mode; the scan over frequencies finds it."""
        return ({"frequency_hz": 5.0, "damping_ratio": 0.05},)

    @property
    def memory_s(self) -> float:
        """Return how long it takes the mode to decay to a three-hundredth."""
        natural = 2 * np.pi * self.value("frequency_hz", 5.0)
        return float(np.log(300.0) / (self.value("damping_ratio", 0.05) * natural))

    def apply(self, world: World) -> World:
        """Let the bench sway."""
        x_cosine, x_sine, y_cosine, y_sine = self.vector(self._KEYS)
        natural, damping = 2 * np.pi * self.value("frequency_hz", 5.0), self.value("damping_ratio", 0.05)

        def shake(spin: SpinState, t: NDArray[np.float64]) -> NDArray[np.float64]:
            sway = _mode_acceleration(_unbalance(spin), t, natural, damping)
            x, y = sway @ [x_cosine, x_sine], sway @ [y_cosine, y_sine]
            return np.stack([x, y, np.zeros_like(x)], axis=-1)

        return world.changed(shakes=(*world.shakes, shake))


def _unbalance(spin: SpinState) -> NDArray[np.float64]:
    """Return the force of a rotating unbalance per its mass and radius, (n, 2): what turns it, with the sign turned."""
    cos, sin = np.cos(spin.angle), np.sin(spin.angle)
    return np.stack(
        [spin.rate**2 * cos + spin.acceleration * sin, spin.rate**2 * sin - spin.acceleration * cos], axis=-1
    )


def _mode_acceleration(
    forces: NDArray[np.float64], t: NDArray[np.float64], natural: float, damping: float
) -> NDArray[np.float64]:
    """Return q̈ of q̈ + 2ζω₀q̇ + ω₀²q = force for forces (n, k) at times (n,), at rest before."""
    grid = np.arange(t[0], t[-1] + _GRID, _GRID)
    system = ([1.0, 0.0, 0.0], [1.0, 2 * damping * natural, natural**2])
    numerator, denominator, _ = cont2discrete(system, _GRID, method="foh")
    columns = []
    for force in forces.T:
        on_grid = np.interp(grid, t, force)
        columns.append(np.interp(t, grid, lfilter(numerator.ravel(), denominator, on_grid)))
    return np.column_stack(columns)
