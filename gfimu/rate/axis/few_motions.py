"""Which motions an array of rank below six determines, with their standard deviations, as text for messages."""

from __future__ import annotations

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.array.observability import MOTION_NAMES, RANK_TOLERANCE, unseen_motions
from gfimu.array.parts.part import white_noise_std
from gfimu.base.errors import GeometryError, InputError
from gfimu.recording import Recording

__all__ = ["require_motions_of_samples"]


def require_motions_of_samples(array: AccelerometerArray, recording: Recording) -> None:
    """Refuse an array of low rank: the motions that single samples give with their σ, those they don't, what helps.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    recording : Recording
        A recording of it, whose sample rate sets the white noise of its samples by the data sheets.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.
    """
    if not (unseen := unseen_motions(array)):
        return
    try:
        noise = white_noise_std(array, recording.sample_rate)
    except InputError:  # a part without data sheet
        noise = np.full(array.n_channels, np.nan)
    scale = np.array([array.length_unit] * 3 + [1.0] * 3)
    inverse = np.linalg.pinv(array.regression_matrix / scale, rcond=RANK_TOLERANCE) / scale[:, None]  # (6, c)
    resolution = inverse @ array.regression_matrix * (scale / scale[:, None])
    std = np.sqrt(inverse**2 @ noise**2)
    given = [
        f"{name} (σ {std[index]:.2g} {'rad/s²' if index < 3 else 'm/s²'})" if np.isfinite(std[index]) else name
        for index, name in enumerate(MOTION_NAMES)
        if np.allclose(resolution[index], np.eye(6)[index], atol=1e-6)
    ]
    if whole := [chip.name for chip in array.chips if np.linalg.matrix_rank(chip.axes) == 3]:
        given.append(f"the specific force at {', '.join(whole)}")
    gives = f"gives {', '.join(given)} per sample, but " if given else ""
    raise GeometryError(
        f"array {array.name!r} (rank {6 - len(unseen)} of 6, {array.n_channels} channels) {gives}can't see "
        f"{'; '.join(unseen)}, and so no rate and no attitude; where it turns about one axis, give that (--axis z, "
        "with --axis-point if it doesn't pass the body's origin): rate and angle about it follow; else add sensing axes"
    )
