"""Derivative of the observations with respect to the drive's coefficients, shared between channels.

Channels that are sampled together see the drive through few functions of time (arm times acceleration, arm times
rate squared, gravity's turn), so that J_c = Σ_r V_cr J_r with r far fewer than the channels. Everything that is
eliminated against the drive is summed over channels first and multiplied by the few J_r.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dsyrk
from scipy.signal import lfilter
from scipy.sparse import csc_array, csr_array, vstack

from gfimu.diagnosis.drive import AngleSpline
from gfimu.diagnosis.ringing import Response, Ringing
from gfimu.diagnosis.rippling import RippleResponse, Rippling

__all__ = ["DriveJacobian"]

_LEAST_SHARE = 1e-14
_NARROW = 20  # coefficients that a row holds
_ROWS = 100  # of a dense block
_FORGOTTEN = 12.0  # time constants of a lag
_COLUMNS = 32  # signatures that are taken at once, which bounds the memory
_Delay = Callable[[csr_array], csr_array]


@dataclass(frozen=True)
class DriveJacobian:
    """Derivative (n, m) of every observation, factored.

    Parameters
    ----------
    parts : tuple of csr_array, each (n, m)
        J_r.
    loading : ndarray, shape (R, c + 1)
        V: J_c = Σ_r loading[r, c] · parts[r].
    """

    parts: tuple[csr_array, ...]
    loading: NDArray[np.float64]

    @classmethod
    def build(
        cls,
        spline: AngleSpline,
        slopes: NDArray[np.float64],
        times: NDArray[np.float64],
        chips: NDArray[np.intp],
        weights: NDArray[np.float64],
        delay: _Delay | None = None,
        ringing: Sequence[Ringing] = (),
        rippling: Rippling | None = None,
    ) -> DriveJacobian:
        """Factor the derivative.

        Parameters
        ----------
        spline : AngleSpline
            The drive's spline.
        slopes : ndarray, shape (3, n, c + 1)
            Derivative of each observation with respect to angle, rate and acceleration.
        times : ndarray, shape (n, k + 1)
            When each chip and, last, the reference is sampled, s.
        chips : ndarray of int, shape (c + 1,)
            Column of ``times`` of each observation.
        weights : ndarray, shape (c + 1,)
            One over the variance of each observation; the factors are orthonormal under it.
        delay : callable, optional
            Applies the sensing chain's lag to a matrix (n, m); the reference has none.
        ringing : sequence of Ringing
            What rings between the table, which the reference sees, and the array.
        rippling : Rippling, optional
            What the table itself ripples by.
        """
        groups: dict[tuple[bytes, bool], list[int]] = {}
        for column, chip in enumerate(chips):
            sensed = bool(chip < times.shape[1] - 1)
            groups.setdefault((times[:, chip].tobytes(), sensed), []).append(column)
        parts: list[csr_array] = []
        loadings: list[NDArray[np.float64]] = []
        for (_, sensed), columns in groups.items():
            root = np.sqrt(weights[columns])
            mine = slopes[:, :, columns] * root  # (3, n, C)
            gram = np.einsum("snc,snd->cd", mine, mine)
            vectors = np.linalg.eigh(gram)[1]
            functions = mine @ vectors  # (3, n, C)
            # The eigenvalues of a vanishing direction are rounding errors of the largest one.
            power = np.einsum("snr,snr->r", functions, functions)
            large = power > _LEAST_SHARE * max(float(power.max()), 1e-30)
            kept, functions = vectors[:, large], functions[:, :, large]  # (C, R), (3, n, R)
            state = _State(spline, times[:, chips[columns[0]]], ringing if sensed else (), rippling)
            for place in range(kept.shape[1]):
                part = state.matrix(functions[:, :, place])
                parts.append(delay(part) if delay is not None and sensed else part)
                row = np.zeros(len(chips))
                row[columns] = kept[:, place] / root
                loadings.append(row)
        if not parts:  # nothing valid in this stretch
            parts, loadings = [csr_array((times.shape[0], spline.size))], [np.zeros(len(chips))]
        return cls(tuple(parts), np.array(loadings).reshape(len(parts), len(chips)))

    @classmethod
    def held(
        cls,
        spline: AngleSpline,
        slopes: NDArray[np.float64],
        times: NDArray[np.float64],
        chips: NDArray[np.intp],
        weights: NDArray[np.float64],
        row_weight: NDArray[np.float64],
        play: tuple[float, NDArray[np.intp]],
        delay: _Delay | None = None,
        ringing: Sequence[Ringing] = (),
        rippling: Rippling | None = None,
    ) -> DriveJacobian:
        """Take the derivative of readings of which a play holds a share, each at the drive of an earlier time.

        Parameters
        ----------
        spline, times, chips, weights, delay, ringing, rippling
            As `build` takes them.
        slopes : ndarray, shape (3, n, c + 1)
            The same as there but without the play and the weights of the samples.
        row_weight : ndarray, shape (n, c + 1)
            Weight of every sample.
        play : tuple of float and ndarray of int, shape (n, c)
            The share, and the sample that each held part is of.
        """
        share, sources = play
        root = np.sqrt(weights)
        sensed_last = times.shape[1] - 1
        states = [
            _State(spline, at, ringing if chip < sensed_last else (), rippling) for chip, at in enumerate(times.T)
        ]
        parts = []
        for column, chip in enumerate(chips):
            sensed = bool(chip < sensed_last)
            part = states[chip].matrix(slopes[:, :, column])
            if sensed:
                part = csr_array((1.0 - share) * part + share * part[sources[:, column]])
                part = delay(part) if delay is not None else part
            parts.append(csr_array(part.multiply(root[column] * row_weight[:, [column]])))
        return cls(tuple(parts), np.diag(1.0 / root))

    def channel(self, column: int) -> csr_array:
        """Return J_c, shape (n, m)."""
        used = np.flatnonzero(self.loading[:, column])
        if len(used) == 0:
            return csr_array(self.parts[0].shape)
        first = self.parts[used[0]]
        if all(_alike(self.parts[r], first) for r in used):
            values = self.loading[used, column] @ np.stack([self.parts[r].data for r in used])
            return csr_array((values, first.indices, first.indptr), shape=first.shape)
        return csr_array(sum(self.loading[r, column] * self.parts[r] for r in used))

    def forward(self, step: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return J δ of every observation, shape (n, c + 1)."""
        return np.asarray(np.column_stack([part @ step for part in self.parts]) @ self.loading)

    def backward(self, weighted: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return Σ_c J_cᵀ z_c of values (n, c + 1), shape (m,)."""
        combined = weighted @ self.loading.T  # (n, R)
        return np.asarray(sum(part.T @ combined[:, r] for r, part in enumerate(self.parts)))

    def correlate(self, values: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return Σ_c w_c J_cᵀ A_c of columns (c + 1, P, n) of every observation, shape (m, P)."""
        total = np.zeros((self.parts[0].shape[1], values.shape[1]))
        scaled = self.loading * weights
        for start in range(0, values.shape[1], _COLUMNS):
            some = values[:, start : start + _COLUMNS]
            mixed = (scaled @ some.reshape(len(some), -1)).reshape(len(scaled), *some.shape[1:])  # (R, P, n)
            for part, mine in zip(self.parts, mixed, strict=True):
                total[:, start : start + _COLUMNS] += part.T @ mine.T
        return total

    def information(self) -> csr_array | NDArray[np.float64]:
        """Return Σ_c w_c J_cᵀJ_c under the weights it was built with, shape (m, m); if dense, the lower triangle."""
        rows, size = self.parts[0].shape
        if sum(part.nnz for part in self.parts) < _NARROW * len(self.parts) * rows:
            stacked = vstack(self.parts, format="csr")
            return csr_array(stacked.T @ stacked)
        total = np.zeros((size, size), order="F")
        for start in range(0, rows, _ROWS):  # sparse products of wide rows are slow
            blocks = [_block(part, start, min(start + _ROWS, rows)) for part in self.parts]
            reached = [columns for _, columns, _ in blocks if len(columns)]
            if not reached:
                continue
            first, last = min(int(one.min()) for one in reached), max(int(one.max()) for one in reached) + 1
            dense = np.zeros((len(blocks) * _ROWS, last - first))
            for number, (row, columns, values) in enumerate(blocks):
                dense[number * _ROWS + row, columns - first] = values
            total[first:last, first:last] += dsyrk(1.0, dense.T, lower=1)
        return total

    def slow(self, cosines: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return J_rᵀC of cosines (n, K), shape (R, m, K)."""
        return np.stack([part.T @ cosines for part in self.parts])

    def slow_rows(
        self, slow: NDArray[np.float64], share: NDArray[np.float64], weights: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return rows whose Gram matrix is Σ_ck w_c share_kc (J_cᵀC)_k (J_cᵀC)_kᵀ, shape (R·K, m).

        Those of a cosine are orthogonal, so that as few as possible are large: channels that are sampled hardly apart
        see nearly the same.

        Parameters
        ----------
        slow : ndarray, shape (R, m, K)
            ``slow(cosines)``.
        share : ndarray, shape (K, c + 1)
            Correction of each cosine in each observation.
        weights : ndarray, shape (c + 1,)
            One over the variance of each observation.
        """
        mixed = np.einsum("rc,kc,sc->krs", self.loading * weights, share, self.loading)  # (K, R, R)
        power, vectors = np.linalg.eigh(mixed)
        there = power.max(axis=0) > _LEAST_SHARE  # the reference has no slow noise
        power, vectors = power[:, there], vectors[:, :, there]
        roots = vectors * np.sqrt(np.maximum(power, 0.0))[:, None, :]  # S_k = roots rootsᵀ
        parts = slow.transpose(2, 0, 1)  # (K, R, m)
        turned = np.linalg.eigh(roots.transpose(0, 2, 1) @ (parts @ parts.transpose(0, 2, 1)) @ roots)[1]
        roots = roots @ turned
        rows = np.einsum("krq,rmk->qkm", roots, slow, optimize=True)
        return np.asarray(rows.reshape(-1, slow.shape[1]))

    @cached_property
    def observations(self) -> int:
        """Number of observations, the reference included."""
        return int(self.loading.shape[1])


def _alike(one: csr_array, other: csr_array) -> bool:
    """Tell whether entries of two matrices are in the same places."""
    return np.array_equal(one.indptr, other.indptr) and np.array_equal(one.indices, other.indices)


def _block(part: csr_array, start: int, stop: int) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Return row, from ``start``, column and value of the entries of some rows."""
    ends = part.indptr[start : stop + 1]
    held = slice(int(ends[0]), int(ends[-1]))
    return np.repeat(np.arange(stop - start), np.diff(ends)), part.indices[held], part.data[held]


class _State:
    """The motion that the array, or the reference, sees at given times as a function of the drive's coefficients."""

    def __init__(
        self,
        spline: AngleSpline,
        t: NDArray[np.float64],
        ringing: Sequence[Ringing],
        rippling: Rippling | None,
    ) -> None:
        self._spline, self._t = spline, t
        self._answers: list[Response | RippleResponse] = [one.response(t) for one in ringing]
        if rippling is not None:
            self._answers.append(rippling.response(t))

    def matrix(self, slopes: NDArray[np.float64]) -> csr_array:
        """Return the matrix (n, m) to Σ slopes · (angle, rate, acceleration); slopes are (3, n)."""
        total = self._spline.matrix(self._t, slopes)
        for answer in self._answers:
            total = csr_array(total + answer.matrix(slopes))
        return total


def lagged(part: csr_array, samples: float) -> csr_array:
    """Return columns (n, m) after a first-order lag of ``samples`` sample periods, inputs joined by straight lines."""
    x = 1.0 / samples
    decay = np.exp(-x)
    mean_decay = -np.expm1(-x) / x
    rise = 1.0 - mean_decay
    n, m = part.shape
    columns = csc_array(part)
    counts = np.diff(columns.indptr)
    first, last = np.zeros(m, dtype=np.intp), np.full(m, -1, dtype=np.intp)
    first[counts > 0] = columns.indices[columns.indptr[:-1][counts > 0]]
    last[counts > 0] = columns.indices[columns.indptr[1:][counts > 0] - 1]
    # Each column is dense from its first entry on, and forgotten some time after its last.
    lengths = np.where(counts > 0, np.minimum(last + int(_FORGOTTEN * samples) + 2, n) - first, 0)
    inside = np.arange(int(lengths.max(initial=1))) < lengths[:, None]  # (m, L)
    dense = np.zeros(inside.shape)
    dense[np.repeat(np.arange(m), counts), columns.indices - np.repeat(first, counts)] = columns.data
    dense = lfilter([rise, mean_decay - decay], [1.0, -decay], dense, axis=1)
    rows = (first[:, None] + np.arange(inside.shape[1]))[inside]
    return csr_array(csc_array((dense[inside], rows, np.concatenate([[0], np.cumsum(lengths)])), shape=(n, m)))
