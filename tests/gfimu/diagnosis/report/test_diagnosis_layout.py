"""The rerun recording of a diagnosis opens with its residuals, none of its views empty."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import made_diagnosis
from rerun_layout import check_layout

from gfimu.diagnosis import DrawnRig, write_picture


@pytest.mark.parametrize("rig", ["table", "carriage", "free"])
def test_each_rig_has_a_layout(tmp_path, rig):
    diagnosis = made_diagnosis("explained")
    (run,) = diagnosis.runs
    stood = DrawnRig()
    if rig == "carriage":
        run, stood = replace(run, linear=True), DrawnRig(slide=np.array([1.0, 0.0, 0.0]))
    if rig == "free":
        unknown = np.full_like(run.angle, np.nan)
        attitude = np.tile([1.0, 0.0, 0.0, 0.0], (len(run.t), 1))
        run = replace(run, angle=unknown, attitude=attitude)
    path = tmp_path / "diagnosis.rrd"
    write_picture(path, replace(diagnosis, runs=(run,)), rig=stood)
    layout = check_layout(path)
    names = [columns["display_name"][0][0] for columns in layout.views("TimeSeries").values()]
    assert {"residual a11", "a43"} <= set(names)
    tabs = [columns["display_name"][0][0] for columns in layout.blueprint.values() if "grid_columns" in columns]
    assert {"residuals, m/s²", "readings, m/s²"} <= set(tabs)
