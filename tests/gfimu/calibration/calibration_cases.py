"""Poses, simulated observations and the test of honest standard deviations, shared by the calibration tests."""

import itertools

import numpy as np

from gfimu.calibration import CalibrationTask, ErrorModel, Observations, calibration_method, run_calibration

GRAVITY = 9.81
FACES = np.concatenate([np.eye(3), -np.eye(3)])
EDGES = np.array([v for v in itertools.product((-1, 0, 1), repeat=3) if np.abs(v).sum() == 2]) / np.sqrt(2)
CORNERS = np.array(list(itertools.product((-1, 1), repeat=3))) / np.sqrt(3)
MULTI = np.concatenate([FACES, EDGES])
TWELVE = np.concatenate([FACES, EDGES[[0, 1, 4, 6, 8, 11]]])


def calibrate(method, recording, **settings):
    """Calibrate by the name of a method, with fields of its task."""
    return run_calibration(calibration_method(method), CalibrationTask(recording, **settings))


def simulate(model, directions, rng, *, sigma=0.002, tilt=0.0, gravity=GRAVITY, unit="m_s2"):
    """Averaged observations of poses, each tilted by ``tilt`` rad per axis and with noise ``sigma`` on its mean."""
    true = directions + np.cross(rng.normal(0.0, 1.0, directions.shape) * tilt, directions)
    true = gravity * true / np.linalg.norm(true, axis=1, keepdims=True)
    readings = model.read(true) + rng.normal(0.0, sigma, directions.shape)
    return Observations.from_means(readings, sigma**2 * np.eye(3), unit=unit)


def chips_in_gauge(array, rng, *, scale=1.0, spread=0.01):
    """Random error models whose mean rotation against the drawing is zero, as the gauge wants it."""
    relative = np.eye(3) + rng.normal(0, spread, (len(array.chips), 3, 3))  # A_iᵀ M_i A_i
    antisymmetric = (relative - relative.swapaxes(1, 2)) / 2
    relative = relative - antisymmetric.mean(axis=0)
    return [
        ErrorModel(scale * chip.axes @ inner @ chip.axes.T, scale * rng.normal(0, 0.3, 3))
        for chip, inner in zip(array.chips, relative, strict=True)
    ]


def poses_of(array, models, directions, rng, sigma):
    means = np.hstack(
        [model.read(GRAVITY * directions @ chip.axes.T) for chip, model in zip(array.chips, models, strict=True)]
    )
    means = means + rng.normal(0, sigma, means.shape)
    return Observations.from_means(means, sigma**2 * np.eye(means.shape[1]), channels=array.channels)


def assert_honest(errors, std):
    """Normalised errors have unit variance and 95 % intervals cover 92 to 98 %.

    ``errors`` and ``std`` have one row per run. The variance of a sample variance is 2/(n − 1): four of its standard
    deviations are allowed to the largest of some ten parameters.
    """
    normalised = errors / std
    runs = len(normalised)
    assert runs >= 200
    limit = 4.0 * np.sqrt(2.0 / (runs - 1))
    np.testing.assert_allclose(normalised.var(axis=0), 1.0, atol=limit)
    np.testing.assert_allclose(normalised.mean(axis=0), 0.0, atol=4.0 / np.sqrt(runs))
    coverage = np.mean(np.abs(normalised) < 1.96)
    assert 0.92 < coverage < 0.98
