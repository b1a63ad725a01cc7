"""Second-order terms of a quadratic measurement."""

from __future__ import annotations

from numba import njit

__all__ = ["second_order"]

_LIMIT = 4.0


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def second_order(m, h0, h1, h2, xx, xy, xz, yy, yz, zz):  # type: ignore[no-untyped-def]
    """Mean tr(BP) and further variance 2 tr(BPBP) of ωᵀBω when ω has the covariance P.

    The variance is limited to a few times the linear one: a filter that knows nothing would otherwise learn nothing.

    Parameters
    ----------
    m : ndarray, shape (6,)
        Row of M: the elements of B in the order of the products of ω, off-diagonal ones doubled.
    h0, h1, h2 : float
        Slope 2Bω at the predicted rate.
    xx, xy, xz, yy, yz, zz : float
        Elements of P.
    """
    b = 0.5 * m[3]
    c = 0.5 * m[4]
    e = 0.5 * m[5]
    c00 = m[0] * xx + b * xy + c * xz
    c01 = m[0] * xy + b * yy + c * yz
    c02 = m[0] * xz + b * yz + c * zz
    c10 = b * xx + m[1] * xy + e * xz
    c11 = b * xy + m[1] * yy + e * yz
    c12 = b * xz + m[1] * yz + e * zz
    c20 = c * xx + e * xy + m[2] * xz
    c21 = c * xy + e * yy + m[2] * yz
    c22 = c * xz + e * yz + m[2] * zz
    variance = 2.0 * (c00 * c00 + c11 * c11 + c22 * c22 + 2.0 * (c01 * c10 + c02 * c20 + c12 * c21))
    linear = h0 * h0 * xx + h1 * h1 * yy + h2 * h2 * zz + 2.0 * (h0 * h1 * xy + h0 * h2 * xz + h1 * h2 * yz)
    return c00 + c11 + c22, min(variance, _LIMIT * linear)
