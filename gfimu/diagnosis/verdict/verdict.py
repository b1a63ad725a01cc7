"""The verdict: what a diagnosis says, with its numbers, in a form that prints, saves and draws."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, figure
from gfimu.base.files.atomic_file import write_text
from gfimu.base.results import Panel, PlottedResult, Series
from gfimu.base.short_repr import joined
from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.search.undetermined import Undetermined
from gfimu.diagnosis.verdict.parts import (
    Interrupted,
    NamedCause,
    NoiseLevels,
    ReferenceClock,
    Residual,
    Rival,
    Unexplained,
    is_in_part,
)
from gfimu.model.world_model import WorldModel

__all__ = ["FORMAT_VERSION", "Diagnosis"]

FORMAT_VERSION = 1  # numerical: of verdict.json, no threshold


@dataclass(frozen=True, kw_only=True)
class Diagnosis(Declared, PlottedResult):
    """The result of a diagnosis: what a simulation gets wrong, and why.

    ``twin`` is the extended twin and ``runs`` are the data for pictures; ``mounting_rotvec_rad`` is how the array was
    turned from upright in the first run, as a rotation vector.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.diagnose("run.parquet", "cube12_turntable")  # doctest: +SKIP
    >>> found.verdict, [cause.effect for cause in found.causes]  # doctest: +SKIP
    >>> found.report("diagnosis")  # doctest: +SKIP
    """

    format_version: Annotated[int, figure("Version of the format.")] = FORMAT_VERSION
    verdict: Annotated[str, figure("nothing_found, explained, ambiguous or unknown.")]
    interrupted: Annotated[Interrupted | None, figure("What ended the diagnosis early; null where nothing did.")] = None
    library_probability: Annotated[
        float,
        figure(
            "Probability that the library holds the truth: that the causes are confounded with "
            "nothing outside it, the least of them; null where no cause was inferred."
        ),
    ] = float("nan")
    sentences: Annotated[tuple[str, ...], figure("The verdict in words, most important first.")]
    reference_clock: Annotated[
        ReferenceClock | None, figure("Clock of the reference; null where it was not aligned.")
    ] = None
    causes: Annotated[
        tuple[NamedCause, ...],
        figure("Causes by contribution; of an ambiguous verdict the effects that can't be distinguished."),
    ]
    residual: Annotated[Residual, figure("Prediction error before and after.")]
    gain: Annotated[Gain, figure("What the extension is worth.")]
    unexplained: Annotated[Unexplained, figure("What nothing in the library explains.")]
    rivals: Annotated[tuple[Rival, ...], figure("Other explanations, best first.")]
    noise: Annotated[NoiseLevels, figure("Noise levels that were estimated.")]
    undetermined: Annotated[
        tuple[Undetermined, ...], figure("Combinations of sizes that these data can't see, which stay at zero.")
    ] = ()
    twin: WorldModel
    runs: tuple[RunView, ...]
    mounting_rotvec_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per parameter of each cause, units in the parameter's name; ``text`` of what is no number."""
        rows = [(cause, key, value) for cause in self.causes for key, value in cause.parameters.items()]
        numbers = [float(value) if _is_number(value) else np.nan for _, _, value in rows]
        stds = [cause.std.get(key, np.nan) for cause, key, _ in rows]
        texts = {
            "effect": [cause.effect for cause, _, _ in rows],
            "place": [cause.place for cause, _, _ in rows],
            "parameter": [key for _, key, _ in rows],
            "text": ["" if _is_number(value) else _in_words(value) for _, _, value in rows],
        }
        named = {key: np.array(values, dtype=object) for key, values in texts.items()}
        return {
            **{key: named[key] for key in ("effect", "place", "parameter")},
            "value": np.array(numbers, dtype=float),
            "std": np.array(stds, dtype=float),
            "text": named["text"],
            "probability": np.array([cause.probability for cause, _, _ in rows], dtype=float),
        }

    def _table_metadata(self) -> dict[str, Any]:
        return {"verdict": self.verdict, "format_version": FORMAT_VERSION}

    def _heading(self) -> str:
        return f"Diagnosis: {self.verdict.replace('_', ' ')}{' (in part)' if self.in_part else ''}"

    def _facts(self) -> list[tuple[str, str]]:
        residual, gain = self.residual, self.gain
        before_after = f"{residual.rms_before:.3g} m/s² before, {residual.rms_after:.3g} m/s² after"
        facts = [("residual, rms", before_after), ("noise floor", f"{residual.noise_floor:.3g} m/s²")]
        if np.isfinite(gain.share_of_excess_removed):
            std = f" ± {100 * gain.share_std:.2g} %" if np.isfinite(gain.share_std) else ""
            facts.append(
                (f"removed on validation data ({gain.held_out})", f"{100 * gain.share_of_excess_removed:.3g} %{std}")
            )
        if np.isfinite(self.library_probability):
            facts.append(("probability that the library holds the cause", f"{100 * self.library_probability:.3g} %"))
        return [*facts, ("runs", ", ".join(run.name for run in self.runs))]

    def _notes(self) -> tuple[str, ...]:
        return self.sentences

    def _panels(self) -> list[Panel]:
        channels = tuple(self.residual.before_by_channel)
        by_channel = (
            ("given simulation", self.residual.before_by_channel, "before"),
            ("extended simulation", self.residual.after_by_channel, "after"),
        )
        sizes = tuple(
            Series(name, np.array([found[channel] for channel in channels]), role=role)
            for name, found, role in by_channel
        )
        panels = [Panel("residual of each channel", "rms, m/s²", sizes, channels, scale="zero")]
        if self.runs and channels:
            panels.append(self._worst_channel(channels))
        columns = self.to_columns()
        known = np.flatnonzero(columns["std"] > 0.0)
        if known.size:
            names = tuple(f"{columns['effect'][row]}\n{columns['parameter'][row]}" for row in known)
            ratios = Series("", (columns["value"] / columns["std"])[known], np.ones(len(known)), role="after")
            panels.append(Panel("named parameters over their standard deviations, ±2σ", "size / σ", (ratios,), names))
        return panels

    def _worst_channel(self, channels: Sequence[str]) -> Panel:
        """Return the residual over time of the channel that the given simulation predicts worst."""
        worst = max(range(len(channels)), key=lambda place: self.residual.before_by_channel[channels[place]])
        view = self.runs[0]
        series = tuple(
            Series(name, np.where(view.valid, view.measured - predicted, np.nan)[:, worst], role=role)
            for name, predicted, role in (
                ("given simulation", view.before, "before"),
                ("extended simulation", view.after, "after"),
            )
        )
        return Panel(f"measured less predicted, {channels[worst]}", "specific force, m/s²", series, view.t)

    @property
    def in_part(
        self,
    ) -> Annotated[
        bool,
        figure(
            "Whether the causes leave more than a tenth of the excess on held-out data, or something significant.",
            before="interrupted",
        ),
    ]:
        """Whether the causes stand but leave more than a tenth of the excess on held-out data, or what is no chance."""
        return is_in_part(self.verdict, self.gain, self.unexplained)

    def __repr__(self) -> str:
        causes = ", ".join(f"{cause.effect} {100 * cause.probability:.3g} %" for cause in self.causes)
        size = f"residual {self.residual.rms_before:.3g} -> {self.residual.rms_after:.3g} m/s²"
        return joined(self, [self.verdict, causes, size, f"{len(self.runs)} runs"])

    @property
    def calibration_residue(self) -> float:
        """Size of a residue of the twin's calibration, 0 where there is none."""
        return self.noise.calibration_residue or 0.0

    def to_json(self) -> str:
        """Return ``verdict.json``; NaN becomes null."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n"

    def write(self, directory: str | Path) -> None:
        """Write ``verdict.json`` and ``twin.toml`` into a folder."""
        folder = Path(directory)
        write_text(folder / "twin.toml", self.twin.to_toml())
        write_text(folder / "verdict.json", self.to_json())


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def _in_words(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
