"""What an accelerometer's data sheet says about its errors (``models/parts``), in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.parts.part_file import PartFile, SupplyTable
from gfimu.base.short_repr import short_repr

__all__ = ["DataSheet"]


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
        Typical cross-axis sensitivity.
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

    @property
    def shifts_with_supply(self) -> bool:
        """Whether the data sheet has other figures at 3.3 V."""
        return bool((self.high_supply_gain != 1.0).any() or self.high_supply_offset.any())

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
        part = PartFile.load(name, files, needs=("full_range_m_s2", "offset_std_m_s2", "range_g"))
        offset_std = np.array(part.offset_std_m_s2)
        supply = part.supply_3_3_V or SupplyTable()
        return cls(
            name=part.name,
            lsb=part.lsb_m_s2,
            ranges_g=part.range_g or (),
            bits=part.bits,
            bits_reduced=part.bits_reduced,
            noise_lsb=np.array(part.noise_lsb_rms_100_hz),
            offset_std=offset_std,
            offset_limit=5 * offset_std if part.offset_limit_m_s2 is None else np.array(part.offset_limit_m_s2),
            offset_tempco=np.array(part.offset_tempco_m_s2_K),
            sensitivity_std=part.sensitivity_std,
            sensitivity_limit=1.0 if part.sensitivity_limit is None else part.sensitivity_limit,
            sensitivity_tempco=part.sensitivity_tempco_K,
            cross_axis_std=part.cross_axis_std,
            misalignment_std=part.misalignment_std_rad,
            nonlinearity=part.nonlinearity_full_scale,
            full_range=part.full_range_m_s2 or np.inf,
            rate_max=part.output_data_rate_max_hz,
            rate_min=part.output_data_rate_min_hz,
            bandwidth_ratio=part.bandwidth_over_output_data_rate,
            zero_lsb_rate=float(np.finfo(float).max) if part.zero_lsb_from_hz is None else part.zero_lsb_from_hz,
            high_supply_gain=np.array(supply.gain),
            high_supply_offset=np.array(supply.offset_m_s2),
        )
