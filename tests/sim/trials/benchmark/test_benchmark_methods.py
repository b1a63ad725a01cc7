"""Methods of the benchmark: baselines are short, one's own is run from a file, errors are answers."""

from pathlib import Path

import numpy as np
import pytest

import gfimu
from gfimu import InputError
from gfimu.model.user_code import user_function
from sim.effects import EFFECTS
from sim.trials.benchmark import baselines
from sim.trials.benchmark.answer import answer_of, read_answers
from sim.trials.benchmark.baselines import BASELINES
from sim.trials.benchmark.baselines.best_single import _log_tail
from sim.trials.benchmark.judge import judge
from sim.trials.benchmark.library import LinearLibrary, stated_parameters
from sim.trials.benchmark.methods import BASELINE_METHODS, answer_task
from sim.trials.benchmark.truth_file import fixed_world, task_of, truths

FOLDER = Path(baselines.__file__).parent


def the_world(name, set_name="own"):
    """A development world that hides this effect alone."""
    found = (one.case.world for one in truths().values() if one.case.split == "dev" and one.case.effects == (name,))
    return next(world for world in found if world.startswith(set_name))


@pytest.mark.parametrize("name", sorted({file.stem for file in FOLDER.glob("*.py")} - {"__init__", "sysid"}))
def test_a_baseline_is_shorter_than_fifty_lines(name):
    assert name in BASELINES
    assert BASELINE_METHODS[name].__module__ == f"sim.trials.benchmark.baselines.{name}"
    assert len((FOLDER / f"{name}.py").read_text(encoding="utf-8").splitlines()) < 50


@pytest.mark.parametrize("name", ["best_single", "greedy_bic", "oracle"])
def test_baselines_name_a_large_effect_with_its_size(name):
    world = the_world("mount_tilt")
    (found,) = judge([answer_task(BASELINE_METHODS[name], task_of(world))])
    assert "mount_tilt" in found.said  # the greedy one adds what slow noise looks like
    assert found.outcome == ("wrong" if name == "greedy_bic" else "alone")
    assert found.removed > 0.99
    assert np.all(np.abs(found.z) < 6.0)


def test_the_tail_of_an_f_test_goes_on_where_it_underflows():
    for free in (1, 2, 12):
        steps = np.diff([_log_tail(x, free) for x in np.linspace(1100.0, 1300.0, 41)])
        assert steps == pytest.approx(np.full(40, -2.5), rel=0.03)


def test_the_library_explains_what_it_made():
    library = LinearLibrary.of(task_of(the_world("table_tilt")).recording, task_of(the_world("table_tilt")).twin)
    tilt = next(one for one in library.candidates if one.effect == "table_tilt")
    truth = fixed_world(the_world("table_tilt")).truth
    assert np.sqrt(library.explained([tilt])) == pytest.approx(truth.distance, abs=3.0)  # d′, and slow noise
    (cause,) = library.causes([tilt])
    true = dict(truth.hidden)["table_tilt"]
    for key in ("x_rad", "y_rad"):
        assert cause["parameters"][key]["value"] == pytest.approx(true[key], abs=6 * cause["parameters"][key]["std"])


def test_sizes_become_the_parameters_of_an_answer():
    twin = task_of(the_world("table_tilt")).twin
    tone, shape = EFFECTS["interference_tone"], {"frequency_hz": 21.0}
    covariance = np.array([[4e-4, 1e-4], [1e-4, 1e-4]])
    sizes = np.array([-0.3, 0.4])
    found = stated_parameters(tone, twin.array, sizes, covariance, shape)
    drawn = np.random.default_rng(0).multivariate_normal(sizes, covariance, 20_000)
    assert found["amplitude_m_s2"]["value"] == pytest.approx(0.5)
    assert found["amplitude_m_s2"]["std"] == pytest.approx(np.hypot(*drawn.T).std(), rel=0.03)
    assert found["phase_rad"]["value"] == pytest.approx(np.arctan2(0.4, -0.3))
    assert found["phase_rad"]["std"] == pytest.approx(np.arctan2(drawn[:, 1], drawn[:, 0]).std(), rel=0.03)
    assert found["frequency_hz"] == {"value": 21.0}
    # Near the cut of the phase a step may jump by a turn.
    cut = stated_parameters(tone, twin.array, np.array([-0.5, 1e-9]), np.diag([1e-4, 1e-4]), shape)
    assert cut["phase_rad"]["std"] == pytest.approx(0.02, rel=1e-3)


@pytest.mark.parametrize("name", ["best_single", "oracle"])
def test_baselines_predict_a_tone(name):
    world = the_world("interference_tone")
    (found,) = judge([answer_task(BASELINE_METHODS[name], task_of(world))])
    assert found.outcome == "alone"
    assert found.z  # amplitude, phase


def test_an_exception_or_a_wrong_answer_is_an_error_of_that_world():
    task = task_of("own/dev/000")

    def raises(task):
        raise RuntimeError("no convergence\nat all")

    assert answer_task(raises, task).error == "RuntimeError: no convergence"
    wrong = answer_task(lambda task: {"verdict": "explained", "causes": "bias"}, task)
    assert (wrong.verdict, "Expected `array`" in wrong.error) == ("error", True)
    arrays = answer_task(lambda task: {"verdict": "unknown", "expected_rms_m_s2": np.float64(0.03)}, task)
    assert (arrays.verdict, arrays.expected_rms_m_s2, arrays.world) == ("unknown", 0.03, "own/dev/000")


def test_a_verdict_of_a_diagnosis_is_an_answer():
    verdict = {
        "world": "own/dev/000",
        "verdict": "ambiguous",
        "causes": [
            {
                "effect": "gravity",
                "parameters": {"delta_m_s2": {"value": 0.02, "std": None}},
                "probability": 0.9,
                "place": "",
                "not_distinguishable_from": ["bias"],
                "why": "",
            }
        ],
        "gain": {},
    }
    assert answer_of(verdict, "verdict.json").causes[0].not_distinguishable_from == ["bias"]


METHOD = """
from pathlib import Path

def answer(task):
    Path("calls.txt").open("a").write(task.world + "\\n")
    return {"verdict": "nothing_found"}
"""


def test_a_run_goes_on_where_it_ended(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(METHOD)
    for _ in range(2):
        found = gfimu.benchmark.run("mine.py:answer", out="run", sets=["own"], limit=2, workers=1)
    assert (found.method, found.worlds, found.failed) == ("mine", 2, 0)
    assert (tmp_path / "calls.txt").read_text().split() == ["own/dev/000", "own/dev/001"]
    assert [one.method for one in read_answers(found.answers)] == ["mine", "mine"]
    with pytest.raises(InputError, match="holds another plan"):
        gfimu.benchmark.run("mine.py:answer", out="run", sets=["own"], limit=3, workers=1)


def test_a_world_without_an_answer_is_an_error_unless_said_otherwise(tmp_path):
    file = tmp_path / "answers.jsonl"
    file.write_text('{"world": "dcmotor/dev/001", "method": "m", "verdict": "nothing_found"}\n')
    assert len(gfimu.benchmark.judge(file, partial=True).judged) == 1
    outcomes = [one.outcome for one in gfimu.benchmark.judge(file).judged]
    assert (len(outcomes), outcomes.count("error")) == (12, 11)
    file.write_text(file.read_text() * 2)
    with pytest.raises(InputError, match="two answers for dcmotor/dev/001"):
        gfimu.benchmark.judge(file)


@pytest.mark.parametrize(
    ("reference", "words"),
    [("mine", "unknown method 'mine'"), ("none.py:answer", "no such file"), ("greedy", "greedy_bic")],
)
def test_a_wrong_method_is_refused_before_anything_is_written(tmp_path, reference, words):
    with pytest.raises(InputError, match=words):
        gfimu.benchmark.run(reference, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_file_that_fails_names_its_error(tmp_path):
    (tmp_path / "mine.py").write_text("import nothing_of_that_name\n")
    with pytest.raises(InputError, match="ModuleNotFoundError"):
        user_function(f"{tmp_path / 'mine.py'}:answer", "a method")
    (tmp_path / "mine.py").write_text("def other(task): pass\n")
    with pytest.raises(InputError, match=r"unknown function of .*mine\.py 'answer'"):
        user_function(f"{tmp_path / 'mine.py'}:answer", "a method")


def test_the_measured_set_needs_its_data(tmp_path):
    with pytest.raises(InputError, match="--data"):
        gfimu.benchmark.run("always_unknown", out=tmp_path / "run", sets=["real"], split="test", data=tmp_path)


def test_answers_for_a_measured_board_are_measured_on_the_other_recording(shared_data, tmp_path):
    """Silence removes nothing; a chip 20 mm away contradicts the drawing, and predicts worse."""
    found = gfimu.benchmark.run(
        "always_unknown", out=tmp_path / "run", sets=["real"], split="test", data=shared_data, workers=1
    )
    silent, other = gfimu.benchmark.judge(found.answers, data=shared_data).judged
    assert (silent.outcome, silent.removed, other.removed) == ("measured", 0.0, 0.0)
    assert np.isnan(silent.points)
    far = {"m1_x_m": {"value": 0.02, "std": 1e-4}}
    cause = {"effect": "sensor_position", "parameters": far}
    moved = answer_of({"world": "real/test/000", "verdict": "explained", "causes": [cause]}, "test")
    (judged,) = judge([moved], shared_data)
    assert judged.outcome == "contradicted"
    assert judged.removed < 0.0
