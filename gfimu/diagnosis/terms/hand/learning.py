"""Noise of a free body, learnt from what causes leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.coloured_noise import FLICKER_GRID
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.hand.drive import HandDrive
from gfimu.diagnosis.terms.hand.noise import BodyNoise, Projection, learn_motion_noise, white_from_rows
from gfimu.diagnosis.terms.hand.posterior import HandPosterior, condition_hand
from gfimu.diagnosis.terms.library import cause_columns, family_columns

__all__ = ["first_noise", "learnt_noise"]


def first_noise(stretch: BodyStretch) -> BodyNoise:
    """Return the noise to begin with: the data sheet's."""
    white = np.where(stretch.alive, stretch.model.expected_noise(stretch.run.output_data_rate).white, np.inf)
    return BodyNoise.of(white, Policy.usual_flicker / 4, stretch.run.acceleration_error)


def learnt_noise(stretch: BodyStretch, drive: HandDrive, causes: Sequence[Cause], levels: BodyNoise) -> BodyNoise:
    """Learn white noise and what grows with the motion, then the bias instability, then how far that is from all."""
    effects = effects_of(causes, stretch.model.array, stretch.index)
    found = condition_hand(stretch, drive, effects, levels)
    fast = _fast_noise(stretch, found.residual)
    about = condition_hand(stretch, found.drive, effects, replace(fast, flicker=levels.flicker))
    # What a pose decides must not pass for slow noise before its cause is found.
    pose = _of_pose(about, causes)
    level = _instability(replace(about, levels=about.levels.with_instability(1.0)), pose)
    about = replace(about, levels=fast.with_instability(level))
    named = cause_columns(stretch, about.observed, about.drive, causes)
    return replace(about.levels, misfit=about.misfit(named, pose))


def _fast_noise(stretch: BodyStretch, residual: NDArray[np.float64]) -> BodyNoise:
    """Return white noise and what grows with the motion, from a residual (n, c), m/s²."""
    array = stretch.model.array
    expected = stretch.model.expected_noise(stretch.run.output_data_rate)
    sensed = np.hstack([array.axes, array.regression_matrix[:, :3] / array.length_unit]) * stretch.alive[:, None]
    projector = (np.eye(len(sensed)) - sensed @ np.linalg.pinv(sensed)) * stretch.alive
    white = white_from_rows(residual @ projector, projector, stretch.change, stretch.use, expected.white)
    white = np.where(stretch.alive, np.maximum(white, expected.quantum / np.sqrt(12)), np.inf)
    projection = Projection(array, white)
    rows = residual @ projection.rows.T
    return learn_motion_noise(white, projection, rows, stretch.change, stretch.use, stretch.run.acceleration_error)


def _of_pose(at: HandPosterior, causes: Sequence[Cause]) -> Columns:
    """Return the columns of every effect that a pose decides."""
    families = [one for one in at.stretch.model.families().values() if getattr(one, "of_pose", False)]
    parts = [Columns.none(len(at.levels.white), len(at.observed.prediction))]
    parts += [family_columns(at.stretch, at.observed, at.drive, causes, family, {}) for family in families]
    return Columns.together(parts)


def _instability(at: HandPosterior, columns: Columns) -> float:
    """Pick the bias instability by marginal likelihood, columns projected out; ``at`` has that of 1 m/s²."""
    gram, score = at.slow_beside(columns)
    values, turn = np.linalg.eigh(gram)
    power, values = (turn.T @ score) ** 2, np.maximum(values, 0.0)
    likelihood = [
        0.5 * np.sum(level**2 * power / (1 + level**2 * values))
        - 0.5 * np.sum(np.log1p(level**2 * values))
        - 0.5 * ((np.log(level) - np.log(Policy.usual_flicker)) / Policy.flicker_spread) ** 2
        for level in FLICKER_GRID
    ]
    return float(FLICKER_GRID[int(np.argmax(likelihood))])
