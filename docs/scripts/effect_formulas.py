"""The formulas of the effects' docstrings: from text to Python, and from Python to LaTeX.

A formula is an equation in plain text. ``·`` is a product (of two vectors the scalar product), ``×`` the vector
product, ``²`` to ``⁴`` are powers, a dot above a letter is a derivative by time, ``′`` marks a quantity with the effect
in it, and a subscript digit is part of a name. What is called (``sin``, ``turn``) is a function.
"""

from __future__ import annotations

import ast
import unicodedata
from collections.abc import Iterable, Mapping

__all__ = ["BY_CHANCE", "DOT", "TOLERANCE", "VECTORS", "to_latex", "to_python", "vectors_of"]

VECTORS = frozenset("aFruxz") | {"ρ"}
"""Sensing axis, specific force, place from the axis, up, the room's x, the table's axis, place from the centre."""

TOLERANCE = {
    # to first order in a small rotation of some 10 mrad
    **dict.fromkeys(("misalignment", "mount_tilt", "table_tilt", "axis_wobble", "mount_turn"), 1e-2),
    "gyro_misalignment": 1e-2,
    # the derivatives of the test or of the simulation are finite differences, and modes are held on a grid of time
    **dict.fromkeys(("cogging", "resonance", "bench_sway", "centrifugal_flex"), 5e-3),
    **dict.fromkeys(("sensor_lag", "chip_lag", "tacho_lag", "proof_mass"), 1e-3),
    **dict.fromkeys(("gyro_scale", "gyro_latency"), 1e-3),
}
"""Largest difference between a formula and the simulation over the largest change that the effect makes; else 1e-6."""

BY_CHANCE = {"noise": 0.02, "bias_random_walk": 0.15, "dropped_frames": 0.25}
"""Of formulas that hold on average: relative error in a simulated recording of the test."""

DOT, TWO_DOTS = "\u0307", "\u0308"

_POWERS = {"²": "**2", "³": "**3", "⁴": "**4"}
_SIGNS = {"·": "*", "×": "@", "−": "-", "′": "_prime"}
_GREEK = {
    "α": "alpha", "γ": "gamma", "δ": "delta", "Δ": "Delta", "ε": "varepsilon", "ζ": "zeta", "θ": "theta",
    "κ": "kappa", "μ": "mu", "ν": "nu", "π": "pi", "ρ": "rho", "σ": "sigma", "τ": "tau", "φ": "varphi",
    "ψ": "psi", "ω": "omega", "Ω": "Omega",
}  # fmt: skip
_WORDS = {"sin": r"\sin", "cos": r"\cos", "exp": r"\exp"}
_LEVEL = {ast.Add: 1, ast.Sub: 1, ast.Mult: 2, ast.Div: 2, ast.MatMult: 2, ast.Pow: 4}


def to_python(equation: str) -> tuple[str, str]:
    """Return both sides of an equation as Python expressions.

    Derivatives are names that end in ``_dot`` or ``_dot2``, quantities with the effect in them in ``_prime``.
    """
    text = unicodedata.normalize("NFD", equation)
    text = text.replace(DOT, "_dot").replace(TWO_DOTS, "_dot2")
    for sign, python in (*_POWERS.items(), *_SIGNS.items()):
        text = text.replace(sign, python)
    text = "".join(f"_{unicodedata.digit(one)}" if "₀" <= one <= "₉" else one for one in text)
    left, _, right = text.partition(" = ")
    return left.strip(), right.strip()


def vectors_of(formula: Iterable[str], symbols: Mapping[str, str]) -> frozenset[str]:
    """Return the names of vectors in the equations of an effect.

    They are those of `VECTORS`, what takes part in a vector product, and what has parts along several axes.
    """
    several = {name for name, keys in symbols.items() if "{axis}_" in keys or "{x,y" in keys}
    crossed = {
        one.id.partition("_")[0]
        for equation in formula
        for side in to_python(equation)
        for node in ast.walk(ast.parse(side))
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult)
        for one in (node.left, node.right)
        if isinstance(one, ast.Name)
    }
    return VECTORS | several | crossed


def to_latex(equation: str, vectors: frozenset[str] = VECTORS) -> str:
    """Return an equation as LaTeX; names of ``vectors`` are set bold."""
    sides = (_latex(ast.parse(side, mode="eval").body, vectors) for side in to_python(equation))
    return " = ".join(sides)


def _latex(node: ast.expr, vectors: frozenset[str], level: int = 0) -> str:
    """Return an expression as LaTeX, in parentheses where it binds less than its surroundings."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.Name):
        return _name(node.id, vectors)
    if isinstance(node, ast.UnaryOp):
        text = f"-{_latex(node.operand, vectors, 2)}"
        return _fenced(text) if level > 1 else text
    if isinstance(node, ast.Subscript):
        return f"{_latex(node.value, vectors, 5)}_{{{_latex(node.slice, vectors)}}}"
    if isinstance(node, ast.Call):
        return _call(node, vectors)
    if isinstance(node, ast.BinOp):
        return _operation(node, vectors, level)
    raise ValueError(f"no LaTeX for {ast.dump(node)}")


def _operation(node: ast.BinOp, vectors: frozenset[str], level: int) -> str:
    mine = _LEVEL[type(node.op)]
    if isinstance(node.op, ast.Pow):
        text = f"{_latex(node.left, vectors, 5)}^{{{_latex(node.right, vectors)}}}"
    elif isinstance(node.op, ast.Div):
        text = rf"\frac{{{_latex(node.left, vectors)}}}{{{_latex(node.right, vectors)}}}"
        mine = 3
    else:
        sign = {ast.Add: " + ", ast.Sub: " - ", ast.MatMult: r" \times "}.get(type(node.op))
        if sign is None:  # a product: with a dot between vectors, else without a sign
            both = _is_vector(node.left, vectors) and _is_vector(node.right, vectors)
            sign = r" \cdot " if both else r"\,"
        # The right side of a difference or of a vector product keeps its parentheses.
        beyond = mine + (not isinstance(node.op, ast.Add | ast.Mult))
        right = beyond if not isinstance(node.op, ast.Mult) else mine + isinstance(node.right, ast.BinOp)
        product_of_vectors = sign == r" \cdot " and isinstance(node.left, ast.BinOp)
        left = 3 if product_of_vectors and isinstance(node.left.op, ast.MatMult) else mine
        text = f"{_latex(node.left, vectors, left)}{sign}{_latex(node.right, vectors, right)}"
    return _fenced(text) if mine < level else text


def _call(node: ast.Call, vectors: frozenset[str]) -> str:
    name = node.func.id if isinstance(node.func, ast.Name) else ""
    arguments = [_latex(one, vectors) for one in node.args]
    if name == "turn":
        return rf"R_z\!\left({arguments[1]}\right) {_latex(node.args[0], vectors, 3)}"
    if name == "abs":
        return rf"\left|{arguments[0]}\right|"
    if name == "mean":
        return rf"\left\langle {arguments[0]} \right\rangle"
    shown = _WORDS.get(name) or (_name(name, vectors) if len(name) == 1 else rf"\operatorname{{{name}}}")
    return shown + _fenced(", ".join(arguments))


def _fenced(text: str) -> str:
    return rf"\left({text}\right)"


def _is_vector(node: ast.expr, vectors: frozenset[str]) -> bool:
    """Whether an expression is a vector: a vector, a vector product, or a multiple or sum of these."""
    if isinstance(node, ast.Name):
        return node.id.partition("_")[0] in vectors
    if isinstance(node, ast.UnaryOp):
        return _is_vector(node.operand, vectors)
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id == "turn"
    if isinstance(node, ast.BinOp):
        sides = _is_vector(node.left, vectors), _is_vector(node.right, vectors)
        return isinstance(node.op, ast.MatMult) or (any(sides) and not (isinstance(node.op, ast.Mult) and all(sides)))
    return False


def _name(name: str, vectors: frozenset[str]) -> str:
    base, *marks = name.split("_")
    text = rf"\{_GREEK[base]}" if base in _GREEK else base if len(base) == 1 else rf"\mathrm{{{base}}}"
    if base in vectors:
        text = rf"\boldsymbol{{{text}}}"
    dots = {"dot": r"\dot", "dot2": r"\ddot"}
    for mark in marks:
        if mark in dots:
            text = rf"{dots[mark]}{{{text}}}"
        elif mark == "prime":
            text += "'"
        else:
            text += f"_{{{mark}}}"
    return text
