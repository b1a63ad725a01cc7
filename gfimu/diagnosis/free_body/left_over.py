"""What the named causes leave on a free body: a dependence on motion or time, a tone, or noise that grows with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from gfimu.diagnosis.adequacy import LEFT_OVER_ODDS
from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.evidence import log_evidence, log_evidence_each
from gfimu.diagnosis.free_body.engine import Known
from gfimu.diagnosis.free_body.segment import BodyLine, BodySegment
from gfimu.diagnosis.free_body.signatures import plan_signatures, signature_columns
from gfimu.diagnosis.residual_tests import LeftOver
from gfimu.geometry.kinematics import omega_products

__all__ = ["motion_noise", "structure_left"]

_UNIT = 0.03
_STEPS = 8
_LOWEST_TONE = 1.0
_WINDOW = 1024
_NEIGHBOURS = 41
_DISAGREE = ("every channel: disagreement per rate of change of the reading, s", "agitation")
_LOST = ("angular acceleration missed by the gyro: rad/s² per m/s³ of change", "acceleration_slope")


def motion_noise(segments: Sequence[BodySegment]) -> LeftOver:
    """Return the noise that grows with the motion, which no effect of the library is."""
    noises = [segment.noise for segment in segments if segment.noise.log_odds > LEFT_OVER_ODDS]
    if not noises:
        return LeftOver(-np.inf, "", {})
    noise = max(noises, key=lambda one: one.log_odds)
    parts, surrogate = [], {}
    if noise.agitation:
        parts.append(
            "the channels disagree from sample to sample in proportion to how fast their readings change, as if each "
            f"were sampled at an instant of its own, {1e3 * noise.agitation:.2g} ms rms apart"
        )
        surrogate[_DISAGREE[0]] = noise.agitation
    if noise.acceleration_slope:
        fast = [s.change[s.use & ~s.body.rest] for s in segments]
        typical = noise.acceleration_slope * float(np.sqrt(np.mean(np.concatenate(fast) ** 2)))
        parts.append(
            f"the angular acceleration differs from what the gyro's samples say by {typical:.2g} rad/s² rms in motion"
        )
        surrogate[_LOST[0]] = noise.acceleration_slope
    return LeftOver(noise.log_odds, "; ".join(parts), surrogate)


def structure_left(segments: Sequence[BodySegment], causes: Sequence[Cause], fixed: Known) -> tuple[LeftOver, LeftOver]:
    """Find the strongest dependence of any channel on motion or time that is left, and the strongest tone."""
    segment, known = max(zip(segments, fixed, strict=True), key=lambda pair: pair[0].run.duration)
    array = segment.model.array
    effects = [*known, *effects_of_run(causes, array, segment.index)]
    line = segment.linearise(effects)
    found = []
    signatures = plan_signatures([segment], causes, {cause.name for cause in causes})
    named = signature_columns(segment, signatures, causes, known, line)
    nuisances = segment.nuisances(effects, line)
    functions = _functions(segment, line)
    alive = np.flatnonzero(segment.alive)
    total = len(functions) * len(alive)
    right = line.rows.ravel()
    named_taken = segment.eliminated(named, nuisances)
    right_taken = segment.eliminated(right[:, None], nuisances)[:, 0]
    inner = named.T @ named - named_taken.T @ named_taken + 1e-3 * np.eye(named.shape[1])
    own = named.T @ right - named_taken.T @ right_taken
    columns = np.empty((line.rows.size, len(alive)), order="F")
    for name, values in functions.items():
        for place, channel in enumerate(alive):
            change = np.zeros((len(values), array.n_channels))
            change[:, channel] = values * _UNIT
            columns[:, place] = segment.signature(segment.grouped(change))
        taken = segment.eliminated(columns, nuisances)
        gram = columns.T @ columns - taken.T @ taken
        score = columns.T @ right - taken.T @ right_taken
        if named.shape[1]:
            cross = named.T @ columns - named_taken.T @ taken
            gain = np.linalg.solve(inner, np.column_stack([cross, own]))
            gram, score = gram - cross.T @ gain[:, :-1], score - cross.T @ gain[:, -1]
        found.append(_strongest(name, gram, score, [array.channels[c] for c in alive], total, len(functions)))
    return max(found, key=lambda one: one.log_odds), _tone(segment, segment.motion_corrected(effects, line, nuisances))


def _strongest(
    name: str,
    gram: NDArray[np.float64],
    score: NDArray[np.float64],
    channels: Sequence[str],
    total: int,
    functions: int,
) -> LeftOver:
    diagonal = np.maximum(gram.diagonal(), 1e-9)
    each = log_evidence_each(diagonal, score, np.zeros(len(score), dtype=bool)) - np.log(total)
    top = int(np.argmax(each))
    size = score[top] / (diagonal[top] + 1e-2) * _UNIT
    one = LeftOver(float(each[top]), f"channel {channels[top]} depends on {name}", {f"{channels[top]}: {name}": size})
    every = float(log_evidence(gram + 1e-9 * np.eye(len(score)), score)) - np.log(functions)
    if every <= one.log_odds + 2.0:
        return one
    values = np.linalg.solve(gram + 1e-2 * np.eye(len(score)), score) * _UNIT
    strong = [channels[c] for c in np.argsort(-np.abs(score / np.sqrt(diagonal)))[:4]]
    text = f"several channels (strongest {', '.join(strong)}) depend on {name}"
    return LeftOver(every, text, {f"{channel}: {name}": float(v) for channel, v in zip(channels, values, strict=True)})


def _functions(segment: BodySegment, line: BodyLine) -> dict[str, NDArray[np.float64]]:
    """Return functions of the motion and time, of unit rms about their mean."""
    rate, acceleration = line.drive.rate_at()
    speed = np.linalg.norm(rate, axis=1)
    time = (segment.run.t - segment.run.t[0]) / max(segment.run.duration, 1e-9)
    found = {f"ω{axis}": rate[:, place] for place, axis in enumerate("xyz")}
    found |= dict(zip(("ωx²", "ωy²", "ωz²", "ωxωy", "ωxωz", "ωyωz"), omega_products(rate).T, strict=True))
    found |= {f"dω{axis}/dt": acceleration[:, place] for place, axis in enumerate("xyz")}
    found |= {"|ω|": speed, "|ω|⁴": speed**4, "the specific force squared": np.sum(line.drive.force**2, axis=1)}
    found |= {f"time (a step at {k / _STEPS:.0%} of the run)": np.sign(time - k / _STEPS) for k in range(1, _STEPS)}
    out = {}
    for name, values in found.items():
        size = float(np.std(values[segment.use]))
        if size > 1e-9:
            out[name] = (values - values[segment.use].mean()) / size
    return out


def _tone(segment: BodySegment, residual: NDArray[np.float64]) -> LeftOver:
    """Test every channel for a narrow line, over the whole run and, as oscillators wander, over short windows."""
    noise = segment.noise
    change = np.where(segment.body.rest, 0.0, segment.change)
    spread = np.sqrt(1.0 + (noise.agitation * change / noise.typical) ** 2)
    left = np.where(segment.use[:, None], residual / spread[:, None], 0.0)[:, segment.alive]
    channels = [name for name, alive in zip(segment.model.array.channels, segment.alive, strict=True) if alive]
    found = LeftOver(-np.inf, "", {})
    for length in {len(left), min(_WINDOW, len(left))}:
        count = len(left) // length
        pieces = left[: count * length].reshape(count, length, -1)
        power = np.abs(np.fft.rfft(pieces - pieces.mean(axis=1, keepdims=True), axis=1)) ** 2 / length
        frequency = np.fft.rfftfreq(length, segment.run.sample_period)
        high = frequency >= max(_LOWEST_TONE, 8.0 / (length * segment.run.sample_period))
        power = power[:, high]
        level = np.maximum(np.median(power, axis=1, keepdims=True) / np.log(2.0), 1e-12)
        # A line stands out of its neighbourhood; a motion that is not fully followed raises whole bands.
        around = median_filter(power, size=(1, _NEIGHBOURS, 1), mode="nearest") / np.log(2.0)
        ratio = power / np.maximum(level, around)
        odds = ratio - np.log(ratio.size)
        window, place, channel = np.unravel_index(int(np.argmax(odds)), odds.shape)
        if odds[window, place, channel] > found.log_odds:
            amplitude = 2 * np.sqrt(power[window, place, channel] / length)
            at = frequency[high][place]
            text = f"channel {channels[channel]} has a tone at {at:.2f} Hz, about {amplitude:.2g} m/s²"
            if count > 1:
                tops = frequency[high][np.argmax(ratio[:, :, channel], axis=1)]
                sure = odds[:, :, channel].max(axis=1) > LEFT_OVER_ODDS
                low, top = tops[sure].min(initial=at), tops[sure].max(initial=at)
                text += f", wandering from {low:.3g} to {top:.3g} Hz" if top - low > 4 * frequency[1] else ""
            found = LeftOver(
                float(odds[window, place, channel]), text, {f"{channels[channel]}: tone at {at:.4f} Hz": amplitude}
            )
    return found
