"""Accelerometer parts: what a data sheet says that estimation needs (``models/parts/*.toml``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part_file import PartFile
from gfimu.base.short_repr import short_repr

__all__ = ["Part", "white_noise_std"]


@dataclass(frozen=True)
class Part:
    """One accelerometer part.

    Parameters
    ----------
    name : str
        Part name.
    lsb : float
        Size of one count, m/s².
    noise_std_100_hz : ndarray, shape (3,)
        Standard deviation of a sample at an output data rate of 100 Hz, per sensing axis, m/s².
    """

    name: str
    lsb: float
    noise_std_100_hz: NDArray[np.float64]

    __repr__ = short_repr

    @classmethod
    def load(cls, name: str, files: Mapping[str, str] | None = None) -> Part:
        """Load a part by name (in ``models/parts``) or from a TOML file.

        Parameters
        ----------
        name : str
            Name in ``models/parts``, name of one of ``files``, or path of a part file.
        files : mapping of str to str, optional
            Part files that an array carries (`gfimu.AccelerometerArray.part_files`).

        Raises
        ------
        InputError
            If the part is unknown (the message lists the names), or its file lacks a figure.
        """
        part = PartFile.load(name, files)
        return cls(part.name, part.lsb_m_s2, np.array(part.noise_lsb_rms_100_hz) * part.lsb_m_s2)

    def noise_std(self, output_data_rate: float) -> NDArray[np.float64]:
        """Return the standard deviation of a sample at an output data rate in Hz, per axis, shape (3,), m/s²."""
        return self.noise_std_100_hz * _noise_growth(output_data_rate)


def white_noise_std(array: AccelerometerArray, sample_rate: float) -> NDArray[np.float64]:
    """Return the standard deviation of one sample of each channel by the data sheets, shape (c,), m/s².

    The noise is white up to half the output data rate, so it grows with the square root of that rate from 100 Hz on;
    below that the data sheets give the figure for 100 Hz. The rate is that of the array file where a chip has one, else
    ``sample_rate``, Hz.
    """
    parts = {chip.part: Part.load(chip.part, array.part_files) for chip in array.chips}
    at_100_hz = [parts[chip.part].noise_std_100_hz[: len(chip.axes)] for chip in array.chips]
    return np.concatenate(at_100_hz) * _noise_growth(array.output_data_rates(sample_rate))


def _noise_growth(output_data_rate: ArrayLike) -> NDArray[np.float64]:
    """Return the noise of a sample at output data rates in Hz over that at 100 Hz; see `white_noise_std`."""
    return np.asarray(np.sqrt(np.maximum(output_data_rate, 100.0) / 100.0))
