"""What one standard deviation of each tolerance adds to the readings of an array in a motion, to first order.

With Ω = [α×] + ωωᵀ − |ω|² I, f = p + Ω r the specific force at a chip and θ_i the sensing axis of channel i:

=============  ==========================================  =====================================
cause          error of channel i                          independent parameters
=============  ==========================================  =====================================
placement      θ_iᵀ Ω δr                                   δr of each chip, three
angles         (ε × θ_i)ᵀ f                                rotation ε of each chip, three
bias           b_i                                         one per channel
gain           g_i a_i                                     one per channel
cross-axis     x_ij a_j                                    one per ordered pair of axes of a chip
nonlinearity   q_i a_i²                                    one per channel
temperature    (β_i + γ_i a_i) ΔT                          two per channel
=============  ==========================================  =====================================
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.budget.tolerances.known_motion import KnownMotion
from gfimu.budget.tolerances.tolerances import Tolerances

__all__ = ["axis_pairs", "signatures", "turned_readings"]

Floats = NDArray[np.float64]


def signatures(array: AccelerometerArray, motion: KnownMotion, tolerances: Tolerances) -> Mapping[str, Floats]:
    """Return the errors of the channels by one standard deviation of each parameter.

    Parameters
    ----------
    array : AccelerometerArray
        The drawing, with c channels.
    motion : KnownMotion
        The motion, of n samples.
    tolerances : Tolerances
        Standard deviations.

    Returns
    -------
    mapping of str to ndarray, shape (n, c, m)
        By cause, of m independent parameters, m/s²; causes of zero size are left out.
    """
    readings = motion.readings(array)  # (n, c)
    found = {name: columns for name, columns in _all(array, motion, readings, tolerances) if columns.any()}
    return {name: columns for name, columns in found.items() if columns.size}


def _all(
    array: AccelerometerArray, motion: KnownMotion, readings: Floats, tolerances: Tolerances
) -> Iterator[tuple[str, Floats]]:
    n, c = readings.shape
    own = np.eye(c)
    along = np.einsum("ci,nij->ncj", array.axes, motion.gradient)  # θᵀ Ω
    yield "placement", _by_chip(array, along * tolerances.placement_std)
    yield "angles", _by_chip(array, turned_readings(array, motion) * tolerances.angle_std)
    yield "bias", np.broadcast_to(own * tolerances.bias, (n, c, c))
    yield "gain", readings[:, :, None] * (own * tolerances.gain)
    yield "cross-axis", _cross_axis(array, readings, tolerances.cross_axis)
    yield "nonlinearity", readings[:, :, None] ** 2 * (own * tolerances.quadratic)
    warm = np.broadcast_to(own * tolerances.bias_tempco, (n, c, c))
    stretched = readings[:, :, None] * (own * tolerances.gain_tempco)
    yield "temperature", np.concatenate([warm, stretched], axis=2) * tolerances.temperature_K


def turned_readings(array: AccelerometerArray, motion: KnownMotion) -> Floats:
    """Return what a rotation of each channel's axis adds to its reading, θ × f, shape (n, c, 3), m/s² per rad."""
    force = motion.p[:, None, :] + np.einsum("nij,cj->nci", motion.gradient, array.positions)  # (n, c, 3)
    return np.asarray(np.cross(array.axes, force))  # (ε × θ)ᵀ f = εᵀ (θ × f)


def axis_pairs(array: AccelerometerArray) -> list[tuple[int, int]]:
    """Return the ordered pairs of channels of one chip: the first picks up the second."""
    chip = array.chip_of_channel
    return [(i, j) for i in range(len(chip)) for j in range(len(chip)) if i != j and chip[i] == chip[j]]


def _cross_axis(array: AccelerometerArray, readings: Floats, std: Floats) -> Floats:
    pairs = axis_pairs(array)
    columns = np.zeros((*readings.shape, len(pairs)))  # (n, c, m)
    for index, (picking, picked) in enumerate(pairs):
        columns[:, picking, index] = readings[:, picked] * std[picking]
    return columns


def _by_chip(array: AccelerometerArray, per_channel: Floats) -> Floats:
    """Spread three parameters per channel, (n, c, 3), over three parameters per chip, (n, c, 3 k)."""
    n, c, _ = per_channel.shape
    columns = np.zeros((n, c, len(array.chips), 3))
    columns[:, np.arange(c), array.chip_of_channel] = per_channel
    return columns.reshape(n, c, -1)
