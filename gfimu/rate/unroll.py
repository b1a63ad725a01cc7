"""Write the twelve-axis filter's step without loops: ``python -m gfimu.rate.unroll`` rewrites ``unrolled.py``.

A compiled loop over a 15 × 15 covariance spends most of its time on loads, stores and checks; with every element a
local variable the compiler keeps them in registers, which is about three times as fast. The formulas are those of
`gfimu.rate.recursion` with all six null-space rows at once:

    G = P Hᵀ,  S = H G + R = L Lᵀ,  P ← P − (L⁻¹Gᵀ)ᵀ(L⁻¹Gᵀ),  x ← x + (L⁻¹Gᵀ)ᵀ L⁻¹ e.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

__all__ = ["source"]

N_NULL = 6
STATES = 15  # ω, b_α, b_z and the noise of α at this sample
_FIRST_BIAS = 6
_WIDTH = 118

_HEADER = '''"""One step of the twelve-axis filter without loops. Written by ``python -m gfimu.rate.unroll``."""
# ruff: noqa: E702
# fmt: off

from __future__ import annotations

import numpy as np
from numba import njit

from gfimu.rate.second_order import second_order


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def step(x, p, turned, t, ringing, noise, inflation, m, z, k, slow):  # type: ignore[no-untyped-def]
    """Predict and update x (15,) and p (15, 15); returns Σ e²/S and det S.

    ``turned`` (3,) is the integral of α over the interval of length ``t``, ``ringing`` g of its noise, ``noise`` (3, 3)
    the covariance of α, ``inflation`` the further noise in units of it, ``m`` (6, 6) and row ``k`` of ``z`` the null
    space; while tr P > ``slow`` |ω|² the update is of second order.
    """
'''


def _p(row: int, column: int) -> str:
    return f"p{min(row, column)}_{max(row, column)}"


def _predict(add: Callable[[str], None]) -> None:
    """Write (1) of the recursion: ω by α, its bias and ε; then (1b), the ε of the new sample."""
    first_noise = STATES - 3
    add("half = 0.5 * t")
    add("carried = half * (1.0 - ringing)")
    add("factor = 1.0 + inflation")
    add("renewed = factor * (1.0 + ringing) * (1.0 + ringing)")
    for a in range(3):
        add(f"x{a} += turned[{a}] - t * x{3 + a} + carried * x{first_noise + a}")
        add(f"x{first_noise + a} *= -ringing")
    for a in range(3):
        for r in range(3, STATES):  # d = the change of the rows of ω
            add(f"d{a}_{r} = carried * {_p(first_noise + a, r)} - t * {_p(3 + a, r)}")
    for a in range(3):
        for b in range(a, 3):
            cross = f"carried * {_p(b, first_noise + a)} - t * {_p(b, 3 + a)}"
            back = f"carried * {_p(a, first_noise + b)} - t * {_p(a, 3 + b)}"
            both = f"carried * d{a}_{first_noise + b} - t * d{a}_{3 + b}"
            add(f"n{a}_{b} = renewed * noise[{a}, {b}]")
            add(f"{_p(a, b)} += {cross} + {back} + {both} + half * half * n{a}_{b}")
    for a in range(3):
        for r in range(3, first_noise):
            add(f"{_p(a, r)} += d{a}_{r}")
    for a in range(3):
        for b in range(3):
            old = f"{_p(a, first_noise + b)} + d{a}_{first_noise + b}"
            add(f"{_p(a, first_noise + b)} = half * n{min(a, b)}_{max(a, b)} - ringing * ({old})")
        for r in range(3, first_noise):
            add(f"{_p(r, first_noise + a)} *= -ringing")
    for a in range(3):
        for b in range(a, 3):
            old = _p(first_noise + a, first_noise + b)
            add(f"{old} = n{a}_{b} + ringing * ringing * {old}")


def _innovations(add: Callable[[str], None]) -> None:
    """Write (2) of the recursion: slopes, innovations and their variances, linearised at the predicted rate."""
    for i in range(N_NULL):
        row = [f"m[{i}, {j}]" for j in range(6)]
        add(f"h{i}_0 = 2.0 * x0 * {row[0]} + x1 * {row[3]} + x2 * {row[4]}")
        add(f"h{i}_1 = 2.0 * x1 * {row[1]} + x0 * {row[3]} + x2 * {row[5]}")
        add(f"h{i}_2 = 2.0 * x2 * {row[2]} + x0 * {row[4]} + x1 * {row[5]}")
        add(f"e{i} = z[k, {i}] - 0.5 * (h{i}_0 * x0 + h{i}_1 * x1 + h{i}_2 * x2) - x{_FIRST_BIAS + i}")
        add(f"v{i} = factor")
    spread = ", ".join(_p(a, b) for a in range(3) for b in range(a, 3))
    add(f"second = {_p(0, 0)} + {_p(1, 1)} + {_p(2, 2)} > slow * (x0 * x0 + x1 * x1 + x2 * x2)")
    for i in range(N_NULL):
        add("if second:")
        add(f"    c{i}, w{i} = second_order(m[{i}], h{i}_0, h{i}_1, h{i}_2, {spread})")
        add(f"    e{i} -= c{i}")
        add(f"    v{i} += w{i}")


def source() -> str:
    """Return the text of ``unrolled.py``."""
    rows, states = range(N_NULL), range(STATES)
    code: list[str] = []
    add = code.append
    for r in states:
        add(f"x{r} = x[{r}]")
        for q in range(r, STATES):
            add(f"{_p(r, q)} = p[{r}, {q}]")
    _predict(add)
    _innovations(add)
    for i in rows:
        for r in states:
            add(
                f"g{i}_{r} = h{i}_0 * {_p(0, r)} + h{i}_1 * {_p(1, r)} + h{i}_2 * {_p(2, r)} + {_p(_FIRST_BIAS + i, r)}"
            )
    for i in rows:
        for j in range(i + 1):
            noise = f" + v{i}" if i == j else ""
            add(f"l{i}_{j} = h{j}_0 * g{i}_0 + h{j}_1 * g{i}_1 + h{j}_2 * g{i}_2 + g{i}_{_FIRST_BIAS + j}{noise}")
    add("squares = 0.0")
    add("determinant = 1.0")
    for i in rows:
        for j in range(i):
            known = "".join(f" - l{i}_{k} * l{j}_{k}" for k in range(j))
            add(f"l{i}_{j} = (l{i}_{j}{known}) * l{j}_{j}")
            add(f"e{i} -= l{i}_{j} * e{j}")
            for r in states:
                add(f"g{i}_{r} -= l{i}_{j} * g{j}_{r}")
        if i:
            add(f"l{i}_{i} -= " + " + ".join(f"l{i}_{k} * l{i}_{k}" for k in range(i)))
        add(f"determinant *= l{i}_{i}")
        add(f"l{i}_{i} = 1.0 / np.sqrt(l{i}_{i})")  # the reciprocal pivot
        add(f"e{i} *= l{i}_{i}")
        add(f"squares += e{i} * e{i}")
        for r in states:
            add(f"g{i}_{r} *= l{i}_{i}")
            add(f"x{r} += g{i}_{r} * e{i}")
    for r in states:
        add(f"x[{r}] = x{r}")
        for q in range(r, STATES):
            gain = " + ".join(f"g{i}_{r} * g{i}_{q}" for i in rows)
            add(f"{_p(r, q)} -= {gain}")
            add(f"p[{r}, {q}] = {_p(r, q)}")
            if q > r:
                add(f"p[{q}, {r}] = {_p(r, q)}")
    lines: list[str] = []
    current = ""
    for statement in code:  # several statements per line keep the file short
        block = statement.startswith(("if ", "    "))  # a compound statement needs its own lines
        if current and (block or len(current) + len(statement) + 2 > _WIDTH - 4):
            lines.append(current)
            current = statement
        else:
            current = f"{current}; {statement}" if current else statement
        if block:
            lines.append(current)
            current = ""
    lines.append(current)
    return _HEADER + "".join(f"    {line}\n" for line in lines) + "    return squares, determinant\n"


if __name__ == "__main__":
    Path(__file__).with_name("unrolled.py").write_text(source(), encoding="utf-8")
