"""What a verdict adds on the samples themselves: time stamps that jitter and values that no sensor reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.verdict.verdict import Diagnosis

__all__ = ["with_sample_notes"]


def with_sample_notes(diagnosis: Diagnosis, runs: Sequence[Run]) -> Diagnosis:
    """Return a diagnosis that reports the jitter of the time stamps and the values left out, where there are any."""
    jitter = max(run.jitter for run in runs)
    impossible = sum(run.impossible for run in runs)
    sentences, noise = list(diagnosis.sentences), dict(diagnosis.noise)
    if jitter > 0.0:
        noise["time_jitter_s"] = jitter
        sentences.append(
            f"The time stamps scatter by {1e3 * jitter:.2g} ms rms about a uniform grid; the samples are taken as "
            "uniform."
        )
    if impossible:
        noise["impossible_values"] = float(impossible)
        values = "value is" if impossible == 1 else "values are"
        sentences.append(f"{impossible} {values} left out as corrupt: no sensor of this part reads that much.")
    return replace(diagnosis, sentences=tuple(sentences), noise=noise)
