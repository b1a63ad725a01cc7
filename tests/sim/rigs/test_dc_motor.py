"""The table on MuJoCo's dcmotor against the motor's equations, worked out here."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
import pytest
from scipy.integrate import quad

from gfimu import AccelerometerArray, InputError
from gfimu.base import find_model
from sim import DcMotor, Drive, Hold, Ramp, SpinState, drive, forward, spin_profile
from sim.scenarios import Scenario
from sim.world import World

MOTOR = DcMotor()
SMOOTH = replace(MOTOR, cogging=0.0)
ALONE = replace(SMOOTH, bristle_stiffness=0.0, viscous=0.0, inductance=0.0)  # winding and inertia only
BACK_EMF = MOTOR.constant**2 / MOTOR.resistance  # N·m·s/rad


@dataclass(frozen=True)
class Steady:
    """A command of one rate from the first moment on; a run starts at it."""

    rate: float

    def at(self, t):
        t = np.asarray(t, dtype=float)
        return SpinState(self.rate * t, np.full_like(t, self.rate), np.zeros_like(t))


@pytest.fixture(scope="module")
def world():
    return World(AccelerometerArray.load("cube12"))


@pytest.fixture(scope="module")
def inertia(world):
    """Of all that turns about the axis, kg·m², from the drawing: half sizes in m, distances from the axis."""

    def cylinder(radius, half, density):
        return 0.5 * density * np.pi * radius**2 * 2 * half * radius**2

    def box(mass, x, y, distance=0.0):
        return mass * ((x**2 + y**2) / 3 + distance**2)

    aluminium, board = 2700 * 8, 1850 * 8  # kg per product of half sizes
    shaft, disc = cylinder(0.010, 0.010, 7850), cylinder(0.15, 0.005, 2700)
    adapter = box(aluminium * 0.03 * 0.03 * 0.005, 0.03, 0.03)
    lids = 2 * box(aluminium * 0.05 * 0.05 * 0.0025, 0.05, 0.05)
    walls = 2 * box(aluminium * 0.0025 * 0.05 * 0.045, 0.0025, 0.05, 0.0475)
    walls += 2 * box(aluminium * 0.045 * 0.0025 * 0.045, 0.045, 0.0025, 0.0475)
    processor = box(board * 0.027 * 0.013 * 0.0008, 0.027, 0.013)
    corner = 0.05 * np.sqrt(2)
    chips = 4 * (box(board * 0.005 * 0.005 * 0.0008, 0.005, 0.005, corner) + box(3e-5, 0.0015, 0.0025, corner))
    return shaft + disc + adapter + lids + walls + processor + chips + MOTOR.rotor_inertia


def friction(motor, rate):
    """Stribeck curve of the LuGre model in steady sliding, N·m."""
    sliding = motor.coulomb + (motor.static - motor.coulomb) * np.exp(-((rate / motor.stribeck_rate) ** 2))
    return sliding + motor.viscous * rate


def test_the_shipped_model_has_the_default_figures(world):
    shipped = mujoco.MjModel.from_xml_path(str(find_model("mjcf", "motor_turntable", suffix=".xml")))
    fitted = Drive(world, Steady(0.0), 1.0, motor=MOTOR).model()
    for field in (
        "actuator_gainprm",
        "actuator_biasprm",
        "actuator_dynprm",
        "actuator_forcerange",
        "actuator_ctrlspec",
    ):
        np.testing.assert_array_equal(getattr(shipped, field), getattr(fitted, field))
    np.testing.assert_allclose(shipped.dof_M0, fitted.dof_M0, rtol=1e-12)
    np.testing.assert_array_equal(shipped.dof_damping, fitted.dof_damping)


@pytest.mark.parametrize("voltage", [0.4, 2.0])
def test_steady_speed_is_where_voltage_and_torque_balance(world, voltage):
    """V = R i + K ω and K i = friction(ω)."""
    motor = replace(SMOOTH, control="voltage")
    run = drive(world, Steady(voltage / motor.constant), 25.0, motor=motor)
    rate = run.state.rate[-1]
    current = (voltage - motor.constant * rate) / motor.resistance
    assert motor.constant * current == pytest.approx(friction(motor, rate), rel=1e-6)
    assert rate == pytest.approx((MOTOR.constant * voltage / MOTOR.resistance - 0.02) / (BACK_EMF + 0.002), rel=1e-6)


def test_spin_up_has_the_mechanical_time_constant(world, inertia):
    """ω = ω₀(1 − exp(−t K²/(R J)))."""
    motor = replace(ALONE, control="voltage")

    @dataclass(frozen=True)
    class FromRest(Steady):
        def at(self, t):
            state = super().at(t)
            return SpinState(state.angle, np.where(np.asarray(t) > 0, self.rate, 0.0), state.acceleration)

    run = drive(world, FromRest(3.0), 4.0, step=2e-4, motor=motor)
    expected = 3.0 * (1 - np.exp(-(run.t - 2e-4) * BACK_EMF / inertia))
    np.testing.assert_allclose(run.state.rate[1:], expected[1:], atol=3e-4)  # of one Euler step: 3·h/τ


@pytest.mark.parametrize("periods", [7, 24])
def test_cogging_shows_at_its_order_of_the_shaft_angle(world, inertia, periods):
    """J dω/dt = A sin Nθ − (K²/R) δω: δω has the amplitude A/√((J N ω)² + (K²/R)²), and only the order N."""
    motor = replace(ALONE, control="voltage", cogging=0.005, cogging_periods=periods)
    run = drive(world, Steady(4.0), 25.0, step=2e-4, motor=motor)
    turns = np.floor((run.state.angle[-1] - 60.0) / (2 * np.pi))
    angle = 60.0 + 2 * np.pi * np.arange(0, turns, 1 / 256)
    spectrum = np.abs(np.fft.rfft(np.interp(angle, run.state.angle, run.state.rate))) / len(angle) * 2
    orders = np.arange(len(spectrum)) / turns
    spectrum[0] = 0.0
    assert orders[np.argmax(spectrum)] == pytest.approx(periods, abs=1e-9)
    expected = 0.005 / np.hypot(inertia * periods * 4.0, BACK_EMF)
    assert spectrum.max() == pytest.approx(expected, rel=0.01)
    elsewhere = np.abs(orders[:, None] - periods * np.arange(1, 4)).min(axis=1) > 1
    assert spectrum[elsewhere].max() < 0.02 * expected


def test_coasting_ends_where_friction_has_taken_the_energy(world, inertia):
    """Without gains the servo gives no torque: ½ J ω₀² = ∫ friction dθ, and the time to rest is ∫ J dω/friction."""
    motor = replace(SMOOTH, stiffness=0.0, damping=0.0)
    run = drive(world, Steady(3.0), 8.0, step=2e-4, motor=motor)
    rest = run.t[np.argmax(np.abs(run.state.rate) < 1e-3)]
    assert rest == pytest.approx(quad(lambda rate: inertia / friction(motor, rate), 1e-3, 3.0)[0], rel=2e-3)
    angle = run.state.angle[np.argmax(np.abs(run.state.rate) < 1e-3)]
    assert angle == pytest.approx(quad(lambda rate: inertia * rate / friction(motor, rate), 1e-3, 3.0)[0], rel=2e-3)
    # At rest it is held: what is left is the spring of the bristles, σ₀, with the inertia.
    assert np.ptp(run.state.angle[run.t > rest + 0.5]) < 2 * motor.static / motor.bristle_stiffness


def test_the_table_breaks_away_at_the_static_torque(world):
    """The voltage rises slowly; K V/R where the table leaves its place is the static torque."""
    motor = replace(SMOOTH, control="voltage")
    top = 0.04  # N·m at the end of 20 s
    run = drive(world, spin_profile([Ramp(top / BACK_EMF, 20.0)]), 20.0, step=5e-4, motor=motor)
    applied = BACK_EMF * spin_profile([Ramp(top / BACK_EMF, 20.0)]).at(run.t).rate
    leaves = np.argmax(run.state.angle > 10 * motor.static / motor.bristle_stiffness)
    assert applied[leaves] == pytest.approx(motor.static, rel=0.05)


@pytest.mark.parametrize(("damping", "sticks"), [(0.11, True), (0.16, False)])
def test_a_slow_servo_sticks_and_slips_where_friction_falls_faster_than_its_damping(world, damping, sticks):
    """Sliding at ω is unstable where 2(τ_s − τ_c) ω/ω_s² exp(−(ω/ω_s)²) exceeds the damping: 0.136 at 0.02 rad/s."""
    rate, motor = 0.02, replace(SMOOTH, stiffness=2.0, viscous=0.0)
    ratio = rate / motor.stribeck_rate
    slope = 2 * (motor.static - motor.coulomb) * ratio / motor.stribeck_rate * np.exp(-(ratio**2))
    assert (damping < slope) == sticks
    run = drive(world, spin_profile([Ramp(rate, 0.2), Hold(40.0)]), 40.0, motor=replace(motor, damping=damping))
    late = run.state.rate[run.t > 30.0]
    assert late.mean() == pytest.approx(rate, rel=0.05)
    if sticks:
        assert late.min() < 0.2 * rate
        assert late.max() > 1.5 * rate
    else:
        assert np.ptp(late) < 0.05 * rate


def test_truth_of_a_motor_run_belongs_to_its_readings():
    scenario = Scenario.load("motor_run", changes=["effect=[{name='table_tilt', parameters={x_rad=0.01}}]"])
    world = scenario.world
    run = drive(world, scenario.motion, 14.0, step=scenario.physics_step, motor=scenario.motor)
    np.testing.assert_allclose(run.readings, forward.rigid_readings(world, run.state), rtol=0, atol=1e-9)
    motion = run.motion.at(run.t)
    np.testing.assert_allclose(motion.rate, run.state.rate, rtol=0, atol=1e-12)
    np.testing.assert_allclose(motion.acceleration, run.state.acceleration, rtol=0, atol=1e-9)
    # The Euler step turns by the new rate: half a step times the change of the rate ahead of the integral.
    ahead = 0.5 * scenario.physics_step * (run.state.rate - run.state.rate[0])
    np.testing.assert_allclose(motion.angle + ahead, run.state.angle, rtol=0, atol=2e-6)
    # Between the steps the acceleration stays between its neighbours, but for the control that is held over a step.
    between = run.motion.at(run.t[:-1] + 0.5 * scenario.physics_step).acceleration
    steps = np.abs(np.diff(run.state.acceleration))
    assert np.all(
        np.abs(between - 0.5 * (run.state.acceleration[1:] + run.state.acceleration[:-1])) < 0.8 * steps + 1e-6
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("drive.motor.static_Nm=0.01", "static friction 0.01 N·m is below"),
        ("drive.mode='driven'", r"\[drive.motor\] belongs to drive.mode = 'dcmotor'"),
        ("drive.motor.cogging_periods=0", "cogging_periods"),
    ],
)
def test_a_motor_that_cannot_be_is_refused(change, message):
    with pytest.raises(InputError, match=message) as error:
        Scenario.load("motor_run", changes=[change])
    assert "\n" not in str(error.value)


def test_a_run_that_does_not_stay_finite_is_one_line(world):
    with pytest.raises(InputError, match=r"did not stay finite with a physics step of 0\.001 s"):
        drive(world, Steady(1.0), 1.0, motor=replace(MOTOR, viscous=100.0))
