"""Calibration by spin: plateaus, model, and K2 and K3 against worlds that the simulation makes."""

from dataclasses import replace

import numpy as np
import pytest
import spin_cases
from spin_cases import CUBE, ON_ITS_SIDE, Unit, normalised_errors

from gfimu import Calibration, InputError, UnitError, load_calibration
from gfimu.calibration import ErrorModel, SpinPolicy, certify
from gfimu.calibration.nonlinearity import cubic_std
from gfimu.calibration.spin import spin
from gfimu.calibration.spin.model import Geometry, SpinGeometry, read_plateaus
from gfimu.calibration.spin.plateaus import find_plateaus
from gfimu.recording import Recording
from sim import SensorErrors, SensorSettings
from sim.scenarios import Scenario
from sim.simulation import simulate

RATE = 100.0
QUIET = SensorSettings(noise=False, quantisation=False, bandwidth=False)


def quiet_unit(rng, *, radius=0.0, quadratic=None, cubic=None, settings=QUIET):
    """Chips without noise or other errors, with bends, at their places but for a tolerance."""
    unit = Unit.draw(rng, settings, SpinPolicy(radius_std_m=radius))
    zero = np.zeros(12)
    errors = replace(
        SensorErrors.none(12),
        quadratic=zero if quadratic is None else quadratic,
        cubic=zero if cubic is None else cubic,
    )
    return replace(unit, sensor=replace(unit.sensor, errors=errors))


def exact_start(bias=1e-4, gain=1e-5):
    """A static calibration that is all but exact."""
    names, values, std = [], [], []
    for chip in CUBE.chips:
        names += [f"{chip.name}_M_{i}{j}" for i in "xyz" for j in "xyz"] + [f"{chip.name}_b_{i}" for i in "xyz"]
        values += [*np.eye(3).ravel(), *np.zeros(3)]
        std += [*np.full(9, gain), *np.full(3, bias)]
    return Calibration(
        "array", "m_s2", CUBE.channels, "array", 9.80665, tuple(names), np.array(values), np.diag(np.square(std))
    )


def table(**changes):
    """A table without imperfections, but for those named."""
    still = dict.fromkeys(
        ("stretch_std_s2_rad2", "dynamic_levelling_std_s2_rad", "shift_std_m_s2_rad2", "tacho_scale_std"), 1e-15
    )
    return SpinPolicy(**{"radius_std_m": 1e-9, "cubic_of_poses": 0.0, **still, **changes})


def bends(result, kind):
    return np.array([result.value(f"{chip}_{kind}_{axis}") for chip in result.chips for axis in "xyz"])


def spread(result, kind):
    return np.array([result.std_of(f"{chip}_{kind}_{axis}") for chip in result.chips for axis in "xyz"])


ACROSS = np.array([0, 1, 3, 4, 6, 7, 9, 10])
"""Channels across the axis of an upright cube."""


def test_a_cubic_model_reads_and_corrects():
    model = ErrorModel(
        np.array([[25.0, 0.3, 0.1], [-0.2, 24.0, 0.0], [0.1, 0.1, 26.0]]),
        np.array([3.0, -2.0, 1.0]),
        np.array([8e-6, -9e-6, 0.0]),
        np.array([3e-9, -2e-9, 4e-9]),
    )
    a = np.random.default_rng(0).uniform(-150, 150, (200, 3))
    np.testing.assert_allclose(model.correct(model.read(a)), a, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(model.in_gauge("x_axis").cubic, model.cubic)


def test_the_series_of_the_reading_is_that_of_its_derivatives():
    model = ErrorModel(np.eye(3), np.zeros(3), np.array([4e-4, -3e-4, 2e-4]), np.array([5e-6, 2e-6, -4e-6]))
    y = np.array([[-2.0], [-1.0], [0.0], [1.0], [2.0]]) * np.ones(3)
    readings = model.read(y)
    second, third = model.series
    np.testing.assert_allclose((readings[3] + readings[1]) / 2.0, second, rtol=1e-4)
    difference = (readings[4] - 2 * readings[3] + 2 * readings[1] - readings[0]) / 12.0
    np.testing.assert_allclose(difference, third, rtol=1e-3)


def test_the_prior_of_c_is_the_data_sheets():
    recording = Recording(np.arange(3.0), np.zeros((3, 12)), CUBE.channels, metadata={"part": "adxl345"})
    np.testing.assert_allclose(cubic_std(recording), 0.005 / 156.9064**2)
    counts = replace(recording, unit="lsb")
    np.testing.assert_allclose(cubic_std(counts), 0.005 / 156.9064**2 * 0.038245935**2)


def steady(rate, ripple=0.0, wave=0.0, seconds=8.0):
    """One channel triad on a table that turns at a rate with a ripple, after a ramp from rest."""
    t = np.arange(round((seconds + 3.0) * RATE)) / RATE
    tacho = np.where(
        t < 2.0, 0.0, np.where(t < 3.0, rate * (t - 2.0) / 1.0, rate + ripple * np.sin(2 * np.pi * 2.0 * t))
    )
    angle = np.concatenate([[0.0], np.cumsum((tacho[1:] + tacho[:-1]) / 2) / RATE])
    readings = np.column_stack([1.0 + wave * np.cos(angle + 0.7), 2.0 + wave * np.sin(angle), np.full(len(t), 3.0)])
    return Recording(t, readings, ("a11", "a12", "a13"), {"tacho_rad_s": tacho})


def test_the_square_of_the_rate_is_without_the_tachometers_noise():
    run, rng, noise, runs = steady(2.0), np.random.default_rng(1), 0.1, 60
    found = []
    for _ in range(runs):
        tacho = run.reference["tacho_rad_s"] + noise * rng.normal(size=len(run))
        plateaus = find_plateaus(replace(run, reference={"tacho_rad_s": tacho}), np.full(3, 0.1), 1.0, SpinPolicy())
        place = int(np.argmax(plateaus.samples * plateaus.spinning))
        found.append([getattr(plateaus, name)[place] for name in ("square", "square_std", "samples", "rate")])
    square, std, samples, rate = np.array(found).T
    assert std == pytest.approx(2 * 2.0 * noise / np.sqrt(samples), rel=0.15)
    assert square.std() == pytest.approx(std.mean(), rel=4 / np.sqrt(2 * runs))
    assert square.mean() == pytest.approx(4.0, abs=3.5 * std.mean() / np.sqrt(runs))
    assert np.mean(square - rate**2) == pytest.approx(0.0, abs=0.1 * noise**2)  # a mean of squares has noise² more


def test_a_table_that_ripples_has_plateaus():
    run = steady(10.0, ripple=0.05)
    found = find_plateaus(run, np.full(3, 0.1), 1.0, SpinPolicy())
    (place,) = np.flatnonzero(found.spinning)
    assert found.samples[place] > 650
    first = round(float(found.start_s[place]) * RATE)
    rates = run.reference["tacho_rad_s"][first : first + found.samples[place]]
    assert found.square[place] == pytest.approx(np.mean(rates**2), abs=1e-3)
    assert np.ptp(rates) > 0.09


def test_a_wave_of_less_than_a_turn_is_in_the_uncertainty_of_the_mean():
    rng = np.random.default_rng(2)
    errors = []
    for _ in range(60):
        run = steady(0.6, wave=0.0, seconds=5.0)
        angle = np.concatenate([[0.0], np.cumsum(run.reference["tacho_rad_s"][1:]) / RATE])
        wave = 0.1 * rng.normal(size=(3, 2)) @ np.stack([np.cos(angle), np.sin(angle)])
        run = replace(run, readings=run.readings + wave.T + 0.01 * rng.normal(size=run.readings.shape))
        found = find_plateaus(run, np.full(3, 0.1), 1.0, SpinPolicy())
        (place,) = np.flatnonzero(found.spinning)
        errors.append((found.means[place] - [1.0, 2.0, 3.0]) / np.sqrt(found.variance[place]))
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(1.0, abs=4.0 / np.sqrt(2 * 180))


def test_derivatives_of_the_readings():
    rng = np.random.default_rng(3)
    run = Unit.draw(rng).turn(rng, speeds=(8.0, -20.0), hold=3.0)
    plateaus = find_plateaus(run, np.full(12, 0.1), 1.0, SpinPolicy())
    layout = Geometry.of(4, plateaus, own_frames=True)
    geometry = SpinGeometry(CUBE, plateaus, np.eye(3), np.zeros(3), 9.8, layout)
    std = np.full(layout.size, 1e-3)
    std[layout.stretch], std[layout.levelling], std[layout.shift] = 1e-6, 1e-6, 1e-6
    x = std * rng.normal(size=layout.size)
    models = [
        ErrorModel(
            np.eye(3) + 0.01 * rng.normal(size=(3, 3)),
            rng.normal(size=3),
            1e-4 * rng.normal(size=3),
            1e-6 * rng.normal(size=3),
        )
        for _ in range(4)
    ]
    kinds = [f"{k}_{i}" for k in "bqc" for i in "xyz"] + [f"M_{i}{j}" for i in "xyz" for j in "xyz"]

    def place(number, kind):
        return 18 * number + kinds.index(kind)

    def readings(values):
        of = [
            ErrorModel(
                *(
                    values[[place(number, f"M_{i}{j}") for i in "xyz" for j in "xyz"]].reshape(3, 3),
                    *(values[[place(number, f"{k}_{i}") for i in "xyz"]] for k in "bqc"),
                )
            )
            for number in range(4)
        ]
        return read_plateaus(geometry, values[72:], std, of, place, 72)

    start = np.zeros(72)
    for number, model in enumerate(models):
        for row, i in enumerate("xyz"):
            for kind, value in (("b", model.bias), ("q", model.quadratic), ("c", model.cubic)):
                start[place(number, f"{kind}_{i}")] = value[row]
            for column, j in enumerate("xyz"):
                start[place(number, f"M_{i}{j}")] = model.sensitivity[row, column]
    whole = np.concatenate([start, x])
    steps = np.concatenate([[{"b": 1e-3, "q": 1e-6, "c": 1e-8, "M": 1e-4}[kinds[p % 18][0]] for p in range(72)], std])
    jacobian = readings(whole)[1]
    for column in rng.choice(len(whole), 12, replace=False):
        step = steps[column] * np.eye(len(whole))[column]
        slope = (readings(whole + step)[0] - readings(whole - step)[0]) / 2.0
        np.testing.assert_allclose(jacobian[..., column] * steps[column], slope, atol=2e-6 + 1e-4 * np.abs(slope).max())


def test_bends_of_a_table_without_errors_are_found():
    rng = np.random.default_rng(4)
    truth = {
        "q": 1e-5 * rng.normal(size=12),
        "c": 4e-8 * rng.normal(size=12),
    }  # 5 q c y⁴ of the inverse is below the atol
    unit = quiet_unit(rng, quadratic=truth["q"], cubic=truth["c"])
    perfect = table()
    for side, seen in ((spin_cases.UPRIGHT, ACROSS), (ON_ITS_SIDE, np.array([0, 2, 3, 5, 6, 8, 9, 11]))):
        run = unit.turn(rng, side, policy=perfect, tacho_noise=0.0, lean_std=0.0)
        result = spin(run, CUBE, start=exact_start(), turn_on_std_m_s2=1e-4, policy=perfect)
        np.testing.assert_allclose(bends(result, "q")[seen], unit.truth["q"][seen], atol=3e-7)
        np.testing.assert_allclose(bends(result, "c")[seen], unit.truth["c"][seen], atol=6e-9)


def test_mujocos_run_of_the_shipped_scenario_gives_its_bends():
    """MuJoCo's rigid body and the effect of a quadratic axis, against the plateaus of this package's own model."""
    scenario = Scenario.load(
        "centrifuge",
        changes=["sensor.perfect=true", 'effect=[{name="quadratic", parameters={a11_s2_m=2e-4, a32_s2_m=-1e-4}}]'],
    )
    result = spin(simulate(scenario), CUBE, start=exact_start(), policy=table())
    expected = np.zeros(12)
    expected[[0, 7]] = 2e-4, -1e-4
    np.testing.assert_allclose(bends(result, "q")[ACROSS], expected[ACROSS], atol=2e-6)
    assert result.statistics["plateaus_turning"] == 10.0
    assert result.statistics["largest_rate_rad_s"] == pytest.approx(30.0, abs=0.01)


def test_a_radius_error_is_in_the_gain_and_not_in_the_bends():
    rng = np.random.default_rng(5)
    cubic, quadratic = 4e-8 * rng.normal(size=12), 1e-5 * rng.normal(size=12)
    unit = quiet_unit(rng, radius=1e-3, quadratic=quadratic, cubic=cubic)
    open_gain = exact_start(gain=3e-3)
    tolerant = table(radius_std_m=1e-3)
    result = spin(
        unit.turn(rng, policy=table(), tacho_noise=0.0, lean_std=0.0),
        CUBE,
        start=open_gain,
        turn_on_std_m_s2=1e-4,
        policy=tolerant,
    )
    np.testing.assert_allclose(bends(result, "q")[ACROSS], unit.truth["q"][ACROSS], atol=1.5e-6)
    np.testing.assert_allclose(bends(result, "c")[ACROSS], unit.truth["c"][ACROSS], atol=2e-8)
    strongest = float(result.statements[-1].rsplit("K1 with the radius ", 1)[1].split()[0])
    assert strongest < -0.5  # a reading shows their product


def test_arm_stretch_is_bucked_by_k2_and_its_prior_widens_it():
    rng = np.random.default_rng(6)
    unit = quiet_unit(rng)
    run = unit.turn(rng, policy=table(), tacho_noise=0.0, lean_std=0.0, stretch=2e-6)
    blind = spin(run, CUBE, start=exact_start(), turn_on_std_m_s2=1e-4, policy=table())
    aware = spin(run, CUBE, start=exact_start(), turn_on_std_m_s2=1e-4, policy=table(stretch_std_s2_rad2=2e-6))
    assert np.abs(bends(blind, "q")[ACROSS]).max() > 5e-6  # a stretch taken for a bend
    assert np.all(np.abs(bends(aware, "q")) < 3.0 * spread(aware, "q"))
    assert spread(aware, "q")[ACROSS].min() > 1.5 * spread(blind, "q")[ACROSS].max()
    correlation = float(aware.statements[-1].split("arm stretch ")[1].split()[0])
    assert abs(correlation) > 0.5


def test_a_run_on_the_side_determines_what_the_upright_one_left_open():
    rng = np.random.default_rng(7)
    unit = Unit.draw(rng)
    static = unit.static(rng)
    upright = spin(unit.turn(rng), CUBE, start=static)
    assert "a1_c_z, a2_c_z" in next(text for text in upright.statements if "not determined" in text)
    both = spin(unit.turn(rng, ON_ITS_SIDE), CUBE, start=upright)
    assert not any("not determined" in text for text in both.statements)
    up = ~np.isin(np.arange(12), ACROSS)
    assert np.all(spread(both, "q")[up] < 0.75 * spread(upright, "q")[up])
    assert np.all(spread(both, "c") <= spread(upright, "c") * 1.02)


def test_a_certificate_of_a_spin_states_what_that_of_the_poses_does():
    """The frame's rotation stays undetermined, at the fitted gains: K1 and the angles are stated all the same."""
    rng = np.random.default_rng(14)
    unit = Unit.draw(rng)
    static = unit.static(rng)
    stated = [
        {term.name for term in certify(one).terms if term.value is not None}
        for one in (static, spin(unit.turn(rng), CUBE, start=static))
    ]
    assert {"a11_K1", "a1_angle_xy"} <= stated[0]
    assert stated[1] - stated[0] == {f"{channel}_K3" for channel in CUBE.channels}
    assert stated[0] <= stated[1]


def test_raw_counts_give_the_same_in_their_unit():
    rng = np.random.default_rng(8)
    run = Unit.draw(rng).turn(rng)
    lsb = run.metadata["lsb_m_s2"]
    counts = replace(run, readings=np.round(run.readings / lsb), unit="lsb")
    metric, raw = spin(run, CUBE), spin(counts, CUBE)
    np.testing.assert_allclose(bends(raw, "q") / lsb, bends(metric, "q"), rtol=1e-4, atol=1e-8)
    np.testing.assert_allclose(bends(raw, "c") / lsb**2, bends(metric, "c"), rtol=1e-4, atol=1e-10)
    assert raw.units[-1] == "1 per lsb²"
    assert metric.units[-1] == "s⁴/m²"


def test_fitted_positions_stay_parameters():
    rng = np.random.default_rng(9)
    start = exact_start()
    names = tuple(f"{chip.name}_r_{axis}" for chip in CUBE.chips for axis in "xyz")
    covariance = np.zeros((60, 60))
    covariance[:48, :48] = start.covariance
    covariance[range(48, 60), range(48, 60)] = 1e-3**2
    placed = replace(
        start,
        names=(*start.names, *names),
        values=np.concatenate([start.values, CUBE.chip_positions.ravel()]),
        covariance=covariance,
        null_space=np.empty((60, 0)),
    )
    unit = quiet_unit(rng, radius=1e-3)
    result = spin(unit.turn(rng, policy=table(), tacho_noise=0.0, lean_std=0.0), CUBE, start=placed, policy=table())
    found = np.array([result.positions[chip.name] for chip in CUBE.chips])
    off = (found - unit.array.chip_positions)[:, :2]
    np.testing.assert_allclose(off - off.mean(axis=0), 0.0, atol=2e-5)  # a common shift is one of the axis


def test_a_result_is_written_and_read(tmp_path):
    rng = np.random.default_rng(10)
    result = spin(Unit.draw(rng).turn(rng, speeds=(10.0, 20.0, 30.0), hold=3.0), CUBE)
    result.save(tmp_path / "spin.json")
    again = load_calibration(tmp_path / "spin.json")
    np.testing.assert_array_equal(again.values, result.values)
    np.testing.assert_array_equal(again.models["a2"].cubic, result.models["a2"].cubic)
    a = Recording(np.arange(5.0), rng.uniform(-40, 40, (5, 12)), CUBE.channels)
    np.testing.assert_allclose(again.apply(again.invert(a)).readings, a.readings, atol=1e-9)


def test_a_saturated_channel_is_left_out_with_a_warning():
    rng = np.random.default_rng(11)
    unit = Unit.draw(rng, SensorSettings(range_g=4))
    result = spin(unit.turn(rng), CUBE)
    assert any("is saturated on 2 of 12 plateaus" in text for text in result.warnings)
    assert np.all(np.isfinite(result.std))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda run: replace(run, reference={}), "no tacho_rad_s column"),
        (lambda run: replace(run, reference={"tacho_rad_s": np.zeros(len(run))}), "no plateau of constant rate"),
        (lambda run: run.between(0.0, 8.0), "one speed only"),
        (lambda run: replace(run, readings=run.readings * 3.0), "not to gravity"),
        (lambda run: replace(run, readings=run.readings[:, :9], channels=run.channels[:9]), "lacks a41, a42, a43"),
    ],
)
def test_what_can_not_be_used_is_said_in_a_line(change, message):
    rng = np.random.default_rng(12)
    run = Unit.draw(rng).turn(rng, speeds=(10.0, 20.0), hold=5.0)
    with pytest.raises(InputError, match=message):
        spin(change(run), CUBE)


def test_counts_need_a_calibration_of_counts():
    rng = np.random.default_rng(13)
    run = replace(Unit.draw(rng).turn(rng, speeds=(10.0, 20.0), hold=3.0), unit="lsb")
    with pytest.raises(UnitError, match="in lsb, the calibration in m_s2"):
        spin(run, CUBE, start=exact_start())


def test_standard_deviations_hold_on_simulated_parts():
    """Two runs: upright, then on the side. All 12 channels have a q and a c: 48 errors, correlated within a run."""
    errors = np.concatenate(
        [np.concatenate([found[kind][0] for kind in "qc"]) for found in map(normalised_errors, range(1000, 1002))]
    )
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(1.0, abs=4.0 / np.sqrt(2 * 48))
    assert np.mean(np.abs(errors) < 1.96) > 0.88


@pytest.mark.study
def test_intervals_of_k2_and_k3_cover():
    """300 runs with chips, biases, poses and tables drawn anew: 95 % intervals cover 95 ± 3 %, of all and each."""
    runs = [normalised_errors(seed) for seed in range(300)]
    for kind in "qc":
        covered = np.abs(np.array([run[kind][0] for run in runs])) < 1.96
        assert abs(np.mean(covered) - 0.95) < 0.03
        assert np.abs(np.mean(covered, axis=0) - 0.95).max() < 4.0 * np.sqrt(0.05 * 0.95 / 300)
