"""Distinguishability: against brute force, closed forms, and what is known of confounding on a turntable."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls

from gfimu import InputError
from gfimu.diagnosis import Columns, family_columns
from gfimu.diagnosis.design.distinguishability import (
    Contender,
    PlannedRun,
    distinguishability,
    energy_left,
    normal_equations,
    plan_contenders,
    predict_distinguishability,
)
from gfimu.diagnosis.design.planned_run import planned
from gfimu.diagnosis.design.table_profile import Leg, TableProfile
from gfimu.diagnosis.fit.linear import linearise
from sim.effects import make_effect
from sim.twin import Twin

RATE = 50.0
DURATION = 45.0
SIDE = np.array([np.pi / 2, 0.0, 0.0])


def contender(name, columns, directions=None, positive=False):
    columns = np.asarray(columns)
    return Contender(
        name,
        columns,
        np.eye(len(columns)) if directions is None else np.asarray(directions, dtype=float),
        (columns,),
        np.full(len(columns), positive),
    )


def profile(*legs):
    return TableProfile(tuple(Leg(*leg) for leg in legs))


@pytest.fixture(scope="module")
def twin():
    return Twin.load("cube12_turntable")


# The excitations of the study of confounding, and the same full profile upright and on its side.
REST = profile((0.0, DURATION))
SLOW = profile((0.0, 2.0), (0.5, 1.0), (0.5, DURATION - 3))
STEADY = profile((14.0, 1.5), (14.0, DURATION - 1.5))
FULL = profile(
    (0, 3), (3, 1), (3, 4), (10, 2), (10, 5), (-5, 3), (-5, 5), (14, 4), (14, 5), (-12, 4), (-12, 4), (0, 3), (0, 2)
)
EXCITATIONS = {
    "rest": [PlannedRun(REST, DURATION, RATE)],
    "slow": [PlannedRun(SLOW, DURATION, RATE)],
    "steady": [PlannedRun(STEADY, DURATION, RATE)],
    "full": [PlannedRun(FULL, DURATION, RATE)],
    "full and on its side": [PlannedRun(FULL, DURATION, RATE), PlannedRun(FULL, DURATION, RATE, SIDE)],
}
EFFECTS = (
    "bias",
    "scale_factor",
    "misalignment",
    "table_tilt",
    "axis_wobble",
    "eccentricity",
    "sensor_position",
    "tacho_scale",
    "gravity",
    "centrifugal_flex",
    "quadratic",
)


@pytest.fixture(scope="module")
def tables(twin):
    return {name: predict_distinguishability(twin, EFFECTS, runs) for name, runs in EXCITATIONS.items()}


@pytest.mark.parametrize("limit", [np.inf, 3.0])
def test_energy_is_what_a_least_squares_fit_of_the_rival_leaves(limit):
    rng = np.random.default_rng(1)
    signatures = rng.standard_normal((300, 9))
    signatures[:, 4] = signatures[:, 0] + 0.1 * signatures[:, 4]  # nearly the same
    signatures[:, 8] = signatures[:, 7]  # a rival with a redundant size
    one, other = contender("one", [0, 1, 2]), contender("other", [3, 4, 5, 6, 7, 8])
    table = distinguishability(signatures.T @ signatures, [one, other], largest_rival=limit)
    rows = np.zeros((6, 6)) if np.isinf(limit) else np.eye(6) / limit
    fit = np.vstack([signatures[:, 3:], rows])
    wanted = np.vstack([signatures[:, :3], np.zeros((6, 3))])
    left = wanted - fit @ np.linalg.lstsq(fit, wanted, rcond=None)[0]
    assert table.energy[0, 1] == pytest.approx(np.sum(left**2), rel=1e-9)
    assert table.detectability[0] ** 2 == pytest.approx(np.sum(signatures[:, :3] ** 2), rel=1e-12)


def test_a_rival_of_one_sign_cannot_explain_the_opposite():
    rng = np.random.default_rng(2)
    signatures = rng.standard_normal((100, 3))
    signatures[:, 1] = -signatures[:, 0] + 0.3 * signatures[:, 1]
    gram = signatures.T @ signatures
    own, rival = contender("own", [0], positive=True), contender("rival", [1, 2], positive=True)
    _, left = nnls(signatures[:, 1:], signatures[:, 0])
    table = distinguishability(gram, [own, rival], largest_rival=np.inf)
    assert table.energy[0, 1] == pytest.approx(left**2, rel=1e-6)
    # An effect of both signs is explained when it has the other one: the mean counts.
    _, other = nnls(signatures[:, 1:], -signatures[:, 0])
    both = distinguishability(gram, [contender("own", [0]), rival], largest_rival=np.inf)
    assert both.energy[0, 1] == pytest.approx((left**2 + other**2) / 2, rel=1e-6)


def test_two_rivals_at_once_leave_what_a_projection_on_both_leaves():
    rng = np.random.default_rng(4)
    signatures = rng.standard_normal((60, 7))
    own, one, other = contender("own", [0]), contender("one", [1, 2]), contender("other", [3, 4])
    other = replace(other, alternatives=(other.columns, np.array([5, 6])))
    both = one.beside(other)
    assert both.name == "one + other"
    lefts = []
    for shape in ([1, 2, 3, 4], [1, 2, 5, 6]):
        fit, *_ = np.linalg.lstsq(signatures[:, shape], signatures[:, 0])
        lefts.append(np.sum((signatures[:, 0] - signatures[:, shape] @ fit) ** 2))
    left = energy_left(signatures.T @ signatures, own, [one, both], largest_rival=np.inf)
    assert left[1] == pytest.approx(min(lefts), rel=1e-9)
    assert left[1] < left[0]


@given(st.integers(0, 10_000))
def test_more_data_never_make_effects_less_distinguishable(seed):
    rng = np.random.default_rng(seed)
    first, second = (rng.standard_normal((8, 6)) for _ in range(2))
    pair = [contender("one", [0, 1]), contender("other", [2, 3, 4, 5])]
    less = distinguishability(first.T @ first, pair)
    more = distinguishability(first.T @ first + second.T @ second, pair)
    assert (more.energy >= less.energy * (1 - 1e-9) - 1e-9).all()
    assert (less.energy.sum(axis=1) <= less.detectability**2 * (1 + 1e-9)).all()


def test_detectability_of_a_change_of_gravity_at_rest(twin):
    run = PlannedRun(REST, DURATION, 100.0, bias_instability=0.0)
    table = predict_distinguishability(twin, [make_effect("gravity", {"delta_m_s2": 0.004})], [run])
    # Four vertical channels, each offset by 0.004 m/s² in every sample.
    vertical = twin.expected_noise(100.0).white[2::3]
    expected = np.sqrt(DURATION * 100.0 * np.sum((0.004 / vertical) ** 2))
    assert table.detectability[0] == pytest.approx(expected, rel=1e-3)


def test_at_rest_gravity_bias_and_scale_factor_are_one(tables):
    table = tables["rest"]
    bias, scale, gravity = (EFFECTS.index(name) for name in ("bias", "scale_factor", "gravity"))
    for i, j in ((gravity, bias), (gravity, scale), (scale, bias)):
        assert table.nats[i, j] < 0.01
    # The other way round the special case does not explain the general one.
    assert table.unexplained[bias, gravity] > 0.9


def test_slow_turning_leaves_tacho_scale_and_position_together(tables):
    tacho, position = EFFECTS.index("tacho_scale"), EFFECTS.index("sensor_position")
    assert tables["slow"].nats[tacho, position] < 0.1
    assert tables["full"].nats[tacho, position] > 12


# Fraction of an effect that a rival cannot explain, by excitation. The orders of magnitude follow from the geometry:
# a constant is one at rest, gravity turns with a slow table, ω² grows with speed, another axis is up on the side.
CONFOUNDING = [
    ("table_tilt", "bias", "rest", 0, 1e-5),
    ("table_tilt", "bias", "slow", 0.9, 1),
    ("axis_wobble", "bias", "slow", 0.4, 0.9),
    ("axis_wobble", "bias", "full", 0.5, 0.95),
    ("misalignment", "bias", "rest", 0, 1e-5),
    ("misalignment", "bias", "full", 0.1, 0.6),
    ("misalignment", "bias", "full and on its side", 0.4, 0.8),
    ("eccentricity", "sensor_position", "full", 0, 1e-5),
    ("eccentricity", "sensor_position", "full and on its side", 0.2, 0.6),
    ("sensor_position", "eccentricity", "full", 0.5, 1),
    ("sensor_position", "scale_factor", "steady", 0, 5e-3),
    ("sensor_position", "scale_factor", "full", 1e-4, 0.03),
    ("sensor_position", "scale_factor", "full and on its side", 0.2, 0.6),
    ("tacho_scale", "sensor_position", "steady", 0, 2e-3),
    ("tacho_scale", "scale_factor", "full", 1e-4, 0.01),
    ("tacho_scale", "scale_factor", "full and on its side", 0.2, 0.7),
    ("gravity", "bias", "full", 0, 1e-5),
    ("gravity", "scale_factor", "full", 0, 1e-5),
    ("gravity", "quadratic", "full", 0, 1e-5),
    ("gravity", "bias", "full and on its side", 0.3, 0.7),
    ("gravity", "scale_factor", "full and on its side", 0.1, 0.5),
    ("centrifugal_flex", "quadratic", "full", 0, 5e-3),
    ("centrifugal_flex", "quadratic", "full and on its side", 0.2, 0.8),
    ("quadratic", "scale_factor", "steady", 0, 5e-3),
    ("quadratic", "scale_factor", "full", 0.01, 0.1),
    ("quadratic", "scale_factor", "full and on its side", 0.2, 0.5),
    ("scale_factor", "bias", "rest", 0, 1e-5),
    ("scale_factor", "bias", "full", 0.1, 0.6),
    ("scale_factor", "bias", "full and on its side", 0.4, 0.8),
]


@pytest.mark.parametrize(("effect", "rival", "excitation", "low", "high"), CONFOUNDING)
def test_confounding_on_a_turntable(tables, effect, rival, excitation, low, high):
    table = tables[excitation]
    assert low <= table.unexplained[EFFECTS.index(effect), EFFECTS.index(rival)] <= high


def test_lag_of_the_channels_and_of_the_reference_have_opposite_signs(twin):
    table = predict_distinguishability(twin, ["tacho_latency", "sensor_lag"], EXCITATIONS["full"])
    assert table.unexplained[0, 1] > 0.99


def test_an_effect_of_known_size_is_imitated_with_its_own_sign_only(twin):
    # A board's clock that runs fast shows the channels late, which a late tachometer cannot imitate.
    fast, slow = (
        predict_distinguishability(
            twin, [make_effect("clock_error", {"ratio": ratio}), "tacho_latency"], EXCITATIONS["full"]
        )
        for ratio in (1e-4, -1e-4)
    )
    assert fast.unexplained[0, 1] > 0.95
    assert slow.unexplained[0, 1] < 0.5
    either = predict_distinguishability(twin, ["clock_error", "tacho_latency"], EXCITATIONS["full"])
    assert either.unexplained[0, 1] == pytest.approx((fast.unexplained[0, 1] + slow.unexplained[0, 1]) / 2, abs=0.01)


def test_the_drive_is_marginalised_to_the_digits_that_a_margin_needs(twin):
    # A tachometer of wrong gain moves the whole drive by its share: a large step that leaves little behind, so that
    # normal equations lose digits first here. Truth: orthogonal projection on drive and rival, no normal equations.
    ramps = profile((0, 1), (15, 1.5), (15, 16), (0, 1.5))
    run = PlannedRun(ramps, 20.0, 100.0, bias_instability=0.0)
    signatures, contenders = plan_contenders(twin, ["tacho_scale", "sensor_position"], duration=20.0, sample_rate=100.0)
    stretches, point = planned(twin, [run])
    gram = normal_equations(stretches, point, signatures)[0]
    [posterior] = linearise(stretches, point).posteriors
    weight = np.sqrt(posterior.observed.weights)
    columns = Columns.together(
        [
            family_columns(stretches[0], posterior.observed, posterior.drive, (), one.family, one.shape)
            for one in signatures
        ]
    )
    wanted = np.column_stack([(columns.times(one) * weight).ravel() for one in np.eye(columns.count)])
    unit = np.eye(posterior.jacobian.size)
    drive = np.column_stack([(posterior.jacobian.times(one) * weight).ravel() for one in unit])
    values, vectors = np.linalg.eigh(posterior.drive.add_precision(np.zeros(unit.shape)))
    prior = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    rival = wanted[:, [1, 2, 4, 5, 7, 8, 10, 11]]  # heights change nothing
    system = np.block([[drive, rival], [prior, np.zeros((len(prior), rival.shape[1]))]])
    target = np.concatenate([wanted[:, 0], np.zeros(len(prior))])
    left = target - system @ np.linalg.lstsq(system, target, rcond=1e-15)[0]
    table = distinguishability(gram, contenders, largest_rival=np.inf)
    assert table.energy[0, 1] == pytest.approx(left @ left, rel=0.01)


def test_weakest_pair(tables):
    table = tables["full"]
    i, j = table.weakest()
    assert i != j
    assert table.nats[i, j] == table.least_nats == np.min(table.nats[~np.eye(len(EFFECTS), dtype=bool)])


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        (["nonsense"], "unknown effect 'nonsense'; valid: .*table_tilt"),
        (["saturation"], "'saturation' has no size"),
        (["bias", "bias"], "named twice"),
    ],
)
def test_effects_that_cannot_be_asked_for(twin, effects, message):
    with pytest.raises(InputError, match=message):
        predict_distinguishability(twin, effects, EXCITATIONS["rest"])
