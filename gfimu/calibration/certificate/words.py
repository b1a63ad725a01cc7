"""Symbols, meanings and units of the terms, without values."""

from __future__ import annotations

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.calibration.certificate.certificate import Term
from gfimu.calibration.certificate.chip_parameters import ChipParameters

__all__ = ["intrinsic_terms", "model_terms"]

_READING = {"lsb": "lsb", "m_s2": "m/s²"}
_PAIRS = ("xy", "xz", "yz")
_MILLI = 1e3 / STANDARD_GRAVITY  # m/s² in mg


def model_terms(chip: ChipParameters) -> tuple[Term, ...]:
    """Terms of the model equation of each input axis, in its order."""
    counts = chip.unit == "lsb"
    scale = "lsb per m/s²" if counts else "1"
    rows = (
        ("K0", "K0", "bias", "m/s²", "mg", _MILLI),
        ("K1", "K1", "scale factor", scale, "lsb per g" if counts else "", STANDARD_GRAVITY if counts else 1.0),
        ("K2", "K2", "second-order coefficient", "s²/m", "µg/g²", 1e6 * STANDARD_GRAVITY),
        ("K3", "K3", "third-order coefficient", "s⁴/m²", "µg/g³", 1e6 * STANDARD_GRAVITY**2),
        ("delta_o", "δ_o", "misalignment about o", "rad", "mrad", 1e3),
        ("delta_p", "δ_p", "misalignment about p", "rad", "mrad", 1e3),
        ("K_ip", "K_ip", "cross-coupling coefficient", "s²/m", "µg/g²", 1e6 * STANDARD_GRAVITY),
        ("K_io", "K_io", "cross-coupling coefficient", "s²/m", "µg/g²", 1e6 * STANDARD_GRAVITY),
        ("K_po", "K_po", "cross-coupling coefficient", "s²/m", "µg/g²", 1e6 * STANDARD_GRAVITY),
    )
    return tuple(
        Term(f"{channel}_{key}", symbol, meaning, unit, familiar_unit=familiar, familiar_factor=factor)
        for channel in chip.channels
        for key, symbol, meaning, unit, familiar, factor in rows
    )


def intrinsic_terms(chip: ChipParameters) -> tuple[Term, ...]:
    """Intrinsic parameters of a triad: sensitivities, offsets, angles."""
    reading, counts = _READING[chip.unit], chip.unit == "lsb"
    degrees = 57.29577951308232
    return (
        *(
            Term(
                f"{channel}_sensitivity",
                f"s_{axis}",
                "intrinsic sensitivity",
                "lsb per m/s²" if counts else "1",
                familiar_unit="lsb per g" if counts else "",
                familiar_factor=STANDARD_GRAVITY if counts else 1.0,
            )
            for channel, axis in zip(chip.channels, "xyz", strict=True)
        ),
        *(
            Term(
                f"{channel}_offset",
                f"r_{axis}",
                "zero-acceleration offset",
                reading,
                familiar_unit="" if counts else "mg",
                familiar_factor=1.0 if counts else _MILLI,
            )
            for channel, axis in zip(chip.channels, "xyz", strict=True)
        ),
        *(
            Term(
                f"{chip.chip}_angle_{pair}",
                f"φ_{pair}",
                "angle between the sensing axes",
                "rad",
                familiar_unit="°",
                familiar_factor=degrees,
            )
            for pair in _PAIRS
        ),
    )
