"""GDOP² and ω² leakage of a geometry as differentiable functions of positions and directions of its chips.

A chip with k sensing axes at r enters JᵀJ only through K P Kᵀ with K = [[r]×; I] and P the projector on its sensing
directions (P = I for three axes, I − nnᵀ for two axes normal to n, θθᵀ for one). So the turn of a tri-axial chip
doesn't matter, and one direction per chip describes the others. With M = JᵀJ = Σ K P Kᵀ, N = JᵀQ = Σ K P V and V the
field of the ω products at r:

- GDOP² = tr M⁻¹, with the gradient −2 M⁻² K P by K and −Kᵀ M⁻² K by P;
- L = M⁻¹N is the leakage S Q; for φ = ⟨R, L⟩ with B = M⁻¹R and C = B Lᵀ the gradient is
  B Vᵀ P − (C + Cᵀ) K P by K, Kᵀ(B Vᵀ − C K) by P and P Kᵀ B by V.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["GeometryObjective"]

_Vector = NDArray[np.float64]

_SINGULAR = 1e-12
_UNSEEN = 1e12  # GDOP² given to geometries of rank < 6: finite, so that a line search turns back without NaN


@dataclass(frozen=True)
class GeometryObjective:
    """Objective of a geometry search; variables are n positions, then one direction per chip where it matters.

    Parameters
    ----------
    n_chips : int
        Number of chips.
    axes_per_chip : int
        Sensing axes of a chip: 1, 2 or 3.
    """

    n_chips: int
    axes_per_chip: int

    @property
    def turns_matter(self) -> bool:
        """Whether the variables hold directions: the turn of a tri-axial chip changes nothing."""
        return self.axes_per_chip < 3

    @property
    def n_variables(self) -> int:
        """Length of the vector of variables."""
        return self.n_chips * (6 if self.turns_matter else 3)

    def split(self, variables: _Vector) -> tuple[_Vector, _Vector]:
        """Return positions, shape (n, 3), and unit directions, shape (n, 3) or (0, 3)."""
        positions, directions = np.split(variables, [3 * self.n_chips])
        directions = directions.reshape(-1, 3)
        return positions.reshape(-1, 3), directions / np.linalg.norm(directions, axis=1, keepdims=True)

    def projectors(self, directions: _Vector) -> _Vector:
        """Projector of each chip on its sensing directions, shape (n, 3, 3)."""
        if not self.turns_matter:
            return np.broadcast_to(np.eye(3), (self.n_chips, 3, 3))
        outer = directions[:, :, None] * directions[:, None, :]
        return outer if self.axes_per_chip == 1 else np.eye(3) - outer

    def sees_all_motions(self, variables: _Vector) -> bool:
        """Whether the geometry has rank 6."""
        return self.gdop_squared(variables)[0] < _UNSEEN

    def gdop_squared(self, variables: _Vector) -> tuple[float, _Vector]:
        """GDOP² and its gradient, shape (n_variables,)."""
        positions, directions = self.split(variables)
        projectors = self.projectors(directions)
        arms = _arms(positions)  # K, (n, 6, 3)
        weighted = arms @ projectors  # K P, (n, 6, 3)
        inverse = _inverse(np.einsum("nij,nkj->ik", weighted, arms))
        if inverse is None:
            return _UNSEEN, np.zeros(self.n_variables)
        squared = inverse @ inverse
        by_arm = -2.0 * squared @ weighted
        by_projector = -np.swapaxes(arms, 1, 2) @ squared @ arms
        return float(np.trace(inverse)), self._gradient(variables, by_arm, by_projector, None)

    def alpha_leakage(self, variables: _Vector) -> _Vector:
        """Products of ω left in α by the linear solution S a, shape (18,)."""
        positions, directions = self.split(variables)
        arms = _arms(positions)
        weighted = arms @ self.projectors(directions)
        inverse = _inverse(np.einsum("nij,nkj->ik", weighted, arms))
        if inverse is None:
            return np.ones(18)
        return (inverse @ np.einsum("nij,njk->ik", weighted, _centripetal(positions)))[:3].ravel()

    def gdop_squared_and_leakage(self, variables: _Vector, weight: float) -> tuple[float, _Vector]:
        """GDOP² + weight · (sum of squares of `alpha_leakage`) and its gradient."""
        positions, directions = self.split(variables)
        projectors = self.projectors(directions)
        arms = _arms(positions)
        field = _centripetal(positions)  # V, (n, 3, 6)
        weighted = arms @ projectors
        value, gradient = self.gdop_squared(variables)
        inverse = _inverse(np.einsum("nij,nkj->ik", weighted, arms))
        if inverse is None:
            return value, gradient
        leakage = inverse @ np.einsum("nij,njk->ik", weighted, field)  # L, (6, 6)
        leakage_of_alpha = np.vstack([leakage[:3], np.zeros((3, 6))])
        b = inverse @ (2.0 * weight * leakage_of_alpha)
        c = b @ leakage.T
        fields = np.swapaxes(field, 1, 2)  # Vᵀ, (n, 6, 3)
        by_arm = b @ fields @ projectors - (c + c.T) @ weighted
        by_projector = np.swapaxes(arms, 1, 2) @ (b @ fields - c @ arms)
        by_field = np.swapaxes(weighted, 1, 2) @ b  # (n, 3, 6)
        penalty = weight * float(np.sum(leakage_of_alpha**2))
        return value + penalty, gradient + self._gradient(variables, by_arm, by_projector, by_field)

    def _gradient(
        self, variables: _Vector, by_arm: _Vector, by_projector: _Vector, by_field: _Vector | None
    ) -> _Vector:
        """Carry derivatives by K, P and V over to the variables."""
        by_position = np.stack(
            [
                by_arm[:, 2, 1] - by_arm[:, 1, 2],
                by_arm[:, 0, 2] - by_arm[:, 2, 0],
                by_arm[:, 1, 0] - by_arm[:, 0, 1],
            ],
            axis=1,
        )
        if by_field is not None:
            e = np.moveaxis(by_field, 0, -1)  # (3, 6, n)
            by_position[:, 0] += -e[0, 1] - e[0, 2] + e[1, 3] + e[2, 4]
            by_position[:, 1] += -e[1, 0] - e[1, 2] + e[0, 3] + e[2, 5]
            by_position[:, 2] += -e[2, 0] - e[2, 1] + e[0, 4] + e[1, 5]
        if not self.turns_matter:
            return by_position.ravel()
        _, directions = self.split(variables)
        sign = 1.0 if self.axes_per_chip == 1 else -1.0
        by_direction = sign * np.einsum("nij,nj->ni", by_projector + np.swapaxes(by_projector, 1, 2), directions)
        by_direction -= np.sum(by_direction * directions, axis=1, keepdims=True) * directions
        lengths = np.linalg.norm(variables[3 * self.n_chips :].reshape(-1, 3), axis=1, keepdims=True)
        return np.concatenate([by_position.ravel(), (by_direction / lengths).ravel()])


def _arms(positions: _Vector) -> _Vector:
    """K = [[r]×; I] of each chip, shape (n, 6, 3)."""
    arms = np.zeros((len(positions), 6, 3))
    x, y, z = positions.T
    arms[:, 0, 1], arms[:, 0, 2] = -z, y
    arms[:, 1, 0], arms[:, 1, 2] = z, -x
    arms[:, 2, 0], arms[:, 2, 1] = -y, x
    arms[:, 3:] = np.eye(3)
    return arms


def _centripetal(positions: _Vector) -> _Vector:
    """Field (ωωᵀ − |ω|² I) r at each chip as a matrix on the six products of ω, shape (n, 3, 6)."""
    field = np.zeros((len(positions), 3, 6))
    x, y, z = positions.T
    field[:, 0, 1], field[:, 0, 2], field[:, 0, 3], field[:, 0, 4] = -x, -x, y, z
    field[:, 1, 0], field[:, 1, 2], field[:, 1, 3], field[:, 1, 5] = -y, -y, x, z
    field[:, 2, 0], field[:, 2, 1], field[:, 2, 4], field[:, 2, 5] = -z, -z, x, y
    return field


def _inverse(matrix: _Vector) -> _Vector | None:
    """Inverse of JᵀJ, shape (6, 6); None where it is singular."""
    values, vectors = np.linalg.eigh(matrix)
    if values[0] <= _SINGULAR * values[-1]:
        return None
    return (vectors / values) @ vectors.T
