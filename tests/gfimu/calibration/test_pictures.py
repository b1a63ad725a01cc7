"""Pictures of a calibration: parameters with units, poses by name, chips in their hue, labels beside each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, Calibration, Chip, Recording
from gfimu.base import chip_colour, css
from gfimu.calibration.parameter_names import parameter_names
from gfimu.calibration.pictures import calibration_figure, pose_names

FACES = np.concatenate([np.eye(3), -np.eye(3)])
EDGES = np.array([[1.0, 1.0, 0.0], [0.0, 1.0, -1.0], [-1.0, 0.0, 1.0]]) / np.sqrt(2)
POSES = np.vstack([FACES, EDGES, [[0.31, -0.50, 0.81]]])


def made(chips: int, *, unit: str = "m_s2", positions: bool = False) -> Calibration:
    array = tuple(f"a{number + 1}" for number in range(chips))
    names = [name for chip in array for name in parameter_names(chip, "array")]
    if positions:
        names += [f"{chip}_r_{axis}" for chip in array for axis in "xyz"]
    values = np.array([1.0 if "_M_" in name and name[-1] == name[-2] else 0.001 for name in names])
    return Calibration(
        "made", unit, tuple(f"{chip}{axis}" for chip in array for axis in (1, 2, 3)), "array", 9.8,
        tuple(names), values, 1e-6 * np.eye(len(names)),
    )  # fmt: skip


def recording(calibration: Calibration) -> Recording:
    """Ten poses of 3 s with turns between them, read by the calibration's chips."""
    rng = np.random.default_rng(1)
    chips = tuple(Chip(chip, 0.01 * np.full(3, number), np.eye(3)) for number, chip in enumerate(calibration.chips))
    array = AccelerometerArray("made", chips)
    true = []
    for one, following in zip(POSES, [*POSES[1:], POSES[0]], strict=True):
        turn = np.linspace(0.0, 1.0, 100)[:, None]
        true += [np.tile(one, (300, 1)), one + turn * (following - one) + 0.3 * rng.standard_normal((100, 3))]
    force = 9.8 * np.vstack(true)
    readings = np.tile(force, len(chips)) + 0.01 * rng.standard_normal((len(force), 3 * len(chips)))
    run = Recording.from_arrays(0.01 * np.arange(len(force)), readings, array)
    return replace(run, unit=calibration.unit)


def shown(labels) -> list[str]:
    return [label.get_text() for label in labels if label.get_text()]


def collisions(labels) -> list[tuple[str, str]]:
    boxes = [(label.get_text(), label.get_window_extent()) for label in labels if label.get_text()]
    return [(one, other) for i, (one, box) in enumerate(boxes) for other, beside in boxes[:i] if box.overlaps(beside)]


def test_poses_are_named_by_what_was_up():
    names = pose_names(9.8 * POSES)
    assert names[0] == "1: +x up"
    assert names[5] == "6: −z up"
    assert names[6:9] == ["7: +x+y up", "8: +y−z up", "9: −x+z up"]
    assert names[9] == "10: (0.31, −0.50, 0.81) up"


@pytest.mark.parametrize(("chips", "positions"), [(1, False), (4, False), (4, True), (8, True)])
def test_parameters_are_named_with_units_and_their_labels_do_not_collide(chips, positions):
    calibration = made(chips, positions=positions)
    figure = calibration_figure(calibration)
    figure.draw_without_rendering()
    panel = figure.axes[0]
    expected = [name if chips > 1 else name.removeprefix("a1_") for name in calibration.names]
    assert shown(panel.get_xticklabels()) == expected == shown(panel.get_yticklabels())
    assert collisions(panel.get_xticklabels()) == []
    assert collisions(panel.get_yticklabels()) == []
    units = panel.get_xlabel()
    assert "b_i: bias, m/s²" in units
    assert "M_ij: sensitivity of axis i to input j, ratio" in units
    assert ("r_i: position, m" in units) == positions


def test_raw_counts_have_their_unit():
    assert "input j, count per m/s²" in calibration_figure(made(1, unit="lsb")).axes[0].get_xlabel()


def test_of_very_many_parameters_the_blocks_are_named():
    calibration = made(16)
    figure = calibration_figure(calibration)
    figure.draw_without_rendering()
    panel = figure.axes[0]
    assert shown(panel.get_xticklabels()) == list(calibration.chips)
    assert collisions(panel.get_xticklabels()) == []
    assert panel.get_xlabel().startswith("in each block: M_xx, M_xy, ")


@pytest.mark.parametrize("chips", [1, 4, 16])
def test_before_and_after_share_named_poses_and_chips_have_their_hue(chips):
    calibration = made(chips)
    figure = calibration_figure(calibration, recording(calibration))
    figure.draw_without_rendering()
    before, after = (panel for panel in figure.axes if panel.get_ylabel() == "|a| − g, m/s²")
    assert before.get_title(loc="left").startswith("before: as read: rms")
    assert after.get_title(loc="left").startswith("after: calibrated: rms")
    poses = shown(after.get_xticklabels())
    assert poses[0] == "1: +x up"
    assert len(poses) == len(POSES)
    assert collisions(after.get_xticklabels()) == []
    dots = [line for line in after.lines if line.get_marker() == "o"]
    assert [line.get_color() for line in dots] == [css(chip_colour(chip, on_paper=True)) for chip in range(chips)]


def test_raw_counts_show_the_calibrated_poses_only():
    calibration = made(1, unit="lsb")
    panels = calibration_figure(calibration, recording(calibration)).axes
    assert len([panel for panel in panels if panel.get_ylabel() == "|a| − g, m/s²"]) == 1
