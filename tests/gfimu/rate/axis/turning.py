"""A world of its own for rotations about one axis: the readings from second differences of positions in the world."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray, Chip
from gfimu.base import STANDARD_GRAVITY
from gfimu.recording import Recording

RATE = 100.0
NOISE = 0.0287  # m/s²


def array_of(*positions):
    chips = tuple(Chip(f"a{n}", np.array(place, float), np.eye(3)) for n, place in enumerate(positions, 1))
    return AccelerometerArray("few", chips)


def turned(
    array, u, rng, *, point=(0.0, 0.0, 0.0), tilt=0.0, hub=0.0, rest=True, speed=8.0, duration=40.0, noise=NOISE
):
    """Return a recording of an array that turns about an axis, and its rate and angle at the samples.

    The body's axis ``u`` stands at ``tilt`` from the vertical; the hub shakes by ``hub`` m/s², white.
    """
    knots = np.linspace(0.0, duration, 12)
    rates = rng.uniform(-speed, speed, 12)
    if rest:
        rates[:2] = 0.0
    rate = CubicSpline(knots, rates, bc_type="clamped")
    angle = rate.antiderivative()
    t = np.arange(0.0, duration, 1.0 / RATE)
    u = np.asarray(u, float) / np.linalg.norm(u)
    stands = Rotation.align_vectors([[np.sin(tilt), 0.0, np.cos(tilt)]], [u])[0]  # body at angle 0 to world

    def attitude(at):
        return stands * Rotation.from_rotvec(np.outer(angle(at) + 1.0, u))

    h = 1e-4
    readings = np.empty((len(t), array.n_channels))
    shake = hub * rng.standard_normal((len(t), 3))
    up = np.array([0.0, 0.0, STANDARD_GRAVITY])
    for chip in range(len(array.chips)):
        lever = array.chips[chip].position - np.asarray(point)
        places = [attitude(at).apply(lever) for at in (t - h, t, t + h)]
        acceleration = (places[0] - 2.0 * places[1] + places[2]) / h**2
        force = attitude(t).inv().apply(acceleration + up + shake)
        readings[:, array.chip_of_channel == chip] = force @ array.chips[chip].axes.T
    readings += noise * rng.standard_normal(readings.shape)
    return Recording.from_arrays(t, readings, array), rate(t), angle(t) - angle(t[0])


def mounted(array, doubt, rng, **world):
    """Return a recording of an array whose places, orientations, biases and axis are off, the rate, and what was off.

    The body's axis is z, as drawn; ``doubt`` holds the standard deviations of what is off, by the names of
    `gfimu.array.turning_axis.AxisUncertainty`; what was off has the names of the estimate's constants.
    """
    off, chips = {}, []
    for chip in array.chips:
        lever, turn = rng.normal(size=3) * doubt.lever_std_m, rng.normal(size=3) * doubt.rotation_std_rad
        axes = Rotation.from_rotvec(turn).apply(chip.axes)
        chips.append(Chip(chip.name, chip.position + lever, axes, chip.part))
        off |= {f"{chip.name}_lever_{axis}_m": value for axis, value in zip("xyz", lever, strict=True)}
        off |= {f"{chip.name}_rotation_{axis}_rad": value for axis, value in zip("xyz", turn, strict=True)}
    point, lean = rng.normal(size=3) * doubt.point_std_m, rng.normal(size=2) * doubt.direction_std_rad
    off |= {f"axis_point_{axis}_m": value for axis, value in zip("xyz", point, strict=True)}
    off |= {f"axis_direction_{axis}_rad": value for axis, value in zip("xy", lean, strict=True)}
    u = Rotation.from_rotvec([*lean, 0.0]).apply([0.0, 0.0, 1.0])
    recording, rate, _ = turned(AccelerometerArray("few", tuple(chips)), u, rng, point=point, **world)
    bias = rng.normal(size=array.n_channels) * doubt.bias_std_m_s2
    recording.readings[:] += bias
    off |= {f"{channel}_bias_m_s2": value for channel, value in zip(array.channels, bias, strict=True)}
    return recording, rate, off | {"inclination_rad": world.get("tilt", 0.0)}
