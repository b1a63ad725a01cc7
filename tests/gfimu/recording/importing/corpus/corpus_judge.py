"""Read a file of the corpus as a user would, and compare what was read with the right reading."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass

import numpy as np
from corpus_motion import Right

import gfimu
from gfimu import InputError

GYRO = ("gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s")
RATE = 1e-3  # relative
MARK = "(check this)"


@dataclass(frozen=True)
class Verdict:
    """``right``, ``marked`` (wrong, or without a piece, and said so) or ``silent``; with what was read."""

    kind: str
    why: str


def judge(right: Right) -> Verdict:
    """Return whether a file is read right."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = gfimu.inspect(right.path)
        except InputError as error:
            said = re.search(right.refused or "$^", str(error)) is not None
            return Verdict("right" if said else "marked", f"inspect: {error}")
        checks = [line for line in found.reasons if MARK in line]
        if found.column_map is None or not found.column_map.channels:
            return _without_channels(right, found, checks)
        try:
            recording = gfimu.convert(right.path, column_map=found.column_map)
        except InputError as error:
            return Verdict("marked", f"convert: {error}")
    faults = list(_faults(right, found, recording))
    if not faults:
        return Verdict("right", "")
    about = {
        "rate": "rate|time|row|sample",
        "chip": "chip",
        "gyro": "gyro",
        "reference": "reference|tacho|angle|temperature",
        "note": "$^",
    }
    silent = [text for subject, text in faults if not any(re.search(about[subject], line) for line in checks)]
    if right.doubt and checks and not silent:
        return Verdict("right", "; ".join(text for _, text in faults))
    return Verdict(
        "silent" if silent else "marked",
        "; ".join([*silent, *(f"[marked] {text}" for _, text in faults if text not in silent)]),
    )


def _without_channels(right: Right, found, checks) -> Verdict:
    said = "; ".join(found.reasons)
    if right.refused:
        return Verdict("right" if re.search(right.refused, said) else "marked", said)
    if right.chips:
        return Verdict("marked", f"no accelerations found: {said}")
    reference = found.column_map.reference if found.column_map is not None else {}
    missing = set(right.references) - set(reference)
    wrong_rate = right.rate and not abs(found.sample_rate_hz / right.rate - 1.0) < 2 * RATE
    if missing or wrong_rate:
        return Verdict("marked", f"{sorted(missing)} missing, {found.sample_rate_hz} Hz: {said}")
    return Verdict("right", "")


def _faults(right: Right, found, recording):
    """Yield what differs from the right reading: what it is about, and words."""
    if right.refused:
        yield "chip", f"channels {dict(_named(found))} where nothing can be read"
        return
    span = recording.t_s[-1] - recording.t_s[0]
    rate = (len(recording.t_s) - 1) / span
    if right.rate is None and not any(MARK in line and "rate" in line for line in found.reasons):
        yield "rate", f"{rate:.6g} Hz, which the file does not state"
    if right.rate is not None and abs(rate / right.rate - 1.0) > RATE:
        yield "rate", f"{rate:.6g} Hz instead of {right.rate:g}"
    count = sum(chip.shape[1] for chip in right.chips)
    truth = np.column_stack(right.chips)
    if recording.readings.shape[1] != count:
        yield "chip", f"{recording.readings.shape[1]} channels instead of {count}: {dict(_named(found))}"
    elif len(recording.t_s) < 0.98 * len(truth) or len(recording.t_s) > len(truth):
        yield "rate", f"{len(recording.t_s)} rows instead of {len(truth)}"
    elif not _same(recording.readings, truth, 0.06 + 0.02):
        ratio = np.nanmedian(np.linalg.norm(recording.readings[:, :3], axis=1)) / np.median(
            np.linalg.norm(truth[:, :3], axis=1)
        )
        yield "chip", f"readings differ (length of the first chip {ratio:.4g} times): {dict(_named(found))}"
    have = set(GYRO) & set(recording.reference)
    if right.gyro is not None and not have:
        yield "gyro", "no gyro"
    elif right.gyro is None and have:
        yield "gyro", f"a gyro of {[str(found.column_map.reference[one].column) for one in GYRO]}"
    elif right.gyro is not None:
        rates = np.column_stack([recording.reference[one] for one in GYRO])
        if not _same(rates, right.gyro, 0.02):
            ratio = np.nanstd(rates) / np.std(right.gyro)
            yield (
                "gyro",
                f"rates differ ({ratio:.4g} times): {[str(found.column_map.reference[one].column) for one in GYRO]}",
            )
    for name, values in right.references.items():
        if name not in recording.reference:
            yield "reference", f"no {name}"
        elif not _same(recording.reference[name][:, None], values[:, None], 0.02):
            yield "reference", f"{name} differs"
    for name in set(recording.reference) - set(right.references) - set(GYRO):
        if not name.endswith("_t_s"):
            yield "reference", f"{name} of {found.column_map.reference[name].column}"
    if right.note and not any(right.note in line for line in found.findings):
        yield "note", f"no word of {right.note!r}"


def _named(found):
    return {key: str(spec.column) for key, spec in found.column_map.channels.items()}.items()


def _same(read: np.ndarray, truth: np.ndarray, tolerance: float) -> bool:
    if len(read) > len(truth):
        return False
    truth = truth[: len(read)]
    off = np.abs(read - truth)
    return bool(np.isfinite(off).mean() > 0.97 and np.nanquantile(off, 0.97) < tolerance)
