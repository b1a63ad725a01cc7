"""The two mountings of the cube: one taken for the other is refused with the right array, without a reference."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.base import STANDARD_GRAVITY
from gfimu.recording import doubts_of
from sim.scenarios import Scenario
from sim.simulation import simulate

ARRAYS = {name: AccelerometerArray.load(name) for name in ("cube12", "cube12_as_built")}


def as_a_board_sends_it(scenario: str, real: str, seed: int):
    """Readings and times alone."""
    run = simulate(replace(Scenario.load(scenario), array=ARRAYS[real]), seed=seed)
    return replace(run, reference={}, metadata={})


@pytest.mark.study(only=["eccentric_mount-cube12", "eccentric_mount-cube12_as_built"])
@pytest.mark.parametrize("real", ARRAYS)
@pytest.mark.parametrize("scenario", ["paper_run", "eccentric_mount", "hand"])
def test_the_wrong_mounting_is_refused_and_the_right_one_is_not(scenario: str, real: str) -> None:
    run = as_a_board_sends_it(scenario, real, 7)
    (wrong,) = set(ARRAYS) - {real}
    (found,) = doubts_of(run, ARRAYS[wrong])
    assert (found.kind, found.refused) == ("array", True)
    assert found.text.endswith(f"give it with --array {real}")
    assert not doubts_of(run, ARRAYS[real])


@pytest.mark.parametrize("real", ARRAYS)
def test_steady_speeds_without_a_tachometer_show_it_too(real: str) -> None:
    """Each of them reads as constant as a rest; only a square of the rate that is negative shows it."""
    run = as_a_board_sends_it("speed_sweep", real, 8)
    (wrong,) = set(ARRAYS) - {real}
    assert [found.kind for found in doubts_of(run, ARRAYS[wrong])] == ["array"]
    assert not doubts_of(run, ARRAYS[real])


def test_at_rest_nothing_shows() -> None:
    run = as_a_board_sends_it("rest", "cube12_as_built", 9)
    assert not any(doubts_of(run, array) for array in ARRAYS.values())


@pytest.mark.parametrize(
    ("name", "table"),
    [
        ("cube12", [(1, 0, 0), (0, 1, 0), (0, 0, 1)]),
        ("cube12_as_built", [(0, 1, 0), (1, 0, 0), (0, 0, -1)]),
    ],
)
def test_the_three_poses_of_the_bench_page(name: str, table, project_root) -> None:
    """Of +x, +y and +z up: what each chip reads, as the page has it."""
    page = (project_root / "docs" / "how_to" / "bench.md").read_text(encoding="utf-8")
    rows = {line.split(" | ")[0]: line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| +")}
    column = 1 + list(ARRAYS).index(name)
    for up, expected, label in zip(np.eye(3), table, "xyz", strict=True):
        readings = ARRAYS[name].axes @ (STANDARD_GRAVITY * up) / STANDARD_GRAVITY  # (12,)
        np.testing.assert_allclose(readings.reshape(4, 3), np.tile(expected, (4, 1)))
        assert rows[f"| +{label}"][column] == str(expected).replace("-", "−")
