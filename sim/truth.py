"""True motion of the cube: what an estimate is compared with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.base.errors import InputError
from gfimu.model.world_model import SpinState
from gfimu.recording import Recording
from sim.forward import nodding_motion
from sim.motions.motion import BodyState
from sim.world import World

if TYPE_CHECKING:
    from gfimu.visual import KnownMotion

__all__ = ["cube_state", "known_motion", "truth_columns"]


def cube_state(world: World, spin: SpinState) -> BodyState:
    """Motion of the cube on the table, about its own centre.

    Parameters
    ----------
    world : World
        The world: place and attitude of the cube, tilt and nod of the axis, stretch of the arms.
    spin : SpinState
        Spin of the cube at n times.

    Returns
    -------
    BodyState
        Position, velocity and acceleration of the cube's centre in the world; rotation, rate and angular acceleration
        in cube axes. The velocity of stretching and nodding arms is left out where the forward model leaves it out.
    """
    if world.slide is not None:
        return _carried_state(world, spin)
    lean, omega, alpha = nodding_motion(world.nod, spin)
    turn = Rotation.from_rotvec(np.outer(spin.angle, [0.0, 0.0, 1.0]))
    arm = turn.apply(world.cube_offset) * (1.0 + world.stretch * spin.rate**2)[:, None]
    velocity = np.cross(omega, arm)
    acceleration = np.cross(alpha, arm) + np.cross(omega, velocity)
    to_world = Rotation.from_rotvec(world.axis_rotvec).as_matrix() @ Rotation.from_rotvec(lean).as_matrix()  # (n, 3, 3)
    attitude = turn.as_matrix() @ Rotation.from_rotvec(world.mount_rotvec).as_matrix()  # from cube to nodding axis
    return BodyState(
        position=np.einsum("nij,nj->ni", to_world, arm),
        rotation=to_world @ attitude,
        velocity=np.einsum("nij,nj->ni", to_world, velocity),
        acceleration=np.einsum("nij,nj->ni", to_world, acceleration),
        omega=np.einsum("nji,nj->ni", attitude, omega),
        alpha=np.einsum("nji,nj->ni", attitude, alpha),
    )


def _carried_state(world: World, spin: SpinState) -> BodyState:
    """Motion of an array on a linear axis: its place, and an attitude that stays."""
    assert world.slide is not None
    rail = Rotation.from_rotvec(world.axis_rotvec)
    along = rail.apply(world.slide / np.linalg.norm(world.slide))
    attitude = (rail * Rotation.from_rotvec(world.mount_rotvec)).as_matrix()
    place, speed, push = (np.outer(part, along) for part in (spin.angle, spin.rate, spin.acceleration))
    still = np.zeros_like(place)
    turned = np.tile(attitude, (len(place), 1, 1))  # SciPy 1.15 takes no read-only rotations
    return BodyState(place + rail.apply(world.cube_offset), turned, speed, push, still, still)


def truth_columns(body: BodyState, gravity: float) -> Mapping[str, NDArray[np.float64]]:
    """Columns of the true motion for a recording: p, alpha, omega, attitude, velocity and position, each (n,)."""
    p = np.einsum("nji,nj->ni", body.rotation, body.acceleration + np.array([0.0, 0.0, gravity]))
    quaternion = Rotation.from_matrix(body.rotation).as_quat(scalar_first=True)
    quaternion *= np.where(quaternion[:, :1] < 0, -1.0, 1.0)
    columns: dict[str, NDArray[np.float64]] = {}
    for quantity, unit, values in (
        ("p", "_m_s2", p),
        ("alpha", "_rad_s2", body.alpha),
        ("omega", "_rad_s", body.omega),
        ("velocity", "_m_s", body.velocity),
        ("position", "_m", body.position),
    ):
        columns |= {f"truth_{quantity}_{axis}{unit}": values[:, index] for index, axis in enumerate("xyz")}
    return columns | {f"truth_q_{part}": quaternion[:, place] for place, part in enumerate("wxyz")}


def known_motion(recording: Recording) -> KnownMotion:
    """Return the true motion in a simulated recording, for its picture.

    Raises
    ------
    InputError
        If the recording holds no truth.
    """
    from gfimu.visual import KnownMotion

    def triple(quantity: str, unit: str) -> NDArray[np.float64]:
        return np.column_stack([recording.extra[f"truth_{quantity}_{axis}{unit}"] for axis in "xyz"])

    if "truth_q_w" not in recording.extra:
        raise InputError("the recording holds no truth; simulate it again")
    return KnownMotion(
        name="truth",
        t=recording.t_s,
        quaternion=np.column_stack([recording.extra[f"truth_q_{part}"] for part in "wxyz"]),
        position=triple("position", "_m"),
        omega=triple("omega", "_rad_s"),
        alpha=triple("alpha", "_rad_s2"),
        p=triple("p", "_m_s2"),
        angle=recording.reference.get("angle_rad"),
    )
