"""The report: one self-contained HTML page whose first screen a person understands who has never seen the project."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.base.files.atomic_file import write_text
from gfimu.base.version import __version__
from gfimu.diagnosis.criticism.views.residuals import ResidualViews, residual_views
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.report import figures
from gfimu.diagnosis.report.channel_tables import channel_bars
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
    three_digits,
    unexplained,
)
from gfimu.diagnosis.report.rig import DrawnRig, marked_of, marked_words
from gfimu.diagnosis.report.zooming import residual_plot, spectrum_plot
from gfimu.diagnosis.verdict.parts import NamedCause
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.diagnosis.verdict.wording import SAME_SHARE
from gfimu.visual.page import Packed, page_plots, page_style, page_text
from gfimu.visual.page.svg import themed
from gfimu.visual.rig import package_of
from gfimu.visual.rig.words import package_words, scene_title

__all__ = ["report_html", "write_report"]

_TEMPLATE = Path(__file__).parent / "templates" / "report.html.j2"
_VERDICTS = {
    "nothing_found": ("Nothing found", "calm"),
    "explained": ("Explained", "found"),
    "ambiguous": ("Ambiguous", "open"),
    "unknown": ("Unknown cause", "alarm"),
}
_MOST_PARAMETERS = 14
_FIRST_PARAMETERS = 4  # beside the headline
_MOST_FUNCTIONS = 2  # on the first screen


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
    return page_text(_TEMPLATE, _content(diagnosis, rig or DrawnRig()), {"odds": odds})


def _content(diagnosis: Diagnosis, rig: DrawnRig) -> Mapping[str, Any]:
    array = diagnosis.twin.array
    bias_instability = diagnosis.noise.bias_instability_m_s2 or 0.0
    seen = [run for run in diagnosis.runs if run.valid.any() and len(run.t) > 1]
    found = [residual_views(run, array.channels, bias_instability=bias_instability) for run in seen]
    label, tone = _VERDICTS[diagnosis.verdict]
    label += " in part" if diagnosis.in_part else ""
    label = "Interrupted" if diagnosis.interrupted and diagnosis.verdict == "unknown" else label
    data, plots = Packed(), {}
    if seen:
        plots["residual"] = residual_plot(seen[0], found[0].size, array, data)
    shown = _views(diagnosis, found[0], plots, data) if found else []
    zooming = page_plots({"plots": plots}, data)
    return {
        "version": __version__,
        "label": label,
        "tone": tone,
        "style": page_style(len(array.chips)),
        "policy": zooming["policy"],
        "plots": zooming,
        "plot_rule": _plot_rule(plots["residual"]["grouped"]) if seen else "",
        "array": _array(diagnosis, rig),
        "drawn": _drawn(diagnosis, rig, (seen[0], found[0]) if found else None),
        "headline": headline(diagnosis),
        "story": story(diagnosis),
        "sentences": diagnosis.sentences[1:],
        "figures_of_merit": _figures_of_merit(diagnosis),
        "causes": [_cause(diagnosis, cause) for cause in diagnosis.causes if cause.unlisted is None],
        "located": [_located(cause) for cause in diagnosis.causes if cause.unlisted is not None],
        "unexplained": unexplained(diagnosis),
        "rivals": diagnosis.rivals,
        "gain": diagnosis.gain,
        "gain_rows": gain_rows(diagnosis),
        "share": percent(diagnosis.gain.share_of_excess_removed),
        "any_share": _share_in_any_recording(diagnosis),
        "steps": next_steps(diagnosis),
        "noise": diagnosis.noise,
        "noise_texts": noise_texts(diagnosis.noise, linear=any(run.linear for run in seen)),
        "linear": any(run.linear for run in seen),
        "runs": [_run(run, views, array) for run, views in zip(seen, found, strict=True)],
        "views": [view for view in shown if view["sentence"]],
        "silent": [view for view in shown if not view["sentence"]],
        "channels_picture": _picture(figures.channels_figure(seen[0], found[0].size, array), array) if found else "",
    }


def _picture(svg: str, array: AccelerometerArray) -> str:
    return themed(svg, len(array.chips))


def _plot_rule(grouped: int) -> str:
    """Return what the pale lines of the residual plot are."""
    return f"lowest and highest of every {grouped} samples" if grouped else "every sample"


def _run(run: RunView, views: ResidualViews, array: AccelerometerArray) -> Mapping[str, Any]:
    """Return what the page says and draws of a run."""
    size, alive = views.size, np.asarray(run.valid.any(axis=0))
    worst = size.furthest[0]
    return {
        "name": run.name,
        "samples": len(run.t),
        "duration": run.t[-1] - run.t[0],
        "fastest": float(np.abs(run.rate).max()),
        "lost": int((~run.valid.any(axis=1)).sum()),
        "dead": [name for name, good in zip(array.channels, alive, strict=True) if not good],
        "trace": _picture(figures.trace_figure(run, size), array),
        "bars": channel_bars(size, array),
        "summary": (
            f"Residual of {size.channels[worst]}, the channel furthest above its noise: rms "
            f"{three_digits(size.before[worst])} m/s² before, {three_digits(size.after[worst])} m/s² after; its noise "
            f"is {three_digits(size.floor[worst])} m/s²."
        ),
        "sentences": views.sentences,
    }


def _array(diagnosis: Diagnosis, rig: DrawnRig) -> dict[str, Any]:
    """Return the picture of the array, and its chips as a table."""
    array, run = diagnosis.twin.array, diagnosis.runs[0] if diagnosis.runs else None
    axis, gravity, name = rig.seen_from(array, run)
    return {
        "title": scene_title(array),
        "package": package_words(package_of(array)),
        "description": array.description,
        "pictures": [_picture(svg, array) for svg in figures.rig_figures(array, axis, gravity, name)],
        "chips": [
            {
                "name": chip.name,
                "channels": ", ".join(chip.channels),
                "place": ", ".join(f"{1000.0 * part + 0.0:.4g}" for part in chip.position).replace("-", "−"),
                "part": chip.part,
            }
            for chip in array.chips
        ],
    }


def _drawn(diagnosis: Diagnosis, rig: DrawnRig, first: tuple[RunView, ResidualViews] | None) -> list[tuple[str, str]]:
    """Return the pictures of the first screen with their captions: where it is, what it goes with, what it removes."""
    array = diagnosis.twin.array
    if not diagnosis.causes:
        return []
    axis, gravity, name = rig.seen_from(array, diagnosis.runs[0] if diagnosis.runs else None)
    marked = marked_of(diagnosis)
    where = figures.marked_figure(array, axis, gravity, name, marked)
    drawn = [(where, f"Where it is: {marked_words(marked, array, has_axis=axis is not None)}.")]
    tables = [cause.unlisted for cause in diagnosis.causes if cause.unlisted is not None and cause.unlisted.function]
    for one in tables[:_MOST_FUNCTIONS]:
        assert one.function is not None
        caption = f"{one.text[0].upper()}{one.text[1:]}: the function that the data show, ±2σ."
        drawn.append((figures.function_figure(one.function, one.what), caption))
    if first is not None:
        caption = "Measured and predicted, by the simulation as given and extended, where it errs most."
        drawn.append((figures.measured_figure(first[0], first[1].size), caption))
    form = first[1].form if first is not None else None
    if form is not None:
        caption = (
            f"What was wrong in {form.channel}: {percent(form.share)} of the square of its error goes with "
            f"{form.quantity}. The line is what the extended simulation makes of it."
        )
        drawn.append((figures.form_figure(form), caption))
    return [(_picture(svg, array), caption) for svg, caption in drawn]


def _located(cause: NamedCause) -> Mapping[str, Any]:
    """Return the words of something that has a place and no name."""
    one = cause.unlisted
    assert one is not None
    return {
        "text": one.text[0].upper() + one.text[1:],
        "probability": percent(one.place_probability),
        "instead": one.instead,
    }


def _share_in_any_recording(diagnosis: Diagnosis) -> str:
    """Return the share without terms of absolute time where that is another one."""
    here, anywhere = diagnosis.gain.share_of_excess_removed, diagnosis.gain.share_in_any_recording
    return percent(anywhere) if np.isfinite(anywhere) and abs(here - anywhere) > SAME_SHARE else ""


def _figures_of_merit(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """Return the numbers of the first screen: value, unit, what it is."""
    residual, gain = diagnosis.residual, diagnosis.gain
    merits = [(three_digits(residual.rms_before), "m/s²", "prediction error, simulation as given")]
    if diagnosis.causes:
        merits.append((three_digits(residual.rms_after), "m/s²", "prediction error, extended"))
    merits.append((three_digits(residual.noise_floor), "m/s²", "the sensors' own noise"))
    if np.isfinite(gain.share_of_excess_removed):
        merits.append((percent(gain.share_of_excess_removed), "", "of the error gone on validation data"))
    if diagnosis.verdict == "explained" and diagnosis.causes:
        merits.append((percent(min(cause.probability for cause in diagnosis.causes)), "", "probability"))
    return merits


def _cause(diagnosis: Diagnosis, cause: NamedCause) -> Mapping[str, Any]:
    every = parameters = parameter_texts(cause, parameter_units(diagnosis, cause))
    # Of many parameters, those that stand out from their uncertainty are worth a line on the first screen.
    if len(parameters) > _MOST_PARAMETERS:
        parameters = [parameter for parameter in parameters if parameter.significant] or parameters
    return {
        "name": cause.effect,
        "summary": summary(diagnosis, cause),
        "parameters": parameters[:_MOST_PARAMETERS],
        "first": [one for one in every if one.significant][:_FIRST_PARAMETERS],
        "more": max(len(every) - min(len(parameters), _MOST_PARAMETERS), 0),
        "probability": percent(cause.probability),
        "why": cause.why.removeprefix(summary(diagnosis, cause)).lstrip("; "),
        "alike": cause.not_distinguishable_from,
        "remedy": cause.would_be_separated_by,
    }


def _views(diagnosis: Diagnosis, views: ResidualViews, plots: dict[str, Any], data: Packed) -> list[Mapping[str, Any]]:
    """Return title, sentence and picture of each residual view of the first run; those that zoom go to ``plots``."""
    array = diagnosis.twin.array
    shown: list[Mapping[str, Any]] = []

    def show(title: str, view: Any, picture: str, caption: str, plot: dict[str, Any] | None = None) -> None:
        name = "" if plot is None or not view.sentence else title.replace(" ", "-")
        if name and plot is not None:
            plots[name] = plot
        words = {"title": title, "sentence": view.sentence, "looks": view.looks, "caption": caption}
        shown.append({**words, "picture": _picture(picture, array), "plot": name})

    spectra = ((views.spectrum, "a line over frequency"), (views.orders, "a line over cycles per revolution"))
    for spectrum, title in spectra:
        if spectrum is not None:
            caption = "Rms over the channels beside that of noise; drawn at its peaks."
            show(title, spectrum, figures.spectrum_figure(spectrum), caption, spectrum_plot(spectrum, data))
    caption = "Cumulative periodogram of each channel; that of noise stays in the band."
    show("is it noise?", views.whiteness, figures.whiteness_figure(views.whiteness), caption)
    return shown
