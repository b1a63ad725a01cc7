"""Sentences of a verdict: what is said, and what is not, for each kind."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_diagnoses import made_diagnosis

from gfimu import NamedCause
from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.verdict.parts import Residual, Unexplained
from gfimu.diagnosis.verdict.wording import Notes, verdict_sentences

FALLS = Residual(0.3, 0.1, 0.1, {}, {})
TILT = NamedCause("table_tilt", {}, {}, 0.99, why="gravity turns once per revolution")
GAIN = Gain("blocks", 0.3, 0.1, 0.97, 2.0, 0.1)


def told(verdict, causes=(), *, residual=FALLS, gain=Gain(), unexplained=Unexplained(), withdrawn=(), **notes):
    return verdict_sentences(verdict, causes, residual, gain, unexplained, withdrawn, Notes(**notes))


def test_nothing_found():
    assert told("nothing_found") == (
        "The simulation agrees with the measurement: nothing was found beyond the sensors' own noise.",
    )
    first, second = told("nothing_found", residue=3.0)
    assert first == "No single thing is wrong with the simulation."
    assert "by 3 times what a good calibration leaves" in second


def test_explained():
    words = told("explained", [TILT], gain=GAIN)
    assert words[:3] == (
        "The simulation is wrong because of table_tilt.",
        "table_tilt: gravity turns once per revolution.",
        "The residual falls from 0.3 to 0.1 m/s²; the noise alone is 0.1 m/s².",
    )
    assert words[3].startswith("On validation data (blocks), 97.0 % of the excess is gone.")
    assert len(words) == 4
    part = told("explained", [TILT], gain=Gain("blocks", 0.3, 0.1, 0.85, 2.0, 0.1))
    assert part[0] == (
        "The simulation is wrong in part because of table_tilt: 85 % of the excess is gone on validation data."
    )


@pytest.mark.parametrize(
    ("after", "says"), [(0.1, "falls from 0.3 to 0.1"), (0.3001, "stays at 0.3"), (0.5, "rises from 0.3 to 0.5")]
)
def test_a_residual_falls_only_where_it_does(after, says):
    words = told("unknown", [TILT], residual=Residual(0.3, after, 0.1, {}, {}))
    assert f"The residual {says} m/s²; the noise alone is 0.1 m/s²." in words


@pytest.mark.parametrize(("after", "says"), [(0.109, False), (0.112, True)])
def test_what_is_left_is_told_from_a_tenth_of_the_noise_on(after, says):
    residual = Residual(0.3, after, 0.1, {}, {})
    words = told("explained", [TILT], residual=residual, rest="a11 follows the rate")
    assert any("times the noise (a11 follows the rate)" in one for one in words) == says
    significant = told("explained", [TILT], residual=residual, unexplained=Unexplained(True, "a tone in a11"))
    rest = "3.2 % of the error beyond noise" if says else "hardly more than noise"
    assert f"A significant residual remains that nothing in the library explains, {rest}: a tone in a11." in significant
    assert significant[0] == "The simulation is wrong in part because of table_tilt."  # never explained beside a rest
    assert not any("times the noise" in one for one in significant)


def test_far_less_on_unseen_data_is_told():
    # Fitted: all of the excess; unseen: a quarter less is the limit, beyond two standard errors.
    far = told("explained", [TILT], gain=Gain("blocks", 0.3, 0.1, 0.7, 2.0, 0.1, share_std=0.01))
    assert any(one.startswith("On the fitted data 100 % of it is gone") for one in far)
    near = told("explained", [TILT], gain=Gain("blocks", 0.3, 0.1, 0.7, 2.0, 0.1, share_std=0.05))
    assert not any(one.startswith("On the fitted data") for one in near)


def test_ambiguous_and_confounded():
    pair = [
        NamedCause("eccentricity", {}, {}, 0.5, "", ("sensor_position",), "the cube turned over"),
        NamedCause("sensor_position", {}, {}, 0.5, "", ("eccentricity",), "the cube turned over"),
    ]
    words = told("ambiguous", pair)
    assert words[0] == (
        "The simulation is wrong, but these data do not separate eccentricity and sensor_position; "
        "the cube turned over would."
    )
    assert not any("coincidence" in one for one in words)
    assert any("eccentricity is confounded with sensor_position" in one for one in told("explained", pair[:1]))


def test_unknown():
    unexplained = Unexplained(True, "the offset of a11 changes, at 5 Hz")
    words = told("unknown", [made_diagnosis("unknown").causes[0]], unexplained=unexplained)
    assert words[0] == "The simulation is wrong in a way that nothing in the library explains."
    (bare, *_) = told("unknown", unexplained=unexplained)
    assert bare == f"{words[0][:-1]}: the offset of a11 changes, at 5 Hz."
    assert words[1].startswith("The reference reads otherwise than the table turns, as a function of the rate")
    assert words[2] == (
        "These data fit as well if the axis tilts in the room, always; "
        "to decide, record held speeds, slow and fast, both ways."
    )
    assert any(one.startswith("The residual falls") for one in words)
    assert not any("significant residual remains" in one for one in words)


def test_notes_come_last_in_order():
    words = told(
        "nothing_found", loudest=("a12", 9.80665e-3, 1.5), unreferenced=2.0, residue=1.0, withdrawn=["resonance"]
    )
    assert words[1:] == (
        "The largest bias instability is that of channel a12: 1.00 mg, 1.5 times the median of the other channels.",
        words[2],
        "2.0 s are left out, as the reference is missing there.",
        "resonance was withdrawn: it did not predict held-out data.",
    )
    assert words[2].startswith("The twin's calibration is a little off everywhere, by what a good calibration leaves")


@pytest.mark.study
def test_causes_that_explain_in_part_of_a_whole_diagnosis():
    whole = made_diagnosis("explained")
    gain = replace(whole.gain, share_of_excess_removed=0.67)
    sentences = verdict_sentences("explained", whole.causes, whole.residual, gain, whole.unexplained, ())
    assert sentences[0].startswith("The simulation is wrong in part because of table_tilt: 67 % of the excess is gone")
    assert any("so much more than on validation data" in sentence for sentence in sentences)
