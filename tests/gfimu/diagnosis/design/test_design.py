"""Design of experiments: profiles within limits, and proposals that do separate effects when they are simulated."""

import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gfimu import InputError
from gfimu.diagnosis import diagnose, prepare_run
from gfimu.diagnosis.design.ambiguity import open_effects
from gfimu.diagnosis.design.design import Limits, design
from gfimu.diagnosis.design.distinguishability import (
    PlannedRun,
    distinguishability,
    gained_log_likelihood,
    normal_equations,
    plan_contenders,
)
from gfimu.diagnosis.design.planned_run import planned
from gfimu.diagnosis.design.profile_search import plain_profile, profile_of, starting_points
from gfimu.diagnosis.design.proposal import SEPARATED
from sim.effects import make_effect
from sim.scenarios import Scenario
from sim.trials import Measurement, measure, random_profile
from sim.twin import Twin

LIMITS = Limits(rate=15.0, acceleration=20.0, duration=30.0)


@pytest.fixture(scope="module")
def twin():
    return Twin.load("cube12_turntable")


@pytest.fixture(scope="module")
def flex_or_quadratic(twin):
    flex = make_effect("centrifugal_flex", {"stretch_s2_rad2": 6e-5})
    return design(twin, [flex, "quadratic"], limits=LIMITS, rng=np.random.default_rng(1), mountings={}, evaluations=60)


@pytest.fixture(scope="module")
def off_axis(twin):
    return design(
        twin, ["eccentricity", "sensor_position"], limits=LIMITS, rng=np.random.default_rng(1), evaluations=12
    )


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.5, 60.0), st.floats(0.2, 200.0), st.floats(4.0, 300.0))
def test_every_point_is_a_profile_within_the_limits(seed, rate, acceleration, duration):
    limits = Limits(rate, acceleration, duration)
    rng = np.random.default_rng(seed)
    made = profile_of(np.where(rng.random(29) < 0.2, rng.integers(0, 2, 29), rng.random(29)), limits)
    assert made.peak_rate <= rate
    assert made.peak_acceleration <= acceleration * (1 + 1e-9)
    assert made.duration == pytest.approx(duration, abs=0.011)
    t = np.linspace(0.0, made.duration, 4001)
    state = made.at(t)
    assert np.abs(state.rate).max() <= rate + 1e-9
    assert np.abs(state.acceleration).max() <= acceleration * (1 + 1e-6)
    assert state.rate[0] == pytest.approx(0.0, abs=1e-9)
    assert state.rate[-1] == pytest.approx(0.0, abs=1e-9)


def test_angle_and_acceleration_are_integral_and_derivative_of_the_rate():
    made = profile_of(starting_points(np.random.default_rng(3), 8)[7], LIMITS)
    t = np.arange(0.0, 30.0, 1e-3)
    state = made.at(t)
    np.testing.assert_allclose(np.gradient(state.angle, t)[1:-1], state.rate[1:-1], atol=1e-3)
    np.testing.assert_allclose(np.gradient(state.rate, t)[1:-1], state.acceleration[1:-1], atol=5e-2)


def test_the_scenario_moves_as_designed(twin, off_axis, flex_or_quadratic):
    t = np.arange(0.0, 30.0, 0.013)
    for proposal in (off_axis, flex_or_quadratic):
        scenario = Scenario.from_dict(tomllib.loads(proposal.to_toml()))
        simulated, planned = scenario.motion.at(t), proposal.profile.at(t)
        np.testing.assert_allclose(simulated.rate, planned.rate, atol=1e-9)
        np.testing.assert_allclose(simulated.angle, planned.angle, atol=1e-9)
        assert scenario.duration == pytest.approx(30.0)
        assert scenario.mounting_rotvec == proposal.mounting
        assert scenario.sample_rate == twin.sample_rate


def test_a_design_beats_the_plain_run_and_every_start(twin, flex_or_quadratic):
    assert flex_or_quadratic.before.least_nats < SEPARATED < flex_or_quadratic.after.least_nats
    assert flex_or_quadratic.separates
    assert "upright" in flex_or_quadratic.text
    flex = make_effect("centrifugal_flex", {"stretch_s2_rad2": 6e-5})
    signatures, contenders = plan_contenders(twin, [flex, "quadratic"], duration=30.0, sample_rate=50.0)
    for point in starting_points(np.random.default_rng(1), 12):
        run = PlannedRun(profile_of(point, LIMITS), LIMITS.duration)
        table = distinguishability(normal_equations(*planned(twin, [run]), signatures)[0], contenders)
        assert table.least_nats <= flex_or_quadratic.after.least_nats * 1.05  # found at half the sample rate


def test_what_no_upright_run_separates_asks_for_another_mounting(off_axis):
    assert off_axis.before.unexplained[0, 1] < 1e-5
    assert off_axis.separates
    assert off_axis.upright_too
    assert np.linalg.norm(off_axis.mounting) > 1.5
    assert "No motion of an upright array separates eccentricity from sensor_position" in off_axis.text
    assert "upright and so mounted" in off_axis.text


def test_upright_only_says_that_it_cannot(twin):
    proposal = design(
        twin, ["gravity", "bias"], limits=LIMITS, rng=np.random.default_rng(0), mountings={}, evaluations=3
    )
    assert not proposal.separates
    assert proposal.mounting == (0.0, 0.0, 0.0)
    assert "can't separate" in proposal.text


def test_a_recording_at_hand_is_counted_and_needs_no_second_upright_run(twin):
    rng = np.random.default_rng(5)
    run = prepare_run(measure(rng, twin, setting=Measurement(duration=20.0)), twin)
    proposal = design(twin, ["gravity", "bias", "scale_factor"], limits=LIMITS, rng=rng, recorded=[run], evaluations=6)
    assert proposal.before.nats[0, 1] < 0.01
    assert proposal.before.nats[1, 0] > 1000  # a bias on every channel is no change of gravity, as the recording shows
    assert proposal.separates
    assert not proposal.upright_too
    assert "together" in proposal.text


def test_three_effects_need_the_side_as_upside_down_still_confounds_gravity_with_gain(twin):
    proposal = design(
        twin, ["gravity", "bias", "scale_factor"], limits=LIMITS, rng=np.random.default_rng(0), evaluations=6
    )
    assert proposal.separates
    assert np.linalg.norm(proposal.mounting) == pytest.approx(np.pi / 2)


def test_the_rate_stays_where_the_sensors_do_not_clip(twin):
    fast = Limits(rate=100.0, acceleration=300.0, duration=10.0)
    proposal = design(
        twin, ["quadratic", "scale_factor"], limits=fast, rng=np.random.default_rng(0), mountings={}, evaluations=3
    )
    t = np.arange(0.0, 10.0, 0.01)
    readings, _ = twin.predict(proposal.profile, t)
    assert np.abs(readings).max() < twin.expected_noise(100.0).full_scale
    assert "clip" in proposal.text
    assert 30 < proposal.profile.peak_rate < 100


def test_the_same_seed_proposes_the_same(twin):
    one, two = (
        design(twin, ["quadratic", "bias"], limits=LIMITS, rng=np.random.default_rng(7), mountings={}, evaluations=4)
        for _ in range(2)
    )
    assert one.to_toml() == two.to_toml()


@pytest.mark.parametrize(
    ("effects", "limits", "message"),
    [
        (["bias"], LIMITS, "at least two effects"),
        (["bias", "noise"], LIMITS, "'noise' has no size"),
        (["bias", "gravity"], Limits(15.0, 20.0, 1.0), "too short"),
    ],
)
def test_what_cannot_be_designed(twin, effects, limits, message):
    with pytest.raises(InputError, match=message):
        design(twin, effects, limits=limits, rng=np.random.default_rng(0))


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf")])
def test_limits_are_positive_numbers(bad):
    with pytest.raises(InputError, match="positive"):
        Limits(bad, 20.0, 60.0)


def margin(twin, effect, rival, recordings):
    """Log likelihood of the best fit of an effect's kind over that of a rival's kind."""
    one, other = gained_log_likelihood(twin, [effect, rival], [prepare_run(each, twin) for each in recordings])
    return one - other


def test_a_proposed_profile_separates_in_the_simulator_as_predicted(twin, flex_or_quadratic):
    flex = make_effect("centrifugal_flex", {"stretch_s2_rad2": 6e-5})
    setting = Measurement(duration=LIMITS.duration)
    plain, designed = (
        [
            margin(
                twin,
                "centrifugal_flex",
                "quadratic",
                [measure(np.random.default_rng(seed), twin, [flex], setting, motion=motion)],
            )
            for seed in range(3)
        ]
        for motion in (plain_profile(LIMITS), flex_or_quadratic.profile)
    )
    for measured, predicted in ((plain, flex_or_quadratic.before), (designed, flex_or_quadratic.after)):
        # The wide rival (12 sizes) fits noise worth about 6 ± 2.5 nats; the effect (one size) about half a nat. The
        # margin itself has variance 2D. Mean of three runs, three standard deviations; levels of noise are not told.
        nats = predicted.nats[0, 1]
        spread = 3 * np.sqrt((2 * nats + 6) / 3)
        assert abs(np.mean(measured) - (nats - 5.5)) < spread + 0.1 * nats
    assert min(designed) > max(SEPARATED, *plain)


def test_a_proposed_mounting_separates_in_the_simulator(twin, off_axis):
    setting = Measurement(duration=LIMITS.duration)

    def record(effects, mounting, seed):
        return measure(
            np.random.default_rng(seed),
            twin,
            effects,
            setting,
            motion=off_axis.profile,
            mounting=np.array(mounting) if np.any(mounting) else None,
        )

    # The cube is put down anew on its side, so its eccentricity is another one.
    first = record([make_effect("eccentricity", {"x_m": 5e-4, "y_m": -3e-4})], (0, 0, 0), 1)
    second = record([make_effect("eccentricity", {"x_m": -2e-4, "y_m": 6e-4})], off_axis.mounting, 2)
    alone = margin(twin, "eccentricity", "sensor_position", [first])
    together = margin(twin, "eccentricity", "sensor_position", [first, second])
    assert abs(alone) < SEPARATED
    assert together > SEPARATED


def test_open_effects_of_a_verdict(twin, tmp_path):
    file = tmp_path / "verdict.json"
    file.write_text(
        """{"verdict": "ambiguous", "causes": [
        {"effect": "gravity", "parameters": {"delta_m_s2": {"value": 0.02, "std": 0.001}},
         "not_distinguishable_from": ["bias"]},
        {"effect": "bias", "parameters": {"a13_m_s2": {"value": 0.02, "std": 0.001}},
         "not_distinguishable_from": ["gravity"]}]}"""
    )
    gravity, bias = open_effects(tmp_path, twin)
    assert gravity.parameters == {"delta_m_s2": 0.02}
    assert bias == "bias"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not a verdict"),
        ("[]", "not a verdict"),
        ('{"verdict": "explained", "causes": [{"effect": "bias", "parameters": {}}]}', "leaves no effects"),
    ],
)
def test_files_that_leave_nothing_open(twin, tmp_path, text, message):
    file = tmp_path / "verdict.json"
    file.write_text(text)
    with pytest.raises(InputError, match=message):
        open_effects(file, twin)


def test_a_random_profile_is_a_start_like_any_other(twin):
    # The search is not needed for easy pairs: any lively motion separates them, and the design does no worse.
    lively = PlannedRun(random_profile(np.random.default_rng(2), 30.0), 30.0)
    signatures, contenders = plan_contenders(twin, ["table_tilt", "bias"], duration=30.0, sample_rate=50.0)
    usual = distinguishability(normal_equations(*planned(twin, [lively]), signatures)[0], contenders).least_nats
    proposal = design(
        twin, ["table_tilt", "bias"], limits=LIMITS, rng=np.random.default_rng(0), mountings={}, evaluations=9
    )
    assert proposal.after.least_nats > 0.5 * usual > SEPARATED


@pytest.mark.study
def test_from_an_open_verdict_to_a_closed_one(twin, tmp_path):
    gravity = make_effect("gravity", {"delta_m_s2": 0.03})
    setting = Measurement(duration=10.0)
    first = measure(np.random.default_rng(1), twin, [gravity], setting)
    verdict = diagnose([first], twin)
    assert {"bias", "scale_factor"} <= set(verdict.causes[0].not_distinguishable_from)
    verdict.write(tmp_path)

    effects = open_effects(tmp_path, twin)
    proposal = design(
        twin,
        effects,
        limits=Limits(rate=15.0, acceleration=20.0, duration=10.0),
        rng=np.random.default_rng(0),
        recorded=[prepare_run(first, twin)],
        evaluations=6,
    )
    mounting = np.array(proposal.mounting)
    assert mounting.any()
    second = measure(np.random.default_rng(2), twin, [gravity], setting, motion=proposal.profile, mounting=mounting)
    closed = diagnose([first, second], twin)
    assert [cause.effect for cause in closed.causes] == ["gravity"]
    assert closed.causes[0].not_distinguishable_from == ()
    assert closed.causes[0].parameters["delta_m_s2"] == pytest.approx(0.03, abs=5 * closed.causes[0].std["delta_m_s2"])
