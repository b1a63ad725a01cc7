"""The results of `gfimu score` and `optimize`."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import UNSET, UnsetType

from gfimu.commands.results.base import Files, Matrix, Number, Numbers, Result
from gfimu.files.schema import about

__all__ = [
    "ArrayScore",
    "Certificate",
    "ChannelLeastFault",
    "DesignArray",
    "DesignChip",
    "Front",
    "FrontPoint",
    "LeastFault",
    "Objective",
    "Optimized",
    "Scored",
]


class ChannelLeastFault(Result, kw_only=True):
    """Least fault of one channel that is found."""

    channel: Annotated[str, about("The channel.")]
    detected_m_s2: Annotated[Number, about("Least fault that is seen; null: never.", "m/s²")]
    isolated_m_s2: Annotated[Number, about("Least fault that is assigned to its channel.", "m/s²")]
    detected_without_rate_m_s2: Annotated[
        Number, about("Least fault that is seen by single samples, ω unknown.", "m/s²")
    ]
    isolated_without_rate_m_s2: Annotated[
        Number, about("Least fault that is assigned by single samples, ω unknown.", "m/s²")
    ]
    unseen_alpha_rad_s2: Annotated[Number, about("Error of α by a fault that is just not seen.", "rad/s²")]
    rival: Annotated[str | None, about("Channel with which it is confused first; null or empty: none.")]


class LeastFault(Result, kw_only=True):
    """Least constant fault that is found within a time with 95 % probability, on the worst channel."""

    noise_m_s2: Annotated[Number, about("White noise of every channel.", "m/s²")]
    sample_rate_hz: Annotated[Number, about("Sample rate.", "Hz")]
    duration_s: Annotated[Number, about("Time since the onset.", "s")]
    detected_m_s2: Annotated[Number, about("Least fault that is seen; null: never.", "m/s²")]
    isolated_m_s2: Annotated[Number, about("Least fault that is assigned to its channel.", "m/s²")]
    detected_without_rate_m_s2: Annotated[
        Number, about("Least fault that is seen by single samples, ω unknown.", "m/s²")
    ]
    isolated_without_rate_m_s2: Annotated[
        Number, about("Least fault that is assigned by single samples, ω unknown.", "m/s²")
    ]
    unseen_alpha_rad_s2: Annotated[Number, about("Error of α by a fault that is just not seen.", "rad/s²")]
    channels: Annotated[list[ChannelLeastFault] | UnsetType, about("Of every channel, with --per-channel.")] = UNSET


class ArrayScore(Result, kw_only=True):
    """Figures of merit of an array."""

    name: Annotated[str, about("Name of the array.")]
    description: Annotated[str, about("What it is.")]
    channels: Annotated[int, about("Channels.")]
    length_unit_m: Annotated[Number, about("Length that counts as 1 in the figures.", "m")]
    condition_number: Annotated[Number, about("Condition number κ(J).")]
    gdop: Annotated[Number, about("√tr((JᵀJ)⁻¹).")]
    gdop_joint: Annotated[Number, about("GDOP with ω unknown and no recursion; null: impossible.")]
    sigma_alpha: Annotated[Numbers, about("Standard deviation of α_x, α_y, α_z, in channel units per length unit.")]
    sigma_p: Annotated[Numbers, about("Standard deviation of p_x, p_y, p_z, in channel units.")]
    omega_squared_leakage: Annotated[
        Numbers, about("Largest coefficient of a product of ω in α_x … p_z by the linear solution.")
    ]
    omega_squared_terms: Annotated[dict[str, str], about("These products in words, by component that has any.")]
    null_space_rank: Annotated[int, about("Products of ω, of six, that the null space of J sees.")]
    omega_rad_s: Annotated[Numbers, about("Angular rate of the bound, body axes.", "rad/s")]
    noise_m_s2: Annotated[Number, about("Standard deviation of a channel at which the bound holds.", "m/s²")]
    rate_bound_rad_s: Annotated[Numbers, about("Cramér–Rao bound of one sample on ω; null: not determined.", "rad/s")]
    least_fault: Annotated[LeastFault | UnsetType, about("Least fault of a channel that is found.")] = UNSET


class Scored(Result, kw_only=True):
    """Figures of merit of arrays; with --axis, or of arrays that turn about one axis, its bounds."""

    length_unit_m: Annotated[Number | UnsetType, about("Length that counts as 1; absent with --axis.", "m")] = UNSET
    arrays: Annotated[
        list[dict[str, Any]],
        about(
            "Figures of merit of each array, or its bounds about its axis.",
            extra_json_schema={"items": {"anyOf": [{"$ref": "#/$defs/ArrayScore"}, {"$ref": "#/$defs/AxisBounds"}]}},
        ),
    ]


class DesignChip(Result, kw_only=True):
    """A chip of an array."""

    name: Annotated[str, about("Its name.")]
    part: Annotated[str, about("Its part.")]
    position_m: Annotated[Numbers, about("Position in the body frame.", "m")]
    axes: Annotated[Matrix, about("Unit vectors of its sensing axes, body frame.")]
    output_data_rate_hz: Annotated[Number | UnsetType, about("Its output data rate.", "Hz")] = UNSET
    supply_V: Annotated[Number | UnsetType, about("Its supply.", "V")] = UNSET


class DesignArray(Result, kw_only=True):
    """An array, as an array file holds it."""

    name: Annotated[str, about("Name of the array.")]
    description: Annotated[str | UnsetType, about("What it is.")] = UNSET
    length_unit_m: Annotated[Number | UnsetType, about("Length that counts as 1 in figures of merit.", "m")] = UNSET
    part: Annotated[str | UnsetType, about("Part of all chips.")] = UNSET
    chip: Annotated[list[DesignChip], about("The chips.")]


class Objective(Result, kw_only=True):
    """What was made small."""

    name: Annotated[str, about("Its name.")]
    meaning: Annotated[str, about("In words.")]
    unit: Annotated[str, about("Its unit; empty of a ratio.")]
    value: Annotated[Number | UnsetType, about("Its value, in that unit.")] = UNSET


class Certificate(Result, kw_only=True):
    """A proven lower bound."""

    bound: Annotated[Number, about("No array has a smaller figure, in the unit of the objective.")]
    gap: Annotated[Number, about("Figure of the array over the bound, less one.")]
    reason: Annotated[str, about("What the bound rests on.")]


class Optimized(Result, kw_only=True):
    """The best array found."""

    array: Annotated[DesignArray, about("The array.")]
    score: Annotated[ArrayScore, about("Its figures of merit.")]
    gdop_lower_bound: Annotated[
        Number, about("GDOP that no geometry of as many tri-axial chips can beat; null of other searches.")
    ]
    starts: Annotated[int, about("Starts that were made.")]
    agreeing: Annotated[int, about("Starts that ended at the best figure.")]
    within_0_1_percent: Annotated[int, about("Starts that ended within 0.1 % of it.")]
    objective: Annotated[Objective, about("What was made small.")]
    certificate: Annotated[Certificate | None, about("A proven lower bound; null where none is known.")]
    files: Files


class FrontPoint(Result, kw_only=True):
    """An array of the front."""

    array: Annotated[str, about("Name of its array file.")]
    chips: Annotated[int, about("Chips.")]
    values: Annotated[Numbers, about("Its two figures.")]
    bounds: Annotated[Numbers, about("Proven least of each figure alone; null: none.")]
    starts: Annotated[int, about("Starts that were made for it.")]
    agreeing: Annotated[int, about("Starts that ended at it.")]


class Front(Result, kw_only=True):
    """Arrays of which none is worse than another in both objectives."""

    objectives: Annotated[list[Objective], about("The two objectives.")]
    points: Annotated[list[FrontPoint], about("The arrays.")]
    files: Files
