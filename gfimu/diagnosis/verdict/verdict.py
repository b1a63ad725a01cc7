"""The verdict: what a diagnosis says, with its numbers, in a form that prints, saves and draws."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.criticism.views.rigid_motion import RigidMotion
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.verdict.parts import NamedCause, Residual, Rival, Unexplained
from gfimu.files.atomic_file import write_text
from gfimu.lazy_names import command_above
from gfimu.results import Panel, RunResult, Series
from gfimu.short_repr import joined
from gfimu.world_model import WorldModel

__all__ = ["FORMAT_VERSION", "Diagnosis"]

FORMAT_VERSION = 1  # numerical: of verdict.json, no threshold


@dataclass(frozen=True)
class Diagnosis(RunResult):
    """The result of a diagnosis.

    Parameters
    ----------
    verdict : {"nothing_found", "explained", "ambiguous", "unknown"}
        The verdict.
    causes : tuple of NamedCause
        By contribution; of an ambiguous verdict, the effects that can't be distinguished.
    residual, gain, unexplained
        See their classes.
    rivals : tuple of Rival
        Other explanations, best first.
    twin : WorldModel
        The extended twin.
    runs : tuple of RunView
        The data for pictures.
    sentences : tuple of str
        The verdict in words, most important first.
    noise : mapping
        Noise levels estimated: ``white_over_data_sheet``, ``bias_instability_m_s2`` (median of the channels),
        ``bias_instability_largest_m_s2`` and ``bias_instability_largest_channel``, ``reference_white``; and
        ``calibration_residue``, small errors of all the twin's numbers at once, in units of what a good calibration
        leaves (0 where there are none).
    undetermined : tuple of mapping
        Combinations of sizes that these data can't see, which stay at zero: ``effect``, ``combination`` (weights by
        key) and ``text``.
    rigid : RigidMotion, optional
        Whether the residual of the given simulation is a motion of the whole array; None for a free body.
    library_probability : float
        Probability that the causes are the truth and are confounded with nothing outside the library, the least of
        them; it is in their own probabilities. NaN where no cause was inferred.
    coincidence : float
        Log odds of the likeliest pattern that binds the free numbers of the causes, nats; NaN where none can be tested.
    mounting_rotvec_rad : tuple of float
        How the array was turned from upright in the first run, as a rotation vector, for the pictures.
    reference_clock : mapping
        Of a reference that was aligned before the diagnosis: ``offset_s`` (the channels' clock less the reference's at
        the first sample), ``rate_error`` (seconds of the channels' clock per second of the reference's, less one), and
        their standard deviations ``offset_std_s`` and ``rate_error_std``. Empty for all others.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.diagnose("run.parquet", "cube12_turntable")  # doctest: +SKIP
    >>> found.verdict, [cause.effect for cause in found.causes]  # doctest: +SKIP
    >>> found.report("diagnosis")  # doctest: +SKIP
    """

    verdict: str
    causes: tuple[NamedCause, ...]
    residual: Residual
    gain: Gain
    unexplained: Unexplained
    rivals: tuple[Rival, ...]
    twin: WorldModel
    runs: tuple[RunView, ...]
    sentences: tuple[str, ...]
    noise: Mapping[str, Any]
    undetermined: tuple[Mapping[str, Any], ...] = ()
    rigid: RigidMotion | None = None
    library_probability: float = float("nan")
    coincidence: float = float("nan")
    reference_clock: Mapping[str, float] = field(default_factory=dict)
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

    def report(self, folder: str | Path) -> Path:
        """Write the folder of the diagnosis: verdict, extended twin, ``report.html`` and a rerun recording.

        Parameters
        ----------
        folder : str or Path
            Folder to write; made if it isn't there, in one that is.

        Returns
        -------
        Path
            The report, for a browser.

        Raises
        ------
        InputError
            If the folder can't be written.
        """
        return Path(command_above("write_report")(self, folder))

    @property
    def in_part(self) -> bool:
        """Whether the causes stand but leave more than a tenth of the excess on held-out data."""
        return self.verdict == "explained" and self.gain.share_of_excess_removed < 1.0 - Policy.small

    def __repr__(self) -> str:
        causes = ", ".join(f"{cause.effect} {100 * cause.probability:.3g} %" for cause in self.causes)
        size = f"residual {self.residual.rms_before:.3g} -> {self.residual.rms_after:.3g} m/s²"
        return joined(self, [self.verdict, causes, size, f"{len(self.runs)} runs"])

    @property
    def calibration_residue(self) -> float:
        """Size of a residue of the twin's calibration, 0 where there is none."""
        return float(self.noise.get("calibration_residue", 0.0))

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form of the contract."""
        return {
            "format_version": FORMAT_VERSION,
            "verdict": self.verdict,
            "in_part": self.in_part,
            "library_probability": self.library_probability,
            "coincidence_nats": self.coincidence,
            "sentences": list(self.sentences),
            "reference_clock": dict(self.reference_clock) or None,
            "causes": [cause.to_dict() for cause in self.causes],
            "residual": self.residual.to_dict(),
            "gain": self.gain.to_dict(),
            "unexplained": self.unexplained.to_dict(),
            "rigid_motion": None if self.rigid is None else self.rigid.to_dict(),
            "rivals": [rival.to_dict() for rival in self.rivals],
            "noise": dict(self.noise),
            "undetermined": [dict(one) for one in self.undetermined],
        }

    def to_json(self) -> str:
        """Return ``verdict.json``; NaN becomes null."""
        return json.dumps(_finite(self.to_dict()), indent=2, allow_nan=False) + "\n"

    def write(self, directory: str | Path) -> None:
        """Write ``verdict.json`` and ``twin.toml`` into a folder."""
        folder = Path(directory)
        write_text(folder / "twin.toml", self.twin.to_toml())
        write_text(folder / "verdict.json", self.to_json())


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def _in_words(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
