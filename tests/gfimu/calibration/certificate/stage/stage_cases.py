"""A triad, its calibrations by every method, and the intrinsic parameters, shared by the tests of type B."""

import numpy as np

from gfimu.calibration import METHODS as RECORDS
from gfimu.calibration import ErrorModel, Observations
from tests.gfimu.calibration.calibration_cases import FACES, GRAVITY, MULTI, TWELVE

PERFECT = ErrorModel(np.eye(3), np.zeros(3))
SKEW = ErrorModel(
    np.array([[1.01, 0.01, -0.005], [0.008, 0.99, 0.01], [-0.01, 0.006, 1.02]]), np.array([0.1, -0.2, 0.05])
)
POSES = {"six-position": FACES, "recursive": FACES, "twelve-position": TWELVE, "multi-position": MULTI}
METHODS = {name: (RECORDS[name].fit, poses) for name, poses in POSES.items()}


def calibration_of(name, model=SKEW, **options):
    """Calibration of a triad from readings without error."""
    method, poses = METHODS[name]
    observations = Observations.from_means(model.read(GRAVITY * poses), 1e-6 * np.eye(3))
    return method(observations, gravity=GRAVITY, **options)


def values(calibration):
    return calibration.values


def intrinsic(calibration):
    """Three sensitivities, three angles (xy, xz, yz; rad) and three offsets of the first chip, written out here."""
    model = calibration.models[calibration.chips[0]]
    size = np.linalg.norm(model.sensitivity, axis=1)
    rows = model.sensitivity / size[:, None]
    angles = [np.arccos(rows[i] @ rows[j]) for i, j in ((0, 1), (0, 2), (1, 2))]
    return np.concatenate([size, angles, model.bias])
