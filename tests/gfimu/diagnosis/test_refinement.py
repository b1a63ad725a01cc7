"""Fits of several effects: columns against central differences, and descent to where nothing more is gained."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gfimu.diagnosis.calibration_residue import CalibrationResidue
from gfimu.diagnosis.causes import effects_of_run
from gfimu.diagnosis.data.run import prepare_run
from gfimu.diagnosis.fit import Start, without
from gfimu.diagnosis.refinement import refine, refine_each
from gfimu.diagnosis.screening import screen
from gfimu.diagnosis.search import Blocks
from gfimu.diagnosis.signatures import Signature, cause_columns, hypotheses, signature_columns
from gfimu.diagnosis.stretches import make_segments
from gfimu.geometry.array import AccelerometerArray
from sim.campaign import Measurement, measure
from sim.effects import make_effect
from sim.twin import Twin

PAIRS = {
    ("scale_factor", "cross_axis"): ({"a12": 0.02, "a21": -0.03}, {"a12_from_a13": 0.02, "a21_from_a22": -0.01}),
    ("cross_axis", "quadratic"): ({"a12_from_a13": 0.02}, {"a12_s2_m": 2e-3, "a33_s2_m": -1e-3}),
    ("misalignment", "bias"): ({"a1_x_rad": 0.02, "a1_y_rad": -0.01}, {"a11_m_s2": 0.3}),
}


@pytest.fixture(scope="module")
def twin():
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


def _segment(twin, effects=()):
    recording = measure(np.random.default_rng(5), twin, effects, Measurement(duration=20.0))
    (segment,) = make_segments(twin, [prepare_run(recording, twin)])
    segment.prepare_weights()
    return segment


def _causes(segment, names, values, array):
    """The freest hypothesis of each effect at given parameters."""
    families = segment.model.families()
    causes = []
    for name, parameters in zip(names, values, strict=True):
        family = families[name]
        signature = Signature(family, {}, np.arange(len(family.sizes(array))))
        free = hypotheses([signature], array, 1)[0]
        sizes = family(parameters).size_values(array) / [size.prior_std for size in family.sizes(array)]
        causes.append(free.cause(np.linalg.lstsq(free.mixing, sizes, rcond=None)[0]))
    return causes


@pytest.mark.parametrize("gain", [0.5, 2.0])
def test_a_gain_of_the_reference_is_not_paid_for_by_the_prior_of_the_drive(twin, gain):
    # The same motion read by a tachometer of another gain: the misfit has to be the same, roughness included.
    objectives = []
    for effects in ([], [make_effect("tacho_scale", {"ratio": gain - 1.0})]):
        segment = _segment(twin, effects)
        for _ in range(2):
            segment.coefficients = refine([segment], (), [effects], iterations=8).drives[0]
            segment.learn_roughness()
        fit = refine([segment], (), [effects], iterations=8)
        objectives.append(fit.objective)
        segment.coefficients = fit.drives[0]
        motion = segment.motion(effects).at(segment.run.t)
        assert_allclose(motion.rate, segment.spin.at(segment.run.t).rate / (gain if effects else 1.0))
    # The roughness alone is some 400, one per coefficient.
    assert objectives[0] == pytest.approx(objectives[1], abs=60.0)


@pytest.mark.parametrize("names", list(PAIRS), ids="+".join)
def test_columns_are_central_differences_of_effects_in_their_order(twin, names):
    # Sensing effects do not commute. Varied at the end of the list instead of in its place, an effect's column holds
    # their commutator over a small step.
    segment = _segment(twin)
    causes = _causes(segment, names, PAIRS[names], twin.array)
    columns = cause_columns(segment, causes, (), shapes=False)  # (c + 1, K, n)
    place = 0
    for number, cause in enumerate(causes):
        for coordinate in range(len(cause.coordinates)):
            two = []
            for step in (1e-3, -1e-3):
                moved = cause.coordinates.copy()
                moved[coordinate] += step
                changed = [*causes[:number], cause.at(moved), *causes[number + 1 :]]
                two.append(segment.predict(effects_of_run(changed, twin.array, 0)))
            truth = (two[0] - two[1]) / 2e-3 * segment.row_weight
            assert_allclose(columns[:, place].T, truth, atol=0.02 * np.abs(truth).max() + 1e-9)
            place += 1


def test_screening_about_a_set_varies_its_effects_in_their_order(twin):
    names = ("scale_factor", "cross_axis")
    segment = _segment(twin)
    causes = _causes(segment, names, PAIRS[names], twin.array)
    family = causes[0].family
    signature = Signature(family, {}, np.arange(len(family.sizes(twin.array))))
    columns, _ = signature_columns(segment, [signature], causes, ())  # (c + 1, P, n)
    assert_allclose(columns, cause_columns(segment, causes[:1], [], shapes=False), atol=0.05 * np.abs(columns).max())


@pytest.mark.usefixtures("several_processors")
def test_sets_refined_at_once_are_as_one_after_the_other_and_leave_the_drive_alone(twin):
    segment = _segment(twin, [make_effect("bias", {"a12_m_s2": 0.2})])
    sets = [_causes(segment, [name], [{}], twin.array) for name in ("bias", "scale_factor", "cross_axis", "quadratic")]
    before, drive = segment.coefficients, refine([segment], (), [[]]).drives
    single = [refine([segment], causes, [[]], drives=drive) for causes in sets]
    for at_once in (refine_each([segment], sets, [[]], [drive] * len(sets)) for _ in range(3)):
        # To the digits that another number of threads in the algebra leaves.
        assert_allclose([fit.log_posterior for fit in at_once], [fit.log_posterior for fit in single], rtol=1e-7)
        assert [fit.key for fit in at_once] == [fit.key for fit in single]
    assert segment.coefficients is before


def test_a_pair_that_does_not_commute_is_fitted_until_nothing_is_gained(twin):
    names = ("scale_factor", "cross_axis")
    truth = [make_effect(name, parameters) for name, parameters in zip(names, PAIRS[names], strict=True)]
    segment = _segment(twin, truth)
    causes = _causes(segment, names, PAIRS[names], twin.array)
    start = [cause.at(0.8 * cause.coordinates) for cause in causes]
    fit = refine([segment], start, [()], iterations=8)
    again = refine([segment], fit.causes, [()], drives=fit.drives, iterations=8)
    assert fit.objective - again.objective == pytest.approx(0.0, abs=0.05)
    for cause, wanted in zip(fit.causes, causes, strict=True):
        off = (cause.coordinates - wanted.coordinates) / np.sqrt(cause.covariance.diagonal())
        assert np.abs(off).max() < 4.5


@pytest.mark.parametrize("off", [0.0, 0.5])
def test_the_energy_of_a_held_drive_is_what_elimination_starts_from(twin, off):
    segment = _segment(twin, [make_effect("bias", {"a12_m_s2": 0.2})])
    segment.coefficients = segment.coefficients + off * np.sin(np.arange(segment.spline.size))
    for _ in range(2):
        drive = segment.linearise([]).drive
        assert segment.energy([]) == pytest.approx(drive.objective + drive.distance(), rel=1e-9)
        # The same with a residue of the calibration that is free at any drive.
        columns = np.zeros((len(segment.weight_mask[0]), 2, len(segment.run.t)))
        columns[1, 0], columns[4, 1] = 0.1, 0.1 * np.sin(segment.run.t)
        segment.calibration_residue = CalibrationResidue.of_columns(columns)


def test_the_last_step_is_taken_though_not_looked_at(twin):
    segment = _segment(twin, [make_effect("bias", {"a12_m_s2": 0.2})])
    fit = refine([segment], _causes(segment, ["bias"], [{}], twin.array), [()], iterations=8)
    (cause,) = fit.causes
    std = np.sqrt(cause.covariance.diagonal())
    start = cause.at(cause.coordinates + 0.3 * std * (np.arange(len(std)) == 1))  # 0.1 nats off
    again = refine([segment], [start], [()], drives=fit.drives, iterations=8)
    assert_allclose(again.causes[0].coordinates, cause.coordinates, atol=0.05 * std.min())
    assert again.log_evidence == pytest.approx(fit.log_evidence, abs=0.01)
    assert again.objective == pytest.approx(fit.objective, abs=0.01)


def test_a_set_starts_where_a_linear_world_would_put_it(twin):
    # Without one of two effects that share the drive, the others and the drive are at once near their new best.
    truth = [make_effect("sensor_position", {"a1_x_m": 5e-4, "a1_y_m": 5e-4}), make_effect("bias", {"a12_m_s2": 0.01})]
    segment = _segment(twin, truth)
    causes = _causes(segment, ["sensor_position", "bias"], [{}, {}], twin.array)
    fit = refine([segment], causes, [()], iterations=8)
    start = without(fit, 0, twin.array)
    best = refine([segment], start.causes, [()], drives=start.drives, iterations=8)
    energies = []
    for state in (start, Start(fit.causes[1:], fit.drives), best):
        segment.coefficients = state.drives[0]
        energies.append(segment.energy(effects_of_run(state.causes, twin.array, 0)))
    assert energies[0] - energies[2] < 1e-3 * (energies[1] - energies[2])
    for other in (start, Start(fit.causes[1:], fit.drives)):
        again = refine([segment], fit.causes[1:], [()], drives=fit.drives, iterations=8, other=other)
        assert again.log_posterior == pytest.approx(best.log_posterior, abs=0.05)


def test_a_screened_set_starts_with_the_drive_that_follows_it(twin):
    segment = _segment(twin, [make_effect("sensor_position", {"a1_x_m": 5e-4, "a1_y_m": 5e-4})])
    nothing = refine([segment], (), [()], iterations=8)
    signatures = screen([segment], nothing, [()], 1)
    (member,) = [
        number
        for number, one in enumerate(signatures.hypotheses)
        if one.name == "sensor_position" and len(one.mixing) == one.mixing.shape[1]
    ]
    blocks = Blocks(signatures)
    cause = signatures.hypotheses[member].cause(blocks.coordinates((member,))[0])
    (move,) = signatures.drive_moves([cause], (member,))
    best = refine([segment], [cause], [()], drives=nothing.drives, iterations=8)
    energies = []
    for drive in (nothing.drives[0] + move, nothing.drives[0], best.drives[0]):
        segment.coefficients = drive
        energies.append(segment.energy(effects_of_run([cause], twin.array, 0)))
    assert energies[0] - energies[2] < 0.01 * (energies[1] - energies[2])


def test_a_gross_play_is_fitted_from_any_width(twin, monkeypatch):
    # The derivative by the state of the instant alone doesn't know what a play remembers.
    lost, width = 1.05, 0.19
    segment = _segment(twin, [make_effect("hysteresis", {"lost_m_s2": lost, "width_m_s2": width})])
    family = segment.model.families()["hysteresis"]
    size = lost / family.sizes(twin.array)[0].prior_std
    ends = []
    for share in (0.5, 1.5):
        (play,) = hypotheses([Signature(family, {"width_m_s2": share * width}, np.arange(1))], twin.array, 1)
        (found,) = refine([segment], [play.cause(np.array([size]))], [[]], iterations=14).causes
        ends.append(found.effect(twin.array).parameters)
    assert ends[0]["width_m_s2"] == pytest.approx(ends[1]["width_m_s2"], rel=0.02)
    assert ends[0]["width_m_s2"] == pytest.approx(width, rel=0.01)
    monkeypatch.setattr(segment, "felt_play", lambda effects: None)
    (play,) = hypotheses([Signature(family, {"width_m_s2": width}, np.arange(1))], twin.array, 1)
    (blind,) = refine([segment], [play.cause(np.array([size]))], [[]], iterations=14).causes
    assert blind.effect(twin.array).parameters["width_m_s2"] != pytest.approx(width, rel=0.1)
    assert ends[0]["lost_m_s2"] == pytest.approx(lost, rel=0.02)


def test_a_play_that_fits_is_followed_from_there(twin, monkeypatch):
    """As if it held nothing, which comes nearer from far off, a fit would go away first."""
    lost, width = 1.05, 0.19
    segment = _segment(twin, [make_effect("hysteresis", {"lost_m_s2": lost, "width_m_s2": width})])
    family = segment.model.families()["hysteresis"]
    (play,) = hypotheses([Signature(family, {"width_m_s2": width}, np.arange(1))], twin.array, 1)
    held = []
    linearised = segment.linearise
    monkeypatch.setattr(segment, "linearise", lambda effects: held.append(segment.holding) or linearised(effects))
    fit = refine([segment], [play.cause(np.array([lost / family.sizes(twin.array)[0].prior_std]))], [[]], iterations=14)
    assert not all(held)
    held.clear()
    again = refine([segment], fit.causes, [[]], drives=fit.drives, iterations=14)
    assert held
    assert all(held)
    assert again.objective == pytest.approx(fit.objective, abs=20.0)


@pytest.mark.parametrize(("name", "shape", "share"), [("hysteresis", {"width_m_s2": 0.06}, 0.02), ("bias", {}, 0.0)])
def test_what_happens_at_a_level_of_the_readings_may_leave_more(twin, name, shape, share):
    """A level is found to 0.2 of the noise, here a tenth of it, whose square is left."""
    family = twin.families()[name]
    places = hypotheses([Signature(family, shape, np.arange(len(family.sizes(twin.array))))], twin.array, 1)
    cause = places[0].cause(np.ones(places[0].mixing.shape[1]))
    assert cause.inexactness(0.03) == pytest.approx(share)
