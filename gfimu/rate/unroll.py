"""Write the filter's measurement update without loops: ``python -m gfimu.rate.unroll`` rewrites ``unrolled.py``.

A compiled loop over a 15 × 15 covariance spends most of its time on loads, stores and checks; with every element a
local variable the compiler keeps them in registers, which is about three times as fast. The formulas are those of
`gfimu.rate.recursion` for all six null-space rows at once:

    G = P Hᵀ,  S = H G + R = L Lᵀ,  P ← P − (L⁻¹Gᵀ)ᵀ(L⁻¹Gᵀ),  x ← x + (L⁻¹Gᵀ)ᵀ L⁻¹ e.
"""

from __future__ import annotations

from pathlib import Path

__all__ = ["source"]

N_NULL = 6
STATES = 15  # ω, b_α, b_z and the noise of α at this sample
_FIRST_BIAS = 6
_WIDTH = 118

_HEADER = '''"""Measurement update of the twelve-axis filter without loops. Written by ``python -m gfimu.rate.unroll``."""
# ruff: noqa
# fmt: off

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def update(x, p, h, innovation, variance):  # type: ignore[no-untyped-def]
    """Update x (15,) and p (15, 15) by the six rows h (6, 3); returns Σ e²/S and det S."""
'''


def _p(row: int, column: int) -> str:
    return f"p{min(row, column)}_{max(row, column)}"


def source() -> str:
    """Return the text of ``unrolled.py``."""
    rows, states = range(N_NULL), range(STATES)
    code: list[str] = []
    add = code.append
    for r in states:
        add(f"x{r} = x[{r}]")
        for q in range(r, STATES):
            add(f"{_p(r, q)} = p[{r}, {q}]")
    for i in rows:
        for a in range(3):
            add(f"h{i}_{a} = h[{i}, {a}]")
        for r in states:
            add(f"g{i}_{r} = h{i}_0 * {_p(0, r)} + h{i}_1 * {_p(1, r)} + h{i}_2 * {_p(2, r)} + {_p(_FIRST_BIAS + i, r)}")
    for i in rows:
        for j in range(i + 1):
            noise = f" + variance[{i}]" if i == j else ""
            add(f"l{i}_{j} = h{j}_0 * g{i}_0 + h{j}_1 * g{i}_1 + h{j}_2 * g{i}_2 + g{i}_{_FIRST_BIAS + j}{noise}")
    add("squares = 0.0")
    add("determinant = 1.0")
    for i in rows:
        add(f"e{i} = innovation[{i}]")
        for j in range(i):
            known = "".join(f" - l{i}_{k} * l{j}_{k}" for k in range(j))
            add(f"l{i}_{j} = (l{i}_{j}{known}) * l{j}_{j}")
            add(f"e{i} -= l{i}_{j} * e{j}")
            for r in states:
                add(f"g{i}_{r} -= l{i}_{j} * g{j}_{r}")
        pivot = "".join(f" - l{i}_{k} * l{i}_{k}" for k in range(i))
        add(f"l{i}_{i} = l{i}_{i}{pivot}")
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
        if current and len(current) + len(statement) + 2 > _WIDTH - 4:
            lines.append(current)
            current = statement
        else:
            current = f"{current}; {statement}" if current else statement
    lines.append(current)
    return _HEADER + "".join(f"    {line}\n" for line in lines) + "    return squares, determinant\n"


if __name__ == "__main__":
    Path(__file__).with_name("unrolled.py").write_text(source(), encoding="utf-8")
