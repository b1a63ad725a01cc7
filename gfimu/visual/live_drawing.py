"""What draws a live stream, block by block, in the entities that `gfimu.visual.live` lays out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import motion_from_readings
from gfimu.base.results.colours import HEALTH
from gfimu.motion.attitude import from_rotation, integrate_attitude, to_rotation
from gfimu.rate.health.fault import HealthCode
from gfimu.rate.health.live.block import Health, LiveBlock, StreamState
from gfimu.visual.plots import broken_at_gaps, entity_part
from gfimu.visual.rig import channel_shapes
from gfimu.visual.scene import TIMELINE

__all__ = ["BODY", "EVENTS", "LiveDrawing", "axis_columns"]

BODY, EVENTS = "scene/array", "events"
"""Entities of the body that turns, and of what happened."""

_BAND = 2.0  # standard deviations on either side
_TILT_S = 1.0  # by choice: in which the tilt follows the specific force
_SETTLES_S = 1.0  # the biases do, in the first rest; the rate of that time would set the scale of its plot

_WORDS = {
    None: "not watched",
    HealthCode.USED: "used",
    HealthCode.DOUBTED: "in doubt",
    HealthCode.EXCLUDED: "excluded",
    HealthCode.MISSING: "missing",
    HealthCode.SATURATED: "saturated",
    HealthCode.STUCK: "stuck",
}
_BAD = {HealthCode.EXCLUDED, HealthCode.MISSING, HealthCode.SATURATED, HealthCode.STUCK}


class LiveDrawing:
    """Draws blocks of a stream, one after the other.

    Parameters
    ----------
    stream : rerun.RecordingStream
        Where to.
    array : AccelerometerArray
        The array, with c channels.
    length_per_m_s2 : float
        Length drawn for 1 m/s², m.
    """

    def __init__(self, stream: rr.RecordingStream, array: AccelerometerArray, length_per_m_s2: float) -> None:
        self._stream, self._array, self._length = stream, array, length_per_m_s2
        self._columns = axis_columns(array)
        places = [np.flatnonzero(array.chip_of_channel == index) for index in range(len(array.chips))]
        self._sites = [(part, np.linalg.pinv(array.axes[part])) for part in places]  # (k,), (3, k) of each chip
        self._axes = channel_shapes(array)
        self._codes: tuple[HealthCode | None, ...] = ()
        self._ends: dict[str, float] = {}  # of each entity of lines the newest time
        self._waiting: list[tuple[float, NDArray[np.float64]]] = []  # mean readings (c,) that no rate has reached yet
        self._attitude = Rotation.identity()
        self._last: tuple[float, NDArray[np.float64]] | None = None  # time and rate of the attitude
        self._drawn_from_s = -np.inf

    def add(self, block: LiveBlock) -> None:
        """Draw what came."""
        for health in block.health:
            self._add_health(health)
        if len(block.t_s):
            self._add_readings(block.t_s, block.readings)
        if len(block.rate_t_s):
            self._add_rate(block)
        if block.states:
            self._add_states(block.states)
        if block.events:
            texts = rr.TextLog.columns(
                text=[event.text for event in block.events],
                level=["WARN" if event.is_fault else "INFO" for event in block.events],
            )
            self._send(EVENTS, np.array([event.t_s for event in block.events]), texts)

    def _send(self, entity: str, t: NDArray[np.float64], columns: Any) -> None:
        self._stream.send_columns(entity, [rr.TimeColumn(TIMELINE, duration=t)], columns)

    def _send_lines(self, entity: str, t: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Send lines (n, k), which break where samples are lost, also between blocks."""
        count = values.shape[1]
        before = self._ends.get(entity, float(t[0]))
        self._ends[entity] = float(t[-1])
        if t[0] > before:
            t, values = np.insert(t, 0, before), np.insert(values, 0, np.nan, axis=0)
            t, values = (part[1:] for part in broken_at_gaps(t, values))
        self._send(entity, t, rr.Scalars.columns(scalars=values.ravel()).partition(np.full(len(t), count)))

    def _add_readings(self, t: NDArray[np.float64], readings: NDArray[np.float64]) -> None:
        for axis, columns in enumerate(self._columns):
            self._send_lines(f"readings/axis_{axis + 1}", t, readings[:, columns])
        forces = np.stack([readings[:, part] @ inverse.T for part, inverse in self._sites], axis=1)  # (n, chips, 3)
        vectors = np.nan_to_num(forces).reshape(-1, 3) * self._length
        arrows = rr.Arrows3D.columns(vectors=vectors).partition(np.full(len(t), len(self._sites)))
        self._send(f"{BODY}/specific_force", t, arrows)
        mean = readings.mean(axis=0)
        if self._codes:
            mean[[code in _BAD for code in self._codes]] = np.nan
        self._waiting.append((float(t[-1]), mean))

    def _add_health(self, health: Health) -> None:
        """Send what changed: lanes, and red arrows in place of the sensing axes that are not used."""
        before = self._codes or ("",) * len(health.codes)
        now = np.array([health.t_s])
        for channel, code, last in zip(self._array.channels, health.codes, before, strict=True):
            if code != last:
                self._send(f"health/{entity_part(channel)}", now, rr.StateChange.columns(state=[_WORDS[code]]))
        if health.codes != self._codes:
            bad = [code in _BAD for code in health.codes]
            along = 1.3 * self._axes.vectors[bad]  # through the chip: one end may lie in the body
            arrows = rr.Arrows3D.columns(
                origins=self._axes.origins[bad] - along, vectors=2.0 * along,
                colors=[HEALTH["excluded"]] * sum(bad), radii=[2.5 * self._axes.radius] * sum(bad),
            )  # fmt: skip
            self._send(f"{BODY}/not_used", now, arrows.partition([sum(bad)]))
        self._codes = health.codes

    def _add_rate(self, block: LiveBlock) -> None:
        t, omega = block.rate_t_s, block.omega.copy()
        if self._last is None:
            self._drawn_from_s = float(t[0]) + _SETTLES_S
        known = np.isfinite(omega).all(axis=1)
        if known.any():
            self._turn(t[known], omega[known])
        omega[t < self._drawn_from_s] = np.nan
        spread = _BAND * block.omega_std
        for axis, name in enumerate("xyz"):
            edges = omega[:, axis, None] + spread[:, axis, None] * [1.0, -1.0]
            self._send_lines(f"rate/omega_{name}/band", t, edges)
            self._send_lines(f"rate/omega_{name}/estimate", t, omega[:, [axis]])
        self._send_lines("rate/sign_probability", t, block.sign_probability[:, None])

    def _turn(self, t: NDArray[np.float64], omega: NDArray[np.float64]) -> None:
        """Turn the body with the rate (n, 3), rad/s; its tilt follows the specific force of the body origin.

        The rate of uncalibrated readings alone would tilt the body by degrees in a second (complementary filter:
        R. Mahony, T. Hamel and J.-M. Pflimlin, IEEE TAC 53, 2008).
        """
        share = 1.0
        if self._last is None:
            self._last = (float(t[0]) - 1e-9, omega[0])
        else:
            share = min(1.0, (float(t[-1]) - self._last[0]) / _TILT_S)
        times, rates = np.insert(t, 0, self._last[0]), np.insert(omega, 0, self._last[1], axis=0)
        turned = to_rotation(integrate_attitude(times, rates, q0=from_rotation(self._attitude)))
        self._last = (float(times[-1]), rates[-1])
        now = [mean for at, mean in self._waiting if at <= t[-1]]
        self._waiting = [(at, mean) for at, mean in self._waiting if at > t[-1]]
        if now:
            force = motion_from_readings(self._array, now[-1:], omega[-1:]).p[0]
            if np.isfinite(force).all():
                turned = _towards_upright(turned[-1], force, share) * turned
        self._attitude = turned[-1]
        self._send(BODY, times[1:], rr.Transform3D.columns(quaternion=turned[1:].as_quat()))

    def _add_states(self, states: Sequence[StreamState]) -> None:
        t = np.array([state.t_s for state in states])
        for name, columns in {
            "sample_rate": [[state.rate_hz] for state in states],
            "missing": [[state.lost, state.corrupt] for state in states],
            "delay": [[state.delay_s, state.behind_s] for state in states],
        }.items():
            values = np.array(columns, dtype=float)
            self._send(f"stream/{name}", t, rr.Scalars.columns(scalars=values))


def _towards_upright(attitude: Rotation, force: NDArray[np.float64], share: float) -> Rotation:
    """Return a share of the least turn, in the world, after which a specific force (3,), body frame, points up."""
    up = attitude.apply(force)
    axis = np.cross(up, [0.0, 0.0, 1.0])
    size = float(np.linalg.norm(axis))
    if size <= 1e-9 * float(np.linalg.norm(up)):  # upright, or on its head: any horizontal axis will do
        return Rotation.from_rotvec([share * np.pi * (up[2] < 0.0), 0.0, 0.0])
    return Rotation.from_rotvec(share * np.arctan2(size, up[2]) / size * axis)


def axis_columns(array: AccelerometerArray) -> list[NDArray[np.intp]]:
    """Return the channels of the chips' first axes, of their second axes, and so on."""
    number = np.concatenate([np.arange(len(chip.axes)) for chip in array.chips])
    return [np.flatnonzero(number == axis) for axis in range(int(number.max()) + 1)]
