"""Compiled loops of `gfimu.array.dilution`: GDOP² = tr (JᵀJ)⁻¹ by the Schur complement of the p block."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["gdop_of_axes", "gdop_of_triads"]

_SINGULAR = 1e-13  # of the cube of the mean eigenvalue


@njit(cache=True)
def _adjugate(
    a: float, b: float, c: float, d: float, e: float, f: float
) -> tuple[float, float, float, float, float, float, float]:
    # Inverse of [[a, d, e], [d, b, f], [e, f, c]] in the same order, and its determinant: zero if singular.
    aa, bb, cc = b * c - f * f, a * c - e * e, a * b - d * d
    dd, ee, ff = e * f - d * c, d * f - b * e, d * e - a * f
    det = a * aa + d * dd + e * ee
    mean = (a + b + c) / 3.0
    if det <= _SINGULAR * mean * mean * mean:
        return aa, bb, cc, dd, ee, ff, 0.0
    return aa / det, bb / det, cc / det, dd / det, ee / det, ff / det, det


@njit(cache=True)
def gdop_of_triads(positions: NDArray[np.float64], scale: float, result: NDArray[np.float64]) -> None:
    """Fill ``result`` (m,) with the GDOP of tri-axial chips.

    GDOP² = 3/n + tr A⁻¹ + |c|² tr A⁻¹ − cᵀA⁻¹c: Schur complement of the p block n·I, with c the centroid and
    A = Σ |r − c|² I − (r − c)(r − c)ᵀ; A⁻¹ by its adjugate.
    """
    m, n, _ = positions.shape
    for g in range(m):
        sx = sy = sz = xx = yy = zz = xy = xz = yz = 0.0
        for i in range(n):
            x, y, z = scale * positions[g, i, 0], scale * positions[g, i, 1], scale * positions[g, i, 2]
            sx += x
            sy += y
            sz += z
            xx += x * x
            yy += y * y
            zz += z * z
            xy += x * y
            xz += x * z
            yz += y * z
        cx, cy, cz = sx / n, sy / n, sz / n
        xx -= sx * cx
        yy -= sy * cy
        zz -= sz * cz
        a, b, c = yy + zz, xx + zz, xx + yy
        d, e, f = sx * cy - xy, sx * cz - xz, sy * cz - yz
        xx, yy, zz, xy, xz, yz, det = _adjugate(a, b, c, d, e, f)
        if det == 0.0:
            result[g] = np.inf
            continue
        trace = xx + yy + zz
        form = cx * cx * xx + cy * cy * yy + cz * cz * zz + 2.0 * (cx * cy * xy + cx * cz * xz + cy * cz * yz)
        result[g] = math.sqrt(3.0 / n + trace * (1.0 + cx * cx + cy * cy + cz * cz) - form)


@njit(cache=True)
def gdop_of_axes(
    positions: NDArray[np.float64], scale: float, axes: NDArray[np.float64], result: NDArray[np.float64]
) -> None:
    """Fill ``result`` (m,) with the GDOP of sensing axes.

    JᵀJ = [[A, B], [Bᵀ, D]] with rows [m, θ], m = r × θ. With D⁻¹, G = B D⁻¹ and the Schur complement S = A − G Bᵀ,
    tr (JᵀJ)⁻¹ = tr D⁻¹ + tr S⁻¹ + tr GᵀS⁻¹G. Written out: small arrays would cost more than the sums.
    """
    geometries, n, _ = positions.shape
    for g in range(geometries):
        h = g if len(axes) > 1 else 0
        axx = ayy = azz = axy = axz = ayz = 0.0
        dxx = dyy = dzz = dxy = dxz = dyz = 0.0
        bxx = bxy = bxz = byx = byy = byz = bzx = bzy = bzz = 0.0
        for i in range(n):
            x, y, z = scale * positions[g, i, 0], scale * positions[g, i, 1], scale * positions[g, i, 2]
            u, v, w = axes[h, i, 0], axes[h, i, 1], axes[h, i, 2]
            p, q, r = y * w - z * v, z * u - x * w, x * v - y * u
            axx, ayy, azz = axx + p * p, ayy + q * q, azz + r * r
            axy, axz, ayz = axy + p * q, axz + p * r, ayz + q * r
            dxx, dyy, dzz = dxx + u * u, dyy + v * v, dzz + w * w
            dxy, dxz, dyz = dxy + u * v, dxz + u * w, dyz + v * w
            bxx, bxy, bxz = bxx + p * u, bxy + p * v, bxz + p * w
            byx, byy, byz = byx + q * u, byy + q * v, byz + q * w
            bzx, bzy, bzz = bzx + r * u, bzy + r * v, bzz + r * w
        result[g] = np.inf
        ixx, iyy, izz, ixy, ixz, iyz, det = _adjugate(dxx, dyy, dzz, dxy, dxz, dyz)  # D⁻¹
        if det == 0.0:
            continue
        gxx, gxy, gxz = (
            bxx * ixx + bxy * ixy + bxz * ixz,
            bxx * ixy + bxy * iyy + bxz * iyz,
            bxx * ixz + bxy * iyz + bxz * izz,
        )
        gyx, gyy, gyz = (
            byx * ixx + byy * ixy + byz * ixz,
            byx * ixy + byy * iyy + byz * iyz,
            byx * ixz + byy * iyz + byz * izz,
        )
        gzx, gzy, gzz = (
            bzx * ixx + bzy * ixy + bzz * ixz,
            bzx * ixy + bzy * iyy + bzz * iyz,
            bzx * ixz + bzy * iyz + bzz * izz,
        )
        sxx, syy, szz, sxy, sxz, syz, det = _adjugate(
            axx - gxx * bxx - gxy * bxy - gxz * bxz,
            ayy - gyx * byx - gyy * byy - gyz * byz,
            azz - gzx * bzx - gzy * bzy - gzz * bzz,
            axy - gxx * byx - gxy * byy - gxz * byz,
            axz - gxx * bzx - gxy * bzy - gxz * bzz,
            ayz - gyx * bzx - gyy * bzy - gyz * bzz,
        )  # S⁻¹
        if det == 0.0:
            continue
        trace = ixx + iyy + izz + sxx + syy + szz
        trace += sxx * (gxx * gxx + gxy * gxy + gxz * gxz)
        trace += syy * (gyx * gyx + gyy * gyy + gyz * gyz)
        trace += szz * (gzx * gzx + gzy * gzy + gzz * gzz)
        trace += 2.0 * sxy * (gxx * gyx + gxy * gyy + gxz * gyz)
        trace += 2.0 * sxz * (gxx * gzx + gxy * gzy + gxz * gzz)
        trace += 2.0 * syz * (gyx * gzx + gyy * gzy + gyz * gzz)
        result[g] = math.sqrt(trace)
