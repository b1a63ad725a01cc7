"""Calibrations with a known model and covariance, written in any gauge."""

import numpy as np
from scipy.spatial.transform import Rotation

from gfimu import Calibration
from gfimu.calibration import ErrorModel
from gfimu.calibration.parameter_names import parameter_names, quadratic_names

PARAMETERS = 15
"""Of one chip with a full matrix: nine of M, three of b, three of q."""


def random_model(rng, scale=1.0):
    """Return a triad with gains, misalignments and biases of some percent."""
    sensitivity = scale * (np.eye(3) + 0.03 * rng.standard_normal((3, 3)))
    return ErrorModel(sensitivity, scale * 0.5 * rng.standard_normal(3), 1e-4 / scale * rng.standard_normal(3))


def random_covariance(rng, scale=1.0):
    """Return a covariance of M, b, q of a chip: strongly correlated, of usual sizes."""
    root = rng.standard_normal((PARAMETERS, PARAMETERS)) / np.sqrt(PARAMETERS)
    sizes = np.concatenate([np.full(9, 2e-4 * scale), np.full(3, 1e-3 * scale), np.full(3, 2e-5 / scale)])
    return sizes[:, None] * (root @ root.T + 0.1 * np.eye(PARAMETERS)) * sizes


def turned(model, rotation):
    """Return the same triad on another fixture: M R."""
    return ErrorModel(model.sensitivity @ rotation, model.bias, model.quadratic)


def random_rotation(rng):
    return Rotation.random(rng=rng).as_matrix()


def parameters_in(model, gauge, rotation=None):
    """Parameters of a model in a gauge: turned onto another fixture first, made triangular where the gauge is."""
    written = model if rotation is None else turned(model, rotation)
    written = written.in_gauge(gauge) if gauge in {"x_axis", "z_axis"} else written
    return np.concatenate([written.parameters(gauge), model.quadratic])


def calibration_of(model, covariance, gauge="poses", *, rotation=None, statistics=None, unit="m_s2", quadratic=True):
    """Return the calibration of a chip in a gauge; its covariance by differences, independently of the package."""
    full = np.concatenate([model.parameters("poses"), model.quadratic])

    def written(values):
        return parameters_in(ErrorModel(values[:9].reshape(3, 3), values[9:12], values[12:]), gauge, rotation)

    steps = 1e-5 * np.maximum(np.abs(full), 1e-3 * np.abs(full).max())
    jacobian = np.column_stack(
        [(written(full + step) - written(full - step)) / (2.0 * step.max()) for step in np.diag(steps)]
    )
    names = parameter_names("a1", gauge) + quadratic_names(("a1",))
    count = len(names) if quadratic else len(names) - 3
    return Calibration(
        "six-position",
        unit,
        ("a11", "a12", "a13"),
        gauge,
        9.81,
        names[:count],
        written(full)[:count],
        (jacobian @ covariance @ jacobian.T)[:count, :count],
        statistics=statistics or {"poses": 18.0, "redundancy": 9.0, "covariance_factor": 1.0},
    )
