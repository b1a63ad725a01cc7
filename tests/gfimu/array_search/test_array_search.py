"""Search of geometries: known optima, gradients, conditions that hold in the result, refusals."""

import numpy as np
import pytest

from gfimu import AccelerometerArray, GeometryError, InputError, optimize
from gfimu.array.dilution import gdop_lower_bound
from gfimu.array_search.scoring import score


def search(n_chips, seed=1, restarts=12, **options):
    return optimize(n_chips, rng=np.random.default_rng(seed), restarts=restarts, **options)


@pytest.mark.parametrize("n", [4, 8])
def test_finds_the_geometry_that_meets_the_bound(n):
    result = search(n)
    assert result.score.gdop == pytest.approx(gdop_lower_bound(n), abs=1e-9)
    assert result.score.condition_number == pytest.approx(np.sqrt(2), abs=1e-6)
    np.testing.assert_allclose(np.abs(result.array.chip_positions), 0.05)
    assert result.agreeing >= 2


def test_finds_the_tetrahedron_from_random_starts_alone(monkeypatch):
    import gfimu.array_search.shapes as module

    monkeypatch.setattr(module, "LATTICE", np.random.default_rng(4).uniform(-0.9, 0.9, (26, 3)))
    assert search(4).score.gdop == pytest.approx(gdop_lower_bound(4), abs=1e-6)


def test_six_uniaxial_sensors_beat_the_face_diagonals():
    result = search(6, axes_per_chip=1)
    assert result.score.gdop < 1.45 < score("p1_face_diagonals")[0].gdop
    assert [len(chip.axes) for chip in result.array.chips] == [1] * 6


def test_chips_of_two_axes_have_two_orthogonal_axes():
    result = search(5, axes_per_chip=2, restarts=4)
    for chip in result.array.chips:
        np.testing.assert_allclose(chip.axes @ chip.axes.T, np.eye(2), atol=1e-12)
    (again,) = score(result.array)
    assert again.gdop == pytest.approx(result.value, rel=1e-9)


def test_condition_of_no_recursion_holds_and_costs_little():
    free, clean = search(5), search(5, non_recursive=True)
    assert free.score.omega_squared_leakage[:3].max() > 0.01
    assert clean.score.omega_squared_leakage[:3].max() < 1e-8
    assert free.score.gdop < clean.score.gdop < 1.05 * free.score.gdop


def test_box_and_spacing_are_kept():
    result = search(9, box_m=(0.1, 0.06, 0.02), min_spacing_m=0.03, restarts=6)
    places = result.array.chip_positions
    assert (np.abs(places) <= np.array([0.05, 0.03, 0.01]) + 1e-12).all()
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)[np.triu_indices(9, 1)]
    assert apart.min() >= 0.03 * (1 - 1e-5)
    assert result.array.length_unit == pytest.approx(0.05)


def test_same_seed_gives_the_same_array_and_its_file_is_read_back(tmp_path):
    first, second = search(5, seed=7, restarts=4), search(5, seed=7, restarts=4)
    assert first.array.to_toml() == second.array.to_toml()
    path = tmp_path / "found.toml"
    path.write_text(first.array.to_toml())
    assert score(AccelerometerArray.load(path))[0].gdop == pytest.approx(first.score.gdop, rel=1e-12)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"n_chips": 2}, GeometryError, "can't see angular acceleration about"),
        ({"n_chips": 1}, GeometryError, "at least 2 chips"),
        ({"n_chips": 5, "axes_per_chip": 1}, GeometryError, "5 channels.*at least 6 chips"),
        ({"n_chips": 3, "non_recursive": True}, GeometryError, "free of ω²"),
        ({"n_chips": 4, "box_m": (0.1, 0.0, 0.0)}, GeometryError, "can't see angular acceleration about x"),
        ({"n_chips": 4, "min_spacing_m": 0.2}, InputError, "don't fit at 0.2 m"),
        ({"n_chips": 4, "axes_per_chip": 4}, InputError, "must be 1, 2 or 3"),
        ({"n_chips": 4, "box_m": (0.1, -0.1, 0.1)}, InputError, "box"),
        ({"n_chips": 4, "min_spacing_m": float("nan")}, InputError, "spacing"),
        ({"n_chips": 4, "restarts": 0}, InputError, "restarts"),
    ],
)
def test_impossible_searches_are_refused_with_the_reason(options, error, message):
    with pytest.raises(error, match=message):
        search(**({"restarts": 3} | options))
