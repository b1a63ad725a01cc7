"""Under `gfimu drift --from-position`: the constant errors that would explain a position error of a unit at rest."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.commands.former_arguments import former_arguments
from gfimu.results import TableResult, text_column

__all__ = ["EquivalentErrors", "drift_from_position"]


@dataclass(frozen=True)
class EquivalentErrors(TableResult):
    """The constant errors that would explain a position error of a unit at rest.

    Parameters
    ----------
    position_m : tuple of float
        Position error x, y, z, m, z up.
    time_s : float
        Time since the start of navigation, s.
    known_bias_mg : tuple of float
        Bias of p that is known, mg; its share was taken off before the drift was worked out.
    left_m : tuple of float
        Position error without that share, m.
    bias_mg : tuple of float
        Bias of p that would explain the whole error, mg.
    rate_drift_deg_h : tuple of float
        Drift about x, y, z that would explain what the known bias leaves, °/h; about z none can, as it moves nothing.
    earth_rate_deg_h, earth_share_m : float or None
        Horizontal part of the Earth's rate, °/h, and the position error that it makes in a unit that takes the Earth
        for still, m; None without a latitude.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.drift_from_position((6.4, 0.0, 0.0), time=30.0)
    >>> print(f"{found.rate_drift_deg_h[1]:.1f} °/h about y, or {found.bias_mg[0]:.2f} mg")
    29.9 °/h about y, or 1.45 mg
    """

    position_m: tuple[float, float, float]
    time_s: float
    known_bias_mg: tuple[float, float, float]
    left_m: tuple[float, float, float]
    bias_mg: tuple[float, float, float]
    rate_drift_deg_h: tuple[float, float, float]
    earth_rate_deg_h: float | None
    earth_share_m: float | None

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per axis: position error, bias of p and rate drift that would explain it."""
        return {
            "axis": text_column("xyz"),
            "position_m": np.array(self.position_m),
            "left_m": np.array(self.left_m),
            "bias_mg": np.array(self.bias_mg),
            "rate_drift_deg_h": np.array(self.rate_drift_deg_h),
        }

    def _heading(self) -> str:
        return f"Errors that would explain the position after {self.time_s:g} s"

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``gfimu drift --from-position --json``."""
        return asdict(self)


@former_arguments(time="duration")
def drift_from_position(
    from_position: tuple[float, float, float],
    *,
    duration: float = 30.0,
    known_bias_mg: tuple[float, float, float] = (0.0, 0.0, 0.0),
    latitude: float | None = None,
    gravity: float = 9.80665,
) -> EquivalentErrors:
    """Compute the bias of p and the error of the rate that would explain a measured position error of a unit at rest.

    Parameters
    ----------
    from_position : tuple of float
        Position error x, y, z after the duration, m; the axes are level, z is up (``--from-position``).
    duration : float
        Time since the start of navigation, s.
    known_bias_mg : tuple of float
        Bias of p that is known, such as table 1 of the GF-IMU paper, mg; its ½ b t² is taken off first.
    latitude : float, optional
        Latitude, degrees, for the share of the Earth's rate.
    gravity : float
        Local gravity, m/s².

    Raises
    ------
    InputError
        If the duration is not positive or the latitude out of range.

    Notes
    -----
    GF-IMU paper, eq. 30 inverted: δr = ½ b t² + (d × g) t³/6, so that a drift about +y moves the unit along +x and one
    about +x along −y.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.drift_from_position((6.4, 0.0, 0.0), time=30.0)
    >>> print(f"{found.rate_drift_deg_h[1]:.1f} °/h")
    29.9 °/h
    """
    from gfimu.motion.earth import EarthRotation
    from gfimu.motion.equivalent_errors import equivalent_p_bias, equivalent_rate_drift
    from gfimu.units import STANDARD_GRAVITY

    mg = 1e-3 * STANDARD_GRAVITY
    bias = equivalent_p_bias(from_position, duration) / mg
    left = tuple(r - 0.5 * b * mg * duration**2 for r, b in zip(from_position, known_bias_mg, strict=True))
    along_x, along_y, _ = (float(one) for one in equivalent_rate_drift(left, duration, gravity=gravity))
    earth = share = None
    if latitude is not None:
        rate = EarthRotation(latitude).horizontal_rate  # rad/s
        earth, share = math.degrees(rate) * 3600.0, gravity * rate * duration**3 / 6.0
    return EquivalentErrors(
        position_m=tuple(map(float, from_position)),  # type: ignore[arg-type]
        time_s=duration,
        known_bias_mg=tuple(map(float, known_bias_mg)),  # type: ignore[arg-type]
        left_m=left,  # type: ignore[arg-type]
        bias_mg=tuple(map(float, bias)),  # type: ignore[arg-type]
        rate_drift_deg_h=(0.0 - along_y, along_x, 0.0),
        earth_rate_deg_h=earth,
        earth_share_m=share,
    )
