"""What a tilt of a pose does to its readings, by turning the specific force itself."""

import numpy as np
from scipy.spatial.transform import Rotation

from gfimu.calibration import ErrorModel, levelling_covariance


def test_the_covariance_of_each_row_is_that_of_readings_at_tilted_poses():
    """Poses of unlike size of the specific force: each row is weighed by its own."""
    rng = np.random.default_rng(5)
    model = ErrorModel(np.eye(3) + 0.1 * rng.normal(size=(3, 3)), np.array([0.3, -0.2, 0.1]))
    references = np.array([[9.8, 0.0, 0.0], [0.0, -9.8, 0.0], [3.0, 4.0, 12.0]])
    tilt = 1e-6
    covariance = levelling_covariance(model, references, tilt)
    for reference, stated in zip(references, covariance, strict=True):
        turned = Rotation.from_rotvec(tilt * np.eye(3)).apply(reference) - reference  # of each axis one tilt
        moved = turned @ model.sensitivity.T
        np.testing.assert_allclose(stated, moved.T @ moved, rtol=1e-4, atol=1e-16)
