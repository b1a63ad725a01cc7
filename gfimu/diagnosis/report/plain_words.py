"""Plain words: a diagnosis as people read it, the same on the terminal and in the report."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.verdict.parts import NamedCause, NoiseLevels
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.diagnosis.verdict.wording import SAME_SHARE
from gfimu.model.parameter_units import NAME, NUMBER, RATIO, key_name

__all__ = [
    "ParameterText",
    "gain_rows",
    "headline",
    "next_steps",
    "noise_texts",
    "odds",
    "parameter_texts",
    "parameter_units",
    "percent",
    "story",
    "summary",
    "three_digits",
    "unexplained",
]

_OF_A_CALIBRATION = frozenset({"bias", "scale_factor", "misalignment", "cross_axis"})
_THOUSANDTHS = ("rad", "m", "s")
_SMALL = 0.1
_MOST_DECIMALS = 5
_MOST_DIGITS = 100


@dataclass(frozen=True)
class ParameterText:
    """One parameter as people read it.

    Parameters
    ----------
    name : str
        Key without its unit: ``"x"``, ``"a11"``, ``"frequency"``.
    value : str
        Value ± standard deviation with unit.
    familiar : str
        The same in the unit people think in (degrees, millimetres, mg), or empty.
    significant : bool
        Whether it differs from zero by more than twice its standard deviation.
    """

    name: str
    value: str
    familiar: str
    significant: bool


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict in one sentence."""
    found = [_short(diagnosis, cause) for cause in diagnosis.causes if cause.unlisted is None]
    nameless = [cause.unlisted.text for cause in diagnosis.causes if cause.unlisted is not None]
    match diagnosis.verdict:
        case "nothing_found" if diagnosis.calibration_residue:
            return "No single thing is wrong: the simulation's numbers are all a little off, as after a calibration."
        case "nothing_found":
            return "Nothing is wrong with the simulation that this recording could show."
        case "unknown":
            return _of_unknown(diagnosis, found, nameless)
        case "ambiguous":
            contested = [cause for cause in diagnosis.causes if cause.not_distinguishable_from] or diagnosis.causes
            names = dict.fromkeys(name for one in contested for name in (one.effect, *one.not_distinguishable_from))
            candidates = _joined([_words(diagnosis, name) for name in names], "or")
            text = f"Something is missing in the simulation, but this recording does not show which: {candidates}."
            certain = [_short(diagnosis, cause) for cause in diagnosis.causes if cause not in contested]
            return f"Found: {_joined(certain)}. {text.replace('Something', 'Something else', 1)}" if certain else text
        case _ if diagnosis.in_part:
            share = diagnosis.gain.share_of_excess_removed
            gone = f" ({percent(share)} of the error is gone)" if math.isfinite(share) else ""
            every = [*found, *(f"without a name, {text}" for text in nameless)]
            return f"Found in part what the simulation leaves out: {_joined(every)}{gone}."
        case _ if len(found) == 1:
            return f"Found what the simulation leaves out: {found[0]}."
        case _:
            return f"Found {_count(len(found))} things that the simulation leaves out: {_joined(found)}."


def _of_unknown(diagnosis: Diagnosis, found: list[str], nameless: list[str]) -> str:
    """Return the headline of an unknown verdict, given the causes that were found beside it in words."""
    if diagnosis.interrupted:
        return diagnosis.sentences[0]
    if diagnosis.unexplained.mistake:
        return f"The files do not fit these data: {diagnosis.unexplained.mistake}."
    if nameless:
        text = f"is wrong that has no name in the library: {nameless[0]}."
        return f"Found: {_joined(found)}. Something else {text}" if found else f"Something {text}"
    if found:
        return f"Found: {_joined(found)}. Something else is real too, and nothing in the library explains it."
    return "Something real is missing in the simulation, and nothing in the library explains it."


def summary(diagnosis: Diagnosis, cause: NamedCause) -> str:
    """Return what is wrong according to a cause, in the effect's own words, and where."""
    family = diagnosis.twin.families().get(cause.effect)
    words = str(family.summary) if family is not None else cause.effect.replace("_", " ")
    return f"{words} ({cause.place})" if cause.place else words


def _short(diagnosis: Diagnosis, cause: NamedCause) -> str:
    """Return the summary up to its explanation, and the place."""
    words = _words(diagnosis, cause.effect)
    return f"{words} ({cause.place})" if cause.place else words


def _words(diagnosis: Diagnosis, effect: str) -> str:
    family = diagnosis.twin.families().get(effect)
    return str(family.summary).split(":", maxsplit=1)[0] if family is not None else effect.replace("_", " ")


def story(diagnosis: Diagnosis) -> str:
    """Return what was compared and how much the verdict improves it, for a reader who knows nothing of it."""
    residual = diagnosis.residual
    count = len(diagnosis.twin.array.channels)
    before, after, floor = residual.rms_before, residual.rms_after, residual.noise_floor
    text = (
        f"A simulation of the rig predicted what its {count} accelerometer channels should have read. "
        f"It misses the measurement by {three_digits(before)} m/s² rms; the sensors' own noise is "
        f"{three_digits(floor)} m/s². "
    )
    silent = sorted({channel for run in diagnosis.runs for channel in _silent(diagnosis, run)})
    if silent:
        text += f"Left out for want of a usable sample: {_joined(silent)}. "
    if diagnosis.verdict == "nothing_found" and diagnosis.calibration_residue:
        return text + (
            f"With small corrections of every bias, gain, axis and position it misses by {three_digits(after)} m/s²; "
            "no single cause predicts the data better."
        )
    if diagnosis.verdict == "nothing_found":
        return text + "No cause in the library, and no pattern of any other kind, predicts the data better than chance."
    parts = [_put_in(diagnosis), _on_unseen_data(diagnosis), _in_library(diagnosis)]
    rest = unexplained(diagnosis)
    if rest and not diagnosis.interrupted:
        size = "" if diagnosis.verdict == "unknown" else f" ({diagnosis.residual.left_in_words})"
        parts.append(f"Left unexplained{size}: {rest}. ")
    level = diagnosis.noise.bias_instability_largest_m_s2 or 0.0
    if level > 0.0:
        name = diagnosis.noise.bias_instability_largest_channel
        parts.append(f"The largest bias instability is that of {name}, {level / STANDARD_GRAVITY * 1e3:.2g} mg. ")
    return (text + "".join(parts)).strip()


def unexplained(diagnosis: Diagnosis) -> str:
    """Return what neither a name nor a described function explains; empty where nothing significant is left."""
    described = {cause.why for cause in diagnosis.causes if cause.unlisted is not None}
    found = diagnosis.unexplained
    return "; ".join(part for part in found.signature.split("; ") if part not in described) if found.significant else ""


def _put_in(diagnosis: Diagnosis) -> str:
    """Return what the causes, or a description without a name, make of the prediction error."""
    text, after = "", diagnosis.residual.rms_after
    if diagnosis.causes:
        what = "this" if len(diagnosis.causes) == 1 else "these"
        what = "either of these" if diagnosis.verdict == "ambiguous" else what
        text += f"With {what} put into the simulation it misses by {three_digits(after)} m/s²"
        text += ", which is noise. " if after < 1.05 * diagnosis.residual.noise_floor else ". "
    return text


def _on_unseen_data(diagnosis: Diagnosis) -> str:
    """Return what of the error is gone on held-out data, where that could be measured."""
    gain = diagnosis.gain
    if not math.isfinite(gain.share_of_excess_removed):
        return ""
    text = (
        f"On validation data ({gain.held_out}), {percent(gain.share_of_excess_removed)} of the error "
        "beyond noise is gone. "
    )
    anywhere = gain.share_in_any_recording
    if math.isfinite(anywhere) and abs(anywhere - gain.share_of_excess_removed) > SAME_SHARE:
        text += f"In any other recording it would be {percent(max(anywhere, 0.0))}. "
    return text


def _in_library(diagnosis: Diagnosis) -> str:
    """Return how likely it is that what is named is true and confounded with nothing that the library lacks."""
    share = diagnosis.library_probability
    if not math.isfinite(share):
        return ""
    return (
        "An effect that is not in the library could look like this; that none does has a probability of "
        f"{percent(share)}. "
    )


def _silent(diagnosis: Diagnosis, run: RunView) -> list[str]:
    """Return the channels of a run without a single usable sample."""
    alive = np.asarray(run.valid.any(axis=0))
    return [name for name, good in zip(diagnosis.twin.array.channels, alive, strict=True) if not good]


def parameter_units(diagnosis: Diagnosis, cause: NamedCause) -> Mapping[str, str]:
    """Return the units that the effect of a cause declares for its parameters, by key."""
    family = diagnosis.twin.families().get(cause.effect)
    return {} if family is None else family.parameter_units(diagnosis.twin.array)


def parameter_texts(cause: NamedCause, units: Mapping[str, str]) -> list[ParameterText]:
    """Return the parameters of a cause as people read them; those that are zero and unknown are left out.

    ``units`` are those that the effect declares (`parameter_units`); a parameter without one is a plain number.
    """
    texts = []
    for key, value in cause.parameters.items():
        unit = units.get(key, "")
        name = key_name(key, unit).replace("_", " ")
        if isinstance(value, bool) or not isinstance(value, int | float):
            plain = ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
            texts.append(ParameterText(name, plain, "", significant=True))
            continue
        std = cause.std.get(key)
        if value == 0 and not std:
            continue
        certain = std is None or not math.isfinite(std) or abs(value) > Policy.stds * std
        texts.append(ParameterText(name, _with_std(value, std, unit), _familiar(value, std, unit), certain))
    return texts


def noise_texts(noise: NoiseLevels, *, linear: bool = False) -> list[str]:
    """Return the noise levels of a diagnosis as people read them: name, value and unit.

    ``linear``: the reference is that of a carriage. A level of zero was not found and is left out.
    """
    texts = []
    for name, key in noise.keys().items():
        value = getattr(noise, name)
        if value:
            words = f"{key.meaning[0].lower()}{key.meaning[1:-1]}"
            unit = key.unit.replace("rad/s", "m/s") if linear else key.unit
            texts.append(f"{words}: {value}" if isinstance(value, str) else f"{words} {_number(value, unit).strip()}")
    return texts


def gain_rows(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """Return what the extension is worth on held-out data: what, before, after."""
    gain = diagnosis.gain
    rows = [
        ("prediction error, rms", _number(gain.rms_before, "m/s²"), _number(gain.rms_after, "m/s²")),
        ("rate error, rms", _number(gain.rate_rmse_before, "rad/s"), _number(gain.rate_rmse_after, "rad/s")),
        ("position drift", _number(gain.drift_before, "m"), _number(gain.drift_after, "m")),
    ]
    return [row for row in rows if row[1] != row[2]]  # also where neither could be measured


def next_steps(diagnosis: Diagnosis) -> list[str]:
    """Return what to do next, most useful first."""
    steps = [*_calibrate_first(diagnosis), *_by_verdict(diagnosis)]
    if diagnosis.verdict == "explained":
        steps += [_to_be_sure(cause) for cause in diagnosis.causes if cause.not_distinguishable_from]
    if not diagnosis.gain.held_out and diagnosis.verdict != "nothing_found":
        steps.append("Record a second run: with --held-out its gain is measured on validation data.")
    return [step.strip() for step in steps]


def _calibrate_first(diagnosis: Diagnosis) -> list[str]:
    """Return the step for a unit that was never calibrated: much of it is a little wrong everywhere."""
    every = [cause.effect for cause in diagnosis.causes if cause.effect in _OF_A_CALIBRATION and "all" in cause.place]
    if not every:
        return []
    step = (
        f"If the unit is not calibrated, do that first: {_joined(every)} on all channels is what such a unit looks "
        "like, and one run can't separate many wrong numbers. Record static poses; then "
        "gfimu calibrate twelve-position POSES --array ARRAY --out cal.json and "
        "gfimu diagnose RUN --calibration cal.json."
    )
    return [step]


def _by_verdict(diagnosis: Diagnosis) -> list[str]:
    """Return the steps that each verdict asks for."""
    remedies = dict.fromkeys(one.would_be_separated_by for one in diagnosis.causes if one.would_be_separated_by)
    match diagnosis.verdict:
        case "nothing_found" if diagnosis.calibration_residue:
            return ["Keep twin.toml, which has the corrections, or calibrate the unit again."]
        case "nothing_found":
            step = (
                "Keep the simulation as it is. A longer run, with faster ramps in both directions, would show "
                "smaller errors."
            )
            return [step]
        case "ambiguous":
            apart = [f"To separate the candidates, record: {remedy}." for remedy in remedies]
            return [*apart, "Give both recordings to one call of gfimu diagnose; it fits them together."]
        case "unknown" if diagnosis.interrupted:
            return ["Run it again with more time (--time-limit), or on a part of the recording."]
        case "unknown":
            located = "; ".join(one.unlisted.text for one in diagnosis.causes if one.unlisted is not None)
            place = f"Look where it was located: {located}." if located else ""
            steps = [place or "Look at the residual views of the report for where the discrepancy sits."]
            if diagnosis.unexplained.mistake:
                steps = [f"Check the files: {diagnosis.unexplained.mistake}."]
            apart = [f"To decide between what fits as well, record: {remedy}." for remedy in remedies]
            other = "Record another run with another motion: what stays is in the rig or the sensors."
            return [*steps, *(apart or [other])]
        case _:
            more = "no more than what is left unexplained" if diagnosis.unexplained.significant else "nothing"
            return [
                f"Confirm on another recording: gfimu diagnose OTHER --twin twin.toml should find {more}.",
                "Correct the rig or calibrate it, or keep twin.toml as the simulation from now on.",
            ]


def _to_be_sure(cause: NamedCause) -> str:
    """Return the step that rules out a coincidence of other effects."""
    others = _joined(list(cause.not_distinguishable_from), "or")
    remedy = f" To be sure, record: {cause.would_be_separated_by}." if cause.would_be_separated_by else ""
    why = f"by a coincidence of values it is confounded with {others} here"
    return f"{cause.effect} is the simplest explanation; {why}.{remedy}"


def percent(share: float) -> str:
    """Return a share in percent, never rounded up to certainty."""
    if not math.isfinite(share):
        return "–"
    if 0.999 < share < 1.0:
        return "> 99.9 %"
    return f"{100 * share:.3g} %"


def three_digits(value: float) -> str:
    """Return a number with three significant digits, zeros at its end too: ``"0.0340"``; a dash if it is none."""
    if not math.isfinite(value):
        return "–"
    return f"{value:#.3g}".removesuffix(".").replace("-", "−") if value else "0"


def odds(log_odds: float) -> str:
    """Return log odds against the verdict as people say them: ``"1 : 20"``, ``"1 : 10⁵²"``."""
    if not math.isfinite(log_odds):
        return "–"
    if abs(log_odds) < math.log(1e4):
        ratio = f"{math.exp(abs(log_odds)):.2g}"
        ratio = f"{float(ratio):.0f}" if float(ratio) >= 10 else ratio
    elif abs(log_odds) < math.log(10.0) * _MOST_DIGITS:
        ratio = f"10{_superscript(round(abs(log_odds) / math.log(10)))}"
    else:
        return f"{'<' if log_odds < 0 else '>'} 1 : 10{_superscript(-_MOST_DIGITS if log_odds > 0 else _MOST_DIGITS)}"
    return f"1 : {ratio}" if log_odds <= 0 else f"{ratio} : 1"


def _with_std(value: float, std: float | None, unit: str) -> str:
    """Return value ± standard deviation, in thousandths of its unit where it is small."""
    unit = "" if unit in {RATIO, NUMBER, NAME} else unit
    scale = max(abs(value), std or 0.0)
    if unit in _THOUSANDTHS and scale < _SMALL:
        value, std, unit = 1e3 * value, None if std is None else 1e3 * std, f"m{unit}"
    if std is None or not math.isfinite(std) or std <= 0:
        text = f"{value:.4g}"
    else:
        decimals = max(1 - math.floor(math.log10(std)), 0)
        if decimals > _MOST_DECIMALS and abs(value) < _SMALL:
            power = math.floor(math.log10(max(abs(value), std)))
            return f"({_with_std(value / 10**power, std / 10**power, '')})·10{_superscript(power)} {unit}".strip()
        text = f"{value:.{decimals}f} ± {std:.{decimals}f}"
    return f"{text} {unit}".strip().replace("-", "−")


def _superscript(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def _familiar(value: float, std: float | None, unit: str) -> str:
    factors = {"rad": (180 / math.pi, "°"), "m/s²": (1e3 / STANDARD_GRAVITY, "mg"), "rad/s": (30 / math.pi, "rpm")}
    if unit == RATIO and abs(value) < _SMALL:
        factors[RATIO] = (100.0, "%")
    if unit not in factors:
        return ""
    factor, name = factors[unit]
    return _with_std(factor * value, None if std is None else factor * std, name)


def _number(value: float, unit: str) -> str:
    return f"{three_digits(value)} {unit}" if math.isfinite(value) else ""


def _count(number: int) -> str:
    return {2: "two", 3: "three", 4: "four"}.get(number, str(number))


def _joined(parts: list[str], word: str = "and") -> str:
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} {word} {parts[-1]}" if len(parts) > 2 else f"{parts[0]} {word} {parts[1]}"
