"""Inverse root of a drive's normal matrix, which is banded but for the slow noise.

The data and the prior of a spline couple only neighbouring coefficients; noise with slow cosines takes away

    H = B − UUᵀ,  B = LLᵀ banded,  U (m, k) with few columns,

so that with V = L⁻¹U and I − VᵀV = MMᵀ (Woodbury)

    H⁻¹ = WᵀW,  W = [L⁻¹; M⁻¹Vᵀ L⁻¹],  det H = det B · det(I − VᵀV).

W has k rows more than H, but any root serves: only inner products of columns that went through it are ever used. A
calibration residue with few sizes is bordered on, as one more step of the elimination.

Where that is cheaper H is factored whole and k is 0: where readings hold what the drive did long before (a play), so
that the bands are as wide as the matrix, and where slow noise comes through in more ways than the drive has numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, solve_triangular
from scipy.linalg.blas import dsyrk
from scipy.sparse import csr_array, diags_array

from gfimu.diagnosis.cholesky import BandFactor, BlockFactor, Factor, WholeFactor

__all__ = ["InverseRoot", "banded"]

_RIDGE = 1e-10
_WIDE_BANDS = 50  # from which blocks of a dense matrix are faster
_UNFELT = 1e-9  # of the largest row
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
    factor : Factor
        L.
    low : ndarray, shape (m, k)
        V.
    inner : ndarray, shape (k, k)
        M, lower triangular.
    border : ndarray, shape (m + k, q)
        W times the coupling of the drive to the residue.
    corner : ndarray, shape (q, q)
        Lower Cholesky factor of the residue's information, the drive eliminated.
    """

    factor: Factor
    low: NDArray[np.float64]
    inner: NDArray[np.float64]
    border: NDArray[np.float64]
    corner: NDArray[np.float64]

    @classmethod
    def of(
        cls, matrix: csr_array | NDArray[np.float64], rows: NDArray[np.float64], residue: _Border | None = None
    ) -> InverseRoot:
        """Factor H = B − rowsᵀ rows.

        Parameters
        ----------
        matrix : csr_array or ndarray, shape (m, m)
            B; of a dense one the lower triangle, which may be overwritten.
        rows : ndarray, shape (k, m)
            Uᵀ.
        residue : tuple of ndarray, optional
            Information (q, q) of a residue, its prior included, and its coupling to the drive (m, q).

        Raises
        ------
        numpy.linalg.LinAlgError
            If H is not positive definite, even with a ridge of 1e-10.
        """
        size = np.einsum("km,km->k", rows, rows)
        felt = rows[size > _UNFELT * size.max(initial=0.0)]  # many channels hardly see the drive
        factored = _factored(matrix, felt)
        if factored is None:  # a stretch of the drive that only its prior holds, and hardly
            diagonal = matrix.diagonal()
            if isinstance(matrix, csr_array):
                matrix = csr_array(matrix + diags_array(_RIDGE * diagonal))
            else:
                matrix[np.diag_indices(len(matrix))] = (1.0 + _RIDGE) * diagonal
            factored = _factored(matrix, felt)
        if factored is None:
            raise np.linalg.LinAlgError("the normal equations of the drive are not positive definite")
        drive = cls(*factored, np.zeros((sum(factored[1].shape), 0)), np.zeros((0, 0)))
        if residue is None:
            return drive
        information, coupling = residue
        border = drive.apply(coupling)
        corner = np.linalg.cholesky(information - border.T @ border)
        return cls(*factored, border, np.asarray(corner, dtype=np.float64))

    @property
    def whole(self) -> bool:
        """Whether H was factored whole."""
        return isinstance(self.factor, WholeFactor)

    def apply(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return W x of columns (m + q, P) or one (m + q,)."""
        size = len(self.low)
        flat = columns if columns.ndim == 2 else columns[:, None]
        drive = self.factor.solve(flat[:size])
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
        drive = self.factor.solve(upper[:size] + self.low @ middle, transposed=True)
        both = np.concatenate([drive, last])
        return both if columns.ndim == 2 else both[:, 0]

    def log_volume(self) -> float:
        """Return −½ log det H, the residue's part included."""
        diagonals = (self.factor.diagonal(), self.inner.diagonal(), self.corner.diagonal())
        return -float(sum(np.log(one).sum() for one in diagonals))

    def _inside(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        if not right.size:
            return right
        return np.asarray(solve_triangular(self.inner, right, lower=True, check_finite=False))


def _factored(
    matrix: csr_array | NDArray[np.float64], rows: NDArray[np.float64]
) -> tuple[Factor, NDArray[np.float64], NDArray[np.float64]] | None:
    """Return L, V and M, the latter without rows where H was factored whole; None if there are none."""
    size, count, bandwidth = matrix.shape[0], len(rows), _bandwidth(matrix)
    factor: Factor | None
    if _cost_whole(size, count) < _cost_apart(size, count, bandwidth):
        whole = _dense(matrix)
        if count:
            whole = dsyrk(-1.0, rows, trans=1, beta=1.0, c=whole, lower=1)
        factor = WholeFactor.of(whole)
        return None if factor is None else (factor, np.zeros((size, 0)), np.zeros((0, 0)))
    if isinstance(matrix, csr_array) and bandwidth < _WIDE_BANDS:
        factor = BandFactor.of(banded(matrix))
    else:
        factor = BlockFactor.of(_dense(matrix), bandwidth)
    if factor is None:
        return None
    low = factor.solve(rows.T)
    if not count:
        return factor, low, np.zeros((0, 0))
    left = dsyrk(-1.0, low, trans=1, beta=1.0, c=np.eye(count, order="F"), lower=1, overwrite_c=1)
    inner, failed = lapack.dpotrf(left, lower=1, clean=1, overwrite_a=1)
    return None if failed else (factor, low, inner)


def _cost_whole(size: int, count: int) -> float:
    """Return the multiplications that a whole factor takes."""
    return size**3 / 3.0 + size**2 * count


def _cost_apart(size: int, count: int, bandwidth: int) -> float:
    """Return the multiplications that a factor in bands takes, and slow noise with it."""
    return 2.0 * size * bandwidth * (bandwidth + 2.0 * count) + size * count**2 + count**3 / 3.0


def _bandwidth(matrix: csr_array | NDArray[np.float64]) -> int:
    """Return how far below the diagonal the entries reach."""
    if isinstance(matrix, csr_array):
        entries = matrix.tocoo()
        return int(np.max(entries.row - entries.col, initial=0))
    last = len(matrix) - 1 - (matrix != 0)[::-1].argmax(axis=0)
    return int(np.max(last - np.arange(len(matrix)), initial=0))


def _dense(matrix: csr_array | NDArray[np.float64]) -> NDArray[np.float64]:
    return matrix.toarray(order="F") if isinstance(matrix, csr_array) else matrix
