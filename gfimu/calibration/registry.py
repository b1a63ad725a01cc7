"""The calibration methods by name, one record each: what it needs, what it estimates, where its equations are from.

The records name their functions instead of importing them, so that a command can list the methods without loading
any of them.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from gfimu.base.errors import check_name

__all__ = ["METHODS", "CalibrationMethod", "calibration_method"]


@dataclass(frozen=True)
class CalibrationMethod:
    """One calibration method.

    Parameters
    ----------
    name : str
        Name for `calibrate`, and in the result.
    function : str
        The fit, as ``module:function``.
    runner : str
        What turns a recording into the input of that fit, as ``module:function``: called with the record and a
        `gfimu.calibration.methods.CalibrationTask`, it returns a `Calibration`.
    needs : str
        Poses or motion that the recording must hold.
    estimates : str
        Parameters that come out.
    source : str
        Paper and equations.
    gauges : mapping of int to str
        Number of parameters per triad, with the gauge (`gfimu.calibration.error_model.GAUGES`) that each implies; the
        first is the default. Empty where the method has only one model.
    options : frozenset of str
        Optional fields of the task that the method uses.
    min_rest_s : float
        Default of the shortest pose, s.
    """

    name: str
    function: str
    runner: str
    needs: str
    estimates: str
    source: str
    gauges: Mapping[int, str] = field(default_factory=dict)
    options: frozenset[str] = frozenset()
    min_rest_s: float = 1.0

    @property
    def fit(self) -> Any:
        """The function that fits."""
        return pkgutil.resolve_name(self.function)

    @property
    def run(self) -> Any:
        """The function that prepares the input of the fit and calls it."""
        return pkgutil.resolve_name(self.runner)


_TRIADS = "gfimu.calibration.methods:calibrate_triads"

_RECORDS = (
    CalibrationMethod(
        "six-position",
        "gfimu.calibration.six_position:six_position",
        _TRIADS,
        needs="six faces, level",
        estimates="M and b of each chip",
        source="Persian calibration paper, section 2.3.1, eqs 5-8",
        gauges={12: "poses", 9: "x_axis"},
        options=frozenset({"n_parameters", "input_kind", "levelling_std_rad"}),
    ),
    CalibrationMethod(
        "recursive",
        "gfimu.calibration.recursive:recursive",
        _TRIADS,
        needs="six faces, level",
        estimates="M and b of each chip, by way of the inverse model",
        source="Persian calibration paper, section 2.3.3, eqs 9-16",
        gauges={12: "poses", 9: "x_axis"},
        options=frozenset({"n_parameters", "input_kind"}),
    ),
    CalibrationMethod(
        "multi-position",
        "gfimu.calibration.multi_position:multi_position",
        _TRIADS,
        needs="nine or more poses, any direction",
        estimates="triangular M and b of each chip",
        source="Persian calibration paper, section 2.3.2",
        gauges={9: "x_axis", 12: "coarse"},
        options=frozenset({"n_parameters", "input_kind"}),
    ),
    CalibrationMethod(
        "twelve-position",
        "gfimu.calibration.twelve_position:twelve_position",
        _TRIADS,
        needs="six faces and six others",
        estimates="M and b of each chip, the common rotation from the faces",
        source="Chinese calibration paper",
        gauges={12: "coarse", 9: "x_axis"},
        options=frozenset({"n_parameters", "input_kind", "levelling_std_rad"}),
    ),
    CalibrationMethod(
        "array",
        "gfimu.calibration.array_calibration:calibrate_array",
        "gfimu.calibration.methods:calibrate_whole_array",
        needs="nine or more poses, any direction; one or more to update an earlier calibration",
        estimates="M and b of all chips in one body frame, positions where there is motion",
        source="conditions |a_1| = g and a_i = a_1, gfimu.calibration.array_static and array_motion",
        options=frozenset({"array", "motion", "update"}),
        min_rest_s=2.0,
    ),
    CalibrationMethod(
        "spin",
        "gfimu.calibration.spin.fit:spin",
        "gfimu.calibration.methods:calibrate_by_spin",
        needs="a turntable with a tachometer, three or more speeds held",
        estimates="q and c (K2, K3) of every axis across the table's axis, with M and b",
        source="spin reduction of IEEE Std 836",
        options=frozenset({"array", "start", "radius_std_m", "stretch_std_s2_rad2"}),
    ),
    CalibrationMethod(
        "gyro",
        "gfimu.calibration.multi_position:multi_position_gyro",
        "gfimu.calibration.methods:calibrate_reference_gyro",
        needs="rest in any poses, with the columns of a gyro",
        estimates="bias of the reference gyro; M where the noise leaves it visible",
        source="|omega| = Earth's rate, in the form of the Persian calibration paper, section 2.3.2",
    ),
    CalibrationMethod(
        "gyro-rate-table",
        "gfimu.calibration.rate_table:rate_table_gyro",
        "gfimu.calibration.methods:calibrate_on_rate_table",
        needs="stretches of constant rate on a rate table, three mountings or more",
        estimates="M and b of the gyro",
        source="the Persian calibration paper's eqs 5-8, with rates of the table for gravity",
        options=frozenset({"rate_table", "levelling_std_rad"}),
    ),
)

METHODS: Mapping[str, CalibrationMethod] = MappingProxyType({method.name: method for method in _RECORDS})
"""Every calibration method by name."""


def calibration_method(name: str) -> CalibrationMethod:
    """Look up a calibration method; raises `InputError` that lists the methods."""
    check_name("calibration method", name, METHODS)
    return METHODS[name]
