"""What a reader of an exported calibration should know of it."""

from __future__ import annotations

from gfimu.calibration.error_model import GAUGES
from gfimu.calibration.parameter_names import kind_of
from gfimu.calibration.result import Calibration

__all__ = ["notes_of"]


def notes_of(calibration: Calibration) -> list[str]:
    """Return where a calibration comes from, its frame, what the format leaves out, its statements and warnings."""
    made = f"gfimu calibration, method {calibration.method}, g = {calibration.gravity:.9g} m/s^2"
    frame = f"frame of the calibrated values: {GAUGES[calibration.gauge]}"
    bends = "".join(kind for kind in "qc" if any(kind_of(name) == kind for name in calibration.names))
    lost = {"q": "quadratic coefficients q are", "c": "cubic coefficients c are", "qc": "coefficients q and c are"}
    left_out = [f"non-linearity: the {lost[bends]} left out; M and b are those at zero input"] if bends else []
    return [made, frame, *left_out, *calibration.statements, *(f"warning: {text}" for text in calibration.warnings)]
