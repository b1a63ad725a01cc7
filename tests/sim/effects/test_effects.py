"""Every effect of the library: its place in the registry, its coordinates, and its physics against three other ways.

The other ways are the MuJoCo rig, MuJoCo models written here, and `independent_world`, which differences positions and
shares no code with the project.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from every_item import every
from scipy.interpolate import CubicSpline
from scipy.signal import lsim, lti

from gfimu import AccelerometerArray, InputError
from sim import Chirp, Hold, Ramp, SpinState, SplineSpin, forward, prescribed_readings, spin_profile, turntable_model
from sim.effects import EFFECTS, Effect, apply_effects, make_effect
from sim.effects.low_pass import low_pass, mass_on_spring
from sim.trials import random_profile
from sim.trials.benchmark.generators.independent_effects import DRAWS, SIZELESS, rig_with
from sim.trials.benchmark.generators.independent_table import Rig, TableRun, drive_table
from sim.trials.benchmark.generators.independent_world import Setting, noise_free
from sim.twin import Twin
from sim.world import SampleContext, World

# The contract's names with one valid set of parameters each.
CONTRACT = {
    "bias": {"a11_m_s2": 0.1, "a43_m_s2": -0.2},
    "scale_factor": {"a11": 0.01, "a32": -0.02},
    "misalignment": {"a1_x_rad": 0.01, "a4_z_rad": -0.02},
    "sensor_position": {"a1_x_m": 1e-3, "a3_y_m": -2e-3},
    "eccentricity": {"x_m": 2e-3, "y_m": -1e-3},
    "mount_tilt": {"x_rad": 0.01, "y_rad": -0.02},
    "table_tilt": {"x_rad": 0.004, "y_rad": -0.002},
    "axis_wobble": {"amplitude_rad": 2e-3, "phase_rad": 0.7},
    "gravity": {"delta_m_s2": -0.02},
    "cogging": {"amplitude_rad_s2": 2.0, "order": 6, "phase_rad": 0.4},
    "resonance": {"frequency_hz": 9.0, "damping_ratio": 0.03, "gain": 0.4},
    "centrifugal_flex": {"stretch_s2_rad2": 3e-5},
    "sensor_lag": {"time_constant_s": 4e-3},
    "channel_skew": {"per_chip_s": 1e-3},
    "clock_error": {"ratio": 1e-3},
    "tacho_latency": {"delay_s": 0.01},
    "tacho_scale": {"ratio": 0.01},
    "bias_temperature": {"a11_m_s2_K": 0.01},
    "warm_up": {"a11_m_s2": 0.05, "time_constant_s": 6.0},
    "bias_random_walk": {"strength_m_s2_rts": 0.02},
    "quadratic": {"a11_s2_m": 4e-4},
    "cross_axis": {"a11_from_a12": 0.01, "a43_from_a41": -0.02},
    "hysteresis": {"lost_m_s2": 0.05, "width_m_s2": 0.05},
    "interference_tone": {"amplitude_m_s2": 0.03, "frequency_hz": 17.3, "phase_rad": 1.1},
    "gain_drift": {"slope_1_s": 2e-4},
    "vibration_rectification": {"a11_m_s2_per_rad4_s4": 1e-6},
    "tacho_ripple": {"amplitude": 0.01, "order": 2, "phase_rad": -0.4},
    "noise": {"factor": 2.0},
    "saturation": {"limit_m_s2": 10.0},
    "coarse_resolution": {"step_m_s2": 0.15},
    "wrong_range": {"chip": "a2", "factor": 0.5},
    "axis_swap": {"channels": ["a11", "a22"]},
    "sign_flip": {"channel": "a31"},
    "stuck_channel": {"channel": "a42", "start_s": 2.0, "stop_s": 4.0},
    "dropped_frames": {"share": 0.02},
}
SIZED = [name for name in CONTRACT if name not in SIZELESS]
MECHANICAL = [name for name, family in EFFECTS.items() if family.place in {"geometry", "motion", "timing"}]


@dataclass(frozen=True)
class Swing:
    """A spin whose angle is a sum of sines on a steady turn, so that every derivative is known."""

    turn: float = 4.0
    sines: tuple = ((5.0, 1.1, 0.0), (2.5, 4.3, 1.0), (0.3, 21.0, 0.0))  # amplitude and frequency in rad/s, phase

    def at(self, t):
        t = np.asarray(t, dtype=float)
        angle, rate, acceleration = self.turn * t, np.full_like(t, self.turn), np.zeros_like(t)
        for amplitude, frequency, phase in self.sines:
            angle = angle - amplitude / frequency * np.cos(frequency * t + phase)
            rate = rate + amplitude * np.sin(frequency * t + phase)
            acceleration = acceleration + amplitude * frequency * np.cos(frequency * t + phase)
        return SpinState(angle, rate, acceleration)


def temperature(t):
    return 25.0 + 3.0 * (1 - np.exp(-np.maximum(t, 0.0) / 6.0))


@pytest.fixture(scope="module")
def cube12():
    return AccelerometerArray.load("cube12")


@pytest.fixture(scope="module")
def twin(cube12):
    return Twin(cube12)


def test_the_library_holds_every_effect_of_the_contract():
    assert set(CONTRACT) <= set(EFFECTS)
    assert set(CONTRACT) <= set(DRAWS)
    assert all(family.name == name and family.summary and family.separated_by for name, family in EFFECTS.items())


@every("name", CONTRACT)
def test_parameter_keys_are_the_contracts(name, cube12):
    make_effect(name, CONTRACT[name], cube12)
    with pytest.raises(InputError, match=rf"{name}.*unknown parameter 'nonsense_m'.*valid: "):
        make_effect(name, {"nonsense_m": 1.0}, cube12)


def test_unknown_effect_lists_the_valid_names():
    with pytest.raises(InputError, match="table_tilt"):
        make_effect("table_tild")


@pytest.mark.parametrize("name", SIZED)
def test_zero_size_changes_nothing(name, cube12, twin):
    family = EFFECTS[name]
    t = np.arange(0.0, 3.0, 0.01)
    zero = family.from_sizes(cube12, np.zeros(len(family.sizes(cube12))), family.shapes(3.0, 100.0)[0])
    before = twin.predict(Swing(), t, temperature=temperature(t))
    after = twin.predict(Swing(), t, effects=[zero], temperature=temperature(t))
    for one, other in zip(before, after, strict=True):
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", SIZED)
def test_size_values_are_the_inverse_of_from_sizes(name, cube12):
    family = EFFECTS[name]
    rng = np.random.default_rng(1)
    for shape in family.shapes(40.0, 100.0)[:3]:
        values = np.array([size.prior_std * rng.standard_normal() for size in family.sizes(cube12)])
        values = np.where([size.positive for size in family.sizes(cube12)], np.abs(values), values)
        effect = family.from_sizes(cube12, values, shape)
        effect.check(cube12)
        np.testing.assert_allclose(effect.size_values(cube12), values, rtol=1e-12)
        assert effect.shape_values() == pytest.approx(shape)


@pytest.mark.parametrize("name", [name for name in SIZED if EFFECTS[name].reach.__func__ is not Effect.reach.__func__])
def test_sizes_reach_the_channels_they_claim(name, cube12, twin):
    family = EFFECTS[name]
    reach = family.reach(cube12)
    t = np.arange(0.0, 3.0, 0.02)
    before, _ = twin.predict(Swing(), t, temperature=temperature(t))
    for number, size in enumerate(family.sizes(cube12)):
        values = np.zeros(len(reach))
        values[number] = size.prior_std
        effect = family.from_sizes(cube12, values, family.shapes(40.0, 100.0)[0])
        after, _ = twin.predict(Swing(), t, effects=[effect], temperature=temperature(t))
        changed = np.abs(after - before).max(axis=0) > 1e-12
        assert not np.any(changed & ~reach[number])


@pytest.mark.parametrize("name", SIZED)
def test_patterns_mix_the_sizes(name, cube12):
    family = EFFECTS[name]
    for pattern in family.patterns(cube12):
        assert pattern.mixing.shape[0] == len(family.sizes(cube12))
        assert np.linalg.matrix_rank(pattern.mixing) == pattern.mixing.shape[1]


@pytest.mark.parametrize("name", CONTRACT)
def test_effects_go_into_a_twin_file_and_come_back(name, cube12, twin, tmp_path):
    extended = twin.extended([make_effect(name, CONTRACT[name], cube12)])
    path = tmp_path / "twin.toml"
    path.write_text(extended.to_toml())
    t = np.arange(0.0, 2.0, 0.01)
    for one, other in zip(
        extended.predict(Swing(), t, temperature=temperature(t)),
        Twin.load(path).predict(Swing(), t, temperature=temperature(t)),
        strict=True,
    ):
        np.testing.assert_array_equal(one, other)
    assert Twin.load(path).effects[0].parameters == CONTRACT[name]


@pytest.mark.parametrize(
    ("name", "more"), [*((name, {}) for name in MECHANICAL), ("centrifugal_flex", {"moving_arms": 1.0})]
)
def test_the_mujoco_rig_carries_it_and_agrees_with_the_analytic_model(name, more, cube12, twin):
    world = twin.world([make_effect(name, CONTRACT[name] | more, cube12)])
    t = np.arange(0.0, 6.0, 0.01)
    motion = spin_profile([Hold(0.3), Ramp(12.0, 1.0), Chirp(1.0, 0.5, 6.0, 3.0), Ramp(-8.0, 1.0), Hold(0.7)])
    moved = motion
    for step in (*world.motion_steps, *world.mount_steps):
        moved = step(moved, t)
    rig = prescribed_readings(world, moved, t)
    np.testing.assert_allclose(rig, forward.channels(world, motion, t), rtol=0, atol=1e-9)
    nominal = prescribed_readings(twin.world(), motion, t)
    assert np.abs(rig - nominal).max() > 1e-4  # the effect is there


TORSION = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.0005" integrator="RK4" gravity="0 0 -9.80665">
    <flag contact="disable" eulerdamp="disable"/>
  </option>
  <worldbody>
    <body name="table">
      <joint name="shaft" type="hinge" axis="0 0 1" armature="1000"/>
      <geom type="cylinder" size="0.1 0.005" mass="1"/>
      <body name="cube" pos="0 0 0.06">
        <joint name="torsion" type="hinge" axis="0 0 1" stiffness="{stiffness}" damping="{damping}"/>
        <inertial pos="0 0 0" mass="0.5" diaginertia="0.001 0.001 0.001"/>
        <site name="a1" pos="0.05 0.05 0.05"/><site name="a2" pos="0.05 -0.05 -0.05"/>
        <site name="a3" pos="-0.05 0.05 -0.05"/><site name="a4" pos="-0.05 -0.05 0.05"/>
      </body>
    </body>
  </worldbody>
  <actuator><general name="motor" joint="shaft" dyntype="integrator" gainprm="1000.005"/></actuator>
  <sensor>
    <accelerometer site="a1"/><accelerometer site="a2"/><accelerometer site="a3"/><accelerometer site="a4"/>
  </sensor>
</mujoco>
"""


def test_resonance_is_a_torsion_joint_between_table_and_cube(cube12, twin):
    frequency, ratio, step = 9.0, 0.03, 5e-4
    natural = 2 * np.pi * frequency
    model = mujoco.MjModel.from_xml_string(
        TORSION.format(stiffness=0.001 * natural**2, damping=2 * ratio * natural * 0.001)
    )
    data = mujoco.MjData(model)
    motion = spin_profile([Hold(0.2), Ramp(10.0, 0.4), Hold(1.0), Ramp(-6.0, 0.5), Hold(0.9)])
    times = np.arange(0.0, 3.0, step)
    # The table weighs a million times the cube's inertia, so the motor imposes its motion: acceleration by its rate.
    jerk = np.diff(motion.at(np.append(times, times[-1] + step)).acceleration) / step
    state, readings = np.empty((len(times), 2)), np.empty((len(times), 12))
    for row, rate in enumerate(jerk):
        data.ctrl[0] = rate
        state[row] = data.qpos[0], data.qvel[0]
        mujoco.mj_step(model, data)
        readings[row] = data.sensordata
    spin = motion.at(times)
    np.testing.assert_allclose(state[:, 1], spin.rate, atol=2e-4)
    t = np.arange(0.0, 3.0, 0.01)
    measured = CubicSpline(times, readings)(t)
    resonance = make_effect("resonance", {"frequency_hz": frequency, "damping_ratio": ratio, "gain": 1.0}, cube12)
    with_mode = forward.channels(twin.world([resonance]), motion, t)
    without = forward.channels(twin.world(), motion, t)
    effect = np.abs(with_mode - without).max()
    assert effect > 0.2
    # A twist joined by straight lines over h = 2 ms errs by (2πf h)²/8 = 0.16 % of its peak; MuJoCo's table is a
    # thousandth of a per cent softer than imposed motion.
    np.testing.assert_allclose(measured, with_mode, rtol=0, atol=4e-3 * effect)


def ripple(order, angle, acceleration):
    """Amplitude and phase of A sin(order·θ + φ) in an angular acceleration."""
    design = np.column_stack([np.sin(order * angle), np.cos(order * angle), np.ones_like(angle), angle])
    sine, cosine, *_ = np.linalg.lstsq(design, acceleration, rcond=None)[0]
    return np.hypot(sine, cosine), np.arctan2(cosine, sine)


def test_cogging_is_the_torque_ripple_of_a_driven_table(twin):
    amplitude, order, phase, rate = 1.5, 6, 0.4, 14.0
    command = spin_profile([Hold(8.0)], start_rate=rate)
    driven = drive_table(lambda t: command.at(t).rate, Rig(cogging=(amplitude, order, phase)), 4.0)
    steady = driven.t > 2.5
    mujoco_amplitude, mujoco_phase = ripple(order, driven.angle[steady], driven.acceleration[steady])
    cogging = make_effect("cogging", {"amplitude_rad_s2": amplitude, "order": order, "phase_rad": phase})
    t = np.arange(0.0, 5.5, 1e-3)
    moved = twin.world([cogging]).motion_steps[0](command, t).at(t[t > 2.5])
    analytic_amplitude, analytic_phase = ripple(order, moved.angle, moved.acceleration)
    # Both tables answer through their own servo: MuJoCo's with its motor lag, the analytic one with 1 Hz and 0.7.
    s = 1j * order * rate
    passed = s**2 / (s**2 + (10 * s + 15) / (1 + 0.004 * s))
    assert mujoco_amplitude == pytest.approx(amplitude * abs(passed), rel=0.03)
    assert mujoco_phase == pytest.approx(phase + np.angle(passed), abs=0.1)
    servo = 2 * np.pi
    passed = s**2 / (s**2 + 1.4 * servo * s + servo**2)
    assert analytic_amplitude == pytest.approx(amplitude * abs(passed), rel=0.01)
    assert analytic_phase == pytest.approx(phase + np.angle(passed), abs=0.02)


# What is not exact, relative to the effect: straight lines between points of the twist (0.2 %), the play at 100 Hz
# against 1 kHz, the lag of a spline through samples against 1 kHz.
RELATIVE = {"resonance": 3e-3, "hysteresis": 1e-2, "sensor_lag": 1e-3}


@pytest.mark.parametrize("name", [name for name in SIZED if name != "cogging"])
def test_it_is_what_the_independent_definition_says(name, cube12, twin):
    plan = Setting(duration=12.0, top=20.0)
    parameters = DRAWS[name](np.random.default_rng(3), plan)
    motion = Swing()
    fine = np.arange(-1.5, 13.5, 1e-3)
    spin = motion.at(fine)
    twist = np.zeros_like(fine)
    if name == "resonance":
        natural = 2 * np.pi * parameters["frequency_hz"]
        mode = ([-1.0], [1.0, 2 * parameters["damping_ratio"] * natural, natural**2])
        _, twist, _ = lsim(mode, spin.acceleration, fine - fine[0])
    run = TableRun(fine, spin.angle, spin.rate, spin.acceleration, twist, np.empty(0))
    t, theirs, their_tacho = noise_free(run, plan, temperature, {name: parameters}, rig_with({name: parameters}))
    _, bare, bare_tacho = noise_free(run, plan, temperature, {}, Rig())
    moves = {"moving_arms": 1.0} if name == "centrifugal_flex" else {}  # theirs differentiates the chips' places
    effect = make_effect(name, parameters | moves, cube12)
    ours, our_tacho = twin.predict(motion, t, effects=[effect], temperature=temperature(t))
    nominal, nominal_tacho = twin.predict(motion, t, temperature=temperature(t))
    settled = slice(500, -10) if name == "resonance" else slice(100, -10)
    np.testing.assert_allclose(bare[settled], nominal[settled], rtol=0, atol=2e-8)
    for one, other, size in (
        (ours - nominal, theirs - bare, np.abs(ours - nominal)[settled].max()),
        (our_tacho - nominal_tacho, their_tacho - bare_tacho, np.abs(our_tacho - nominal_tacho)[settled].max()),
    ):
        difference = np.sqrt(np.mean((one - other)[settled] ** 2))
        assert difference <= RELATIVE.get(name, 1e-6) * size + 2e-8
    assert max(np.abs(ours - nominal).max(), np.abs(our_tacho - nominal_tacho).max()) > 1e-4


def with_data_steps(twin, name, readings, t, seed=0):
    rng = np.random.default_rng(seed)
    for step in twin.world([make_effect(name, CONTRACT[name], twin.array)]).data_steps:
        readings = step(t, readings, rng)
    return readings


@pytest.fixture
def samples():
    t = np.arange(1000) / 100.0
    return t, 15.0 * np.sin(t[:, None] * np.arange(1.0, 13.0))


def test_saturation_clips(twin, samples):
    t, readings = samples
    np.testing.assert_array_equal(with_data_steps(twin, "saturation", readings, t), np.clip(readings, -10.0, 10.0))


def test_coarse_resolution_rounds_to_its_step(twin, samples):
    t, readings = samples
    coarse = with_data_steps(twin, "coarse_resolution", readings, t)
    np.testing.assert_allclose(np.abs(coarse / 0.15 - np.round(coarse / 0.15)).max(), 0.0, atol=1e-9)
    assert np.abs(coarse - readings).max() <= 0.075 + 1e-12


def test_wrong_range_scales_one_chip(twin, samples):
    t, readings = samples
    gain = np.array([1, 1, 1, 0.5, 0.5, 0.5, 1, 1, 1, 1, 1, 1])
    np.testing.assert_array_equal(with_data_steps(twin, "wrong_range", readings, t), readings * gain)
    with pytest.raises(InputError, match="unknown chip 'a9'; valid: a1, a2, a3, a4"):
        twin.world([make_effect("wrong_range", {"chip": "a9", "factor": 2.0})])


def test_axis_swap_exchanges_two_channels(twin, samples):
    t, readings = samples
    swapped = with_data_steps(twin, "axis_swap", readings, t)
    np.testing.assert_array_equal(swapped[:, [0, 4]], readings[:, [4, 0]])
    others = [k for k in range(12) if k not in {0, 4}]
    np.testing.assert_array_equal(swapped[:, others], readings[:, others])


def test_sign_flip_inverts_one_channel(twin, samples):
    t, readings = samples
    flipped = with_data_steps(twin, "sign_flip", readings, t)
    np.testing.assert_array_equal(flipped[:, 6], -readings[:, 6])
    np.testing.assert_array_equal(np.delete(flipped, 6, axis=1), np.delete(readings, 6, axis=1))


def test_stuck_channel_freezes_from_start_to_stop(twin, samples):
    t, readings = samples
    stuck = with_data_steps(twin, "stuck_channel", readings, t)
    frozen = (t >= 2.0) & (t < 4.0)
    assert np.ptp(stuck[frozen, 10]) == 0.0
    np.testing.assert_array_equal(stuck[~frozen], readings[~frozen])
    np.testing.assert_array_equal(np.delete(stuck, 10, axis=1), np.delete(readings, 10, axis=1))


def test_dropped_frames_lose_their_share(twin):
    t = np.arange(20_000) / 100.0
    left = with_data_steps(twin, "dropped_frames", np.ones((len(t), 12)), t)
    lost = np.isnan(left)
    assert np.all(lost.all(axis=1) == lost.any(axis=1))
    assert lost[:, 0].mean() == pytest.approx(0.02, abs=4 * np.sqrt(0.02 * 0.98 / len(t)))


def test_noise_and_random_walk_reach_the_world(twin):
    world = twin.world(
        [make_effect("noise", {"factor": 3.0}), make_effect("bias_random_walk", {"strength_m_s2_rts": 0.02})]
    )
    assert (world.noise_factor, world.bias_walk) == (3.0, 0.02)


@pytest.mark.parametrize(
    "names",
    [
        ("sign_flip", "bias", "table_tilt", "cogging"),
        ("scale_factor", "cross_axis"),
        ("sensor_lag", "vibration_rectification"),
        ("mount_tilt", "misalignment"),
        ("eccentricity", "mount_tilt", "sensor_position"),
    ],
    ids="+".join,
)
def test_effects_are_applied_by_their_place_whatever_the_order(cube12, twin, names):
    effects = [make_effect(name, CONTRACT[name], cube12) for name in names]
    t = np.arange(0.0, 2.0, 0.01)
    forth, back = (twin.predict(Swing(), t, effects=order)[0] for order in (effects, effects[::-1]))
    np.testing.assert_array_equal(forth, back)


def test_lag_passes_a_sine_as_the_transfer_function_says(twin):
    t = np.arange(0.0, 20.0, 0.01)
    wave = np.sin(2 * np.pi * 3.0 * t)[:, None] * np.ones(12)
    for tau in (1e-3, 1e-2, 0.3):
        world = twin.world([make_effect("sensor_lag", {"time_constant_s": tau})])
        spin = SplineSpin.through(t, np.zeros_like(t)).at(t)
        passed = world.sense(wave, SampleContext(t, spin, np.full_like(t, 25.0)))
        response = 1 / (1 + 2j * np.pi * 3.0 * tau)
        expected = np.imag(response * np.exp(2j * np.pi * 3.0 * t))
        np.testing.assert_allclose(passed[500:-20, 0], expected[500:-20], rtol=0, atol=5e-6)


@pytest.mark.parametrize("damping", [0.3, 2.0])
def test_a_mass_on_a_spring_is_a_lag_while_it_is_fast(damping):
    """GF-IMU paper, eq. 2: M x″ + D x′ + k x = −M a. Far below its resonance the reading lags by D/k, and no more."""
    hertz, resonance = 5.0, 100.0
    t = np.arange(0.0, 4.0, 1e-3)
    wave = np.sin(2 * np.pi * hertz * t)
    natural = 2 * np.pi * resonance  # √(k/M), rad/s
    spring = lti([natural**2], [1.0, 2 * damping * natural, natural**2])  # reading k x/M over −a
    reading = lsim(spring, wave, t)[1]
    lag = low_pass(wave[:, None], t, 2 * damping / natural)[:, 0]
    settled = slice(2000, -20)
    limit = (hertz / resonance) ** 2
    assert np.abs(reading - lag)[settled].max() == pytest.approx(limit, rel=0.1)
    assert np.abs(reading - wave)[settled].max() > 5 * limit  # so the lag is not to be left out


@pytest.mark.parametrize("damping", [0.05, 0.7, 2.0])
@pytest.mark.parametrize(("hertz", "rate"), [(5.0, 1000.0), (90.0, 1000.0), (5.0, 200.0)])
def test_a_proof_mass_passes_a_sine_as_its_transfer_function_says(hertz, rate, damping):
    """GF-IMU paper, eq. 2, at, below and far below a resonance of 100 Hz that the samples do or do not resolve."""
    natural, t = 2 * np.pi * 100.0, np.arange(0.0, 2.0, 1.0 / rate)
    s = 2j * np.pi * hertz / natural
    passed = 1.0 / (1.0 + 2.0 * damping * s + s**2)
    reading = mass_on_spring(np.sin(2 * np.pi * hertz * t)[:, None], t, natural, damping)[:, 0]
    settled = slice(len(t) // 2, -20)  # the mode has decayed to exp(-30), the spline's free end is far
    expected = np.imag(passed * np.exp(2j * np.pi * hertz * t))
    assert np.abs(reading - expected)[settled].max() < 2e-3 * np.abs(passed)


def test_a_stiff_proof_mass_is_a_first_order_lag():
    t = np.arange(0.0, 4.0, 0.01)
    wave = np.sin(2 * np.pi * 3.0 * t)[:, None]
    natural = 2 * np.pi * 1e6
    lag = mass_on_spring(wave, t, natural, 0.5 * natural * 3e-3)  # D/k = 2 ζ / ω = 3 ms
    assert np.abs(lag - low_pass(wave, t, 3e-3)).max() < 1e-6


def test_a_world_with_a_proof_mass_reads_later(cube12):
    twin = Twin(array=cube12, array_name="cube12")
    motion, t = random_profile(np.random.default_rng(3), 10.0), np.arange(0.0, 10.0, 0.01)

    def readings(*effects):
        return twin.predict(motion, t, effects=effects)[0]

    mass = readings(make_effect("proof_mass", {"resonance_hz": 1500.0, "damping_ratio": 0.7}, cube12))
    lag = readings(make_effect("sensor_lag", {"time_constant_s": 0.7 / (np.pi * 1500.0)}, cube12))
    ideal = readings()
    assert np.abs(mass - lag).max() < 0.1 * np.abs(mass - ideal).max()
    assert np.abs(readings(make_effect("proof_mass", {}, cube12)) - ideal).max() == 0.0


def test_apply_effects_leaves_the_given_world_alone(cube12, twin):
    world = twin.world()
    apply_effects(world, [make_effect(name, CONTRACT[name], cube12) for name in CONTRACT])
    assert world.gravity == twin.gravity
    assert world.sensing_steps == world.motion_steps == world.data_steps == ()


@pytest.mark.parametrize("name", [name for name in CONTRACT if EFFECTS[name].sizes(AccelerometerArray.load("cube12"))])
def test_an_effect_that_the_twin_has_already_grows_by_another(name):
    """A little more of it reads as it does in a world without it: two plays in a row apart, effects add."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    motion = random_profile(np.random.default_rng(1), 20.0)
    t = np.arange(0.0, 20.0, 0.01)

    def predicted(*effects):
        warm = 20.0 + 5.0 * np.sin(t / 7.0)
        return np.column_stack(twin.predict(motion, t, effects=effects, temperature=warm))

    known = make_effect(name, CONTRACT[name], twin.array)
    little = 0.05 * np.array([size.prior_std for size in EFFECTS[name].sizes(twin.array)])
    more = EFFECTS[name].from_sizes(twin.array, little, known.shape_values())
    alone = predicted(more) - predicted()
    beside = predicted(known, more) - predicted(known)
    assert np.linalg.norm(beside - alone) < (0.5 if name == "hysteresis" else 0.1) * np.linalg.norm(alone)


def test_mujoco_refuses_a_nod_that_keeps_to_no_line(cube12):
    nods = [{"amplitude_rad": 2e-3, "phase_rad": phase, "direction_rad": phase} for phase in (0.0, 1.0)]
    world = apply_effects(World(cube12), [make_effect("axis_wobble", nod) for nod in nods])
    with pytest.raises(InputError, match="one direction_rad"):
        turntable_model(world)


def test_a_twin_refuses_effects_of_another_simulation(cube12):
    foreign = SimpleNamespace(name="drag", place="motion", parameters={})
    with pytest.raises(InputError, match=r"not effects of this simulation: drag; build them with"):
        Twin(cube12).extended([foreign])
