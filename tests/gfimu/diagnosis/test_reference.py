"""The reference as people have it: encoders with counts, coarse tachometers, commands, references that fail."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError
from gfimu.diagnosis import diagnose, prepare_run
from gfimu.recording import Recording
from sim.effects import EFFECTS, ENCODER_EFFECTS, NOT_OF_AN_ENCODER, Effect
from sim.trials import Measurement, hidden_effect, measure, random_profile
from sim.twin import Twin

SETTING = Measurement(duration=26.0)
TURN = 2 * np.pi


@pytest.fixture(scope="module")
def twin():
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


def in_steps(values, step):
    return np.floor(values / step) * step if step else values


def recorded(twin, seed, source, reference, name=None, size=300.0):
    """A run whose reference is ``reference(motion, times it is read at, tachometer)``."""
    rng = np.random.default_rng(seed)
    motion = random_profile(rng, SETTING.duration)
    hidden = [] if name is None else [hidden_effect(rng, twin, name, motion, size, SETTING)]
    run = measure(rng, twin, hidden, SETTING, motion=motion)
    moved = motion
    for step in twin.world(hidden).motion_steps:
        moved = step(moved, run.t_s)
    read_at = twin.sample_times(run.t_s, hidden)[:, -1]
    column = {"tacho": "tacho_rad_s", "angle": "angle_rad", "command": "command_rad_s"}[source]
    values = reference(moved, read_at, run.reference["tacho_rad_s"])
    recording = Recording.from_arrays(run.t_s, run.readings, twin.array, reference={column: values})
    return recording, replace(twin, drive_source=source)


@pytest.mark.study(but=["inf"])
@pytest.mark.parametrize("counts", [63, np.inf])
def test_an_encoder_with_nothing_hidden(twin, counts):
    step = TURN / counts
    found = diagnose(*one(recorded(twin, 900, "angle", lambda spin, t, _: in_steps(spin.at(t).angle, step))))
    assert found.verdict == "nothing_found", (found.causes, found.unexplained.signature)


@pytest.mark.study
@pytest.mark.parametrize("name", ["table_tilt", "tacho_latency", "clock_error"])
def test_an_encoder_finds_what_is_hidden(twin, name):
    step = TURN / 4096
    found = diagnose(*one(recorded(twin, 21, "angle", lambda spin, t, _: in_steps(spin.at(t).angle, step), name)))
    assert [cause.effect for cause in found.causes] == [name]
    assert found.gain.share_of_excess_removed > 0.97


@pytest.mark.study
@pytest.mark.parametrize("step", [0.2])
def test_a_coarse_tachometer_with_nothing_hidden(twin, step):
    found = diagnose(*one(recorded(twin, 901, "tacho", lambda spin, t, tacho: np.round(tacho / step) * step)))
    assert found.verdict == "nothing_found", (found.causes, found.unexplained.signature)


def test_a_command_that_is_followed_exactly(twin):
    found = diagnose(*one(recorded(twin, 902, "command", lambda spin, t, _: spin.at(t).rate)))
    assert found.verdict == "nothing_found", (found.causes, found.unexplained.signature)


@pytest.mark.study
@pytest.mark.parametrize(("start", "stop"), [(0.0, 9.0), (10.0, 18.0)])
def test_a_reference_that_fails_for_long(twin, start, stop):
    def failing(spin, t, tacho):
        return np.where((t >= start) & (t < stop), np.nan, tacho)

    found = diagnose(*one(recorded(twin, 908, "tacho", failing, "table_tilt")))
    assert [cause.effect for cause in found.causes] == ["table_tilt"]
    assert found.gain.share_of_excess_removed > 0.95
    assert any(f"{stop - start:.1f} s are left out" in sentence for sentence in found.sentences)


def test_a_table_at_rest_repeats_no_readings(twin):
    def resting(spin, t, _):
        return in_steps(5.0 * np.maximum(t - 12.0, 0.0) ** 2, TURN / 4096)

    recording, with_encoder = recorded(twin, 904, "angle", resting)
    assert prepare_run(recording, with_encoder).reference_valid.all()


def test_an_encoder_has_no_gain(twin):
    with_encoder = replace(twin, drive_source="angle")
    assert with_encoder.families() == ENCODER_EFFECTS
    assert (
        set(EFFECTS) - set(ENCODER_EFFECTS) == set(NOT_OF_AN_ENCODER) & set(EFFECTS) == {"tacho_scale", "tacho_ripple"}
    )
    assert not any(family.place == "reference" and name != "tacho_latency" for name, family in ENCODER_EFFECTS.items())
    assert with_encoder.reference_gain([EFFECTS["tacho_scale"]({"ratio": 0.02})]) == 1.0


@dataclass(frozen=True)
class WithoutRipple(Twin):
    """A twin that knows no ripple of the tachometer."""

    def families(self) -> Mapping[str, type[Effect]]:
        return {name: family for name, family in super().families().items() if name != "tacho_ripple"}


@pytest.mark.study
@pytest.mark.parametrize("size", [60.0])
def test_what_only_the_reference_shows_is_told_of_it(size):
    blind = WithoutRipple(array=AccelerometerArray.load("cube12"), array_name="cube12")
    recording, twin = recorded(blind, 905, "tacho", lambda spin, t, tacho: tacho, "tacho_ripple", size)
    found = diagnose([recording], twin)
    assert found.verdict == "unknown"
    assert "the reference" in found.unexplained.signature


@pytest.mark.study
def test_a_wandering_zero_of_the_tachometer_is_told_of_the_reference(twin):
    def wandering(spin, t, tacho):
        return tacho + 0.015 * np.cos(TURN * 2.5 * t / SETTING.duration)

    found = diagnose(*one(recorded(twin, 906, "tacho", wandering)))
    assert found.verdict == "unknown"
    assert found.unexplained.signature.startswith("the reference depends on slow time")


def one(pair):
    """Arguments of ``diagnose`` for one recording and its twin."""
    recording, twin = pair
    return [recording], twin


def with_gaps(twin, gaps, duration=20.0):
    """A prepared run at rest whose tachometer is missing from ``start`` to ``stop`` s."""
    t = np.arange(round(100 * duration)) / 100.0
    tacho = 0.02 * np.random.default_rng(3).standard_normal(len(t))
    for start, stop in gaps:
        tacho[(t >= start) & (t < stop)] = np.nan
    readings = np.zeros((len(t), 12))
    return prepare_run(Recording.from_arrays(t, readings, twin.array, reference={"tacho_rad_s": tacho}), twin)


@pytest.mark.parametrize(
    ("gaps", "left_out", "resumed"),
    [
        ([(3.0, 3.4)], 0.0, ()),
        ([(3.0, 5.0)], 2.0, (500,)),
        ([(0.0, 4.0), (18.0, 20.0)], 6.0, (400,)),
        ([(5.0, 7.0), (8.0, 11.0)], 6.0, (1100,)),  # too little between them
        ([(5.0, 7.0), (18.5, 19.0)], 4.0 - 0.5, (700,)),
    ],
)
def test_gaps_of_the_reference(twin, gaps, left_out, resumed):
    run = with_gaps(twin, gaps)
    assert run.unreferenced == pytest.approx(left_out, abs=0.02)
    assert run.resumed == resumed
    assert (~run.valid).any(axis=1).sum() == pytest.approx(100 * left_out, abs=2)


def test_a_reference_in_short_bursts_is_refused(twin):
    with pytest.raises(InputError, match="column tacho_rad_s has no 2 s without a gap"):
        with_gaps(twin, [(second, second + 0.7) for second in np.arange(0.0, 20.0, 1.5)])
