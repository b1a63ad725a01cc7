"""What a verdict adds on the samples: jitter of time stamps, impossible values, the clock of the reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.verdict.parts import NamedCause, ReferenceClock
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.model.world_model import WorldModel

__all__ = ["with_reference_clock", "with_sample_notes"]


def with_sample_notes(diagnosis: Diagnosis, runs: Sequence[Run]) -> Diagnosis:
    """Return a diagnosis that reports the jitter of the time stamps and the values left out, where there are any."""
    jitter = max(run.jitter for run in runs)
    impossible = sum(run.impossible for run in runs)
    sentences, noise = list(diagnosis.sentences), diagnosis.noise
    if jitter > 0.0:
        noise = replace(noise, time_jitter_s=jitter)
        sentences.append(
            f"The time stamps scatter by {1e3 * jitter:.2g} ms rms about a uniform grid; the samples are taken as "
            "uniform."
        )
    if impossible:
        noise = replace(noise, impossible_values=float(impossible))
        values = "value is" if impossible == 1 else "values are"
        sentences.append(f"{impossible} {values} left out as corrupt: no sensor of this part reads that much.")
    return replace(diagnosis, sentences=tuple(sentences), noise=noise)


def with_reference_clock(
    diagnosis: Diagnosis,
    clock: ReferenceClock,
    corrected: Sequence[str],
    given: WorldModel,
    policy: Policy = Policy(),
) -> Diagnosis:
    """Return a diagnosis that reports the clock of a reference that was aligned before.

    A delay or a rate error that is within what the alignment is uncertain by is no cause: the next recording of the
    same rig would have another one.

    Parameters
    ----------
    diagnosis : Diagnosis
        Of the aligned recording.
    clock : ReferenceClock
        `Diagnosis.reference_clock`.
    corrected : sequence of str
        What the alignment took off the recording and therefore is no part of the extended twin: ``tacho_latency``,
        ``clock_error``. Each becomes a cause.
    given : WorldModel
        The twin before it was extended.
    policy : Policy
        Thresholds ``most_certain`` and ``noise_stds``.
    """
    sizes = {
        "tacho_latency": ("delay_s", -clock.offset_s, clock.offset_std_s),
        "clock_error": ("ratio", clock.rate_error, clock.rate_error_std),
    }
    why = "shown by the correlation of ω² and α with the channels; taken off before the rest was diagnosed"
    causes = [
        NamedCause(name, {key: value}, {key: std}, policy.most_certain, why=why)
        for name, (key, value, std) in sizes.items()
        if name in corrected
    ]
    offset, rate = clock.offset_s, clock.rate_error
    text = (
        f"By the alignment of the two the channels' clock was {abs(offset):.4g} ± {clock.offset_std_s:.2g} s "
        f"{'ahead of' if offset >= 0.0 else 'behind'} the reference's at the first sample and is {1e2 * abs(rate):.3g} "
        f"± {1e2 * clock.rate_error_std:.2g} % {'fast' if rate >= 0.0 else 'slow'} against it."
    )
    if corrected:
        text += " The extended twin does not hold this: it is of the aligned recording."
    own = [cause for cause in diagnosis.causes if not _is_of_alignment(cause, clock, policy.noise_stds)]
    if diagnosis.causes and not own and diagnosis.verdict in ("explained", "ambiguous"):
        names = " or ".join(one.effect for one in diagnosis.causes)
        said = f"Beside that nothing is wrong: {names} would be within what the alignment is uncertain by."
        diagnosis = replace(diagnosis, verdict="nothing_found", causes=(), sentences=(said,), twin=given)
    causes += [_as_sure(one, clock) for one in diagnosis.causes]
    verdict = "explained" if causes and diagnosis.verdict == "nothing_found" else diagnosis.verdict
    return replace(
        diagnosis,
        verdict=verdict,
        causes=tuple(causes),
        sentences=(text, *diagnosis.sentences) if corrected else (*diagnosis.sentences, text),
        reference_clock=clock,
    )


def _is_of_alignment(cause: NamedCause, clock: ReferenceClock, stds: float) -> bool:
    """Return whether a cause is one delay, or one rate error, within some standard deviations of the alignment."""
    if len(cause.parameters) != 1:
        return False
    [(key, value)] = cause.parameters.items()
    most = {
        "delay_s": clock.offset_std_s,
        "time_constant_s": clock.offset_std_s,
        "ratio": clock.rate_error_std,
    }.get(key)
    if most is None or (key == "ratio" and cause.effect != "clock_error"):
        return False
    return abs(float(value)) <= stds * most


def _as_sure(cause: NamedCause, clock: ReferenceClock) -> NamedCause:
    """Return a cause; a clock error no surer than the alignment, as the offset that it was found at is not exact."""
    if cause.effect != "clock_error":
        return cause
    return replace(cause, std={key: float(np.hypot(std, clock.rate_error_std)) for key, std in cause.std.items()})
