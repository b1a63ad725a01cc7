"""References that a recording has beside its readings, for an estimate."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gfimu.base.difference_noise import difference_noise
from gfimu.base.errors import InputError, check_name
from gfimu.rate.references import Measured, Reference, ReferencePolicy
from gfimu.rate.sensing import SensorErrors
from gfimu.recording import Recording
from gfimu.recording.quantities import ESTIMATE_REFERENCES

__all__ = ["references_of", "require_references"]


def references_of(
    recording: Recording, names: Sequence[str], axis: NDArray[np.float64], errors: SensorErrors
) -> tuple[Measured, ...]:
    """Return references of a recording with their values.

    Parameters
    ----------
    recording : Recording
        Its references stand on its rows.
    names : sequence of str
        Those wanted, of `ESTIMATE_REFERENCES`.
    axis : ndarray, shape (3,)
        Axis of the table in body axes.
    errors : SensorErrors
        Noise and bias of a gyro.

    Raises
    ------
    InputError
        If there is no such reference, or the recording lacks it.
    """
    return tuple(_measured(recording, name, axis, errors) for name in dict.fromkeys(names))


def require_references(recording: Recording, names: Sequence[str]) -> None:
    """Raise `InputError` if there is no such reference, or the recording lacks it."""
    for name in names:
        _columns(recording, name)


def _measured(recording: Recording, name: str, axis: NDArray[np.float64], errors: SensorErrors) -> Measured:
    values = _columns(recording, name)
    known: NDArray[np.bool_] = np.asarray(np.isfinite(values).all(axis=1))
    made: Mapping[str, Callable[[], Reference]] = {
        "gyro": lambda: Reference.gyro(errors),
        "tacho": lambda: Reference.tachometer(axis, _noise_of(values)),
        "angle": lambda: Reference.encoder(_noise_of(values), first_known=bool(known[0])),
        "position": lambda: Reference.position(_noise_of(values), first_known=bool(known[0])),
        "axis": lambda: Reference.fixed_axis(axis),
    }
    if name in ("angle", "position"):
        values = values - values[int(np.argmax(known))]
    return made[name]().measured(values, len(recording))


def _columns(recording: Recording, name: str) -> NDArray[np.float64]:
    """Return the values (n, k) of a reference."""
    check_name("reference", name, ESTIMATE_REFERENCES)
    columns = ESTIMATE_REFERENCES[name]
    missing = [column for column in columns if column not in recording.reference]
    if missing:
        raise InputError(f"the recording has no {', '.join(missing)}; record them, or estimate without {name}")
    if not columns:
        return np.zeros((len(recording), 2))
    values = np.column_stack([recording.reference[column] for column in columns])
    if not np.isfinite(values).any():
        raise InputError(f"the recording's {', '.join(columns)} have no value; estimate without {name}")
    return _unwrapped(values) if name == "angle" else values


def _unwrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return an encoder's angle (n, 1) as one that goes on where it jumps by a turn."""
    known = np.isfinite(angle[:, 0])
    if np.ptp(angle[known]) > 2.0 * np.pi * (1.0 + 1e-6):
        return angle
    whole = angle.copy()
    whole[known, 0] = np.unwrap(angle[known, 0])
    return whole


def _noise_of(values: NDArray[np.float64], policy: ReferencePolicy = ReferencePolicy()) -> float:
    """Return the white noise of values (n, k), no less than their steps show."""
    changes = np.abs(np.diff(values, axis=0))
    steps = changes[changes > 0.0]
    step = float(steps.min()) if steps.size else 0.0
    white = [difference_noise(column[np.isfinite(column)]) for column in values.T]
    return max(*white, step / np.sqrt(12.0), policy.least_noise)
