"""Expanded uncertainties of certificates cover the truth, errors of stage, gravity and noise together."""

from dataclasses import replace

import numpy as np
import pytest

from gfimu.calibration import Observations, Stage, certify, stage_components
from gfimu.calibration.certificate.quantities import stated_quantities
from gfimu.calibration.certificate.stage.simulated_calibration import poses_of
from gfimu.calibration.certificate.stage.stage_errors import draw_errors, specific_force
from tests.gfimu.calibration.calibration_cases import GRAVITY
from tests.gfimu.calibration.certificate.stage.stage_cases import METHODS, SKEW, calibration_of

NOISE = 1e-3  # of a mean, m/s²
CASES = {
    "levelling": ("six-position", {"pose_tilt_std_rad": 1e-3}, {}),
    "levelling in the fit": ("six-position", {"pose_tilt_std_rad": 1e-3}, {"levelling_std_rad": 1e-3}),
    "noise": ("six-position", {"pose_tilt_std_rad": 2e-5}, {}),
    "magnitudes": ("multi-position", {"pose_tilt_std_rad": 1e-3}, {}),
    "twelve": ("twelve-position", {"pose_tilt_std_rad": 1e-3}, {}),
}


def coverage(name, keys, options, *, runs, explained=True):
    """Share of runs in which each uncertain term lies within U of the truth, shape (t,)."""
    rng, (method, _) = np.random.default_rng(9), METHODS[name]
    stage = Stage(stage="s", gravity_std_m_s2=1e-3, **keys)
    ideal = calibration_of(name, **options)
    ideal = replace(ideal, statistics={**ideal.statistics, "a1_mean_noise_m_s2": NOISE})
    poses, truth = poses_of(ideal), stated_quantities(ideal).values
    found = stage_components(ideal, stage, rng=rng, runs=100)
    force = specific_force(poses, draw_errors(stage, poses, runs, rng), GRAVITY)
    inside = []
    for one in force:
        readings = SKEW.read(one) + rng.normal(0.0, NOISE, one.shape)
        fit = method(Observations.from_means(readings, NOISE**2 * np.eye(3)), gravity=GRAVITY, **options)
        misfit = found.misfit if explained else 0.0
        terms = certify(fit, components=found.components, explained_misfit=misfit).terms
        stated = [(term.value, term.expanded or 0.0) for term in terms if term.value is not None]
        value, expanded = np.array(stated).T
        inside.append((np.abs(value - truth) <= expanded)[expanded > 0.0])
    return np.mean(inside, axis=0)


@pytest.mark.study
@pytest.mark.parametrize("case", CASES)
def test_expanded_uncertainties_cover_95_per_cent(case):
    found = coverage(*CASES[case], runs=300)
    assert 0.92 < found.mean() < 0.98
    assert found.min() > 0.95 - 4.0 * np.sqrt(0.95 * 0.05 / 300)


def test_a_misfit_that_the_stage_explains_is_not_counted_twice():
    once, twice = (coverage(*CASES["levelling"], runs=60, explained=explained) for explained in (True, False))
    assert once.mean() < 0.99 < twice.mean()
