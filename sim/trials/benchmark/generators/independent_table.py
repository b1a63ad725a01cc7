"""A turntable of its own: MuJoCo stepped under a real speed drive, written without looking at the project's rig.

Nothing here comes from `sim` or `gfimu`: own MJCF text, own motor and controller, own command profiles, and specific
force read two ways: by MuJoCo's accelerometers, and by differencing positions.
"""

from dataclasses import dataclass, field

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

LEAD = 1.5  # s of motion before the first and after the last sample
INERTIA = 0.02  # kg m², rotor with drive
EDGE = 0.1  # m
CHIPS = 0.5 * EDGE * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
HEIGHT = 0.06  # m, of the cube's centre above the table

MJCF = """
<mujoco model="rotary stage">
  <compiler angle="radian"/>
  <option timestep="{step}" integrator="RK4" gravity="{gravity[0]} {gravity[1]} {gravity[2]}">
    <flag contact="disable" eulerdamp="disable"/>
  </option>
  <worldbody>
    <body name="rotor">
      <joint name="shaft" type="hinge" axis="0 0 1" armature="0.003" damping="0.01" frictionloss="{friction}"/>
      <geom type="cylinder" size="0.12 0.006" mass="2.3"/>
      <body name="cube" pos="{cube[0]} {cube[1]} {cube[2]}" quat="{turn[0]} {turn[1]} {turn[2]} {turn[3]}">
        <geom type="box" size="0.05 0.05 0.05" mass="0.4"/>
        {sites}
      </body>
      <body name="mode">
        <joint name="torsion" type="hinge" axis="0 0 1" stiffness="{stiffness}" damping="{torsion_damping}"/>
        <geom type="box" size="0.01 0.01 0.01" mass="0.006"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <general name="motor" joint="shaft" dyntype="filterexact" dynprm="0.004" gainprm="1" ctrlrange="-3 3"
             ctrllimited="true"/>
  </actuator>
  <sensor>
    <frameangacc name="shaft_acceleration" objtype="body" objname="rotor"/>
    {sensors}
  </sensor>
</mujoco>
"""


@dataclass(frozen=True)
class Rig:
    """What the rig is like; lengths in m, angles in rad."""

    gravity: float = 9.80665
    table_tilt: tuple[float, float] = (0.0, 0.0)
    mount_tilt: tuple[float, float] = (0.0, 0.0)
    eccentricity: tuple[float, float] = (0.0, 0.0)
    moved: np.ndarray = field(default_factory=lambda: np.zeros((4, 3)))
    turned: np.ndarray = field(default_factory=lambda: np.zeros((4, 3)))
    torsion_hz: float = 12.0
    torsion_damping: float = 0.03
    cogging: tuple[float, float, float] = (0.0, 1.0, 0.0)  # rad/s², order, rad
    wobble: tuple[float, float, float] = (0.0, 0.0, 0.0)  # amplitude, phase, azimuth of the nod's axis
    stretch: float = 0.0  # s²/rad²
    friction: float = 0.008  # N m, Coulomb's, in the bearing

    @property
    def down(self):
        """Gravity in the frame of the tilted axis: the tilt turns the table, so it turns gravity back."""
        tilt = Rotation.from_rotvec([*self.table_tilt, 0.0])
        return tilt.inv().apply([0.0, 0.0, -self.gravity])

    @property
    def arms(self):
        """Positions of the chips in the table frame, (4, 3)."""
        centre = np.array([*self.eccentricity, HEIGHT])
        return centre + Rotation.from_rotvec([*self.mount_tilt, 0.0]).apply(CHIPS + self.moved)

    @property
    def axes(self):
        """Sensing axes of the chips in the table frame, (4, 3 axes, 3)."""
        mount = Rotation.from_rotvec([*self.mount_tilt, 0.0]).as_matrix()
        chips = Rotation.from_rotvec(self.turned).as_matrix()  # columns are the turned axes
        return np.swapaxes(mount @ chips, 1, 2)


@dataclass(frozen=True)
class TableRun:
    """A run on a fine, even time base: time, angle, rate, acceleration, twist of the mode, readings (n, 12)."""

    t: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    twist: np.ndarray
    readings: np.ndarray


def mjcf_of(rig, step):
    turn = Rotation.from_rotvec([*rig.mount_tilt, 0.0]).as_quat(scalar_first=True)
    sites, sensors = [], []
    for index, (place, turned) in enumerate(zip(CHIPS + rig.moved, rig.turned, strict=True)):
        quat = Rotation.from_rotvec(turned).as_quat(scalar_first=True)
        sites.append(f'<site name="c{index}" pos="{_words(place)}" quat="{_words(quat)}"/>')
        sensors.append(f'<accelerometer name="f{index}" site="c{index}"/>')
    mode = 0.006 * (0.02**2 + 0.02**2) / 12  # kg m², box of 2 cm
    natural = 2 * np.pi * rig.torsion_hz
    return MJCF.format(
        step=step,
        gravity=rig.down.tolist(),
        cube=[*rig.eccentricity, HEIGHT],
        turn=turn.tolist(),
        sites="".join(sites),
        sensors="".join(sensors),
        stiffness=mode * natural**2,
        torsion_damping=2 * rig.torsion_damping * natural * mode,
        friction=rig.friction,
    )


def _words(values):
    return " ".join(repr(float(value)) for value in values)


def drive_table(command, rig, duration, step=1e-3):
    """Drive the table after a commanded rate (a function of time) with a PI speed loop and a motor that lags 4 ms."""
    model = mujoco.MjModel.from_xml_string(mjcf_of(rig, step))
    data = mujoco.MjData(model)
    t = np.arange(round((duration + 2 * LEAD) / step) + 1) * step - LEAD
    wanted = command(t)
    forward = np.gradient(wanted, step)
    log = np.empty((len(t), 3))
    sensed = np.empty((len(t), model.nsensordata))
    qpos, qvel, ctrl, push, sensors = data.qpos, data.qvel, data.ctrl, data.qfrc_applied, data.sensordata
    qvel[0] = wanted[0]
    integral = 0.0
    amplitude, order, phase = rig.cogging
    for row, (rate, acceleration) in enumerate(zip(wanted.tolist(), forward.tolist(), strict=True)):
        error = rate - qvel[0]
        integral += error * step
        ctrl[0] = INERTIA * (acceleration + 10.0 * error + 15.0 * integral) + 0.01 * rate
        if amplitude:
            push[0] = INERTIA * amplitude * np.sin(order * qpos[0] + phase)
        log[row] = qpos[0], qvel[0], qpos[1]
        mujoco.mj_step(model, data)
        sensed[row] = sensors  # of the first Runge-Kutta stage: the state logged just above
    return TableRun(t, log[:, 0], log[:, 1], sensed[:, 2], log[:, 2], sensed[:, 3:])


# Second derivative by central differences of eighth order.
_STENCIL = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])


def differenced_readings(rig, t, angle, rate):
    """Specific force (n, 12) from the chips' positions alone on an even time base; four samples at each end repeat."""
    frame = Rotation.from_rotvec(np.outer(angle, [0.0, 0.0, 1.0])).as_matrix()
    amplitude, phase, azimuth = rig.wobble
    if amplitude:
        nod = np.outer(amplitude * np.cos(angle + phase), [np.cos(azimuth), np.sin(azimuth), 0.0])
        frame = Rotation.from_rotvec(nod).as_matrix() @ frame
    grown = (1.0 + rig.stretch * rate**2)[:, None] * [1.0, 1.0, 0.0] + [0.0, 0.0, 1.0]  # the load is radial
    arms = rig.arms[None] * grown[:, None, :]
    to_rig = frame.transpose(0, 2, 1)
    axes = (rig.axes.reshape(12, 3) @ to_rig).reshape(len(t), 4, 3, 3)
    return read_positions(arms @ to_rig, axes, t[1] - t[0], rig.down)


def read_positions(positions, axes, h, down):
    """Specific force (n, 12) of chips at positions (n, 4, 3) with axes (n, 4, 3 axes, 3), every ``h`` seconds."""
    inner = len(positions) - 8
    acceleration = sum(c * positions[k : k + inner] for k, c in enumerate(_STENCIL)) / h**2
    acceleration = np.concatenate([acceleration[:1]] * 4 + [acceleration] + [acceleration[-1:]] * 4)
    return (axes @ (acceleration - down)[..., None]).reshape(len(positions), 12)


def random_command(rng, duration, top=15.0, kind=None):
    """Draw a commanded rate: S-curves between held speeds (0), smooth random waypoints, or plateaus with chirps (2).

    The table rests for the first 0.3 s, so that its angle is zero at the first sample.
    """
    kind = rng.integers(3) if kind is None else kind
    fine = np.arange(-2.0, duration + 2.0, 1e-3)
    if kind == 1:
        knots = np.concatenate([[-2.0, 0.3], 0.3 + np.cumsum(rng.uniform(0.8, 2.5, int(duration) + 10))])
        rates = rng.uniform(-top, top, len(knots))
        rates[rng.random(len(knots)) < 0.15] = 0.0
        rates[:2] = 0.0
        profile = PchipInterpolator(knots, rates)(np.clip(fine, knots[0], knots[-1]))
        return CubicSpline(fine, gaussian_filter1d(profile, 60.0))
    profile, now, rate = np.zeros_like(fine), 0.5, 0.0
    while now < duration + 2.0:
        target = 0.0 if rng.random() < 0.2 else rng.uniform(-top, top)
        ramp = abs(target - rate) / rng.uniform(6.0, 25.0) + 0.15
        share = np.clip((fine - now) / ramp, 0.0, 1.0)
        profile += (target - rate) * (share - np.sin(2 * np.pi * share) / (2 * np.pi))
        rate, now = target, now + ramp + rng.uniform(1.0, 3.5)
    if kind == 2:
        for begin in rng.uniform(0.05, 0.8, 3) * duration:
            length, rise = rng.uniform(3.0, 6.0), rng.uniform(0.3, 0.6)
            since = np.clip(fine - begin, 0.0, length)
            window = np.sin(np.pi * since / length) ** 2
            profile += rng.uniform(0.5, 2.0) * window * np.sin(2 * np.pi * (0.3 * since + rise * since**2 / 2))
    return CubicSpline(fine, gaussian_filter1d(profile, 30.0))
