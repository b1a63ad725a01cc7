"""What a verdict is made of: named causes, rivals, the residual, and what is unexplained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from gfimu.base.declared import Declared, figure
from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.policy import Policy

__all__ = [
    "FunctionTable",
    "Interrupted",
    "Located",
    "NamedCause",
    "NoiseLevels",
    "ReferenceClock",
    "Residual",
    "Rival",
    "Unexplained",
    "is_in_part",
]


class Parameter(Declared):
    """A parameter of a cause as JSON holds it; its unit is in its key."""

    value: Annotated[Any, figure("Its value: a number, or a name or list of names.")]
    std: Annotated[float | None, figure("Of a number: its standard deviation; null where none is known.", absent=True)]


@dataclass(frozen=True)
class FunctionTable(Declared):
    """An unknown function as a table, with its standard deviation."""

    x: Annotated[tuple[float, ...], figure("Values of what it is a function of.")]
    f: Annotated[tuple[float, ...], figure("The function there; of several components the largest one.")]
    std: Annotated[tuple[float, ...], figure("Standard deviations of the function.")]
    x_unit: Annotated[str, figure("Unit of x.")]
    unit: Annotated[str, figure("Unit of f; 1 of a ratio.")]


@dataclass(frozen=True)
class Located(Declared):
    """Something that has no name: where it is and what it goes with."""

    place: Annotated[
        str,
        figure("Where in the chain it acts: reference, motion, clock, array, bench, supply, chip or channel."),
    ]
    what: Annotated[str, figure("What changes there, such as leans or offset.")]
    pattern: Annotated[str, figure("Which series share it: one channel, a chip, each its own, or all.")]
    series: Annotated[tuple[str, ...], figure("Axes, channels or chips that it is of.")]
    dependence: Annotated[str, figure("What it goes with, such as omega^3; time where nothing else serves.")]
    text: Annotated[str, figure("The same in words, with its size.")]
    place_probability: Annotated[float, figure("Probability of the place.")]
    dependence_probability: Annotated[
        float | None, figure("Probability of what it goes with; null where that is time alone.")
    ]
    instead: Annotated[tuple[str, ...], figure("Descriptions that these data can't separate from it.")] = ()
    function: Annotated[FunctionTable | None, figure("The function; null where it is not of one quantity.")] = None


@dataclass(frozen=True)
class NamedCause(Declared):
    """One cause in a verdict: an effect with its sizes, their standard deviations and a probability.

    ``parameters`` are the values by contract key (numbers, names or lists of names), and ``std`` the standard
    deviations of those that are estimated.

    Examples
    --------
    >>> import gfimu
    >>> cause = gfimu.diagnose("run.parquet", "cube12_turntable").causes[0]  # doctest: +SKIP
    >>> cause.parameters, cause.std  # doctest: +SKIP
    """

    effect: Annotated[str, figure("The effect; unlisted for one without a name.")]
    parameters: Mapping[str, Any]
    std: Mapping[str, float]
    probability: Annotated[float, figure("Probability that this effect is among the causes.")]
    place: Annotated[str, figure("Where it acts, such as chip a2; empty where it has only one place.")] = ""
    not_distinguishable_from: Annotated[tuple[str, ...], figure("Effects that explain these data as well.")] = ()
    would_be_separated_by: Annotated[str, figure("Excitation that would separate them.")] = ""
    why: Annotated[str, figure("Where and how it shows, one sentence.")] = ""
    log_odds: Annotated[float, figure("Log odds against the best explanation without it.", "nats")] = 0.0
    unlisted: Annotated[
        Located | None, figure("Of an effect that the contract has no name for.", flat=True, absent=True)
    ] = None

    @property
    def sizes(
        self,
    ) -> Annotated[
        dict[str, Any],
        figure("Parameters; units in the keys.", key="parameters", before="probability", json=dict[str, Parameter]),
    ]:
        """Values and standard deviations by contract key, as JSON holds them."""
        return {
            key: {"value": value, "std": self.std.get(key)} if isinstance(value, int | float) else {"value": value}
            for key, value in self.parameters.items()
        }


@dataclass(frozen=True)
class Rival(Declared):
    """Another explanation and why it lost."""

    effects: Annotated[tuple[str, ...], figure("Its effects.")]
    log_odds: Annotated[float, figure("Log odds against the verdict; negative: less probable.", "nats")]
    why: Annotated[str, figure("Why it lost, one sentence.")] = ""


@dataclass(frozen=True)
class Residual(Declared):
    """Prediction error over all valid samples of all channels, before and after."""

    rms_before: Annotated[float, figure("Of the twin as given.", "m/s²")]
    rms_after: Annotated[float, figure("Of the extended twin.", "m/s²")]
    noise_floor: Annotated[float, figure("Noise as estimated from the data.", "m/s²")]
    before_by_channel: Annotated[Mapping[str, float], figure("Of the twin as given, by channel.", "m/s²")]
    after_by_channel: Annotated[Mapping[str, float], figure("Of the extended twin, by channel.", "m/s²")]

    @property
    def unit(self) -> Annotated[str, figure("Unit of all of these.", before="before_by_channel")]:
        """Unit of all of these, as keys write it."""
        return "m/s2"

    @classmethod
    def of_views(cls, views: Sequence[RunView], channels: Sequence[str], noise_floor: float) -> Residual:
        """Measure the residual over the valid samples of all runs."""
        count = np.maximum(np.sum([view.valid.sum(axis=0) for view in views], axis=0), 1)
        before, after = (
            np.sum([np.sum(np.where(v.valid, v.measured - getattr(v, name), 0.0) ** 2, axis=0) for v in views], axis=0)
            for name in ("before", "after")
        )
        return cls(
            float(np.sqrt(before.sum() / count.sum())),
            float(np.sqrt(after.sum() / count.sum())),
            noise_floor,
            dict(zip(channels, map(float, np.sqrt(before / count)), strict=True)),
            dict(zip(channels, map(float, np.sqrt(after / count)), strict=True)),
        )

    @property
    def share_left(self) -> float:
        """Share of the squared error beyond noise that remains on the fitted data, 0 to 1; 0 where there was none."""
        before, after = (max(rms**2 - self.noise_floor**2, 0.0) for rms in (self.rms_before, self.rms_after))
        return min(after / before, 1.0) if before else 0.0

    @property
    def is_noise(self) -> bool:
        """Whether hardly more than noise remains on the fitted data."""
        return self.rms_after <= (1.0 + Policy.small) * self.noise_floor

    @property
    def left_in_words(self) -> str:
        """How much of the error remains, for people."""
        return "hardly more than noise" if self.is_noise else f"{100 * self.share_left:.2g} % of the error beyond noise"


@dataclass(frozen=True)
class Unexplained(Declared):
    """What is left and nothing in the library explains."""

    significant: Annotated[bool, figure("Whether it is more than chance.")] = False
    signature: Annotated[str, figure("Which channels and which dependence, in words.")] = ""
    log_odds: Annotated[float, figure("Log odds of the strongest term against chance.", "nats")] = 0.0
    mistake: Annotated[str, figure("A mistake in the files that makes the simulation fit; empty where none does.")] = ""


@dataclass(frozen=True, kw_only=True)
class NoiseLevels(Declared):
    """Noise levels that were estimated; None where the recording has no such level.

    The disagreement and the gyro are those of a free body. The noise of the reference of a stage is in m/s. The
    calibration residue, 0 where there is none, is of all the twin's numbers at once.
    """

    white_over_data_sheet: Annotated[
        float | None, figure("White noise of the channels over that of the data sheet (median).", absent=True)
    ] = None
    bias_instability_m_s2: Annotated[
        float | None, figure("Bias instability (median of the channels).", "m/s²", absent=True)
    ] = None
    bias_instability_largest_m_s2: Annotated[float | None, figure("Largest bias instability.", "m/s²", absent=True)] = (
        None
    )
    bias_instability_largest_channel: Annotated[
        str | None, figure("Channel of the largest bias instability.", absent=True)
    ] = None
    reference_white: Annotated[float | None, figure("White noise of the reference.", "rad/s", absent=True)] = None
    calibration_residue: Annotated[
        float | None,
        figure(
            "Size of the small corrections (calibration residue) in units of what a good calibration leaves.",
            absent=True,
        ),
    ] = None
    disagreement_s: Annotated[
        float | None,
        figure("Disagreement of the channels over the rate of change of their readings.", "s", absent=True),
    ] = None
    gyro_bias_rad_s: Annotated[float | None, figure("Bias of the gyro.", "rad/s", absent=True)] = None
    time_jitter_s: Annotated[float | None, figure("Jitter of the sample times.", "s", absent=True)] = None
    impossible_values: Annotated[float | None, figure("Values that can't be a measurement.", absent=True)] = None


@dataclass(frozen=True)
class ReferenceClock(Declared):
    """Clock of a reference that was aligned before the diagnosis."""

    offset_s: Annotated[float, figure("Channels' clock less the reference's at the first sample.", "s")]
    offset_std_s: Annotated[float, figure("Its standard deviation.", "s")]
    rate_error: Annotated[float, figure("Seconds of the channels' clock per second of the reference's, less one.")]
    rate_error_std: Annotated[float, figure("Its standard deviation.")]


@dataclass(frozen=True)
class Interrupted(Declared):
    """What ended a diagnosis before it was done."""

    by: Annotated[str, figure("time limit, Ctrl-C or SIGTERM.")]
    stage: Annotated[str, figure("The stage that was going on.")]
    done: Annotated[tuple[str, ...], figure("Stages that were done.")]
    not_done: Annotated[tuple[str, ...], figure("Stages that were not.")]


def is_in_part(verdict: str, gain: Gain, unexplained: Unexplained) -> bool:
    """Whether causes explain a part only: they leave a tenth of the held-out excess, or what is no chance."""
    return verdict == "explained" and (unexplained.significant or gain.share_of_excess_removed < 1.0 - Policy.small)
