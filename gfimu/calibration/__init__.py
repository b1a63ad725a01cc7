"""Calibration: one error model, one result class, one method per file.

In: recordings of poses, a rate table, a spin or any motion; an earlier calibration to update.
Out: `Calibration` with its covariance, a certificate with its uncertainty budget (`certificate`), files of other
programs (`exporting`). `registry` lists the methods; `method` says what one is, and has one call for all.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.calibration.certificate.certify import certify
    from gfimu.calibration.certificate.comparison import compare
    from gfimu.calibration.certificate.page import certificate_html
    from gfimu.calibration.certificate.stage.components import stage_components
    from gfimu.calibration.certificate.stage.stage import Stage
    from gfimu.calibration.certificate.stage.type_b import type_b
    from gfimu.calibration.check_poses import check_on_poses
    from gfimu.calibration.error_model import ErrorModel, free_elements
    from gfimu.calibration.imu_tk import read_text_triad
    from gfimu.calibration.known_poses import levelling_covariance
    from gfimu.calibration.method import CalibrationTask, run_calibration
    from gfimu.calibration.multi_position import multi_position_gyro
    from gfimu.calibration.observations import Observations, averaged_poses, every_sample
    from gfimu.calibration.registry import METHODS, calibration_method
    from gfimu.calibration.run_file import open_poses, open_uncalibrated
    from gfimu.calibration.spin import SpinPolicy
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
