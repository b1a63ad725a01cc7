"""The quantities that a certificate states of a chip: numbers, and their Jacobian by the parameters of the calibration.

Model equation of an input axis i with its reference axes p and o (IEEE Std 1293; form from secondary sources, see
docs/how_to/certificate.md), without the terms that no method here determines:

    E = K1 (K0 + a_i + K2 a_i² + K3 a_i³ + δ_o a_p − δ_p a_o + K_ip a_i a_p + K_io a_i a_o + K_po a_p a_o)

i, p, o are right-handed: x, y, z for the first input axis, then cyclic, so that δ_o and δ_p are right-handed rotations
of the sensing axis about o and p. With l = b + y + q y² + (c + 2 q²) y³, y = M a (`ErrorModel.series`): K1 = M_ii,
K0 = b_i / M_ii, δ_o = M_ip / M_ii, δ_p = −M_io / M_ii, K2 = q_i M_ii, K3 = (c_i + 2 q_i²) M_ii².

Intrinsic parameters (Geist, Afridi, McGray & Gaitan, J. Res. NIST 122, 32 (2017)): norms of the rows of M, readings at
zero input, and angles between the rows. A rotation of the frame, M R, changes none of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.calibration.certificate.chip_parameters import ChipParameters, chip_parameters
from gfimu.calibration.result import Calibration

__all__ = ["MODEL_EQUATION", "Quantities", "intrinsic_quantities", "model_quantities", "stated_quantities"]

Floats = NDArray[np.float64]

MODEL_EQUATION = (
    "E = K1 (K0 + a_i + K2 a_i² + K3 a_i³ + δ_o a_p − δ_p a_o + K_ip a_i a_p + K_io a_i a_o + K_po a_p a_o)"
)

_STILL = 1e-6  # numerical: relative slope along a direction that changes nothing
_PAIRS = ((0, 1), (0, 2), (1, 2))
_AXES = "xyz"


@dataclass(frozen=True)
class Quantities:
    """Named values and their derivatives by the parameters of the calibration.

    Parameters
    ----------
    names : tuple of str
        Names of the terms: ``a11_K0``, ``a1_angle_xy``.
    values : ndarray, shape (m,)
        Values, in the unit of the `gfimu.calibration.certificate.certificate.Term` of that name.
    jacobian : ndarray, shape (m, p)
        Derivatives by the p parameters of the calibration.
    """

    names: tuple[str, ...]
    values: Floats
    jacobian: Floats

    def covariance(self, parameters: Floats) -> Floats:
        """Covariance of the values, (m, m), from that of the parameters, (p, p)."""
        return self.jacobian @ parameters @ self.jacobian.T

    def without(self, undetermined: Floats) -> Quantities:
        """Leave out what changes along directions of the parameters that were not determined, (p, k)."""
        moved = np.linalg.norm(self.jacobian @ undetermined, axis=1)
        kept = np.flatnonzero(moved <= _STILL * np.linalg.norm(self.jacobian, axis=1))
        return Quantities(tuple(self.names[k] for k in kept), self.values[kept], self.jacobian[kept])

    def __add__(self, other: Quantities) -> Quantities:
        return Quantities(
            (*self.names, *other.names),
            np.concatenate([self.values, other.values]),
            np.concatenate([self.jacobian, other.jacobian]),
        )


def stated_quantities(calibration: Calibration) -> Quantities:
    """Return all quantities of all chips of a calibration of accelerometers, chip by chip."""
    found = [model_quantities(chip) + intrinsic_quantities(chip) for chip in chip_parameters(calibration)]
    return sum(found[1:], found[0])


def model_quantities(chip: ChipParameters) -> Quantities:
    """Return the determined terms of the model equation of each input axis."""
    m, b, q, c = chip.sensitivity, chip.bias, chip.quadratic, chip.cubic
    by_m, by_b, by_q, by_c = chip.slopes
    names: list[str] = []
    values: list[float] = []
    rows: list[Floats] = []

    def state(name: str, value: float, slope: Floats) -> None:
        names.append(name)
        values.append(float(value))
        rows.append(slope)

    for i, channel in enumerate(chip.channels):
        p, o = (i + 1) % 3, (i + 2) % 3
        k1, by_k1 = m[i, i], by_m[:, i, i]
        state(f"{channel}_K0", b[i] / k1, by_b[:, i] / k1 - b[i] / k1**2 * by_k1)
        state(f"{channel}_K1", k1, by_k1)
        if chip.has_quadratic:
            state(f"{channel}_K2", q[i] * k1, by_q[:, i] * k1 + q[i] * by_k1)
        if chip.has_cubic:
            third, by_third = c[i] + 2.0 * q[i] ** 2, by_c[:, i] + 4.0 * q[i] * by_q[:, i]
            state(f"{channel}_K3", third * k1**2, by_third * k1**2 + 2.0 * third * k1 * by_k1)
        state(f"{channel}_delta_o", m[i, p] / k1, by_m[:, i, p] / k1 - m[i, p] / k1**2 * by_k1)
        state(f"{channel}_delta_p", -m[i, o] / k1, m[i, o] / k1**2 * by_k1 - by_m[:, i, o] / k1)
    return Quantities(tuple(names), np.array(values), np.array(rows)).without(chip.undetermined)


def intrinsic_quantities(chip: ChipParameters) -> Quantities:
    """Return the nine intrinsic parameters of a triad: three sensitivities, three offsets, three angles."""
    m, (by_m, by_b, _, _) = chip.sensitivity, chip.slopes
    size = np.linalg.norm(m, axis=1)  # (3,)
    axes = m / size[:, None]
    by_size = np.einsum("pij,ij->pi", by_m, axes)  # (p, 3)
    by_axes = (by_m - by_size[:, :, None] * axes) / size[:, None]  # (p, 3, 3)
    cosine = np.array([axes[i] @ axes[j] for i, j in _PAIRS])
    by_cosine = np.stack([by_axes[:, i] @ axes[j] + by_axes[:, j] @ axes[i] for i, j in _PAIRS])  # (3, p)
    sine = np.array([np.linalg.norm(np.cross(axes[i], axes[j])) for i, j in _PAIRS])
    names = (
        *(f"{channel}_sensitivity" for channel in chip.channels),
        *(f"{channel}_offset" for channel in chip.channels),
        *(f"{chip.chip}_angle_{_AXES[i]}{_AXES[j]}" for i, j in _PAIRS),
    )
    values = np.concatenate([size, chip.bias, np.arctan2(sine, cosine)])
    jacobian = np.concatenate([by_size.T, by_b.T, -by_cosine / sine[:, None]])
    return Quantities(names, values, jacobian).without(chip.undetermined)
