"""The calibration methods by name, one record each: what it needs, what it estimates, where its equations are from."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from gfimu.base.errors import check_name
from gfimu.calibration.array_calibration import calibrate_array
from gfimu.calibration.method import CalibrationMethod
from gfimu.calibration.multi_position import multi_position, multi_position_gyro
from gfimu.calibration.rate_table import rate_table_gyro
from gfimu.calibration.recursive import recursive
from gfimu.calibration.runners import (
    calibrate_by_spin,
    calibrate_on_rate_table,
    calibrate_reference_gyro,
    calibrate_triads,
    calibrate_whole_array,
)
from gfimu.calibration.six_position import six_position
from gfimu.calibration.spin.fit import spin
from gfimu.calibration.twelve_position import twelve_position

__all__ = ["METHODS", "CalibrationMethod", "calibration_method"]

_ROWS = ("rows", "row_noise_m_s2")

_RECORDS = (
    CalibrationMethod(
        "six-position",
        six_position,
        calibrate_triads,
        needs="six faces, level",
        estimates="M and b of each chip",
        source="Persian calibration paper, section 2.3.1, eqs 5-8",
        gauges={12: "poses", 9: "x_axis"},
        options=frozenset({"n_parameters", "input_kind", *_ROWS, "levelling_std_rad"}),
    ),
    CalibrationMethod(
        "recursive",
        recursive,
        calibrate_triads,
        needs="six faces, level",
        estimates="M and b of each chip, by way of the inverse model",
        source="Persian calibration paper, section 2.3.3, eqs 9-16",
        gauges={12: "poses", 9: "x_axis"},
        options=frozenset({"n_parameters", "input_kind", *_ROWS}),
    ),
    CalibrationMethod(
        "multi-position",
        multi_position,
        calibrate_triads,
        needs="nine or more poses, any direction",
        estimates="triangular M and b of each chip",
        source="Persian calibration paper, section 2.3.2",
        gauges={9: "x_axis", 12: "coarse"},
        options=frozenset({"n_parameters", "input_kind", *_ROWS}),
    ),
    CalibrationMethod(
        "twelve-position",
        twelve_position,
        calibrate_triads,
        needs="six faces and six others",
        estimates="M and b of each chip, the common rotation from the faces",
        source="Chinese calibration paper",
        gauges={12: "coarse", 9: "x_axis"},
        options=frozenset({"n_parameters", "input_kind", *_ROWS, "levelling_std_rad"}),
    ),
    CalibrationMethod(
        "array",
        calibrate_array,
        calibrate_whole_array,
        needs="nine or more poses, any direction; one or more to update an earlier calibration",
        estimates="M and b of all chips in one body frame, positions where there is motion",
        source="conditions |a_1| = g and a_i = a_1, gfimu.calibration.array_static and array_motion",
        options=frozenset({"array", "motion", "update", *_ROWS}),
        min_rest_s=2.0,
    ),
    CalibrationMethod(
        "spin",
        spin,
        calibrate_by_spin,
        needs="a turntable with a tachometer, three or more speeds held",
        estimates="q and c (K2, K3) of every axis across the table's axis, with M and b",
        source="spin reduction of IEEE Std 836",
        options=frozenset({"array", "start", "radius_std_m", "stretch_std_s2_rad2"}),
    ),
    CalibrationMethod(
        "gyro",
        multi_position_gyro,
        calibrate_reference_gyro,
        needs="rest in any poses, with the columns of a gyro",
        estimates="bias of the reference gyro; M where the noise leaves it visible",
        source="|omega| = Earth's rate, in the form of the Persian calibration paper, section 2.3.2",
    ),
    CalibrationMethod(
        "gyro-rate-table",
        rate_table_gyro,
        calibrate_on_rate_table,
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
