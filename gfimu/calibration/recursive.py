"""Recursive least squares on the inverse model a = Q l − B', one reading after another.

Source: Persian calibration paper, section 2.3.3, eqs 9-16. The state is kept as the square root of the information
(a triangular matrix updated by orthogonal transformations), which equals the paper's recursion of gain K_n and
covariance P_n but needs no guess of P_0 and loses no digits: at the end it is the batch solution.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from gfimu.base.errors import InputError
from gfimu.calibration.coverage import fit_sphere
from gfimu.calibration.error_model import ErrorModel, free_elements
from gfimu.calibration.fit_quality import covariance_scale
from gfimu.calibration.known_poses import face_poses
from gfimu.calibration.nonlinearity import quadratic_statement
from gfimu.calibration.observations import Observations
from gfimu.calibration.parameter_names import parameter_names, quadratic_names
from gfimu.calibration.result import Calibration

__all__ = ["RecursiveCalibrator", "recursive"]

Floats = NDArray[np.float64]

_RANK_TOLERANCE = 1e-10
_ATTENUATION = (
    "noise in the readings enters the regressors: with raw samples the scale is biased low by about noise variance "
    "over signal variance; averaged poses avoid it"
)


class RecursiveCalibrator:
    """Calibration that grows with the data: feed readings of known poses, ask for the result at any time.

    Parameters
    ----------
    nominal_scale : float
        Reading units per m/s², to turn the covariance of a reading into that of a specific force.
    gauge : {"poses", "x_axis", "z_axis"}
        ``poses`` estimates all 12 parameters, the others a triangular Q with 9.
    quadratic_std : array_like, shape (3,), optional
        Prior of the quadratic coefficients of the axes, 1 per reading unit; not given: the axes are straight.
    centre : array_like, shape (3,)
        Reading at zero input, about which they bend: a coarse bias.
    """

    def __init__(
        self,
        nominal_scale: float,
        *,
        gauge: str = "poses",
        quadratic_std: ArrayLike | None = None,
        centre: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        if not nominal_scale > 0.0:
            raise InputError("the nominal scale must be positive: reading units per m/s²")
        self.gauge = gauge
        self.nominal_scale = nominal_scale
        self._elements = free_elements(gauge)
        self._centre = np.asarray(centre, dtype=float)
        prior = np.empty(0) if quadratic_std is None else np.asarray(quadratic_std, dtype=float)
        self._bends = len(prior)
        size = len(self._elements) + 3 + self._bends
        self._root = np.zeros((size, size + 1))  # [R | R Φ]: information square root and right-hand side
        self._root[range(size - self._bends, size), range(size - self._bends, size)] = 1.0 / prior
        self._residual_square = 0.0
        self.count = 0

    def update(self, reading: ArrayLike, reference: ArrayLike, covariance: ArrayLike) -> None:
        """Add one reading.

        Parameters
        ----------
        reading : array_like, shape (3,)
            Reading l of the triad.
        reference : array_like, shape (3,)
            Known specific force z, m/s².
        covariance : array_like, shape (3, 3)
            Covariance of the reading, reading unit squared.
        """
        l = np.asarray(reading, dtype=float)  # noqa: E741  the paper's symbol
        h = np.zeros((3, len(self._root)))
        for column, (i, j) in enumerate(self._elements):
            h[i, column] = l[j]  # eq. 13
        place = len(self._elements)
        h[:, place : place + 3] = -np.eye(3)
        if self._bends:  # a = Q (l − q (l − b)²) − B', the bend by the nominal scale
            h[:, place + 3 :] = -np.diag((l - self._centre) ** 2) / self.nominal_scale
        noise_root = np.linalg.cholesky(np.asarray(covariance, dtype=float)) / self.nominal_scale
        rows = np.linalg.solve(noise_root, np.column_stack([h, np.asarray(reference, dtype=float)]))
        stacked = np.asarray(np.linalg.qr(np.vstack([self._root, rows]), mode="r"), dtype=np.float64)
        size = len(self._root)
        self._root = stacked[:size]
        if stacked.shape[0] > size:
            self._residual_square += float(stacked[size, size] ** 2)
        self.count += 1

    @property
    def determined(self) -> bool:
        """Whether the readings so far determine every parameter."""
        triangle = self._root[:, :-1]
        scale = np.linalg.norm(triangle, axis=0)
        return bool(np.all(scale > 0.0) and np.linalg.cond(triangle / scale) < 1.0 / _RANK_TOLERANCE)

    @property
    def estimate(self) -> Floats:
        """Parameters Φ of the inverse model: elements of Q, then B', shape (12,) or (9,)."""
        triangle, scale = self._scaled()
        return np.asarray(np.linalg.solve(triangle, self._root[:, -1]) / scale, dtype=np.float64)

    @property
    def covariance(self) -> Floats:
        """Covariance P_n of the parameters Φ."""
        triangle, scale = self._scaled()
        root = np.linalg.inv(triangle) / scale[:, None]
        return np.asarray(root @ root.T, dtype=np.float64)

    @property
    def redundancy(self) -> int:
        """Scalar readings beyond the number of parameters."""
        return max(3 * self.count + self._bends - len(self._root), 0)

    @property
    def variance_factor(self) -> float:
        """Weighted residual square over the redundancy; NaN without redundancy."""
        return self._residual_square / self.redundancy if self.redundancy else float("nan")

    def _scaled(self) -> tuple[Floats, Floats]:
        if not self.determined:
            raise InputError(f"{self.count} readings do not determine the parameters yet; add readings of other poses")
        triangle = self._root[:, :-1]
        scale = np.linalg.norm(triangle, axis=0)
        return triangle / scale, scale

    def calibration(
        self,
        *,
        unit: str,
        channels: tuple[str, ...],
        gravity: float,
        input_kind: str = "raw",
        misfit: tuple[float, int, float | None] | None = None,
    ) -> Calibration:
        """Return the calibration from the readings so far.

        Parameters
        ----------
        unit : str
            Reading unit.
        channels : tuple of str
            Names of the three channels.
        gravity : float
            Local gravity, m/s².
        input_kind : str
            What the readings are.
        misfit : tuple, optional
            Variance factor, redundancy and learned factor for `gfimu.calibration.fit_quality.covariance_scale`; by
            default those of the readings.

        Raises
        ------
        InputError
            If they don't determine it yet.
        """
        values, jacobian = self._forward_parameters()
        factor, redundancy, learned = misfit or (self.variance_factor, self.redundancy, None)
        scale, warnings = covariance_scale(factor, redundancy, learned)
        bends = quadratic_names((channels[0][:-1],)) if self._bends else ()
        return Calibration(
            "recursive",
            unit,
            channels,
            self.gauge,
            gravity,
            (*parameter_names(channels[0][:-1], self.gauge), *bends),
            values,
            jacobian @ self.covariance @ jacobian.T * scale,
            statements=(
                "a tilt of the table or of a face goes into the misalignments: the faces must be level",
                _ATTENUATION,
            ),
            warnings=warnings,
            statistics={
                "readings": float(self.count),
                "redundancy": float(redundancy),
                "variance_factor": factor,
                "covariance_factor": scale,
                "input": input_kind,
            },
        )

    def _forward_parameters(self) -> tuple[Floats, Floats]:
        """Parameters of l = M a + b, and their derivatives by Φ."""
        estimate = self.estimate
        q = np.zeros((3, 3))
        for value, (i, j) in zip(estimate, self._elements, strict=False):
            q[i, j] = value
        offset = estimate[len(self._elements) : len(self._elements) + 3]
        m = np.asarray(np.linalg.inv(q), dtype=np.float64)
        model = ErrorModel(m, m @ offset)  # a = Q (l − b) with b = Q⁻¹ B'
        columns = []
        for i, j in self._elements:
            change = -np.outer(m[:, i], m[j])  # dM = −M dQ M
            columns.append(np.concatenate([[change[k] for k in self._elements], change @ offset]))
        columns.extend(np.concatenate([np.zeros(len(self._elements)), m[:, axis]]) for axis in range(3))
        jacobian = block_diag(np.column_stack(columns), np.eye(self._bends))
        return np.concatenate([model.parameters(self.gauge), estimate[len(estimate) - self._bends :]]), jacobian


def recursive(observations: Observations, *, gravity: float, gauge: str = "poses") -> Calibration:
    """Calibrate one triad by recursive least squares over known poses.

    Parameters
    ----------
    observations : Observations
        Rows of one triad, taken in order; poses that are no face are left out.
    gravity : float
        Local gravity, m/s².
    gauge : {"poses", "x_axis", "z_axis"}
        ``poses`` estimates all 12 parameters, the others a triangular M with 9.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If a face is missing.
    """
    kept, references = face_poses(observations, gravity)
    centre, radius = fit_sphere(kept.means)
    calibrator = RecursiveCalibrator(
        radius / float(np.linalg.norm(references, axis=1).mean()),
        gauge=gauge,
        quadratic_std=kept.quadratic_prior if kept.bends else None,
        centre=centre,
    )
    for reading, pose in zip(kept.readings, kept.pose, strict=True):
        calibrator.update(reading, references[pose], kept.covariance[pose])
    result = calibrator.calibration(
        unit=observations.unit,
        channels=observations.channels,
        gravity=gravity,
        input_kind=observations.kind,
        misfit=_pose_misfit(calibrator, kept, references, centre),
    )
    return replace(result, statements=(*result.statements, *quadratic_statement(observations)))


def _pose_misfit(
    calibrator: RecursiveCalibrator, kept: Observations, references: Floats, centre: Floats
) -> tuple[float, int, float | None]:
    """Variance factor of the pose means and its degrees of freedom: many samples per pose must not hide that."""
    whole = RecursiveCalibrator(
        calibrator.nominal_scale,
        gauge=calibrator.gauge,
        quadratic_std=kept.quadratic_prior if kept.bends else None,
        centre=centre,
    )
    for reading, reference, spread in zip(kept.means, references, kept.mean_covariance, strict=True):
        whole.update(reading, reference, spread)
    return whole.variance_factor, whole.redundancy, kept.variance_factor
