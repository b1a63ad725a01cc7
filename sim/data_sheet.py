"""What an accelerometer's data sheet says about its errors (``models/parts``), in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.errors import InputError
from gfimu.parts.files import part_table
from gfimu.short_repr import short_repr
from sim.toml_table import TomlTable

__all__ = ["DataSheet"]

_NOMINAL_SENSITIVITY_LSB_G = 256.0


@dataclass(frozen=True)
class DataSheet:
    """Figures of one accelerometer part; arrays have one value per sensing axis, shape (3,).

    Parameters
    ----------
    name : str
        Name of the part.
    lsb : float
        Size of one count at the finest resolution of the widest range, m/s².
    ranges_g : tuple of int
        Ranges that can be set, in units of g.
    bits, bits_reduced : int
        Word length at the widest range; word length with full resolution off (0: the part has no such mode).
    noise_lsb : ndarray
        Noise of the output codes at output data rates up to 100 Hz, counts rms.
    offset_std, offset_limit : ndarray
        Typical and largest 0 g offset, m/s².
    offset_tempco : ndarray
        Typical change of the offset with temperature, m/s² per K.
    sensitivity_std, sensitivity_limit, sensitivity_tempco : float
        Typical and largest relative gain error, and its typical change per K.
    cross_axis_std : float
        Typical pick-up of a neighbouring axis.
    misalignment_std : float
        Typical misalignment of a sensing axis, rad.
    nonlinearity : float
        Typical deviation from a straight line at full scale, relative to full scale.
    full_range : float
        Widest range, m/s².
    rate_max, rate_min : float
        Highest and lowest output data rate, Hz; between them in steps of two.
    bandwidth_ratio : float
        −3 dB bandwidth over output data rate.
    zero_lsb_rate : float
        Output data rate from which the last bit is always zero, Hz.
    high_supply_gain, high_supply_offset : ndarray
        Gain ratio and offset, m/s², at 3.3 V against the nominal supply.
    """

    name: str
    lsb: float
    ranges_g: tuple[int, ...]
    bits: int
    bits_reduced: int
    noise_lsb: NDArray[np.float64]
    offset_std: NDArray[np.float64]
    offset_limit: NDArray[np.float64]
    offset_tempco: NDArray[np.float64]
    sensitivity_std: float
    sensitivity_limit: float
    sensitivity_tempco: float
    cross_axis_std: float
    misalignment_std: float
    nonlinearity: float
    full_range: float
    rate_max: float
    rate_min: float
    bandwidth_ratio: float
    zero_lsb_rate: float
    high_supply_gain: NDArray[np.float64]
    high_supply_offset: NDArray[np.float64]

    __repr__ = short_repr

    @classmethod
    def load(cls, name: str, files: Mapping[str, str] | None = None) -> DataSheet:
        """Load the data sheet of a part by name (in ``models/parts``) or from a TOML file.

        Parameters
        ----------
        name : str
            Name in ``models/parts``, name of one of ``files``, or path of a part file.
        files : mapping of str to str, optional
            Part files that an array carries (`gfimu.AccelerometerArray.part_files`).

        Raises
        ------
        InputError
            If the part is unknown (the message lists the names) or the file is malformed.
        """
        content, source = part_table(name, files or {})
        table = TomlTable(content, source)
        supply = table.table("supply_3_3_V")
        sensitivity = supply.numbers("sensitivity_lsb_g", 3, [_NOMINAL_SENSITIVITY_LSB_G] * 3)
        ranges = table.raw("range_g")
        if not isinstance(ranges, list) or not ranges or not all(isinstance(value, int) for value in ranges):
            raise InputError(f"{source}: range_g must be a list of whole numbers of g")
        offset_std = np.array(table.numbers("offset_std_m_s2", 3))
        return cls(
            name=table.text("name", name),
            lsb=table.number("lsb_m_s2", above=0.0),
            ranges_g=tuple(ranges),
            bits=int(table.number("bits", 16, above=1)),
            bits_reduced=int(table.number("bits_reduced", 0, least=0)),
            noise_lsb=np.array(table.numbers("noise_lsb_rms_100_hz", 3)),
            offset_std=offset_std,
            offset_limit=np.array(table.numbers("offset_limit_m_s2", 3, (5 * offset_std).tolist())),
            offset_tempco=np.array(table.numbers("offset_tempco_m_s2_K", 3, [0.0] * 3)),
            sensitivity_std=table.number("sensitivity_std", 0.0, least=0.0),
            sensitivity_limit=table.number("sensitivity_limit", 1.0, above=0.0),
            sensitivity_tempco=table.number("sensitivity_tempco_K", 0.0, least=0.0),
            cross_axis_std=table.number("cross_axis_std", 0.0, least=0.0),
            misalignment_std=table.number("misalignment_std_rad", 0.0, least=0.0),
            nonlinearity=table.number("nonlinearity_full_scale", 0.0, least=0.0),
            full_range=table.number("full_range_m_s2", above=0.0),
            rate_max=table.number("output_data_rate_max_hz", 3200.0, above=0.0),
            rate_min=table.number("output_data_rate_min_hz", 0.0, least=0.0),
            bandwidth_ratio=table.number("bandwidth_over_output_data_rate", 0.5, above=0.0),
            zero_lsb_rate=table.number("zero_lsb_from_hz", np.finfo(float).max, above=0.0),
            high_supply_gain=np.array(sensitivity) / _NOMINAL_SENSITIVITY_LSB_G,
            high_supply_offset=np.array(supply.numbers("offset_m_s2", 3, [0.0] * 3)),
        )
