"""The analytic forward model: what ideal and real sensors of a `World` read at given times.

One forward model serves scenario simulation, calibration, bounds and diagnosis; the MuJoCo rig computes the same
rigid-body part independently and agrees to 1e-9 m/s².
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.model.world_model import SpinState
from sim.motions.motion import SpinMotion
from sim.world import Nod, SampleContext, World

__all__ = [
    "TableGeometry",
    "arm_growth",
    "channels",
    "lean_states",
    "leaning",
    "nodding_motion",
    "reference",
    "rigid_readings",
    "shaking",
    "table_geometry",
]

_JERK_STEP = 1e-4  # s
_LEAN_STEP = 2e-3  # s: no finer than the grid on which a mode is simulated


@dataclass(frozen=True)
class TableGeometry:
    """Sensing axes in the table frame.

    Parameters
    ----------
    axes : ndarray, shape (c, 3)
        Unit vectors.
    tangential : ndarray, shape (c, 3)
        r × θ: reading per angular acceleration, m; on a linear axis reading per acceleration along it, last column.
    centripetal : ndarray, shape (c, 6)
        Reading per product of the angular rate, m (`gfimu.array.array.OMEGA_PRODUCTS`).
    up : ndarray, shape (3,)
        The world's up in the frame of the tilted axis.
    places : ndarray, shape (c, 3)
        Places of the chips, m.
    """

    axes: NDArray[np.float64]
    tangential: NDArray[np.float64]
    centripetal: NDArray[np.float64]
    up: NDArray[np.float64]
    places: NDArray[np.float64]

    def of(self, channels: NDArray[np.bool_]) -> TableGeometry:
        """Return the geometry of some channels."""
        return TableGeometry(
            self.axes[channels], self.tangential[channels], self.centripetal[channels], self.up, self.places[channels]
        )


def table_geometry(world: World) -> TableGeometry:
    """Place the array of a world in the table frame: turned by the mounting, moved by the cube's offset."""
    mount = Rotation.from_rotvec(world.mount_rotvec).as_matrix()
    moved = world.array.with_geometry(
        world.cube_offset + world.array.chip_positions @ mount.T,
        [chip.axes @ mount.T for chip in world.array.chips],
    )
    up = Rotation.from_rotvec(world.axis_rotvec).as_matrix()[2]
    if world.slide is not None:
        pushed = np.zeros((len(moved.axes), 3))
        pushed[:, 2] = moved.axes @ (world.slide / np.linalg.norm(world.slide))
        return TableGeometry(moved.axes, pushed, np.zeros((len(moved.axes), 6)), up, moved.positions)
    return TableGeometry(moved.axes, moved.regression_matrix[:, :3], moved.centripetal_matrix, up, moved.positions)


def rigid_readings(world: World, spin: SpinState, geometry: TableGeometry | None = None) -> NDArray[np.float64]:
    """Specific force along each sensing axis for a spin of the table, before the sensing chain.

    Parameters
    ----------
    world : World
        The world.
    spin : SpinState
        Spin at n times.
    geometry : TableGeometry, optional
        ``table_geometry(world)`` where it is at hand.

    Returns
    -------
    ndarray, shape (n, c)
        Readings of ideal sensors, m/s².
    """
    placed = table_geometry(world) if geometry is None else geometry
    if world.slide is not None:  # nothing turns
        return world.gravity * (placed.axes @ placed.up) + np.outer(spin.acceleration, placed.tangential[:, 2])
    theta, rate, acceleration = spin.angle, spin.rate, spin.acceleration
    cos, sin = np.cos(theta), np.sin(theta)
    stretch = 1.0 + world.stretch * rate**2 if world.stretch else 1.0
    if not world.nod:
        x, y, z = placed.up
        gravity = world.gravity * np.stack(
            [cos * x + sin * y, cos * y - sin * x, np.full_like(cos, z)], axis=-1
        )  # (n, 3)
        spun = np.outer(acceleration * stretch, placed.tangential[:, 2])
        spun += np.outer(rate**2 * stretch, placed.centripetal[:, 2])
        return gravity @ placed.axes.T + spun
    return _nodding_readings(world, spin, placed, stretch)


def nodding_motion(nod: Nod, spin: SpinState) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return rotation vector, angular rate and acceleration of a spin whose axis nods, in the nodding axis frame.

    With the nod n and the axis z: ω = ṅ + ω z, α = n̈ + α z + ω ṅ × z, to first order in n. Each (n, 3).
    """
    lean, omega, alpha = nod.lean(spin)
    alpha[:, 0] += spin.rate * omega[:, 1]
    alpha[:, 1] -= spin.rate * omega[:, 0]
    omega[:, 2] += spin.rate
    alpha[:, 2] += spin.acceleration
    return lean, omega, alpha


def _nodding_readings(
    world: World, spin: SpinState, placed: TableGeometry, stretch: NDArray[np.float64] | float
) -> NDArray[np.float64]:
    """Return the readings when the axis nods: the angular rate has parts across the axis."""
    lean, omega, alpha = nodding_motion(world.nod, spin)
    gravity = world.gravity * Rotation.from_rotvec(lean).inv().apply(placed.up)
    turn = Rotation.from_rotvec(np.outer(spin.angle, [0.0, 0.0, 1.0])).inv()
    omega, alpha, gravity = turn.apply(omega), turn.apply(alpha), turn.apply(gravity)
    x, y, z = omega.T
    products = np.stack([x * x, y * y, z * z, x * y, x * z, y * z], axis=-1)  # (n, 6)
    readings = gravity @ placed.axes.T + alpha @ placed.tangential.T + products @ placed.centripetal.T
    if not world.stretch:
        return readings
    # Arms are longer across the axis alone: α × r and ω × (ω × r) of that part of them, along each sensing axis.
    across, axes = placed.places * [1.0, 1.0, 0.0], placed.axes
    along = np.sum(omega**2, axis=1)[:, None] * _along(axes, across)
    longer = alpha @ np.cross(across, axes).T + (omega @ across.T) * (omega @ axes.T) - along
    return readings + (np.reshape(stretch, (-1, 1)) - 1.0) * longer


def arm_growth(world: World, motion: SpinMotion, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Return first (1/s) and second (1/s²) derivative of the arms' relative length 1 + k ω², each (n,)."""
    spin = motion.at(t)
    ahead, behind = motion.at(t + _JERK_STEP), motion.at(t - _JERK_STEP)
    jerk = (ahead.acceleration - behind.acceleration) / (2 * _JERK_STEP)
    rate, acceleration = spin.rate, spin.acceleration
    return 2 * world.stretch * rate * acceleration, 2 * world.stretch * (acceleration**2 + rate * jerk)


def growing_arms(
    world: World, motion: SpinMotion, t: NDArray[np.float64], geometry: TableGeometry
) -> NDArray[np.float64] | float:
    """Return what the growth of the arms adds to the readings, 2 ω × ṙ + r̈, shape (n, c), m/s²; 0 without."""
    if not (world.moving_arms and world.stretch):
        return 0.0
    first, second = arm_growth(world, motion, t)
    along = -geometry.centripetal[:, 2]  # r · a across the axis, of each sensing axis a: the load is radial
    return np.outer(2 * motion.at(t).rate * first, geometry.tangential[:, 2]) + np.outer(second, along)


def leaning(
    world: World, motion: SpinMotion, t: NDArray[np.float64], geometry: TableGeometry
) -> NDArray[np.float64] | float:
    """Return what leans of the cube add to the readings, to first order in the lean, shape (n, c), m/s²; 0 without.

    A lean n(t) in the turning frame moves a place r to r + n × r and an axis a to a + n × a. The place is then
    accelerated by n̈ × r + 2 ω × (ṅ × r) + α × (n × r) + ω × (ω × (n × r)) more.
    """
    if not world.leans:
        return 0.0
    here = motion.at(t)
    rate, acceleration = here.rate[:, None], here.acceleration[:, None]
    added = np.zeros((len(t), len(geometry.axes)))
    vertical = np.array([0.0, 0.0, 1.0])
    up = _turned_back(here, geometry.up)
    for lean, states in zip(world.leans, lean_states(world, motion, t), strict=True):
        vector = lean.vector / np.linalg.norm(lean.vector)
        now, first, second = (state[:, None] for state in states)
        turned = np.cross(vector, geometry.axes)  # (c, 3)
        moved = np.cross(vector, geometry.places)
        across, inward = (_along(geometry.axes, vectors) for vectors in _spun(vertical, moved))  # (c,)
        spun, pulled = (_along(turned, vectors) for vectors in _spun(vertical, geometry.places))
        added += now * (world.gravity * up @ turned.T + acceleration * (spun + across) + rate**2 * (pulled + inward))
        added += first * 2.0 * rate * across + second * _along(geometry.axes, moved)
    return added


def lean_states(world: World, motion: SpinMotion, t: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return the angle of every lean about its own line, rad, with its two derivatives, each (3, n)."""
    found = []
    for lean in world.leans:
        size = float(np.linalg.norm(lean.vector))
        earlier, now, later = (size * lean.function(motion.at(t + step)) for step in (-_LEAN_STEP, 0.0, _LEAN_STEP))
        first, second = (later - earlier) / (2.0 * _LEAN_STEP), (later - 2.0 * now + earlier) / _LEAN_STEP**2
        found.append(np.stack([now, first, second]))
    return found


def _turned_back(spin: SpinState, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vectors of the room, (n, 3) or (3,), in the turning frame, (n, 3)."""
    cos, sin = np.cos(spin.angle), np.sin(spin.angle)
    x, y, z = np.broadcast_to(vectors, (len(cos), 3)).T
    return np.stack([cos * x + sin * y, cos * y - sin * x, z], axis=-1)


def _spun(axis: NDArray[np.float64], places: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return axis × place and axis × (axis × place), each (c, 3)."""
    across = np.cross(axis, places)
    return across, np.cross(axis, across)


def _along(axes: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.einsum("ck,ck->c", axes, vectors)


def shaking(
    world: World, spin: SpinState, t: NDArray[np.float64], geometry: TableGeometry
) -> NDArray[np.float64] | float:
    """Return what accelerations of the whole rig in the room add to the readings, shape (n, c), m/s²; 0 without."""
    if not world.shakes:
        return 0.0
    total = np.sum([shake(spin, t) for shake in world.shakes], axis=0)
    return _turned_back(spin, total) @ geometry.axes.T


def _mechanical(
    world: World, motion: SpinMotion, t: NDArray[np.float64], geometry: TableGeometry
) -> NDArray[np.float64]:
    """Return what ideal sensors read, with arms that grow, a cube that leans and a rig that shakes, (n, c), m/s²."""
    spin = motion.at(t)
    readings = rigid_readings(world, spin, geometry) + growing_arms(world, motion, t, geometry)
    return readings + leaning(world, motion, t, geometry) + shaking(world, spin, t, geometry)


def channels(
    world: World,
    motion: SpinMotion,
    t: NDArray[np.float64],
    temperature: NDArray[np.float64] | None = None,
    geometry: TableGeometry | None = None,
) -> NDArray[np.float64]:
    """Noise-free analogue readings of a world at board times.

    Parameters
    ----------
    world : World
        The world.
    motion : SpinMotion
        The table's motion as driven; the world's motion and mount steps are applied to it.
    t : ndarray, shape (n,)
        Time on the board's clock, s.
    temperature : ndarray, shape (n,), optional
        Board temperature, °C.
    geometry : TableGeometry, optional
        ``table_geometry(world)`` where it is at hand.

    Returns
    -------
    ndarray, shape (n, c)
        Readings, m/s², before noise and quantisation.
    """
    for step in (*world.motion_steps, *world.mount_steps):
        motion = step(motion, t)
    geometry = table_geometry(world) if geometry is None else geometry
    true_times = world.true_times(t)
    spin = motion.at(true_times)
    if world.chip_delay is None:
        readings = _mechanical(world, motion, true_times, geometry)
    else:
        readings = np.empty((len(t), world.array.n_channels))
        for chip, times in enumerate(world.chip_times(t).T):
            mine = world.array.chip_of_channel == chip
            readings[:, mine] = _mechanical(world, motion, times, geometry.of(mine))
    return world.sense(readings, SampleContext(t, spin, _warm(world, t, temperature)))


def _warm(world: World, t: NDArray[np.float64], temperature: NDArray[np.float64] | None) -> NDArray[np.float64]:
    return np.full(len(t), world.temperature) if temperature is None else temperature


def reference(
    world: World, motion: SpinMotion, t: NDArray[np.float64], temperature: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Noise-free reading of the tachometer of a world at reference times, shape (n,), rad/s.

    ``temperature`` is the board's, °C, where it is recorded.
    """
    for step in world.motion_steps:
        motion = step(motion, t)
    times = t - world.tacho_delay
    context = SampleContext(times, motion.at(times), _warm(world, t, temperature))
    reading = context.spin.rate
    for change in world.reference_steps:
        reading = change(reading, context.spin, times)
    for error in world.reference_errors:
        reading = error(reading, context)
    return reading
