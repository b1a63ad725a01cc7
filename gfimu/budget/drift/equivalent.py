"""The constant errors that would explain a position error of a unit at rest.

GF-IMU paper, eq. 30 inverted: δr = ½ b t² + (d × g) t³/6, so that a drift about +y moves the unit along +x and one
about +x along −y.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, Table, figure
from gfimu.base.results import TableResult, text_column
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.motion.earth import EarthRotation
from gfimu.motion.equivalent_errors import equivalent_p_bias, equivalent_rate_drift

__all__ = ["EquivalentErrors", "equivalent_errors"]

_Triple = tuple[float, float, float]
_MG = 1e-3 * STANDARD_GRAVITY


@dataclass(frozen=True)
class EquivalentErrors(Declared, TableResult):
    """The constant errors that would explain a position error of a unit at rest.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.drift_from_position((6.4, 0.0, 0.0), duration=30.0)
    >>> print(f"{found.rate_drift_deg_h[1]:.1f} °/h about y, or {found.bias_mg[0]:.2f} mg")
    29.9 °/h about y, or 1.45 mg
    """

    position_m: Annotated[_Triple, figure("The position error, z up.", "m")]
    time_s: Annotated[float, figure("Time since the start of navigation.", "s")]
    known_bias_mg: Annotated[_Triple, figure("Known bias of p.", "mg")]
    left_m: Annotated[_Triple, figure("Position error without its share.", "m")]
    bias_mg: Annotated[_Triple, figure("Bias of p that explains the whole error.", "mg")]
    rate_drift_deg_h: Annotated[
        _Triple, figure("Drift about x, y, z that explains the rest of it; about z none can.", "°/h")
    ]
    earth_rate_deg_h: Annotated[
        float | None, figure("Horizontal part of the Earth's rate; null without a latitude.", "°/h")
    ] = None
    earth_share_m: Annotated[float | None, figure("Its share of the position error; null without a latitude.", "m")] = (
        None
    )

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per axis: position error, bias of p and rate drift that would explain it."""
        names = ("position_m", "left_m", "bias_mg", "rate_drift_deg_h")
        return {"axis": text_column("xyz")} | {name: np.array(getattr(self, name)) for name in names}

    def _heading(self) -> str:
        return f"Errors that would explain the position after {self.time_s:g} s"

    def _facts(self) -> tuple[()]:
        return ()

    def shown(self) -> Iterator[Table | str]:
        """Yield the errors by axis, and the share of the Earth's rate."""
        rows = [
            ("position error, m", *_numbers(self.position_m)),
            ("bias of p that explains it, mg: 2 r/t²", *_numbers(self.bias_mg)),
        ]
        if any(self.known_bias_mg):
            rows.append(("known bias of p, mg", *_numbers(self.known_bias_mg)))
            rows.append(("position error without its share, m", *_numbers(self.left_m)))
        rows.append(("drift about the axis, °/h: 6 r/(g t³)", *_numbers(self.rate_drift_deg_h[:2]), "none"))
        yield Table(f"What explains a position error after {self.time_s:g} s at rest", ("", "x", "y", "z"), rows)
        if self.earth_share_m is not None:
            yield (
                f"The Earth's rate has {self.earth_rate_deg_h:.3g} °/h in the horizontal: {self.earth_share_m:.3g} m "
                "in a unit that takes the Earth for still, in a direction that its heading decides."
            )


def _numbers(values: tuple[float, ...]) -> list[str]:
    return [f"{value:.4g}" for value in values]


def equivalent_errors(
    position: _Triple, time: float, *, known_bias_mg: _Triple, latitude: float | None, gravity: float
) -> EquivalentErrors:
    """Return the errors that explain a position error, m, after a time, s; raises `InputError` if it is not positive.

    The share of a known bias of p, mg, is taken off before the drift is worked out; a latitude, degrees, gives the
    share of the Earth's rate.
    """
    bias = equivalent_p_bias(position, time) / _MG
    left = np.asarray(position, dtype=float) - 0.5 * np.asarray(known_bias_mg, dtype=float) * _MG * time**2
    along_x, along_y, _ = equivalent_rate_drift(left, time, gravity=gravity).tolist()
    earth = share = None
    if latitude is not None:
        rate = EarthRotation(latitude).horizontal_rate  # rad/s
        earth, share = math.degrees(rate) * 3600.0, gravity * rate * time**3 / 6.0
    drift = (0.0 - along_y, along_x, 0.0)
    return EquivalentErrors(
        _triple(position), time, _triple(known_bias_mg), _triple(left), _triple(bias), drift, earth, share
    )


def _triple(values: Any) -> _Triple:
    x, y, z = map(float, values)
    return x, y, z
