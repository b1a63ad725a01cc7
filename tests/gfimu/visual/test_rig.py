"""The drawn array: what holds the chips, where they are, their names and colours, gravity and the axis of rotation."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray, Chip, TurningAxis
from gfimu.base import chip_colour
from gfimu.visual import Box, Cylinder, Names, Pointers
from gfimu.visual.rig import (
    array_shapes,
    axis_shapes,
    channel_shapes,
    chip_names,
    drawing_size,
    gravity_shapes,
    is_cube,
    package_of,
    stand_height,
    table_shapes,
)
from gfimu.visual.rig.figure import array_figure
from gfimu.visual.rig.words import array_words, package_words, run_legend


def made(places, axes=None, **more) -> AccelerometerArray:
    chips = tuple(
        Chip(f"c{number}", np.array(place, dtype=float), np.eye(3) if axes is None else np.array(axes[number]))
        for number, place in enumerate(places)
    )
    return AccelerometerArray("made", chips, **more)


def ring(count: int, radius: float) -> np.ndarray:
    angle = 2 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])


GRID = np.array([[x, y, z] for z in (0.0, 0.06) for y in range(4) for x in range(4)]) * [0.03, 0.03, 1.0]


@pytest.mark.parametrize(
    ("array", "kind", "half"),
    [
        ("cube12", "cube", [0.05, 0.05, 0.05]),
        ("p3_three_plus_one", "cube", [0.05, 0.05, 0.05]),
        ("one_chip", "chip", None),
        ("sisfall_belt", "rod", None),
        ("mimu4444", "plate", [0.00945, 0.00945, 0.001]),
        (made(ring(6, 0.14)), "disc", [0.14, 0.14, 0.0]),
        (made(ring(4, 0.14)), "plate", None),
        (made(GRID), "box", [0.045, 0.045, 0.03]),
        (made([[0.1, 0.0, 0.0]], turning_axis=TurningAxis.of("z")), "rod", [0.05, 0.0, 0.0]),
    ],
)
def test_the_package_follows_from_the_places_of_the_chips(array, kind, half):
    array = AccelerometerArray.load(array) if isinstance(array, str) else array
    package = package_of(array)
    assert package.kind == kind
    own = package.rotation.inv().apply(array.chip_positions - package.centre)
    assert (np.abs(own) <= package.half + 1e-9).all()
    if half is not None:
        assert (package.half >= np.array(half) - 1e-9).all()
        assert (package.half < np.array(half) + 0.15 * max(half)).all()


def test_a_plate_may_be_skew_in_the_body():
    turn = Rotation.from_euler("xyz", [0.5, 0.4, 0.3])
    package = package_of(made(turn.apply(ring(6, 0.1))))
    assert package.kind == "disc"
    normal = package.rotation.apply([0.0, 0.0, 1.0])
    assert_allclose(np.abs(normal @ turn.apply([0.0, 0.0, 1.0])), 1.0, atol=1e-9)


def test_only_the_cube_is_a_cube():
    assert is_cube(AccelerometerArray.load("cube12_as_built"))
    assert is_cube(AccelerometerArray.load("corners8"))
    for name in ("one_chip", "mimu4444", "sisfall_belt"):
        assert not is_cube(AccelerometerArray.load(name))
    assert not is_cube(made(GRID))


@pytest.mark.parametrize("count", [1, 3, 32, 64])
def test_every_chip_is_drawn_at_its_place_with_its_name_and_hue(count):
    array = made(np.random.default_rng(count).uniform(-0.1, 0.1, (count, 3)))
    body, *chips = array_shapes(array)
    assert isinstance(body, Box)
    assert [chip.label for chip in chips] == [chip.name for chip in array.chips]
    assert_allclose([chip.centre for chip in chips], array.chip_positions)
    assert [chip.colour for chip in chips] == [chip_colour(number) for number in range(count)]
    names = chip_names(array)
    assert list(names.texts) == [chip.name for chip in array.chips]
    assert np.linalg.norm(names.places - array.chip_positions, axis=1).max() < 0.35 * drawing_size(array)


def test_sensing_axes_point_along_their_axes_in_three_shades():
    array = AccelerometerArray.load("mimu4444")
    arrows = channel_shapes(array)
    assert_allclose(arrows.origins, array.positions)
    assert_allclose(arrows.vectors / np.linalg.norm(arrows.vectors, axis=1)[:, None], array.axes)
    assert list(arrows.labels) == list(array.channels)
    assert arrows.colours[:3] == [chip_colour(0, axis) for axis in range(3)]
    assert not arrows.show_labels  # 24 channel names would cover the board
    assert channel_shapes(AccelerometerArray.load("one_chip")).show_labels


def test_the_axis_of_rotation_passes_through_its_point_and_is_named():
    axis = TurningAxis.of([0.0, 1.0, 1.0], point=[0.02, 0.0, 0.0], hub="free")
    array = made([[0.1, 0.0, 0.0]], turning_axis=axis)
    hub, line, name = axis_shapes(axis, array)
    assert isinstance(hub, Cylinder)
    assert isinstance(line, Pointers)
    assert isinstance(name, Names)
    assert_allclose(np.cross(line.origins[0] - axis.point, axis.direction), 0.0, atol=1e-12)
    assert_allclose(np.cross(line.vectors[0], axis.direction), 0.0, atol=1e-12)
    assert name.texts == ["axis of rotation, hub moves"]


def test_gravity_points_down_and_is_named():
    arrow, name = gravity_shapes(AccelerometerArray.load("mimu4444"), np.array([0.0, 0.0, 0.06]))
    assert arrow.vectors[0, 2] < 0
    assert_allclose(arrow.vectors[0, :2], 0.0)
    assert name.texts == ["gravity"]


def test_a_table_is_as_large_as_the_array_needs():
    wide = made(ring(6, 0.4))
    disc, *_ = table_shapes(wide, np.array([0.0, 0.0, stand_height(wide)]))["table"]
    assert 0.4 < disc.radius < 0.6
    cube = AccelerometerArray.load("cube12")
    disc, *_ = table_shapes(cube, np.array([0.0, 0.0, stand_height(cube)]))["table"]
    assert disc.radius == pytest.approx(0.15)


def test_the_words_say_which_array_and_size_it_is():
    axis = TurningAxis.of("z", inclination=0.5)
    array = made(ring(6, 0.14), turning_axis=axis)
    words = array_words(array)
    assert "disc of 314 mm" in package_words(package_of(array))
    assert "It turns about (0, 0, 1) only, an axis that stands still, 28.6° from the vertical." in words
    assert all(f"| {chip.name} |" in words for chip in array.chips)
    assert "orange outline" not in run_legend(array, estimate=True, known=None)


@pytest.mark.parametrize("array", ["cube12", "one_chip", "mimu4444", made(GRID), made(ring(6, 0.14))])
def test_the_figure_names_every_chip_once_in_each_view_and_names_do_not_collide(array):
    array = AccelerometerArray.load(array) if isinstance(array, str) else array
    figure = array_figure(array, axis=TurningAxis.of("z"), gravity=np.array([0.0, 0.0, -1.0]))
    figure.draw_without_rendering()
    names = {chip.name for chip in array.chips}
    for panel in figure.axes:
        texts = [text for text in panel.texts if set(text.get_text().split(", ")) <= names]
        shown = [name for text in texts for name in text.get_text().split(", ")]
        assert sorted(shown) == sorted(names)
        boxes = [text.get_window_extent() for text in texts]
        overlaps = [
            (one.get_text(), other.get_text())
            for i, one in enumerate(texts)
            for j, other in enumerate(texts[:i])
            if boxes[i].shrunk(0.9, 0.7).overlaps(boxes[j].shrunk(0.9, 0.7))
        ]
        assert overlaps == []
