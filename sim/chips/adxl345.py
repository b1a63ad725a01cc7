"""The ADXL345 as a sensing chain: from specific force along the axes to the counts the chip puts out.

Two things that are kept apart: `draw_errors` throws the dice once for a set of chips (biases, gains, cross-axis
sensitivity, misalignment, non-linearity, temperature coefficients, all from the data sheet), and `Sensor` is the chain
that they then go through (errors, noise, bias instability, range, resolution). The scenarios and the register-level
chip of `firmware_bridge` use the same chain. Any part of ``models/parts`` fits it.

Per the data sheet, typical deviations are one standard deviation of the population. Noise is given as counts rms of
the output codes, so the analogue noise is what remains of it after the variance of the quantisation.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray, Chip
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from sim.chips.data_sheet import DataSheet

__all__ = ["Sensor", "SensorErrors", "SensorSettings", "conversion_offsets", "draw_errors", "flicker", "quantise"]

_REFERENCE_RATE = 100.0  # rate of the noise figures, Hz
_REFERENCE_TEMPERATURE = 25.0
_SUPPLIES = (2.5, 3.3)


@dataclass(frozen=True)
class SensorSettings:
    """How the chips are set up.

    Parameters
    ----------
    output_data_rate : float
        Output data rate, Hz.
    range_g : int
        Range: ±2, 4, 8 or 16 g.
    full_resolution : bool
        Whether the count keeps its size in every range; otherwise 10 bits are spread over the range.
    supply : float
        Supply voltage, 2.5 or 3.3 V.
    errors, noise, quantisation, bandwidth : bool
        Parts of the chain that can be left out; ``bandwidth`` is the average over the conversions of a sample.
    bias_instability : float
        Flicker floor B of the Allan deviation, m/s² (0: none).
    """

    output_data_rate: float = 100.0
    range_g: int = 16
    full_resolution: bool = True
    supply: float = 2.5
    errors: bool = True
    noise: bool = True
    quantisation: bool = True
    bandwidth: bool = True
    bias_instability: float = 0.0

    def perfect(self) -> SensorSettings:
        """Return these settings with every imperfection left out: readings are the specific force itself."""
        return replace(self, errors=False, noise=False, quantisation=False, bandwidth=False, bias_instability=0.0)

    def of(self, chip: Chip) -> SensorSettings:
        """Return the settings of a chip: its own supply and output data rate, where the array file has them."""
        if chip.supply is None and chip.output_data_rate is None:
            return self
        return replace(
            self,
            supply=self.supply if chip.supply is None else chip.supply,
            output_data_rate=self.output_data_rate if chip.output_data_rate is None else chip.output_data_rate,
        )

    def check(self, sheet: DataSheet) -> None:
        """Raise `InputError` for a setting that the part does not have."""
        if self.range_g not in sheet.ranges_g:
            valid = ", ".join(str(value) for value in sheet.ranges_g)
            raise InputError(f"{sheet.name}: unknown range_g {self.range_g}; valid: {valid}")
        if not self.full_resolution and not sheet.bits_reduced:
            raise InputError(f"{sheet.name}: the part has no mode without full resolution; set full_resolution = true")
        if sheet.shifts_with_supply and self.supply not in _SUPPLIES:
            raise InputError(f"{sheet.name}: supply_V {self.supply:g}: figures exist for 2.5 and 3.3 V")
        steps = np.log2(sheet.rate_max / self.output_data_rate)
        if sheet.rate_min and (
            abs(steps - round(steps)) > 1e-9 or not 0 <= steps <= np.log2(sheet.rate_max / sheet.rate_min)
        ):
            raise InputError(
                f"{sheet.name}: output data rate {self.output_data_rate:g} Hz does not exist; valid: "
                f"{sheet.rate_max:g} Hz over powers of two, down to {sheet.rate_min:g} Hz"
            )


@dataclass(frozen=True)
class SensorErrors:
    """Analogue errors of c channels; what is zero here is ideal.

    Parameters
    ----------
    bias : ndarray, shape (c,)
        Offset at 25 °C, m/s².
    scale : ndarray, shape (c,)
        Relative gain error.
    cross_axis, misalignment : ndarray, shape (c, c)
        Pick-up of the chip's other axes by coupling, and by the direction of the sensing axis; zero diagonals.
    quadratic : ndarray, shape (c,)
        Second-order non-linearity, s²/m: reading + quadratic · reading².
    bias_temperature : ndarray, shape (c,)
        Change of the offset with temperature, m/s² per K.
    scale_temperature : ndarray, shape (c,)
        Relative change of the gain per K.
    cubic : ndarray, shape (c,), or float
        Third-order non-linearity, s⁴/m²: reading + cubic · reading³. No data sheet states one, so none is drawn.
    """

    bias: NDArray[np.float64]
    scale: NDArray[np.float64]
    cross_axis: NDArray[np.float64]
    misalignment: NDArray[np.float64]
    quadratic: NDArray[np.float64]
    bias_temperature: NDArray[np.float64]
    scale_temperature: NDArray[np.float64]
    cubic: NDArray[np.float64] | float = 0.0

    __repr__ = short_repr

    @classmethod
    def none(cls, n_channels: int) -> SensorErrors:
        """Return the errors of ideal chips."""
        square = {"cross_axis", "misalignment"}
        shapes = {f.name: (n_channels, n_channels) if f.name in square else (n_channels,) for f in fields(cls)}
        return cls(**{name: np.zeros(shape) for name, shape in shapes.items()})

    def distort(self, force: NDArray[np.float64], temperature: NDArray[np.float64]) -> NDArray[np.float64]:
        """Apply the errors to specific force (n, c), m/s², at board temperatures (n,), °C."""
        warm = (temperature - _REFERENCE_TEMPERATURE)[:, None]
        picked = force + force @ (self.cross_axis + self.misalignment).T  # (n, c)
        bent = picked + self.quadratic * picked**2 + self.cubic * picked**3
        gain = 1.0 + self.scale + self.scale_temperature * warm
        return bent * gain + self.bias + self.bias_temperature * warm


def draw_errors(
    array: AccelerometerArray, sheets: dict[str, DataSheet], *, supply: float, rng: np.random.Generator
) -> SensorErrors:
    """Draw the errors of every chip of an array from its part's data sheet.

    Offsets and gains are normal, cut off at the data sheet's limits; at 3.3 V the typical shifts of that supply are
    added. A chip's axes pick up each other; a chip with a single axis has nobody to pick up.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    sheets : dict
        Data sheets by part name.
    supply : float
        Supply voltage of the chips that have none of their own, V.
    rng : Generator
        Random number generator.
    """
    n = array.n_channels
    of_channel, axis = _figures(array, sheets)
    same_chip = (array.chip_of_channel[:, None] == array.chip_of_channel) & ~np.eye(n, dtype=bool)

    def per_axis(name: str) -> NDArray[np.float64]:
        return np.array([getattr(sheet, name)[j] for sheet, j in zip(of_channel, axis, strict=True)])

    def per_part(name: str) -> NDArray[np.float64]:
        return np.array([getattr(sheet, name) for sheet in of_channel])

    bias = _cut_normal(per_axis("offset_std"), per_axis("offset_limit"), rng)
    scale = _cut_normal(per_part("sensitivity_std"), per_part("sensitivity_limit"), rng)
    own_supply = np.array([supply if chip.supply is None else chip.supply for chip in array.chips])
    high = own_supply[array.chip_of_channel] > 3.0
    bias = np.where(high, bias + per_axis("high_supply_offset"), bias)
    scale = np.where(high, (1 + scale) * per_axis("high_supply_gain") - 1, scale)
    full_range = per_part("full_range")
    return SensorErrors(
        bias=bias,
        scale=scale,
        cross_axis=rng.normal(size=(n, n)) * per_part("cross_axis_std")[:, None] * same_chip,
        misalignment=rng.normal(size=(n, n)) * per_part("misalignment_std")[:, None] * same_chip,
        quadratic=rng.normal(size=n) * per_part("nonlinearity") / full_range,
        bias_temperature=rng.normal(size=n) * per_axis("offset_tempco"),
        scale_temperature=rng.normal(size=n) * per_part("sensitivity_tempco"),
    )


@dataclass(frozen=True)
class Sensor:
    """The sensing chain of the c channels of an array.

    Parameters
    ----------
    settings : SensorSettings
        How the chips are set up.
    errors : SensorErrors
        Their analogue errors.
    lsb : ndarray, shape (c,)
        Size of one output count, m/s².
    noise_std : ndarray, shape (c,)
        Analogue white noise of one sample, m/s².
    lowest, highest : ndarray, shape (c,)
        First and last count of the range.
    zero_lsb : ndarray of bool, shape (c,)
        Where the last bit is always zero.
    """

    settings: SensorSettings
    errors: SensorErrors
    lsb: NDArray[np.float64]
    noise_std: NDArray[np.float64]
    lowest: NDArray[np.int64]
    highest: NDArray[np.int64]
    zero_lsb: NDArray[np.bool_]

    __repr__ = short_repr

    @classmethod
    def build(
        cls, array: AccelerometerArray, settings: SensorSettings, rng: np.random.Generator, *, part: str | None = None
    ) -> Sensor:
        """Build the chain for an array: data sheets of its parts, errors drawn with ``rng``.

        Parameters
        ----------
        array : AccelerometerArray
            The array.
        settings : SensorSettings
            How the chips are set up; a chip's own supply and output data rate go first.
        rng : Generator
            Random number generator for the errors.
        part : str, optional
            Part of every chip, instead of those of the array.

        Raises
        ------
        InputError
            If a part is unknown or does not have these settings.
        """
        if part is not None:
            array = array.with_part(part)
        sheets = {name: DataSheet.load(name, array.part_files) for name in {chip.part for chip in array.chips}}
        for chip in array.chips:
            settings.of(chip).check(sheets[chip.part])
        errors = draw_errors(array, sheets, supply=settings.supply, rng=rng)
        of_channel, axis = _figures(array, sheets)
        own = [settings.of(array.chips[number]) for number in array.chip_of_channel]
        formats = [_word(sheet, mine) for sheet, mine in zip(of_channel, own, strict=True)]
        noise = [_analogue_noise(sheet, mine)[j] for sheet, mine, j in zip(of_channel, own, axis, strict=True)]
        return cls(
            settings,
            errors if settings.errors else SensorErrors.none(array.n_channels),
            np.array([sheet.lsb * step for sheet, (step, _, _) in zip(of_channel, formats, strict=True)]),
            np.array(noise) * settings.noise,
            np.array([-(1 << (bits - 1)) for _, bits, _ in formats]),
            np.array([(1 << (bits - 1)) - 1 for _, bits, _ in formats]),
            np.array([zero for _, _, zero in formats]),
        )

    def analogue(
        self,
        force: NDArray[np.float64],
        temperature: NDArray[np.float64],
        rng: np.random.Generator,
        *,
        noise_factor: float = 1.0,
    ) -> NDArray[np.float64]:
        """Return the readings before the converter: errors, bias instability and white noise.

        Parameters
        ----------
        force : ndarray, shape (n, c)
            Specific force along each sensing axis at the samples, m/s².
        temperature : ndarray, shape (n,)
            Board temperature, °C.
        rng : Generator
            Random number generator for the noise.
        noise_factor : float
            White noise against the data sheet's.

        Returns
        -------
        ndarray, shape (n, c)
            Analogue readings, m/s².
        """
        reading = self.errors.distort(force, temperature)
        if self.settings.bias_instability:
            reading = reading + flicker(reading.shape, self.settings.bias_instability, rng)
        if self.noise_std.any():
            reading = reading + rng.normal(size=reading.shape) * (self.noise_std * noise_factor)
        return reading

    def counts(self, reading: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the output codes of analogue readings (n, c), m/s²."""
        return quantise(reading / self.lsb, self.lowest, self.highest, self.zero_lsb)

    def sense(
        self,
        force: NDArray[np.float64],
        temperature: NDArray[np.float64],
        rng: np.random.Generator,
        *,
        noise_factor: float = 1.0,
    ) -> NDArray[np.float64]:
        """Return what a host reads for specific force (n, c): counts times their nominal size, m/s²."""
        reading = self.analogue(force, temperature, rng, noise_factor=noise_factor)
        return self.counts(reading) * self.lsb if self.settings.quantisation else reading


def quantise(
    value: NDArray[np.float64],
    lowest: NDArray[np.int64] | int,
    highest: NDArray[np.int64] | int,
    zero_lsb: NDArray[np.bool_] | bool = False,
) -> NDArray[np.int64]:
    """Round values in counts to the nearest code (half up), clip them, and clear the last bit where it is always 0."""
    codes = np.clip(np.floor(value + 0.5), lowest, highest).astype(np.int64)
    return np.where(zero_lsb, codes & ~1, codes)


def conversion_offsets(settings: SensorSettings, sheet: DataSheet) -> NDArray[np.float64]:
    """Return when the conversions behind one sample take place, against its time stamp, s; their mean is the sample.

    The data sheet gives the −3 dB frequency, half the output data rate, but neither the filter's shape nor its delay.
    Two conversions a quarter of a period before and after the time stamp have that bandwidth (|cos(πf/2r)| at the
    output data rate r, zero at r) and no delay; a chain that lags is the effect `sensor_lag`.
    """
    if not settings.bandwidth:
        return np.zeros(1)
    half_power = sheet.bandwidth_ratio * settings.output_data_rate
    return np.array([-0.125, 0.125]) / half_power


def flicker(shape: tuple[int, int], instability: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Flicker noise (n, c) whose Allan deviation has its floor at √(2 ln 2/π) times ``instability``.

    Power spectral density B²/(2πf), two-sided (IEEE Std 952-1997, C.1.3), shaped in the frequency domain over twice
    the length so that the ends are not tied together. The floor is at about 0.664 B whatever the sample rate.
    """
    n, channels = shape
    frequency = np.arange(1, n + 1) / (2 * n)  # of the sample rate
    # Two-sided density at f·fs, times fs for samples, times the length for an unnormalised transform.
    amplitude = np.sqrt(instability**2 / (2 * np.pi * frequency) * 2 * n)
    spectrum = np.zeros((n + 1, channels), dtype=complex)
    spectrum[1:] = amplitude[:, None] * (rng.normal(size=(n, channels)) + 1j * rng.normal(size=(n, channels)))
    spectrum[1:] /= np.sqrt(2.0)
    return np.fft.irfft(spectrum, 2 * n, axis=0)[:n]


def _figures(array: AccelerometerArray, sheets: dict[str, DataSheet]) -> tuple[list[DataSheet], list[int]]:
    """Return the data sheet of each channel, and the number of its axis in the chip."""
    pairs = [(sheets[chip.part], j) for chip in array.chips for j in range(len(chip.axes))]
    return [sheet for sheet, _ in pairs], [j for _, j in pairs]


def _word(sheet: DataSheet, settings: SensorSettings) -> tuple[float, int, bool]:
    """Size of a count in finest counts, word length in bits, and whether the last bit is always zero."""
    narrower = max(sheet.ranges_g) / settings.range_g
    zero = settings.output_data_rate >= sheet.zero_lsb_rate
    if not sheet.bits_reduced:  # one word length for every range
        return 1.0 / narrower, sheet.bits, zero
    if settings.full_resolution:
        return 1.0, sheet.bits - round(np.log2(narrower)), zero
    step = 2.0 ** (sheet.bits - sheet.bits_reduced) / narrower
    return step, sheet.bits_reduced, zero and step == 1.0


def _analogue_noise(sheet: DataSheet, settings: SensorSettings) -> NDArray[np.float64]:
    """White noise before the converter, m/s², shape (3,): the data sheet's code noise less the quantisation's."""
    rate = max(settings.output_data_rate / _REFERENCE_RATE, 1.0)
    finest = 2.0 if settings.output_data_rate >= sheet.zero_lsb_rate else 1.0  # counts between codes
    variance = sheet.noise_lsb**2 * rate - finest**2 / 12.0
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)) * sheet.lsb)


def _cut_normal(std: NDArray[np.float64], limit: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw zero-mean normal numbers again until they lie within ±limit."""
    value = rng.normal(size=std.shape) * std
    while (outside := np.abs(value) > limit).any():
        value[outside] = rng.normal(size=int(outside.sum())) * std[outside]
    return value
