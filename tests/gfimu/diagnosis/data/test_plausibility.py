"""Files wrong about themselves: units, a reversed reference, a cube turned over; and wiring faults at large."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError
from gfimu.base import STANDARD_GRAVITY
from gfimu.diagnosis import diagnose, prepare, prepare_run
from sim.effects import EFFECTS
from sim.trials import Measurement, hidden_effect, measure, random_profile
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
SHORT = Measurement(duration=15.0)
UPSIDE_DOWN = np.array([np.pi, 0.0, 0.0])


@pytest.fixture(scope="module")
def sound():
    return measure(np.random.default_rng(5), TWIN, [], SHORT)


@pytest.mark.parametrize(
    ("factor", "told"),
    [
        (1.0 / STANDARD_GRAVITY, "in g "),
        (1000.0 / STANDARD_GRAVITY, "thousandths of g"),
        (100.0, "cm/s²"),
        (1.0 / 0.0382459, "counts of the converter"),
    ],
)
def test_readings_in_another_unit_are_refused(sound, factor, told):
    with pytest.raises(InputError, match=told):
        diagnose([replace(sound, readings=factor * sound.readings)], TWIN)


@pytest.mark.parametrize(
    ("factor", "told"),
    [(60 / (2 * np.pi), "rev/min"), (180 / np.pi, "deg/s"), (1 / (2 * np.pi), "rev/s"), (-1.0, "opposite sign")],
)
def test_a_reference_in_another_unit_or_reversed_is_refused(sound, factor, told):
    reference = {**sound.reference, "tacho_rad_s": factor * sound.reference["tacho_rad_s"]}
    with pytest.raises(InputError, match=told):
        diagnose([replace(sound, reference=reference)], TWIN)


def test_both_in_other_units_are_told_together(sound):
    reference = {**sound.reference, "tacho_rad_s": sound.reference["tacho_rad_s"] * 60 / (2 * np.pi)}
    with pytest.raises(InputError, match=r"in g .*rev/min"):
        diagnose([replace(sound, readings=sound.readings / STANDARD_GRAVITY, reference=reference)], TWIN)


def test_a_dead_chip_besides_hides_no_wrong_unit(sound):
    readings = sound.readings / STANDARD_GRAVITY
    readings[:, 3:6] = 0.0
    with pytest.raises(InputError, match="in g "):
        diagnose([replace(sound, readings=readings)], TWIN)


def test_a_reference_without_a_direction_is_refused(sound):
    """As of a tachometer that counts pulses: the runs of the campaign turn both ways."""
    reference = {**sound.reference, "tacho_rad_s": np.abs(sound.reference["tacho_rad_s"])}
    with pytest.raises(InputError, match="wrong sign in"):
        diagnose([replace(sound, reference=reference)], TWIN)


def test_channels_that_follow_no_motion_are_refused(sound):
    noise = np.random.default_rng(1).normal(0.0, 3.0, sound.readings.shape)
    with pytest.raises(InputError, match="no channel follows"):
        diagnose([replace(sound, readings=noise)], TWIN)


def test_times_in_milliseconds_are_refused(sound):
    with pytest.raises(InputError, match="is column t_s in seconds"):
        diagnose([replace(sound, t_s=1000.0 * sound.t_s)], TWIN)


@pytest.mark.study
def test_isolated_values_of_the_reference_are_told_and_spoil_nothing(sound):
    """Pulses too many, some close to each other: they are left out, and what remains fits to the noise."""
    wrong = np.random.default_rng(1).random(len(sound)) < 0.01
    reference = {**sound.reference, "tacho_rad_s": sound.reference["tacho_rad_s"] + np.where(wrong, 30.0, 0.0)}
    found = diagnose([replace(sound, reference=reference)], TWIN)
    assert found.verdict == "unknown"
    assert found.unexplained.signature.startswith(f"{wrong.sum()} isolated")
    assert not found.causes
    assert found.residual.rms_after < 1.02 * found.residual.noise_floor


@pytest.mark.study(but=["holds its last"])
@pytest.mark.parametrize(
    ("lost", "value"),
    [((6.0, 9.0), None), ((6.0, 9.0), 0.0), ((8.0, 8.2), 0.0)],
    ids=["holds its last", "falls to zero", "falls to zero for a moment"],
)
def test_a_reference_that_stops_for_a_while_counts_as_lost(sound, lost, value):
    tacho = sound.reference["tacho_rad_s"].copy()
    gone = (sound.t_s >= lost[0]) & (sound.t_s < lost[1])
    tacho[gone] = tacho[gone][0] if value is None else value
    found = diagnose([replace(sound, reference={**sound.reference, "tacho_rad_s": tacho})], TWIN)
    assert found.verdict == "nothing_found"
    assert any("the reference is missing" in line for line in found.sentences) == (lost[1] - lost[0] > 0.5)


def test_zero_to_the_last_digit_at_rest_is_no_lost_reference():
    """A tachometer of pulses tells rest without noise."""
    recording = measure(np.random.default_rng(5), TWIN, [], SHORT)
    tacho = recording.reference["tacho_rad_s"].copy()
    tacho[np.abs(tacho) < 0.08] = 0.0
    run = prepare_run(replace(recording, reference={**recording.reference, "tacho_rad_s": tacho}), TWIN)
    assert run.reference_valid.all()


def test_a_cube_that_lies_otherwise_than_its_metadata_say_is_refused():
    turned = measure(np.random.default_rng(5), TWIN, [], SHORT, mounting=UPSIDE_DOWN)
    assert diagnose([turned], TWIN).verdict == "nothing_found"
    untold = replace(turned, metadata={k: v for k, v in turned.metadata.items() if k != "mounting_rotvec_rad"})
    with pytest.raises(InputError, match=r"upside down.*mounting_rotvec_rad: \[3.1416, 0.0000, 0.0000\]"):
        diagnose([untold], TWIN)


@pytest.mark.parametrize("name", sorted(set(EFFECTS) - {"noise", "bias_random_walk", "coarse_resolution"}))
def test_no_gross_effect_is_taken_for_a_wrong_file(name):
    """Every effect of the library far beyond its usual size passes."""
    rng = np.random.default_rng(7)
    motion = random_profile(rng, SHORT.duration)
    hidden = hidden_effect(rng, TWIN, name, motion, 6000.0, SHORT)
    prepare([measure(rng, TWIN, [hidden], SHORT, motion=motion)], TWIN, ["run"])


def test_a_board_that_was_not_read_is_refused(sound):
    with pytest.raises(InputError, match="the channels hold one value"):
        diagnose([replace(sound, readings=np.tile(sound.readings[:1], (len(sound), 1)))], TWIN)


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 2)], ids=["all", "y and z"])
def test_many_inverted_channels_are_one_fault(sound, axes):
    """In pairs they would look exchanged: opposite arms feel opposite accelerations."""
    sign = np.ones(12)
    wrong = [3 * chip + axis for chip in range(4) for axis in axes]
    sign[wrong] = -1.0
    (cause,) = diagnose([replace(sound, readings=sign * sound.readings)], TWIN).causes
    assert cause.effect == "sign_flip"
    assert cause.parameters["channel"] == [TWIN.array.channels[channel] for channel in wrong]


@pytest.mark.study
def test_exchanged_chips_are_one_fault_and_undone_in_the_extended_twin(sound):
    order = [3, 4, 5, 0, 1, 2, *range(6, 12)]
    exchanged = replace(sound, readings=sound.readings[:, order])
    found = diagnose([exchanged], TWIN)
    (cause,) = found.causes
    assert cause.effect == "axis_swap"
    assert cause.parameters["channels"] == ["a11", "a21", "a12", "a22", "a13", "a23"]
    assert "chips a1 and a2" in cause.why
    assert diagnose([exchanged], found.twin).verdict == "nothing_found"
