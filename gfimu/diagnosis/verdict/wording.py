"""The verdict in words that a person who has never seen the project understands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.verdict.parts import NamedCause, Residual, Unexplained, is_in_part

__all__ = ["SAME_SHARE", "Notes", "verdict_sentences"]

SAME_SHARE = 5e-3  # numerical: half of the last digit of a share in words
_FEW = 2  # numerical: alternatives in a sentence; all are in ``verdict.json``


@dataclass(frozen=True)
class Notes:
    """What sentences hold besides the verdict.

    Parameters
    ----------
    residue : float
        Size of a calibration residue, in units of what a good calibration leaves; 0 where there is none.
    unreferenced : float
        Time without a reference, s.
    loudest : tuple of (str, float, float), optional
        Channel with the largest bias instability, its level, m/s², and that over the median of the others.
    rest : str
        What the strongest of the lack of fit looks like.
    """

    residue: float = 0.0
    unreferenced: float = 0.0
    loudest: tuple[str, float, float] | None = None
    rest: str = ""


def verdict_sentences(
    verdict: str,
    causes: Sequence[NamedCause],
    residual: Residual,
    gain: Gain,
    unexplained: Unexplained,
    withdrawn: Sequence[str],
    notes: Notes = Notes(),
) -> tuple[str, ...]:
    """Return the verdict in sentences, the most important first; ``withdrawn`` are causes that did not predict."""
    words = [_headline(verdict, causes, unexplained, notes.residue, gain)]
    words += [f"{cause.effect}: {cause.why}." for cause in causes if cause.why and cause.unlisted is None]
    for cause in causes:
        if cause.unlisted is not None:
            words += [_sentence(cause.why), *_instead(cause.unlisted.instead, cause.would_be_separated_by)]
    words += _coincidences(verdict, causes)
    if causes:
        words.append(f"The residual {_course(residual)} m/s²; the noise alone is {residual.noise_floor:.3g} m/s².")
    words += _held_out(residual, gain)
    words += _left_over(verdict, residual, unexplained, notes.rest)
    words += _noted(notes)
    words += [f"{name} was withdrawn: it did not predict held-out data." for name in withdrawn]
    return tuple(words)


def _course(residual: Residual) -> str:
    before, after = f"{residual.rms_before:.3g}", f"{residual.rms_after:.3g}"
    if before == after:
        return f"stays at {after}"
    return f"{'falls' if residual.rms_after < residual.rms_before else 'rises'} from {before} to {after}"


def _coincidences(verdict: str, causes: Sequence[NamedCause]) -> list[str]:
    """State which effects a cause is confounded with; an ambiguous verdict says it of all."""
    return [
        f"{cause.effect} is confounded with {', '.join(cause.not_distinguishable_from)} in these data, by a "
        f"coincidence of values only; {cause.would_be_separated_by} would separate them."
        for cause in causes
        if cause.not_distinguishable_from and verdict != "ambiguous"
    ]


def _instead(others: Sequence[str], remedy: str) -> list[str]:
    """Say what fits as well as something without a name, and what to record to decide."""
    if not others:
        return []
    decide = f"; to decide, record {remedy}" if remedy else ""
    return [f"These data fit as well if {' or '.join(others[:_FEW])}{decide}."]


def _held_out(residual: Residual, gain: Gain) -> list[str]:
    """Say what the causes are worth on held-out data."""
    if not gain.held_out:
        return []
    words = []
    if np.isfinite(gain.share_of_excess_removed):
        words.append(
            f"On validation data ({gain.held_out}), {100 * gain.share_of_excess_removed:.1f} % of the excess "
            f"is gone{_anywhere(gain)}."
        )
        words += _far_below(residual, gain)
    if np.isnan(gain.rms_after):
        words.append(f"On validation data ({gain.held_out}) the gain is within the noise and can't be measured.")
    return words


def _left_over(verdict: str, residual: Residual, unexplained: Unexplained, rest: str) -> list[str]:
    """Say what the causes leave; an unknown verdict says it at first."""
    if unexplained.significant:
        sentence = (
            f"A significant residual remains that nothing in the library explains, {residual.left_in_words}: "
            f"{unexplained.signature}."
        )
        return [] if verdict == "unknown" else [sentence]
    over = residual.rms_after / max(residual.noise_floor, 1e-12)
    if verdict != "explained" or residual.is_noise:
        return []
    sentence = (
        f"The remaining residual is {over:.2f} times the noise{f' ({rest})' if rest else ''}: "
        "small compared with what is explained, and included in the standard deviations."
    )
    return [sentence]


def _noted(notes: Notes) -> list[str]:
    """Say what is known of the noise, the calibration and the reference."""
    words = []
    if notes.loudest is not None and notes.loudest[1] > 0.0:
        name, level, ratio = notes.loudest
        words.append(
            f"The largest bias instability is that of channel {name}: {level / STANDARD_GRAVITY * 1e3:.2f} mg, "
            f"{ratio:.1f} times the median of the other channels."
        )
    if notes.residue > 0.0:
        words.append(_residue_sentence(notes.residue))
    if notes.unreferenced > 0.0:
        words.append(f"{notes.unreferenced:.1f} s are left out, as the reference is missing there.")
    return words


def _anywhere(gain: Gain) -> str:
    """Return the share without what belongs to the clock of one recording, where that is another one."""
    share = gain.share_in_any_recording
    if not np.isfinite(share) or abs(share - gain.share_of_excess_removed) < SAME_SHARE:
        return ""
    return f"; without terms of absolute time, as in any other recording, {100 * max(share, 0.0):.1f} %"


def _far_below(residual: Residual, gain: Gain) -> list[str]:
    """Say where far less is removed on validation data than on the fitted ones."""
    excess, left = (rms**2 - residual.noise_floor**2 for rms in (residual.rms_before, residual.rms_after))
    if excess <= 0.0:
        return []
    fitted = min(1.0 - max(left, 0.0) / excess, 1.0)
    share = gain.share_of_excess_removed
    if share + 2.0 * float(np.nan_to_num(gain.share_std)) > fitted - Policy.sizeable:
        return []
    sentence = (
        f"On the fitted data {100 * fitted:.0f} % of it is gone: so much more than on validation data that the sizes "
        "may belong to this recording alone; confirm them on another one."
    )
    return [sentence]


def _headline(verdict: str, causes: Sequence[NamedCause], unexplained: Unexplained, residue: float, gain: Gain) -> str:
    names = _listed([cause.effect for cause in causes])
    if verdict == "nothing_found" and residue > 0.0:
        return "No single thing is wrong with the simulation."
    if verdict == "nothing_found":
        return "The simulation agrees with the measurement: nothing was found beyond the sensors' own noise."
    if is_in_part(verdict, gain, unexplained):
        share = gain.share_of_excess_removed
        gone = f": {100 * share:.3g} % of the excess is gone on validation data" if np.isfinite(share) else ""
        return f"The simulation is wrong in part because of {names}{gone}."
    if verdict == "explained":
        return f"The simulation is wrong because of {names}."
    if verdict == "ambiguous":
        contested = [cause for cause in causes if cause.not_distinguishable_from]
        by = next((cause.would_be_separated_by for cause in contested if cause.would_be_separated_by), "")
        which = _listed([cause.effect for cause in contested])
        return f"The simulation is wrong, but these data do not separate {which}; {by} would."
    text = "The simulation is wrong in a way that nothing in the library explains"
    return f"{text}." if any(cause.unlisted is not None for cause in causes) else f"{text}: {unexplained.signature}."


def _residue_sentence(scale: float) -> str:
    times = "what" if scale == 1.0 else f"{scale:g} times what"
    return (
        f"The twin's calibration is a little off everywhere, by {times} a good calibration leaves of bias, gain, axes "
        "and position; no single cause stands behind that, and the extended twin has the corrections."
    )


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _listed(names: Sequence[str]) -> str:
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"
