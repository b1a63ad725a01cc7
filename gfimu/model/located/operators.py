"""Places of the forward model: what a small error φ(t) there changes in channels and reference, to first order.

With the sensing axis a of a chip at r in the frame that turns with the table, e a unit vector, z the axis, u the
specific force of gravity and F that of the chip, all in that frame, and e′ a unit vector of the room in that frame:

    the reference reads φ more:    Ω + φ
    the array moves by φ e:        a·(φ̈ e + 2ω φ̇ z×e + α φ z×e + ω² φ z×(z×e))
    the array leans by φ e:        the same of e × r, and φ (e × a)·F
    the array twists by φ:         what the drive moves is the array, so the reference reads φ̇ less
    the array vibrates along e:    a·e φ
    its arms stretch by φ:         the same of the part of r across the axis
    the bench shakes:              a·e′ φ
    the axis tilts by φ e′:        a·(φ̈ e′×r + 2ω φ̇ e′×(z×r) − φ e′×u)
    the table turns by φ more:     a·(φ̈ z×r + 2ω φ̇ z×(z×r)), and the reference reads it

Each is A φ + B φ̇ + C φ̈ with A, B and C per observation; what is read at another time is moved by φ(t). A free body
has the places of `body_places` instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from gfimu.model.located.rig_state import RigState
from gfimu.model.located.usual import USUAL

__all__ = ["Operator", "Place", "body_places", "channel_place", "moved", "rig_places"]

_Floats = NDArray[np.float64]
_Groups = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Operator:
    """What an error φ adds to each observation: A φ + B φ̇ + C φ̈, or s(t ± φ) − s(t) where it moves a signal in time.

    Parameters
    ----------
    of_value, of_rate, of_acceleration : ndarray, shape (n, c + 1), optional
        A, B and C; None where it is zero.
    signal : ndarray, shape (n, c + 1), optional
        What is read at another time; A is its derivative, with the sign of ``later``.
    later : float
        1 where what is read happened φ later than its time says, −1 where earlier.
    """

    of_value: _Floats | None
    of_rate: _Floats | None = None
    of_acceleration: _Floats | None = None
    signal: _Floats | None = None
    later: float = 1.0

    @property
    def parts(self) -> tuple[_Floats | None, _Floats | None, _Floats | None]:
        """A, B and C."""
        return self.of_value, self.of_rate, self.of_acceleration

    @property
    def order(self) -> int:
        """Order of the highest derivative of φ that it takes."""
        return max(order for order, part in enumerate(self.parts) if part is not None)

    @cached_property
    def reached(self) -> NDArray[np.intp]:
        """Observations that it changes."""
        changed = [part.any(axis=0) for part in self.parts if part is not None]
        return np.flatnonzero(np.any(changed, axis=0))

    def added(self, error: _Floats, period: float) -> _Floats:
        """Return what an error (n, 1) or (n, c + 1) adds to the observations, shape (n, c + 1)."""
        if self.signal is not None:
            return moved(self.signal, self.later * error / period) - self.signal
        total, derivative = np.zeros_like(error), error
        for order, part in enumerate(self.parts[: self.order + 1]):
            derivative = np.gradient(derivative, period, axis=0, edge_order=2) if order else derivative
            total = total if part is None else total + part * derivative
        return total

    def averaged(self, means: Callable[[_Floats], _Floats]) -> Operator:
        """Return A, B and C of means of the samples."""
        value, rate, acceleration = (None if part is None else means(part) for part in self.parts)
        return Operator(value, rate, acceleration)

    def about(self, error: _Floats, period: float) -> Operator:
        """Return what a small change of an error (n, 1) adds."""
        if self.signal is None or self.of_value is None:
            return self
        return replace(self, of_value=moved(self.of_value, self.later * error / period))


def moved(values: _Floats, share: _Floats) -> _Floats:
    """Return smooth values (n, …) moved by shares of a sample (n, …), by the cubic through the four nearest.

    Lagrange's form (Abramowitz and Stegun, 25.2.13). Values are known to one sample beyond the ends, by the cubic
    through the outermost four, and stay from there on what they are there.
    """
    if len(values) < 4:
        return values
    at = np.arange(len(values)).reshape(-1, *[1] * (values.ndim - 1)) + share
    at = np.clip(at, -1.0, float(len(values)))
    first = np.clip(np.floor(at).astype(int) - 1, 0, len(values) - 4)
    u = at - first
    weights = (
        -(u - 1.0) * (u - 2.0) * (u - 3.0) / 6.0,
        u * (u - 2.0) * (u - 3.0) / 2.0,
        -u * (u - 1.0) * (u - 3.0) / 2.0,
        u * (u - 1.0) * (u - 2.0) / 6.0,
    )
    near = (np.take_along_axis(values, first + index, axis=0) for index in range(len(weights)))
    return np.asarray(sum(weight * one for weight, one in zip(weights, near, strict=True)))


@dataclass(frozen=True)
class Place:
    """Where an error is, and what it is of.

    Parameters
    ----------
    name : str
        Place of the contract: reference, motion, array, bench, supply, channel, chip, clock.
    what : str
        What the error is, which identifies it beside the name: ``leans``, ``offset`` and so on.
    words : str
        The error in words, as the subject and verb of a sentence.
    unit : str
        Unit of the error.
    usual : float
        Its usual size, in that unit.
    components : tuple of str
        Names of its components: axes, channels or chips.
    operators : callable
        From the state of the rig to the operator of each component.
    of_angle : bool
        Whether the reference that it is an error of is an angle.
    """

    name: str
    what: str
    words: str
    unit: str
    usual: float
    components: tuple[str, ...]
    operators: Callable[[RigState], Sequence[Operator]]
    of_angle: bool = False


def rig_places(*, is_angle: bool, has_geometry: bool = True) -> dict[str, Place]:
    """Return the places in the rig, by what the error there is.

    Parameters
    ----------
    is_angle : bool
        Whether the reference is an angle.
    has_geometry : bool
        Whether the simulation says how its array stands on a table; without that only places of the reference and of
        all channels alike are known.
    """
    read, usual = "rad" if is_angle else "rad/s", USUAL
    x, xy, xyz = ("",), ("x", "y"), ("x", "y", "z")
    late, turns = partial(_is_late, is_angle), partial(_turns, is_angle)
    places = (
        Place("reference", "reads", "the reference reads otherwise than the table turns", read, usual.reads, x, _reads),
        Place("clock", "late", "the reference is late", "s", usual.late_s, x, late),
        Place("motion", "turns", "the table turns otherwise than its drive", "rad", usual.turns_rad, x, turns),
        Place("array", "leans", "the array leans on the table", "rad", usual.leans_rad, xy, _leans),
        Place(
            "array", "twists", "the array twists on the table", "rad", usual.turns_rad, x, partial(_twists, is_angle)
        ),
        Place("array", "moves", "the array moves on the table", "m", usual.moves_m, xyz, _moves),
        Place("array", "stretches", "the array stretches away from the axis", "1", usual.ratio, x, _stretches),
        Place("array", "vibrates", "the array vibrates with the table", "m/s²", usual.shakes_m_s2, xyz, _vibrates),
        Place("bench", "shakes", "the bench shakes", "m/s²", usual.shakes_m_s2, xyz, _shakes),
        Place("bench", "heaves", "the bench shakes up and down", "m/s²", usual.shakes_m_s2, ("z",), _heaves),
        Place("bench", "tilts", "the axis tilts in the room", "rad", usual.leans_rad, xy, _tilts),
        Place("supply", "gain", "the gain of all channels changes", "1", usual.ratio, x, _gain_of_all),
    )
    return {
        place.what: replace(place, of_angle=is_angle)
        for place in places
        if has_geometry or place.what in _WITHOUT_GEOMETRY
    }


def body_places() -> dict[str, Place]:
    """Return the places of an array on a free body but its channels, by what the error there is."""
    usual, x, xyz = USUAL, ("",), ("x", "y", "z")
    places = (
        Place("reference", "gyro", "the gyro reads otherwise than the body turns", "rad/s", usual.reads, xyz, _gyro),
        Place("clock", "gyro late", "the gyro is late", "s", usual.late_s, x, _gyro_is_late),
        Place("array", "arms", "the array stretches", "1", usual.ratio, x, _arms),
        Place("supply", "gain", "the gain of all channels changes", "1", usual.ratio, x, _gain_of_all),
    )
    return {place.what: place for place in places}


_WITHOUT_GEOMETRY = ("reads", "late", "gain")


def channel_place(name: str, kind: str, groups: _Groups, labels: Sequence[str]) -> Place:
    """Return the place of an error of channels, with a component for each group of channels that share it.

    Parameters
    ----------
    name : str
        ``channel``, ``chip`` or ``clock``.
    kind : str
        ``offset``, ``gain`` or ``delay``.
    groups : tuple of tuple of int
        Channels of each component.
    labels : sequence of str
        Name of each component.
    """
    words, unit, usual, operators = _CHANNEL_KINDS[kind]
    few = ", ".join(labels) if len(labels) < 4 else f"{len(labels)} {'chips' if name == 'clock' else 'channels'}"
    return Place(name, kind, words.format(few), unit, usual, tuple(labels), partial(operators, groups))


def _across(vectors: _Floats) -> _Floats:
    """Return the axis of the table × vectors (c, 3)."""
    return np.cross(np.array([0.0, 0.0, 1.0]), vectors)


def _turned_back(state: RigState, vector: _Floats) -> _Floats:
    """Return a vector of the room (3,) in the turning frame, shape (n, 3)."""
    cos, sin = np.cos(state.spin.angle), np.sin(state.spin.angle)
    x, y, z = vector
    return np.stack([cos * x + sin * y, cos * y - sin * x, np.full_like(cos, z)], axis=-1)


def _along(axes: _Floats, vectors: _Floats) -> _Floats:
    return np.einsum("ck,ck->c", axes, vectors)


def _observed(channels: _Floats, reference: _Floats | float = 0.0) -> _Floats:
    """Return what changes channels (n, c) and the reference (n,) as one, shape (n, c + 1)."""
    return np.column_stack([channels, np.broadcast_to(reference, len(channels))])


def _of_moved(state: RigState, moved: _Floats) -> tuple[_Floats, _Floats, _Floats]:
    """Return A, B and C (n, c) of chips that move by φ times vectors (c, 3)."""
    axes, rate = state.on_table.axes, state.spin.rate
    across = _across(moved)
    beside, inward = _along(axes, across), _along(axes, _across(across))
    of_value = np.outer(state.spin.acceleration, beside) + np.outer(rate**2, inward)
    return of_value, np.outer(2.0 * rate, beside), np.tile(_along(axes, moved), (len(rate), 1))


def _operator(of_value: _Floats, of_rate: _Floats, of_acceleration: _Floats) -> Operator:
    return Operator(_observed(of_value), _observed(of_rate), _observed(of_acceleration))


def _reads(state: RigState) -> list[Operator]:
    return [Operator(_observed(np.zeros_like(state.readings), 1.0))]


def _is_late(is_angle: bool, state: RigState) -> list[Operator]:
    none, spin = np.zeros_like(state.readings), state.spin
    read, lost = (spin.angle, spin.rate) if is_angle else (spin.rate, spin.acceleration)
    return [Operator(_observed(none, -lost), signal=_observed(none, read), later=-1.0)]


def _turns(is_angle: bool, state: RigState) -> list[Operator]:
    axes, across = state.on_table.axes, _across(state.on_table.places)
    by_rate = np.outer(2.0 * state.spin.rate, _along(axes, _across(across)))
    by_acceleration = np.tile(_along(axes, across), (len(state.t), 1))
    of_angle = _observed(np.zeros_like(by_rate), float(is_angle))
    return [Operator(of_angle, _observed(by_rate, float(not is_angle)), _observed(by_acceleration))]


def _twists(is_angle: bool, state: RigState) -> list[Operator]:
    read = _observed(np.zeros_like(state.readings), -1.0)
    return [Operator(read) if is_angle else Operator(None, read)]


def _moves(state: RigState) -> list[Operator]:
    chips = np.ones((len(state.on_table.axes), 1))
    return [_operator(*_of_moved(state, chips * unit)) for unit in np.eye(3)]


def _leans(state: RigState) -> list[Operator]:
    axes, places, spin = state.on_table.axes, state.on_table.places, state.spin
    across = _across(places)
    inward = _across(across)
    gravity = _turned_back(state, state.on_table.gravity)
    operators = []
    for unit in np.eye(3)[:2]:
        of_value, of_rate, of_acceleration = _of_moved(state, np.cross(unit, places))
        turned = np.cross(unit, axes)
        of_value = of_value + gravity @ turned.T + np.outer(spin.acceleration, _along(turned, across))
        of_value += np.outer(spin.rate**2, _along(turned, inward))
        operators.append(_operator(of_value, of_rate, of_acceleration))
    return operators


def _stretches(state: RigState) -> list[Operator]:
    return [_operator(*_of_moved(state, state.on_table.places * [1.0, 1.0, 0.0]))]


def _shakes(state: RigState) -> list[Operator]:
    return [Operator(_observed(_turned_back(state, unit) @ state.on_table.axes.T)) for unit in np.eye(3)]


def _heaves(state: RigState) -> list[Operator]:
    return _shakes(state)[2:]


def _vibrates(state: RigState) -> list[Operator]:
    return [Operator(_observed(np.tile(state.on_table.axes @ unit, (len(state.t), 1)))) for unit in np.eye(3)]


def _tilts(state: RigState) -> list[Operator]:
    axes, places = state.on_table.axes, state.on_table.places
    gravity, across = _turned_back(state, state.on_table.gravity), _across(places)
    operators = []
    for unit in np.eye(3)[:2]:
        turned = _turned_back(state, unit)
        of_value = -np.cross(turned, gravity) @ axes.T
        of_rate = 2.0 * state.spin.rate[:, None] * (turned @ np.cross(across, axes).T)  # a·(e × v) = e·(v × a)
        operators.append(_operator(of_value, of_rate, turned @ np.cross(places, axes).T))
    return operators


def _gain_of_all(state: RigState) -> list[Operator]:
    return [Operator(_observed(state.readings))]


def _gyro(state: RigState) -> list[Operator]:
    """Return what a body lacks that turns by φ e less than its gyro: e × r by φ̇, e × (ω × r) + ω × (e × r) by φ."""
    axes, places, rate = state.on_body.axes, state.on_body.places, state.free_body.rate
    operators = []
    for unit in np.eye(3):
        turned = (rate @ places.T) * (axes @ unit) + (rate @ axes.T) * (places @ unit)
        turned -= 2.0 * np.outer(rate @ unit, _along(axes, places))
        swung = np.tile(_along(axes, np.cross(unit, places)), (len(rate), 1))
        operators.append(Operator(_observed(-turned), _observed(-swung)))
    return operators


def _rigid(state: RigState) -> _Floats:
    """Return what the chips of a free body read by its turning, (n, c): a·(α × r + ω × (ω × r))."""
    axes, places, body = state.on_body.axes, state.on_body.places, state.free_body
    inward = (body.rate @ axes.T) * (body.rate @ places.T)
    inward -= np.outer(state.spin.rate**2, _along(axes, places))
    return np.asarray(body.acceleration @ np.cross(places, axes).T + inward)


def _gyro_is_late(state: RigState) -> list[Operator]:
    rigid = _rigid(state)
    return [Operator(_observed(np.gradient(rigid, state.period, axis=0)), signal=_observed(rigid))]


def _arms(state: RigState) -> list[Operator]:
    axes, places = state.on_body.axes, state.on_body.places
    by_rate = 2.0 * (state.free_body.rate @ np.cross(places, axes).T)
    by_acceleration = np.tile(_along(axes, places), (len(by_rate), 1))
    return [_operator(_rigid(state), by_rate, by_acceleration)]


def _on_groups(values: _Floats, groups: _Groups) -> list[_Floats]:
    """Return values (n, c) of each group of channels and zeros elsewhere, (n, c + 1)."""
    found = []
    for group in groups:
        own = np.zeros((len(values), values.shape[1] + 1))
        own[:, list(group)] = values[:, list(group)]
        found.append(own)
    return found


def _offset(groups: _Groups, state: RigState) -> list[Operator]:
    return [Operator(own) for own in _on_groups(np.ones_like(state.readings), groups)]


def _gain(groups: _Groups, state: RigState) -> list[Operator]:
    return [Operator(own) for own in _on_groups(state.readings, groups)]


def _delay(groups: _Groups, state: RigState) -> list[Operator]:
    changing = _on_groups(np.gradient(state.readings, state.period, axis=0), groups)
    read = _on_groups(state.readings, groups)
    return [Operator(own, signal=signal) for own, signal in zip(changing, read, strict=True)]


_CHANNEL_KINDS: dict[str, tuple[str, str, float, Callable[[_Groups, RigState], Sequence[Operator]]]] = {
    "offset": ("the offset of {} changes", "m/s²", USUAL.shakes_m_s2, _offset),
    "gain": ("the gain of {} changes", "1", USUAL.ratio, _gain),
    "delay": ("the sampling of {} is late", "s", USUAL.late_s, _delay),
}
"""Errors of channels: words, unit, usual size, operators."""
