"""What an array that can't see all six motions gives nevertheless, and how well, in words."""

from __future__ import annotations

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.array.observability import MOTION_NAMES, RANK_TOLERANCE, unseen_motions
from gfimu.array.parts.part import white_noise_std
from gfimu.base.errors import InputError

__all__ = ["few_motions_text"]

_UNITS = ("rad/s²", "m/s²")


def few_motions_text(array: AccelerometerArray, sample_rate: float) -> str:
    """Return one line: the motions that single samples give with their σ, those they don't, and what helps.

    Parameters
    ----------
    array : AccelerometerArray
        An array of low rank.
    sample_rate : float
        Rate of the samples, Hz, which sets their white noise by the data sheets.
    """
    try:
        noise = white_noise_std(array, sample_rate)
    except InputError:  # a part without data sheet
        noise = np.full(array.n_channels, np.nan)
    scale = np.array([array.length_unit] * 3 + [1.0] * 3)
    inverse = np.linalg.pinv(array.regression_matrix / scale, rcond=RANK_TOLERANCE) / scale[:, None]  # (6, c)
    resolution = inverse @ array.regression_matrix * (scale / scale[:, None])
    std = np.sqrt(inverse**2 @ noise**2)
    given = [
        f"{name} (σ {std[index]:.2g} {_UNITS[index // 3]})" if np.isfinite(std[index]) else name
        for index, name in enumerate(MOTION_NAMES)
        if np.allclose(resolution[index], np.eye(6)[index], atol=1e-6)
    ]
    whole = [chip.name for chip in array.chips if np.linalg.matrix_rank(chip.axes) == 3]
    if whole:
        given.append(f"the specific force at {', '.join(whole)}")
    unseen = unseen_motions(array)
    gives = f"gives {', '.join(given)} per sample, but " if given else ""
    return (
        f"array {array.name!r} (rank {6 - len(unseen)} of 6, {array.n_channels} channels) {gives}can't see "
        f"{'; '.join(unseen)}, and so no rate and no attitude; where it turns about one axis, give that (--axis z, "
        "with --axis-point if it doesn't pass the body's origin): rate and angle about it follow; else add sensing axes"
    )
