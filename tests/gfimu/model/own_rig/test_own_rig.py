"""A simulation of one's own: found, checked, and taking part in a diagnosis, as docs/examples/pendulum.py does."""

import dataclasses
import json
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import gfimu
from gfimu import InputError
from gfimu.diagnosis import State
from gfimu.model import load_model
from gfimu.model.own_rig import Cause, Parameter, SimulatorModel, bias_cause, gain_cause
from gfimu.model.own_rig.places import chip_patterns

PENDULUM = Path(__file__).parents[4] / "docs" / "examples" / "pendulum.py"
ARRAY = gfimu.AccelerometerArray.load("one_chip")
T = np.arange(200) / 100.0


class Still:
    def at(self, t):
        return State(np.zeros(len(t)), np.ones(len(t)), np.zeros(len(t)))


def readings_of(state, t, wrong):
    centripetal = np.outer(state.rate**2, [0.1 + wrong["radius_m"], 0.0, 0.0])
    return centripetal + np.array([0.0, 0.0, 9.8]), state.rate


RADIUS = Cause("radius", "the chip is farther out", (Parameter("radius_m", "m", 0.01),))


def model(**changes):
    fields = {"array": ARRAY, "simulate": readings_of, "causes": (RADIUS, bias_cause(ARRAY), gain_cause(ARRAY))}
    return SimulatorModel(**fields | changes)


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory):
    """Run the example as its first lines say."""
    folder = tmp_path_factory.mktemp("pendulum")
    subprocess.run([sys.executable, PENDULUM, "run.csv"], cwd=folder, check=True)
    return folder / "run.csv"


@pytest.mark.study
def test_the_stranger_s_mistake_is_found(pendulum, tmp_path):
    found = gfimu.diagnose(pendulum, f"{PENDULUM}:twin", out=tmp_path / "d")
    assert [cause.effect for cause in found.causes] == ["pivot_offset"]
    value, std = found.causes[0].parameters["pivot_offset_m"], found.causes[0].std["pivot_offset_m"]
    assert abs(value - 0.004) < 4 * std
    assert std < 1e-4
    assert {file.name for file in (tmp_path / "d").iterdir()} >= {"verdict.json", "twin.toml", "report.html"}
    again = load_model(tmp_path / "d" / "twin.toml", allow_code=True)  # the twin file leads back to the simulation
    assert again.effects[0].parameters["pivot_offset_m"] == pytest.approx(value)
    assert json.loads((tmp_path / "d" / "verdict.json").read_text())["verdict"] == "explained"


def test_the_example_is_as_short_as_it_says():
    assert len(PENDULUM.read_text(encoding="utf-8").splitlines()) <= 100
    assert "sim" not in {line.split()[1].partition(".")[0] for line in PENDULUM.open() if line.startswith("from ")}


def test_the_example_s_readings_are_those_of_a_moving_chip():
    """Specific force by second differences of the chip's place, in the chip's axes."""
    names = runpy.run_path(str(PENDULUM))
    t = np.arange(0.0, 4.0, 1e-3)
    nothing = {one.key: 0.0 for cause in names["twin"]().causes for one in cause.parameters}
    motion = names["Swing"](t)
    readings, _ = names["simulate"](motion, t, nothing)
    x, z = names["FAR"] * np.sin(motion.angle), -names["FAR"] * np.cos(motion.angle)
    force = np.column_stack([np.diff(x, 2), np.diff(z, 2)]) / 1e-6 + [0.0, names["GRAVITY"]]
    angle = motion.angle[1:-1]
    outwards, across = (np.sin(angle), -np.cos(angle)), (np.cos(angle), np.sin(angle))
    for column, (right, up) in ((3, outwards), (4, across)):
        expected = force[:, 0] * right + force[:, 1] * up
        np.testing.assert_allclose(readings[1:-1, column], expected, atol=2e-4)


def test_causes_change_the_prediction_in_their_order():
    here = model()
    families = here.families()
    effects = [
        families["radius"]({"radius_m": 0.02}),
        families["scale_factor"]({"a13": 0.1}),
        families["bias"]({"a11_m_s2": 0.5}),
    ]
    readings, reference = here.extended(effects[:1]).predict(Still(), T, effects=effects[1:])
    np.testing.assert_allclose(readings, np.tile([0.12 + 0.5, 0.0, 9.8 * 1.1], (200, 1)))
    np.testing.assert_allclose(reference, 1.0)


def nameless(dependence, series=("a12",), **numbers):
    """A described error of a channel, or of the reference where it is of no series."""
    place = {"place": "channel", "what": "offset", "pattern": "one", "series": list(series)}
    place = place if series else {"place": "reference", "what": "reads"}
    return {**place, "dependence": dependence, "numbers": numbers, "coefficients": [[0.4]]}


def test_what_has_no_name_is_added_per_channel_or_to_the_reference():
    here = model()
    cubic = here.described(nameless("y^3", ["a13"], most=10.0))
    np.testing.assert_allclose(here.predict(Still(), T, effects=[cubic])[0][:, 2], 9.8 + 0.4 * (9.8 / 9.80665) ** 3)
    rate = here.described(nameless("omega", scale=2.0, first=0.0))
    np.testing.assert_allclose(here.predict(Still(), T, effects=[rate])[0][:, 1], 0.2)
    read = here.described(nameless("omega", (), scale=2.0, first=0.0))
    np.testing.assert_allclose(here.predict(Still(), T, effects=[read])[1], 1.2)


def test_the_noise_follows_the_band():
    slow, fast = (model(noise_std=0.02).expected_noise(rate) for rate in (50.0, 400.0))
    np.testing.assert_allclose(slow.white, np.hypot(0.02, 1e-3 / np.sqrt(12)))
    np.testing.assert_allclose(fast.analogue, 0.04, rtol=1e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"causes": (RADIUS, RADIUS)}, "two causes are called 'radius'"),
        ({"causes": (RADIUS, dataclasses.replace(RADIUS, name="arm"))}, "two parameters are called 'radius_m'"),
        ({"drive_source": "gyro"}, "unknown drive source 'gyro'"),
        ({"quantum": 0.0}, "quantum = 0.0 must be positive"),
        ({"noise_std": float("nan")}, "noise_std = nan must be positive"),
    ],
)
def test_a_model_that_can_t_be_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        model(**changes)


def test_a_cause_without_parameters_and_a_wrong_key_are_refused():
    with pytest.raises(InputError, match="needs parameters"):
        Cause("nothing", "", ())
    with pytest.raises(InputError, match="unknown parameter 'radius'; valid: radius_m"):
        RADIUS({"radius": 1.0})


def test_a_wrong_shape_is_refused():
    here = model(simulate=lambda state, t, wrong: (np.zeros((len(t), 2)), state.rate))
    with pytest.raises(InputError, match=r"readings have shape \(200, 2\) for 200 times; return \(200, 3\)"):
        here.predict(Still(), T)


@pytest.mark.parametrize(
    ("content", "function", "message"),
    [
        ("x = 1\n", "twin", "unknown function"),
        ("def twin():\n    return 3\n", "twin", "no world model"),
        ("def twin(a):\n    return 3\n", "twin", "takes no arguments"),
        ("raise OSError('no file')\n", "twin", "OSError: no file"),
        ("def twin(:\n", "twin", "SyntaxError"),
        (None, "twin", "no such file"),
    ],
)
def test_a_file_without_a_model_is_one_clear_line(tmp_path, content, function, message):
    file = tmp_path / "rig.py"
    if content is not None:
        file.write_text(content)
    with pytest.raises(InputError, match=message) as error:
        load_model(f"{file}:{function}")
    assert "\n" not in str(error.value)


def test_other_names_mean_no_model_of_one_s_own(tmp_path):
    assert load_model("cube12_turntable") is None
    file = tmp_path / "twin.toml"
    file.write_text('array = "cube12"\n')
    assert load_model(file) is None


def test_a_twin_file_with_an_unknown_effect_is_refused(tmp_path):
    file = tmp_path / "twin.toml"
    file.write_text(f'simulator = "{PENDULUM}:twin"\n[[effect]]\nname = "pivot"\n')
    with pytest.raises(InputError, match="unknown effect"):
        load_model(file, allow_code=True)


def test_a_term_without_a_name_comes_back_from_its_twin_file(tmp_path):
    pendulum = load_model(f"{PENDULUM}:twin")
    term = pendulum.described(nameless("omega^2", scale=4.0, first=0.0))
    file = tmp_path / "twin.toml"
    file.write_text(pendulum.extended([term]).to_toml())
    again = load_model(file, allow_code=True)
    np.testing.assert_allclose(again.predict(Still(), T)[0], pendulum.predict(Still(), T, effects=[term])[0])
    file.write_text(f'simulator = "{PENDULUM}:twin"\n[[effect]]\nname = "unlisted"\n')
    with pytest.raises(InputError, match="effect 'unlisted': 'what' is missing"):
        load_model(file, allow_code=True)


def test_patterns_of_chips_take_their_sizes():
    array = gfimu.AccelerometerArray.load("cube12")
    every, first, *_ = chip_patterns(array, 3)
    assert every.mixing.shape == (12, 12)
    assert first.mixing.shape == (12, 3)
