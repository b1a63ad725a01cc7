"""The smoother's pass back over the samples that the filter recorded."""

from __future__ import annotations

import numpy as np

from gfimu.base.compiled import compiled

__all__ = ["backward"]


@compiled
def backward(record, count, overshoot, adjoint, curvature, omega, covariance, first):  # type: ignore[no-untyped-def]
    """Run the smoother back over a recorded block of ``count`` samples (Bryson–Frazier form of Rauch–Tung–Striebel).

    For each scalar measurement, from the last to the first, with gain k = P h/S:

        λ ← λ − h (e/S + kᵀλ),   Λ ← (I − k hᵀ)ᵀ Λ (I − k hᵀ) + h hᵀ/S

    then x_s = x − P λ and P_s = P − P Λ P with the predicted x and P, and λ ← Fᵀλ, Λ ← FᵀΛF. No inverse is needed.
    """
    n = len(adjoint)
    work = np.zeros(n)
    three = np.zeros((3, n))
    for row in range(count - 1, -1, -1):
        for place in range(record.updates[row] - 1, -1, -1):
            h = record.h[row, place]
            gain = record.gain[row, place]
            inverse = record.inverse[row, place]
            along = record.innovation[row, place] * inverse
            for r in range(n):
                along += gain[r] * adjoint[r]
            both = inverse
            for r in range(n):
                total = 0.0
                for q in range(n):
                    total += curvature[r, q] * gain[q]
                work[r] = total
                both += total * gain[r]
            for r in range(n):
                adjoint[r] -= h[r] * along
                for q in range(n):
                    curvature[r, q] += both * h[r] * h[q] - h[r] * work[q] - work[r] * h[q]
        for a in range(3):
            total = record.x[row, a]
            for r in range(n):
                total -= record.rows[row, a, r] * adjoint[r]
                value = 0.0
                for q in range(n):
                    value += record.rows[row, a, q] * curvature[q, r]
                three[a, r] = value
            omega[first + row, a] = total
        for place in range(6):
            a = place if place < 3 else (0 if place < 5 else 1)
            b = place if place < 3 else (1 if place == 3 else 2)
            total = record.rows[row, a, b]
            for r in range(n):
                total -= three[a, r] * record.rows[row, b, r]
            covariance[first + row, place] = total
        # λ ← Fᵀλ, Λ ← FᵀΛF with F the identity but for the rows of ω, and −g for ε.
        transition = record.transition[row]
        adjoint[n - 3 :] *= -overshoot
        curvature[n - 3 :] *= -overshoot
        curvature[:, n - 3 :] *= -overshoot
        for r in range(n):
            total = adjoint[r] if r >= 3 else 0.0
            for a in range(3):
                total += transition[a, r] * adjoint[a]
            work[r] = total
        adjoint[:] = work
        # Λ F, column by column, then Fᵀ (Λ F), row by row.
        for r in range(n):
            l0 = curvature[r, 0]
            l1 = curvature[r, 1]
            l2 = curvature[r, 2]
            for q in range(n):
                base = curvature[r, q] if q >= 3 else 0.0
                curvature[r, q] = base + l0 * transition[0, q] + l1 * transition[1, q] + l2 * transition[2, q]
        for q in range(n):
            l0 = curvature[0, q]
            l1 = curvature[1, q]
            l2 = curvature[2, q]
            for r in range(n):
                base = curvature[r, q] if r >= 3 else 0.0
                curvature[r, q] = base + transition[0, r] * l0 + transition[1, r] * l1 + transition[2, r] * l2
