"""Local gravity against published values."""

import pytest

from gfimu import InputError, local_gravity


def test_wgs84_equator_and_pole():
    assert local_gravity(0.0) == pytest.approx(9.7803253359, abs=1e-10)
    assert local_gravity(90.0) == pytest.approx(9.8321849379, abs=1e-9)
    assert local_gravity(-90.0) == local_gravity(90.0)


def test_two_places():
    """Published figures from an older normal gravity formula, which lies 7e-6 m/s² below WGS 84 everywhere."""
    assert local_gravity(52.3, 80.0) == pytest.approx(9.812484, abs=1e-5)
    assert local_gravity(60.0, 250.0) == pytest.approx(9.818399, abs=1e-5)


def test_free_air_gradient():
    assert local_gravity(45.0) - local_gravity(45.0, 1000.0) == pytest.approx(3.086e-3, rel=1e-3)


@pytest.mark.parametrize(("latitude", "height"), [(91.0, 0.0), (-95.0, 0.0), (0.0, 2e6), (float("nan"), 0.0)])
def test_impossible_places(latitude, height):
    with pytest.raises(InputError, match="is outside"):
        local_gravity(latitude, height)
