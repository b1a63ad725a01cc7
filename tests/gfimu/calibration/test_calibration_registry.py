"""One record per calibration method: complete, listed once, and looked up with a message."""

import inspect
from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest
from calibration_cases import GRAVITY, MULTI, calibrate
from every_item import every
from recordings import pose_recording

from gfimu import InputError
from gfimu.calibration import METHODS, CalibrationTask, calibration_method, run_calibration
from gfimu.calibration.error_model import GAUGES
from gfimu.calibration.registry import CalibrationMethod


@every("method", METHODS.values())
def test_every_record_is_complete(method):
    assert METHODS[method.name] is method
    assert method.needs
    assert method.estimates
    assert method.source
    assert callable(method.fit)
    assert callable(method.run)
    assert set(method.gauges.values()) <= set(GAUGES)
    assert method.options <= {field.name for field in fields(CalibrationTask)}
    assert ("levelling_std_rad" in method.options) == ("levelling_std_rad" in inspect.signature(method.fit).parameters)


def test_records_are_frozen():
    with pytest.raises(FrozenInstanceError):
        METHODS["gyro"].needs = "nothing"
    with pytest.raises(TypeError):
        METHODS["mine"] = METHODS["gyro"]


@pytest.mark.parametrize("ask", [calibration_method, lambda name: calibrate(name, None)])
def test_an_unknown_method_is_one_line_with_the_list(ask):
    with pytest.raises(InputError) as refused:
        ask("seven-position")
    assert str(refused.value) == (
        "unknown calibration method 'seven-position'; "
        "valid: array, gyro, gyro-rate-table, multi-position, recursive, six-position, spin, twelve-position; "
        "did you mean 'twelve-position'?"
    )


def test_the_array_method_asks_for_the_array(triad):
    recording = pose_recording([triad], MULTI, np.random.default_rng(1), still_s=4.0)
    with pytest.raises(InputError, match="'array' needs the array"):
        calibrate("array", recording)


def counted(observations, *, gravity, gauge):
    """Fit of a method that the package does not have: the six-position one under another name."""
    return METHODS["six-position"].fit(observations, gravity=gravity, gauge=gauge)


def test_a_new_method_is_one_record(triad):
    record = CalibrationMethod(
        "counted",
        counted,
        METHODS["six-position"].run,
        needs="six faces, level",
        estimates="M and b of each chip",
        source="none",
        gauges={9: "x_axis"},
    )
    recording = pose_recording([triad], MULTI, np.random.default_rng(1), still_s=4.0, sigma=0.01)
    found = run_calibration(record, CalibrationTask(recording, gravity=GRAVITY))
    assert found.gauge == "x_axis"
    with pytest.raises(InputError, match=r"^12 parameters: choose 9 \(triangular M\)$"):
        run_calibration(record, CalibrationTask(recording, gravity=GRAVITY, n_parameters=12))
