"""Columns of causes and families against central differences of the simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_cases import cause_of, dense, lively, small_twin, stretches_of
from numpy.testing import assert_allclose

from gfimu.diagnosis import Cause, cause_columns, effects_of, family_columns, mixing_of, observe, starting_point
from sim.effects import EFFECTS, make_effect

ARRAY = small_twin("cube12").array
WITH_SIZES = [name for name, family in EFFECTS.items() if family.sizes(ARRAY)]
SMOOTH = 2e-3
"""Relative error of a column by a step of a thousandth of the prior."""
ONE_SIDED = {
    # Not smooth in their size, or a shift in time: the step is a share of the prior that is seen.
    "channel_skew": 0.05,
    "clock_error": 0.02,
    "tacho_latency": 0.05,
    "sensor_lag": 0.2,
    "hysteresis": 0.02,
    "saturation": 0.02,
    "cogging": 5e-3,
    "resonance": 5e-3,
}


@pytest.fixture(scope="module")
def stretch():
    return stretches_of(small_twin("cube12"), duration=6.0, motion=lively())[0]


@pytest.fixture(scope="module")
def drive(stretch):
    return starting_point([stretch], 0.05).drives[0]


def seen_at(stretch, drive, causes):
    effects = effects_of(causes, stretch.model.array, stretch.index)
    return observe(stretch, stretch.predict(effects, drive.spin), stretch.first_levels)


def slope(stretch, drive, effects_at, size, *, positive=False):
    """Central difference of the observations by a size; one-sided to second order where it can't be negative."""

    def at(value):
        return stretch.predict(effects_at(value), drive.spin)

    if positive:
        return (4.0 * at(size) - at(2.0 * size) - 3.0 * at(0.0)) / (2.0 * size)
    return (at(size) - at(-size)) / (2.0 * size)


def agree(columns, truth, tolerance):
    scale = np.linalg.norm(truth, axis=(0, 1)).max()
    assert scale > 0.0
    assert np.linalg.norm(columns - truth, axis=(0, 1)).max() < tolerance * scale


@pytest.mark.parametrize("name", WITH_SIZES)
def test_columns_of_every_family(stretch, drive, name):
    family = EFFECTS[name]
    shape = family.shapes(6.0, 50.0)[0]
    sizes = family.sizes(ARRAY)
    columns = dense(family_columns(stretch, seen_at(stretch, drive, ()), drive, (), family, shape))
    chosen = range(0, len(sizes), max(len(sizes) // 4, 1))  # a few of those that have one of each channel

    def truth(number):
        def effects_at(value):
            unit = np.zeros(len(sizes))
            unit[number] = value * sizes[number].prior_std
            return [family.from_sizes(ARRAY, unit, shape)]

        return slope(stretch, drive, effects_at, 1e-3, positive=sizes[number].positive)

    agree(columns[:, :, list(chosen)], np.stack([truth(k) for k in chosen], axis=2), ONE_SIDED.get(name, SMOOTH))


@pytest.mark.parametrize("name", ["cross_axis", "table_tilt", "bias", "tacho_scale"])
def test_a_family_among_the_causes_is_varied_in_its_place(stretch, drive, name):
    # Sensing effects do not commute: at the end of the list a column would hold their commutator over a small step.
    tilt, cross = cause_of("table_tilt", ARRAY, [2.0, -1.0]), cause_of("cross_axis", ARRAY, np.full(24, 2.0))
    gain = cause_of("scale_factor", ARRAY, np.linspace(-1.0, 2.0, 12))
    causes = (cross, tilt, gain)
    family = EFFECTS[name]
    columns = dense(family_columns(stretch, seen_at(stretch, drive, causes), drive, causes, family, {}))
    present = effects_of(causes, ARRAY, 0)
    place = next((k for k, one in enumerate(present) if one.name == name), len(present))
    base = present[place].size_values(ARRAY) if place < len(present) else np.zeros(len(family.sizes(ARRAY)))

    def effects_at(value):
        moved = base.copy()
        moved[0] += value * family.sizes(ARRAY)[0].prior_std
        return [*present[:place], family.from_sizes(ARRAY, moved, {}), *present[place + 1 :]]

    agree(columns[:, :, [0]], slope(stretch, drive, effects_at, 1e-3)[:, :, None], SMOOTH)


def test_columns_of_causes_by_coordinates_and_shapes(stretch, drive):
    warm = cause_of("warm_up", ARRAY, np.linspace(1.0, 2.0, 12), time_constant_s=2.5)
    wobble = cause_of("axis_wobble", ARRAY, [1.0, 0.5], direction_rad=0.3)
    causes = (warm, cause_of("gravity", ARRAY, [1.5]), wobble)
    columns = dense(cause_columns(stretch, seen_at(stretch, drive, causes), drive, causes))
    assert columns.shape[2] == 12 + 1 + 1 + 2 + 1
    flat = [(k, j) for k, cause in enumerate(causes) for j in range(cause.unknowns)]
    steps = np.eye(len(flat))

    def effects_at(number, value):
        step = np.split(value * steps[number], np.cumsum([c.unknowns for c in causes])[:-1])
        return effects_of([c.moved(by, ARRAY) for c, by in zip(causes, step, strict=True)], ARRAY, 0)

    for number, (which, own) in enumerate(flat):
        is_shape = own >= len(causes[which].coordinates)
        truth = slope(stretch, drive, lambda v, n=number: effects_at(n, v), 1e-4 if is_shape else 1e-3)
        agree(columns[:, :, [number]], truth[:, :, None], 2e-3)


def test_a_held_shape_has_no_column(stretch, drive):
    warm = replace(cause_of("warm_up", ARRAY, np.ones(12), time_constant_s=2.5), held=True)
    assert cause_columns(stretch, seen_at(stretch, drive, (warm,)), drive, (warm,)).count == 12
    order = cause_of("cogging", ARRAY, [1.0, 0.5], order=4.0)  # whole numbers are not refined
    assert cause_columns(stretch, seen_at(stretch, drive, (order,)), drive, (order,)).count == 2


def test_no_causes_have_no_columns(stretch, drive):
    assert cause_columns(stretch, seen_at(stretch, drive, ()), drive, ()).count == 0


def test_each_run_has_its_own_sizes_of_what_a_mounting_has_anew(stretch, drive):
    family = EFFECTS["eccentricity"]
    assert family.per_run
    mixing = mixing_of(family.patterns(ARRAY)[0], 2)
    cause = Cause(family, "", mixing, {}, np.array([1.0, 2.0, -3.0, 4.0]))
    assert_allclose(cause.sizes(ARRAY, 1), np.array([-3.0, 4.0]) * 1e-3)
    for run in (0, 1):
        mine = replace(stretch, index=run)
        columns = dense(cause_columns(mine, seen_at(mine, drive, (cause,)), drive, (cause,)))
        alone = Cause(family, "", np.eye(2), {}, cause.coordinates[2 * run : 2 * run + 2])
        expected = dense(cause_columns(stretch, seen_at(stretch, drive, (alone,)), drive, (alone,)))
        assert_allclose(columns[:, :, 2 * run : 2 * run + 2], expected)
        assert_allclose(columns[:, :, 2 - 2 * run : 4 - 2 * run], 0.0)


def test_columns_come_out_of_the_wires_that_they_go_into(stretch, drive):
    # A bias of a11 shows in a22 where the two are exchanged; which channels a size reaches must not hide it.
    swap = make_effect("axis_swap", {"channels": ["a11", "a22"]}, ARRAY)
    channels = list(ARRAY.channels)
    swapped = replace(stretch, known=(swap,))
    for other in (swapped, replace(stretch, model=stretch.model.extended([swap]))):
        columns = dense(family_columns(other, seen_at(other, drive, ()), drive, (), EFFECTS["bias"], {}))
        usual = dense(family_columns(stretch, seen_at(stretch, drive, ()), drive, (), EFFECTS["bias"], {}))
        one, two = channels.index("a11"), channels.index("a22")
        assert np.abs(columns[:, two, one]).min() > 0.0
        assert_allclose(columns[:, one, one], 0.0)
        assert_allclose(columns[:, two, one], usual[:, one, one])


def test_columns_are_weighed_and_do_not_count_where_samples_do_not(stretch, drive):
    valid = stretch.run.valid.copy()
    valid[50:80, 3] = False
    masked = replace(stretch, run=replace(stretch.run, valid=valid))
    columns = dense(family_columns(masked, seen_at(masked, drive, ()), drive, (), EFFECTS["bias"], {}))
    assert_allclose(columns[50:80, 3], 0.0)
    assert np.abs(columns[:50, 3, 3]).min() > 0.0


def test_a_size_changes_no_channel_outside_its_reach(stretch, drive):
    for name in ("misalignment", "sensor_position", "cross_axis", "scale_factor", "quadratic"):
        family = EFFECTS[name]
        reach = family.reach(ARRAY)
        columns = dense(family_columns(stretch, seen_at(stretch, drive, ()), drive, (), family, {}))
        assert_allclose(columns[:, :-1][:, ~reach.T], 0.0)
        assert_allclose(columns[:, -1], 0.0)
        # Taken together or one by one, they are the same.
        one = family.from_sizes(ARRAY, 1e-3 * family.sizes(ARRAY)[0].prior_std * np.eye(len(reach))[0], {})
        alone = (stretch.predict([one], drive.spin) - stretch.predict([], drive.spin)) / 1e-3
        assert_allclose(columns[:, :, 0], alone, atol=1e-9)
