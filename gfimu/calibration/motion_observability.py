"""Which combinations of positions and biases a motion does not determine, in words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray

__all__ = ["describe_null_space"]

Floats = NDArray[np.float64]


def describe_null_space(null_space: Floats, array: AccelerometerArray) -> tuple[str, ...]:
    """Put the undetermined directions into words.

    Parameters
    ----------
    null_space : ndarray, shape (3k + c, m)
        Directions of positions (chip by chip) and biases.
    array : AccelerometerArray
        The array.

    Returns
    -------
    tuple of str
        First how many combinations are undetermined, then each known pattern that lies in that space.
    """
    k, c = len(array.chips), array.n_channels
    found = null_space.shape[1]
    if not found:
        return ("all positions and biases are determined by this motion",)
    total = 3 * k + c
    texts = [
        f"{found} of {total} combinations of positions and biases are not determined by this motion; they stay put"
    ]
    basis = np.linalg.qr(null_space / np.linalg.norm(null_space, axis=0))[0]
    patterns: list[tuple[str, Floats]] = []
    for axis in range(3):
        shift = np.zeros((k, 3))
        shift[:, axis] = 1.0
        patterns.append((f"a common shift of all positions along {'xyz'[axis]}", np.r_[shift.ravel(), np.zeros(c)]))
    for axis, name in enumerate("xyz"):
        single = []
        for chip in range(k):
            one = np.zeros(3 * k + c)
            one[3 * chip + axis] = 1.0
            single.append(_inside(basis, one))
        if all(single):
            patterns = [item for item in patterns if not item[0].endswith(f"along {name}")]
            texts.append(f"not determined: the {name} position of every chip")
    for axis in range(3):
        for column, meaning in ((axis, "angular acceleration α"), (3 + axis, "specific force p")):
            bias = array.regression_matrix[:, column]
            patterns.append((f"biases that look like the {meaning}_{'xyz'[axis]}", np.r_[np.zeros(3 * k), bias]))
    texts.extend(f"not determined: {name}" for name, pattern in patterns if _inside(basis, pattern))
    return tuple(texts)


def _inside(basis: Floats, direction: Floats) -> bool:
    unit = direction / np.linalg.norm(direction)
    return bool(np.linalg.norm(basis.T @ unit) > 1.0 - 1e-6)
