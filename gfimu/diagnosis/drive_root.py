"""Inverse root of a drive's normal matrix, which is banded but for the slow noise.

The data and the prior of a spline couple only neighbouring coefficients; noise with slow cosines takes away

    H = B − UUᵀ,  B = LLᵀ banded,  U (m, k) with few columns,

so that with V = L⁻¹U and I − VᵀV = MMᵀ (Woodbury)

    H⁻¹ = WᵀW,  W = [L⁻¹; M⁻¹Vᵀ L⁻¹],  det H = det B · det(I − VᵀV).

W has k rows more than H, but any root serves: only inner products of columns that went through it are ever used. A
calibration residue with few sizes is bordered on, as one more step of the elimination.

Where readings hold what the drive did long before (a play), the bands are as wide as the matrix; then H is factored
whole and k is 0.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, solve_triangular
from scipy.linalg.blas import dsyrk
from scipy.sparse import csr_array

from gfimu.diagnosis.parallel import wide_algebra

__all__ = ["InverseRoot", "banded"]

_RIDGE = 1e-10
_WIDE_BANDS = 0.05  # of the matrix, from which it is factored whole
_UNFELT = 1e-9  # of the largest row
_WIDE = 400  # rows from which several processors are faster than one
_Border = tuple[NDArray[np.float64], NDArray[np.float64]]


def banded(matrix: csr_array) -> NDArray[np.float64]:
    """Return the lower bands of a symmetric sparse matrix (m, m) as LAPACK holds them, shape (b + 1, m)."""
    entries = matrix.tocoo()
    apart = entries.row - entries.col
    lower = apart >= 0
    bands = np.zeros((int(apart.max(initial=0)) + 1, matrix.shape[0]), order="F")
    bands[apart[lower], entries.col[lower]] = entries.data[lower]
    return bands


@dataclass(frozen=True)
class InverseRoot:
    """W with WᵀW = H⁻¹, of shape (m + k + q, m + q).

    Parameters
    ----------
    band : ndarray, shape (b + 1, m) or (m, m)
        L in lower bands, or whole.
    low : ndarray, shape (m, k)
        V.
    inner : ndarray, shape (k, k)
        M, lower triangular.
    border : ndarray, shape (m + k, q)
        W times the coupling of the drive to the residue.
    corner : ndarray, shape (q, q)
        Lower Cholesky factor of the residue's information, the drive eliminated.
    """

    band: NDArray[np.float64]
    low: NDArray[np.float64]
    inner: NDArray[np.float64]
    border: NDArray[np.float64]
    corner: NDArray[np.float64]
    whole: bool = False

    @classmethod
    def of(
        cls, matrix: csr_array | NDArray[np.float64], rows: NDArray[np.float64], residue: _Border | None = None
    ) -> InverseRoot:
        """Factor H = B − rowsᵀ rows.

        Parameters
        ----------
        matrix : csr_array or ndarray, shape (m, m)
            B; of a dense one the lower triangle, which is overwritten.
        rows : ndarray, shape (k, m)
            Uᵀ.
        residue : tuple of ndarray, optional
            Information (q, q) of a residue, its prior included, and its coupling to the drive (m, q).

        Raises
        ------
        numpy.linalg.LinAlgError
            If H is not positive definite, even with a ridge of 1e-10.
        """
        size = matrix.shape[0]
        if isinstance(matrix, csr_array):
            entries = matrix.tocoo()
            whole = bool(np.max(entries.row - entries.col, initial=0) > _WIDE_BANDS * size)
            form = matrix.toarray(order="F") if whole else banded(matrix)
        else:
            whole, form = True, matrix
        factor = _factored_whole if whole else _factored
        factored = factor(form, rows)
        if factored is None:  # a stretch of the drive that only its prior holds, and hardly
            form[np.diag_indices(size) if whole else 0] *= 1.0 + _RIDGE
            factored = factor(form, rows)
        if factored is None:
            raise np.linalg.LinAlgError("the normal equations of the drive are not positive definite")
        drive = cls(*factored, np.zeros((size + len(factored[2]), 0)), np.zeros((0, 0)), whole)
        if residue is None:
            return drive
        information, coupling = residue
        border = drive.apply(coupling)
        corner = np.linalg.cholesky(information - border.T @ border)
        return cls(*factored, border, np.asarray(corner, dtype=np.float64), whole)

    def apply(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return W x of columns (m + q, P) or one (m + q,)."""
        size = len(self.low)
        flat = columns if columns.ndim == 2 else columns[:, None]
        drive = self._solved(flat[:size])
        parts = [drive, self._inside(self.low.T @ drive)]
        if len(self.corner):
            inside = flat[size:] - self.border.T @ np.concatenate(parts)
            parts.append(solve_triangular(self.corner, inside, lower=True, check_finite=False))
        both = np.concatenate(parts)
        return both if columns.ndim == 2 else both[:, 0]

    def transposed(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return Wᵀ y of columns (m + k + q, P) or one (m + k + q,): H⁻¹x of what was ``apply(x)``."""
        size, count = self.low.shape
        flat = columns if columns.ndim == 2 else columns[:, None]
        upper, last = flat[: size + count], np.zeros((0, flat.shape[1]))
        if len(self.corner):
            last = solve_triangular(self.corner, flat[size + count :], lower=True, trans=1, check_finite=False)
            upper = upper - self.border @ last
        middle = upper[size:]
        if middle.size:
            middle = solve_triangular(self.inner, middle, lower=True, trans=1, check_finite=False)
        both = np.concatenate([self._solved(upper[:size] + self.low @ middle, trans="T"), last])
        return both if columns.ndim == 2 else both[:, 0]

    def log_volume(self) -> float:
        """Return −½ log det H, the residue's part included."""
        diagonals = (
            self.band.diagonal() if self.whole else self.band[0],
            self.inner.diagonal(),
            self.corner.diagonal(),
        )
        return -float(sum(np.log(one).sum() for one in diagonals))

    def _solved(self, right: NDArray[np.float64], trans: str = "N") -> NDArray[np.float64]:
        if self.whole:
            return np.asarray(solve_triangular(self.band, right, lower=True, trans=trans, check_finite=False))
        return _solved(self.band, right, trans)

    def _inside(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        if not right.size:
            return right
        return np.asarray(solve_triangular(self.inner, right, lower=True, check_finite=False))


def _solved(band: NDArray[np.float64], right: NDArray[np.float64], trans: str = "N") -> NDArray[np.float64]:
    """Return L⁻¹ or, with ``trans`` T, L⁻ᵀ of columns (m, P)."""
    if not right.size:  # SciPy's wrapper of dtbtrs writes beyond an empty array
        return right.copy()
    return np.asarray(lapack.dtbtrs(band, np.asfortranarray(right), uplo="L", trans=trans)[0])


def _factored_whole(
    matrix: NDArray[np.float64], rows: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]] | None:
    """Return L with LLᵀ = H whole, and V and M of no rows; None if there is none."""
    size = np.einsum("km,km->k", rows, rows)
    felt = rows[size > _UNFELT * size.max(initial=0.0)]  # many channels hardly see the drive
    with wide_algebra():
        left = dsyrk(-1.0, felt, trans=1, beta=1.0, c=matrix, lower=1) if len(felt) else matrix
        root, failed = lapack.dpotrf(left, lower=1, clean=1)
    return None if failed else (root, np.zeros((len(root), 0)), np.zeros((0, 0)))


def _factored(
    bands: NDArray[np.float64], rows: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]] | None:
    """Return L in bands, V and M; None if there are none."""
    band, failed = lapack.dpbtrf(bands, lower=1)
    if failed:
        return None
    low = _solved(band, rows.T)
    if not len(rows):
        return band, low, np.zeros((0, 0))
    with wide_algebra() if len(rows) >= _WIDE else nullcontext():
        left = dsyrk(-1.0, low, trans=1, beta=1.0, c=np.eye(len(rows), order="F"), lower=1, overwrite_c=1)
        inner, failed = lapack.dpotrf(left, lower=1, clean=1, overwrite_a=1)
    return None if failed else (band, low, inner)
