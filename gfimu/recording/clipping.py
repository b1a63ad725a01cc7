"""Readings at a rail: the truth is beyond them, so that an estimate goes on without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.base.units import GYRO_COLUMNS
from gfimu.recording.checks import Finding, noisy_channels
from gfimu.recording.importing.oddities import rails_of
from gfimu.recording.recording import Recording

__all__ = ["without_clipped"]


def without_clipped(recording: Recording, array: AccelerometerArray) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with readings at a rail of a channel or a gyro axis as missing, and what was found.

    A rail is a pile of readings within a few counts of a channel's extreme, all but a few of them at one count.
    """
    readings, found = recording.for_array(array), []
    cleaned = readings
    noisy = noisy_channels(recording, array)  # a computed channel without noise may hold a level exactly
    for index, name in enumerate(array.channels):
        if not noisy[index]:
            continue
        for rail in rails_of(readings[:, index]):
            if cleaned is readings:
                cleaned = readings.copy()
            cleaned[rail.on, index] = np.nan
            text = (
                f"channel {name} reads its rail ({rail.level:.4g} m/s²) in {int(rail.on.sum())} samples, "
                "which are left out; set a wider range"
            )
            found.append(Finding("clipped", text, False, (name,)))
    reference = dict(recording.reference)
    for name in GYRO_COLUMNS:
        if name not in reference:
            continue
        values = np.array(reference[name])
        for rail in rails_of(values):
            values[rail.on] = np.nan
            samples = int(rail.on.sum())
            text = f"{name} reads its rail ({rail.level:.4g} rad/s) in {samples} samples, which are left out"
            found.append(Finding("clipped", text, False))
        reference[name] = values
    if not found:
        return recording, ()
    return replace(recording, readings=cleaned, channels=array.channels, reference=reference), tuple(found)
