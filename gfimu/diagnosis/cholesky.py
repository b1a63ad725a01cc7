"""Cholesky factors of matrices with bands: narrow ones, wide ones and such as fill the matrix.

LAPACK's routines for bands solve for one column after another, which is slow where bands are wide. There

    A = [D₀ E₀ᵀ; E₀ D₁ E₁ᵀ; …],  L = [L₀; F₀ L₁; …],  LᵢLᵢᵀ = Dᵢ − Fᵢ₋₁Fᵢ₋₁ᵀ,  Fᵢ = Eᵢ Lᵢ^−ᵀ,

in blocks as large as the bands are wide, takes all columns at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack
from scipy.linalg.blas import dsyrk, dtrsm

__all__ = ["BandFactor", "BlockFactor", "Factor", "WholeFactor"]

_LEAST_BLOCK = 32


class Factor(Protocol):
    """Lower Cholesky factor L of a matrix (m, m)."""

    def solve(self, right: NDArray[np.float64], *, transposed: bool = False) -> NDArray[np.float64]:
        """Return L⁻¹, or L⁻ᵀ, of columns (m, P)."""
        ...

    def diagonal(self) -> NDArray[np.float64]:
        """Return the diagonal of L, shape (m,)."""
        ...


@dataclass(frozen=True)
class BandFactor:
    """L in lower bands.

    Parameters
    ----------
    bands : ndarray, shape (b + 1, m)
        As LAPACK holds them.
    """

    bands: NDArray[np.float64]

    @classmethod
    def of(cls, bands: NDArray[np.float64]) -> BandFactor | None:
        """Factor a matrix given by its lower bands (b + 1, m); None if it is not positive definite."""
        factor, failed = lapack.dpbtrf(bands, lower=1)
        return None if failed else cls(factor)

    def solve(self, right: NDArray[np.float64], *, transposed: bool = False) -> NDArray[np.float64]:
        """Return L⁻¹, or L⁻ᵀ, of columns (m, P)."""
        if not right.size:  # SciPy's wrapper of dtbtrs writes beyond an empty array
            return right.copy()
        trans = "T" if transposed else "N"
        return np.asarray(lapack.dtbtrs(self.bands, np.asfortranarray(right), uplo="L", trans=trans)[0])

    def diagonal(self) -> NDArray[np.float64]:
        """Return the diagonal of L, shape (m,)."""
        return self.bands[0]


@dataclass(frozen=True)
class BlockFactor:
    """L in blocks on and below its diagonal.

    Parameters
    ----------
    own : tuple of ndarray
        Lᵢ, lower triangular.
    below : tuple of ndarray
        Fᵢ, one fewer.
    """

    own: tuple[NDArray[np.float64], ...]
    below: tuple[NDArray[np.float64], ...]

    @classmethod
    def of(cls, matrix: NDArray[np.float64], bandwidth: int) -> BlockFactor | None:
        """Factor a dense matrix (m, m), of which the lower triangle is read; None if it is not positive definite."""
        starts = np.arange(0, len(matrix), max(bandwidth, _LEAST_BLOCK))
        pieces = [slice(int(start), int(stop)) for start, stop in zip(starts, [*starts[1:], len(matrix)], strict=True)]
        own: list[NDArray[np.float64]] = []
        below: list[NDArray[np.float64]] = []
        for number, piece in enumerate(pieces):
            block = np.array(matrix[piece, piece], order="F")
            if below:
                block = dsyrk(-1.0, below[-1], beta=1.0, c=block, lower=1, overwrite_c=1)
            root, failed = lapack.dpotrf(block, lower=1, clean=1, overwrite_a=1)
            if failed:
                return None
            own.append(root)
            if piece is not pieces[-1]:
                coupling = np.array(matrix[pieces[number + 1], piece], order="F")
                below.append(dtrsm(1.0, root, coupling, side=1, lower=1, trans_a=1, overwrite_b=1))
        return cls(tuple(own), tuple(below))

    def solve(self, right: NDArray[np.float64], *, transposed: bool = False) -> NDArray[np.float64]:
        """Return L⁻¹, or L⁻ᵀ, of columns (m, P)."""
        ends = np.cumsum([len(root) for root in self.own])
        pieces = [np.array(piece, order="F") for piece in np.split(right, ends[:-1])]
        order = range(len(pieces))
        for number in reversed(order) if transposed else order:
            piece = pieces[number]
            if transposed and number < len(self.below):
                piece = piece - self.below[number].T @ pieces[number + 1]
            elif not transposed and number:
                piece = piece - self.below[number - 1] @ pieces[number - 1]
            pieces[number] = dtrsm(1.0, self.own[number], piece, lower=1, trans_a=int(transposed))
        return np.concatenate(pieces)

    def diagonal(self) -> NDArray[np.float64]:
        """Return the diagonal of L, shape (m,)."""
        return np.concatenate([root.diagonal() for root in self.own])


@dataclass(frozen=True)
class WholeFactor:
    """L whole.

    Parameters
    ----------
    root : ndarray, shape (m, m)
        L.
    """

    root: NDArray[np.float64]

    @classmethod
    def of(cls, matrix: NDArray[np.float64]) -> WholeFactor | None:
        """Factor a dense matrix (m, m), of which the lower triangle is read; None if it is not positive definite."""
        root, failed = lapack.dpotrf(matrix, lower=1, clean=1)
        return None if failed else cls(root)

    def solve(self, right: NDArray[np.float64], *, transposed: bool = False) -> NDArray[np.float64]:
        """Return L⁻¹, or L⁻ᵀ, of columns (m, P)."""
        return np.asarray(dtrsm(1.0, self.root, right, lower=1, trans_a=int(transposed)))

    def diagonal(self) -> NDArray[np.float64]:
        """Return the diagonal of L, shape (m,)."""
        return self.root.diagonal()
