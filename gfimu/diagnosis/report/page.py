"""The report: one self-contained HTML page whose first screen a person understands who has never seen the project."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, select_autoescape

from gfimu import __version__
from gfimu.diagnosis.criticism.views.residuals import ResidualViews, residual_views
from gfimu.diagnosis.criticism.views.rigid_motion import RigidMotion
from gfimu.diagnosis.report import figures
from gfimu.diagnosis.report.plain_words import (
    gain_rows,
    headline,
    next_steps,
    noise_texts,
    odds,
    parameter_texts,
    parameter_units,
    percent,
    story,
    summary,
)
from gfimu.diagnosis.report.rig import DrawnRig
from gfimu.diagnosis.verdict.verdict import Diagnosis, NamedCause
from gfimu.diagnosis.verdict.wording import SAME_SHARE
from gfimu.files.atomic_file import write_text
from gfimu.visual.colours import INK, TONES, chip_colour, css
from gfimu.visual.rig import package_of
from gfimu.visual.rig.words import package_words, scene_title

__all__ = ["report_html", "write_report"]

_VERDICTS = {
    "nothing_found": ("Nothing found", "calm"),
    "explained": ("Explained", "found"),
    "ambiguous": ("Ambiguous", "open"),
    "unknown": ("Unknown cause", "alarm"),
}
_VIEWS = (
    ("time", "over time"),
    ("rate", "over the rate"),
    ("rate squared", "over the rate squared"),
    ("acceleration", "over the angular acceleration"),
    ("angle", "over the table's angle"),
    ("temperature", "over the board's temperature"),
    ("reading", "over the reading itself"),
)
_MOST_PARAMETERS = 14


def write_report(path: str | Path, diagnosis: Diagnosis, rig: DrawnRig | None = None) -> None:
    """Write ``report.html``, whole or not at all; arguments as `report_html`."""
    write_text(path, report_html(diagnosis, rig))


def report_html(diagnosis: Diagnosis, rig: DrawnRig | None = None) -> str:
    """Return the report as one HTML page without references to anything outside it.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis.
    rig : DrawnRig, optional
        How the array stood on its table; upright at the usual height by default.
    """
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=select_autoescape(default=True, default_for_string=True),
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["odds"] = odds
    return environment.get_template("report.html.j2").render(_content(diagnosis, rig or DrawnRig()))


def _content(diagnosis: Diagnosis, rig: DrawnRig) -> Mapping[str, Any]:
    channels = diagnosis.twin.array.channels
    bias_instability = float(diagnosis.noise.get("bias_instability_m_s2", 0.0))
    seen = [run for run in diagnosis.runs if run.valid.any()]
    views = [residual_views(run, channels, bias_instability=bias_instability) for run in seen]
    label, tone = _VERDICTS[diagnosis.verdict]
    label += " in part" if diagnosis.in_part else ""
    return {
        "version": __version__,
        "label": label,
        "tone": tone,
        "colours": {name: css(colour) for name, colour in TONES.items()} | {"ink": css(INK)},
        "array": _array(diagnosis, rig),
        "headline": headline(diagnosis),
        "story": story(diagnosis),
        "sentences": diagnosis.sentences[1:],
        "figures_of_merit": _figures_of_merit(diagnosis),
        "causes": [_cause(diagnosis, cause) for cause in diagnosis.causes],
        "surrogate": _surrogate(diagnosis) if diagnosis.unexplained.significant else {},
        "extended": diagnosis.unexplained.extends_twin,
        "unexplained": diagnosis.unexplained,
        "rivals": diagnosis.rivals,
        "gain": diagnosis.gain,
        "gain_rows": gain_rows(diagnosis),
        "share": percent(diagnosis.gain.share_of_excess_removed),
        "any_share": _share_in_any_recording(diagnosis),
        "steps": next_steps(diagnosis),
        "noise": diagnosis.noise,
        "noise_texts": noise_texts(diagnosis.noise),
        "linear": any(run.linear for run in seen),
        "runs": [
            {
                "name": run.name,
                "samples": len(run.t),
                "duration": run.t[-1] - run.t[0],
                "fastest": float(np.abs(run.rate).max()),
                "lost": int((~run.valid.any(axis=1)).sum()),
                "dead": [
                    name for name, alive in zip(channels, np.asarray(run.valid.any(axis=0)), strict=True) if not alive
                ],
                "picture": figures.before_after_figure(run, view.size),
                "sentences": view.sentences,
            }
            for run, view in zip(seen, views, strict=True)
        ],
        "views": _views(diagnosis, views[0]) if views else [],
        "channels_picture": figures.channels_figure(seen[0], views[0].size, diagnosis.twin.array) if views else "",
        "fingerprint": figures.fingerprint_figure(views[0].fingerprint) if views else "",
    }


def _array(diagnosis: Diagnosis, rig: DrawnRig) -> dict[str, Any]:
    """Return the picture of the array, and its chips as a table."""
    array, run = diagnosis.twin.array, diagnosis.runs[0] if diagnosis.runs else None
    axis, gravity, name = rig.seen_from(array, run)
    return {
        "title": scene_title(array),
        "package": package_words(package_of(array)),
        "description": array.description,
        "picture": figures.rig_figure(array, axis, gravity, name),
        "chips": [
            {
                "name": chip.name,
                "colour": css(chip_colour(number, on_paper=True)),
                "channels": ", ".join(chip.channels),
                "place": ", ".join(f"{1000.0 * part + 0.0:.4g}" for part in chip.position),
                "part": chip.part,
            }
            for number, chip in enumerate(array.chips)
        ],
    }


def _surrogate(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the coefficients of a surrogate as a table: functions down, channels and the reference across."""
    places = [key.split(": ", maxsplit=1) for key in diagnosis.unexplained.surrogate]
    if not places or any(len(place) < 2 for place in places):
        return {}
    of = list(dict.fromkeys(series for series, _ in places))
    rows: dict[str, list[str]] = {}
    for (series, function), value in zip(places, diagnosis.unexplained.surrogate.values(), strict=True):
        rows.setdefault(function, [""] * len(of))[of.index(series)] = f"{value:.3g}"
    return {"columns": of, "rows": rows}


def _share_in_any_recording(diagnosis: Diagnosis) -> str:
    """Return the share without terms of absolute time where that is another one."""
    here, anywhere = diagnosis.gain.share_of_excess_removed, diagnosis.gain.share_in_any_recording
    return percent(anywhere) if np.isfinite(anywhere) and abs(here - anywhere) > SAME_SHARE else ""


def _figures_of_merit(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """Return the numbers of the first screen: value, unit, what it is."""
    residual, gain = diagnosis.residual, diagnosis.gain
    merits = [(f"{residual.rms_before:.3g}", "m/s²", "prediction error, simulation as given")]
    if diagnosis.causes or diagnosis.unexplained.extends_twin:
        merits.append((f"{residual.rms_after:.3g}", "m/s²", "prediction error, extended"))
    merits.append((f"{residual.noise_floor:.3g}", "m/s²", "the sensors' own noise"))
    if np.isfinite(gain.share_of_excess_removed):
        merits.append((percent(gain.share_of_excess_removed), "", "of the error gone on unseen data"))
    if diagnosis.verdict == "explained" and diagnosis.causes:
        merits.append((percent(min(cause.probability for cause in diagnosis.causes)), "", "probability"))
    return merits


def _cause(diagnosis: Diagnosis, cause: NamedCause) -> Mapping[str, Any]:
    every = parameters = parameter_texts(cause, parameter_units(diagnosis, cause))
    # Of many parameters, those that stand out from their uncertainty are worth a line on the first screen.
    if len(parameters) > _MOST_PARAMETERS:
        parameters = [one for one in parameters if one.significant] or parameters
    return {
        "name": cause.effect,
        "summary": summary(diagnosis, cause),
        "parameters": parameters[:_MOST_PARAMETERS],
        "more": max(len(every) - min(len(parameters), _MOST_PARAMETERS), 0),
        "probability": percent(cause.probability),
        "why": cause.why.removeprefix(summary(diagnosis, cause)).lstrip("; "),
        "alike": cause.not_distinguishable_from,
        "remedy": cause.would_be_separated_by,
    }


def _views(diagnosis: Diagnosis, views: ResidualViews) -> list[Mapping[str, Any]]:
    """Return title, sentence and picture of each residual view of the first run."""
    array = diagnosis.twin.array
    shown: list[Mapping[str, Any]] = []
    for name, title in _VIEWS:
        dependence = views.by_view(name)
        if dependence is not None:
            picture = figures.dependence_figure(dependence, array)
            shown.append(
                {"title": title, "sentence": dependence.sentence, "picture": picture, "looks": dependence.looks}
            )
    for spectrum, title in ((views.spectrum, "over frequency"), (views.orders, "over cycles per revolution")):
        if spectrum is not None:
            picture = figures.spectrum_figure(spectrum)
            shown.append({"title": title, "sentence": spectrum.sentence, "picture": picture, "looks": spectrum.looks})
    if diagnosis.rigid is not None and diagnosis.rigid.combinations:
        picture, sentence = figures.rigid_figure(diagnosis.rigid.power), _place(diagnosis.rigid)
        shown.append(
            {
                "title": "whose motion is it?",
                "sentence": sentence,
                "picture": picture,
                "looks": len(diagnosis.rigid.excesses),
            }
        )
    picture = figures.whiteness_figure(views.whiteness)
    looks = views.whiteness.looks
    shown.append({"title": "is it noise?", "sentence": views.whiteness.sentence, "picture": picture, "looks": looks})
    return shown


def _place(rigid: RigidMotion) -> str:
    """Return what the division of the residual shows; of a spin nothing, as the noise of the reference is one too."""
    return "" if rigid.place == "spin" else rigid.sentence
