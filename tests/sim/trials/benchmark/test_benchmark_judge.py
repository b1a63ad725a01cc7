"""The judge favours nobody: fake methods get what they must, by names, sizes and predictions."""

import numpy as np
import pytest

from gfimu import InputError
from sim.effects import EFFECTS
from sim.trials.benchmark.answer import Answer, CauseAnswer, ParameterAnswer, answer_of
from sim.trials.benchmark.judge import POINTS, claims_of, judge, outcome_of
from sim.trials.benchmark.judged import Judged
from sim.trials.benchmark.judged_file import read_judged, write_judged
from sim.trials.benchmark.table import Share, summaries
from sim.trials.benchmark.truth_file import Fixed, fixed_world, truths
from sim.trials.benchmark.unlisted import GOES_WITH, PLACES, PLACES_OF_LISTED, UNLISTED_TRUTH, quantities_of
from sim.trials.benchmark.world import Truth

LISTED = [fixed for fixed in truths().values() if fixed.case.set_name != "unlisted"]
UNLISTED = [fixed for fixed in truths().values() if fixed.case.set_name == "unlisted"]


def said(fixed, *names, verdict="explained", **keys):
    causes = [CauseAnswer(name, **keys) for name in names]
    return Answer(fixed.case.world, verdict if causes else "nothing_found", causes)


def mean_points(answers):
    return float(np.mean([outcome_of(one, fixed_world(one.world))[1] for one in answers]))


def test_the_oracle_gets_all_points():
    assert mean_points([said(fixed, *dict(fixed.truth.hidden)) for fixed in LISTED]) == 1.0


def test_always_unknown_gets_a_quarter_and_a_half_where_no_name_is_right():
    assert mean_points([Answer(fixed.case.world, "unknown") for fixed in LISTED]) == 0.25
    hidden = [fixed for fixed in UNLISTED if fixed.truth.place != "nothing"]
    assert mean_points([Answer(fixed.case.world, "unknown") for fixed in hidden]) == 0.5


@pytest.mark.parametrize("name", EFFECTS)
def test_always_one_name_is_worth_less_than_silence(name):
    assert mean_points([said(fixed, name) for fixed in LISTED]) < -0.7


def test_a_random_name_is_worth_less_than_silence():
    rng = np.random.default_rng(1)
    assert mean_points([said(fixed, str(rng.choice(list(EFFECTS)))) for fixed in truths().values()]) < -0.8


def test_naming_all_effects_at_once_or_in_one_set_does_not_pay():
    everything = list(EFFECTS)
    assert mean_points([said(fixed, *everything) for fixed in LISTED]) == -1.0
    one_set = [said(fixed, "bias", verdict="ambiguous", not_distinguishable_from=everything) for fixed in LISTED]
    assert mean_points(one_set) < 0.05


def test_a_single_name_pays_from_a_probability_of_five_eighths():
    p = 5 / 8
    assert p * POINTS["alone"] + (1 - p) * POINTS["wrong"] == POINTS["unknown"]


def world_with(*hidden, **more):
    case = fixed_world("own/test/005").case
    return Fixed(case, 0, "", Truth(tuple((name, {}) for name in hidden), **more))


@pytest.mark.parametrize(
    ("names", "outcome", "points"),
    [
        (["gravity", "table_tilt"], "alone", 1.0),
        (["gravity"], "part", 0.5),
        (["bias", "table_tilt"], "set", 0.5),  # bias is a tie of gravity
        (["gravity", "bias", "table_tilt"], "wrong", -1.0),  # the tie beside the truth is one cause too many
        (["gravity", "table_tilt", "cogging"], "alone", 1.0),  # true as well
        (["cogging"], "missed", 0.0),
        (["gravity", "table_tilt", "noise"], "wrong", -1.0),
        ([], "missed", 0.0),
    ],
)
def test_outcomes_of_two_hidden_effects(names, outcome, points):
    fixed = world_with("gravity", "table_tilt", ties={"gravity": ("bias",)}, allowed=("cogging",))
    assert outcome_of(said(fixed, *names), fixed) == (outcome, points)


def test_causes_that_name_each_other_are_one_claim():
    fixed = world_with("gravity")
    causes = [CauseAnswer("gravity", not_distinguishable_from=["bias"]), CauseAnswer("bias"), CauseAnswer("noise")]
    answer = Answer(fixed.case.world, "ambiguous", causes)
    assert [sorted(claim.names) for claim in claims_of(answer)] == [["bias", "gravity"], ["noise"]]
    assert outcome_of(answer, fixed)[0] == "wrong"
    pair = Answer(fixed.case.world, "ambiguous", causes[:2])
    assert outcome_of(pair, fixed) == ("set", 0.5)


def test_a_wrong_name_under_unknown_is_a_wrong_name():
    fixed = world_with("gravity")
    assert outcome_of(said(fixed, "noise", verdict="unknown"), fixed)[0] == "wrong"
    assert outcome_of(said(fixed, "unknown", verdict="unknown"), fixed)[0] == "unknown"


def test_with_nothing_hidden_silence_is_right_and_any_name_a_false_alarm():
    fixed = world_with()
    assert outcome_of(said(fixed), fixed) == ("quiet", 1.0)
    assert outcome_of(said(fixed, "bias"), fixed) == ("false_alarm", -1.0)
    assert outcome_of(Answer(fixed.case.world, "unknown"), fixed) == ("unknown", 0.25)
    assert outcome_of(Answer(fixed.case.world, "error"), fixed) == ("error", 0.0)


def test_an_unlisted_effect_is_described_by_place_or_by_a_name_of_its_own():
    fixed = next(one for one in UNLISTED if one.case.effects == ("tacho_cubic",))
    assert outcome_of(said(fixed, "unlisted", place="reference"), fixed) == ("alone", 1.0)
    assert outcome_of(said(fixed, "unlisted", place="chip"), fixed)[0] == "wrong"
    assert outcome_of(said(fixed, "unlisted", name="reference_rate_cubed", place="reference"), fixed)[0] == "alone"
    assert outcome_of(said(fixed, "unlisted", place="reference", dependence="omega^3"), fixed) == ("alone", 1.0)
    assert outcome_of(said(fixed, "unlisted", place="reference", dependence="alpha"), fixed) == ("set", 0.5)
    assert outcome_of(said(fixed, "unlisted", place="channel", dependence="omega^3"), fixed)[0] == "wrong"
    assert outcome_of(said(fixed, "quadratic"), fixed)[0] == "wrong"
    near = next(one for one in UNLISTED if one.truth.near)
    assert outcome_of(said(near, near.truth.near[0]), near) == ("set", 0.5)


def test_the_place_of_a_listed_effect_is_worth_half_its_name():
    fixed = world_with("mount_tilt")
    assert outcome_of(said(fixed, "unlisted", place="array"), fixed) == ("set", 0.5)
    assert outcome_of(said(fixed, "unlisted", place="bench"), fixed) == ("wrong", -1.0)
    two = world_with("mount_tilt", "bias")
    assert outcome_of(said(two, "unlisted", place="array"), two) == ("part", 0.5)
    there = [CauseAnswer("bias"), CauseAnswer("unlisted", place="array")]
    assert outcome_of(Answer(two.case.world, "unknown", there), two) == ("set", 0.5)


def test_every_listed_effect_has_a_place_and_every_dependence_its_quantities():
    assert set(PLACES_OF_LISTED) == set(EFFECTS)
    assert {place for places in PLACES_OF_LISTED.values() for place in places} <= set(PLACES)
    assert set(GOES_WITH) <= set(UNLISTED_TRUTH)
    for dependence, quantities in {
        "f(omega, alpha)": {"omega", "alpha"},
        "order 7.3 |omega|": {"theta", "omega"},
        "mode at 6.2 Hz of alpha": {"alpha"},
        "tone at 23.7 Hz": {"t"},
        "step at 12.13 s": {"t"},
        "memory of alpha": {"alpha"},
        "y^3": {"y"},
        "1": {"1"},
        "T lagging": {"T"},
        "time": {"t"},
    }.items():
        assert quantities_of(dependence) == quantities


def tilt(x, y, std, world="independent/dev/000"):
    sizes = {"x_rad": ParameterAnswer(x, std), "y_rad": ParameterAnswer(y, std)}
    return Answer(world, "explained", [CauseAnswer("table_tilt", sizes)], expected_rms_m_s2=0.034)


def test_sizes_and_predictions_are_measured_against_the_true_world():
    true = dict(fixed_world("independent/dev/000").truth.hidden)["table_tilt"]
    x, y = true["x_rad"], true["y_rad"]
    right, doubled, opposite = judge([tilt(x, y, 1e-4), tilt(2 * x, 2 * y, 1e-4), tilt(-x, -y, 1e-4)])
    assert right.z == (0.0, 0.0)
    assert doubled.z == pytest.approx((x / 1e-4, y / 1e-4))
    assert right.removed == pytest.approx(1.0, abs=1e-3)
    assert doubled.removed == pytest.approx(0.0, abs=0.05)
    assert opposite.removed == -1.0
    assert right.expected_ratio == pytest.approx(1.0, abs=0.02)


def test_an_angle_is_compared_on_the_circle():
    fixed = next(one for one in LISTED if one.case.effects == ("tacho_ripple",))
    true = dict(fixed.truth.hidden)["tacho_ripple"]
    turned = {"phase_rad": ParameterAnswer(true["phase_rad"] + 2 * np.pi, 0.1)}
    (found,) = judge([Answer(fixed.case.world, "explained", [CauseAnswer("tacho_ripple", turned)])])
    assert found.z == pytest.approx((0.0,), abs=1e-9)


def test_the_name_of_a_method_changes_nothing():
    one, other = judge([answer_of({**tilt_json(), "method": name}, "test") for name in ("gfimu", "mine")])
    assert {**one.to_dict(), "method": ""} == {**other.to_dict(), "method": ""}


def tilt_json():
    parameters = {"x_rad": {"value": 1e-3, "std": 1e-4}}
    return {
        "world": "independent/dev/000",
        "verdict": "explained",
        "causes": [{"effect": "table_tilt", "parameters": parameters, "probability": 0.9}],
        "sentences": ["further keys are ignored"],
    }


def test_absurd_sizes_remove_nothing():
    (found,) = judge([tilt(1e200, 0.0, 1.0)])
    assert found.removed == -1.0


def test_a_parameter_of_a_channel_that_the_array_lacks_is_refused():
    """It would change nothing, so that a wrong size would pass for none."""
    wrong = CauseAnswer("bias", {"a11_m_s2": ParameterAnswer(0.1, 0.01), "a99_m_s2": ParameterAnswer(0.1, 0.01)})
    with pytest.raises(InputError, match="independent/dev/000: effect 'bias': unknown parameter 'a99_m_s2'"):
        judge([Answer("independent/dev/000", "explained", [wrong])])
    second = CauseAnswer("misalignment", {"a7_x_rad": ParameterAnswer(0.1, 0.01)})
    with pytest.raises(InputError, match="unknown parameter 'a7_x_rad'"):  # also where it is one of a set
        judge([Answer("independent/dev/000", "ambiguous", [*tilt(1e-3, 0.0, 1e-4).causes, second])])


def test_a_description_without_a_name_may_have_any_parameter():
    described = CauseAnswer("unlisted", {"a99_m_s2": ParameterAnswer(0.1)}, place="chip")
    assert judge([Answer("independent/dev/000", "unknown", [described])])[0].outcome == "wrong"


def test_unknown_worlds_and_wrong_answers_are_refused():
    with pytest.raises(InputError, match="no world 'own/test/999'"):
        judge([Answer("own/test/999", "unknown")])
    with pytest.raises(InputError, match=r"line 3: Expected `array`.*causes"):
        answer_of({"world": "own/test/000", "verdict": "explained", "causes": "bias"}, "mine.jsonl: line 3")


def test_judged_answers_are_read_as_they_were_written(tmp_path):
    judged = judge([tilt(1e-3, 2e-3, 1e-4), Answer("independent/dev/004", "unknown", method="m", processor_s=1.5)])
    for name in ("judged.jsonl", "judged.jsonl.xz"):
        write_judged(judged, tmp_path / name)
        assert [one.to_dict() for one in read_judged(tmp_path / name)] == [one.to_dict() for one in judged]
    (tmp_path / "other.jsonl").write_text('{"world": "own/test/000"}\n')
    with pytest.raises(InputError, match="no judged answers"):
        read_judged(tmp_path / "other.jsonl")


def test_shares_have_exact_intervals():
    """Clopper and Pearson for 0 of 10 and 5 of 10, from their table."""
    assert Share(0, 10).interval == pytest.approx((0.0, 0.3085), abs=1e-4)
    assert Share(5, 10).interval == pytest.approx((0.1871, 0.8129), abs=1e-4)
    assert str(Share(0, 0)) == "–"


def test_a_summary_counts_worlds_with_and_without_something_hidden_apart():
    worlds = [fixed.case.world for fixed in LISTED if fixed.case.set_name == "own" and fixed.case.split == "dev"]
    judged = judge([Answer(world, "unknown", method="m") for world in worlds[:6]])
    (own,) = summaries(judged)  # of one set there is no summary of all
    other = next(one.case.world for one in LISTED if one.case.set_name == "independent")
    names = [one.set_name for one in summaries([*judged, *judge([Answer(other, "unknown", method="m")])])]
    assert (own.set_name, names) == ("own", ["own", "independent", "all"])
    hidden = sum(bool(fixed_world(world).truth.hidden) for world in worlds[:6])
    assert own.share("unknown") == Share(hidden, hidden)
    assert own.share("false_alarm", nothing=True) == Share(0, 6 - hidden)
    assert own.points == 0.25


def test_a_method_that_fails_on_measured_data_has_no_share_there():
    failed = Judged("real/test/000", "mine", (), ("error",), "error", float("nan"))
    (summary,) = (one for one in summaries([failed]) if one.set_name == "real")
    assert {share.cases for share in summary.shares.values()} == {0}
