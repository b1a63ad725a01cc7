"""The part file: what the data sheet of an accelerometer says, in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

import msgspec

from gfimu.array.parts.files import part_table
from gfimu.base.errors import InputError
from gfimu.base.files.schema import NotNegative, Positive, Table, Triple, about, read

__all__ = ["PartFile", "SupplyTable"]

_NOMINAL = 256.0  # counts per g of the ADXL345, whose data sheet gives the shift with the supply in counts


class SupplyTable(Table, frozen=True):
    """Nominal figures at a supply of 3.3 V, where they differ from those of the file."""

    sensitivity_lsb_g: Annotated[Triple, about("Nominal sensitivity, of 256 at the file's supply.", "counts/g")] = (
        _NOMINAL,
        _NOMINAL,
        _NOMINAL,
    )
    offset_m_s2: Annotated[Triple, about("Offset against the file's supply.", "m/s²")] = (0.0, 0.0, 0.0)

    @property
    def gain(self) -> Triple:
        """Gain at that supply over the nominal one, per axis."""
        x, y, z = self.sensitivity_lsb_g
        return (x / _NOMINAL, y / _NOMINAL, z / _NOMINAL)


class PartFile(Table, frozen=True, forbid_unknown_fields=False):
    """What the data sheet of an accelerometer says, in SI units; lists hold one number per sensing axis.

    Estimation needs ``lsb_m_s2``, ``full_range_m_s2``, ``noise_lsb_rms_100_hz`` and ``offset_std_m_s2``, simulation
    ``range_g`` as well; the other keys make a simulation more
    accurate. Keys that are not listed here are ignored.
    """

    lsb_m_s2: Annotated[
        Positive, about("Size of one count at the finest resolution of the widest range.", "m/s²", example=0.0382)
    ]
    noise_lsb_rms_100_hz: Annotated[
        Triple,
        about(
            "Noise of the output codes at output data rates up to 100 Hz, rms; √2 more per doubling of the rate above. "
            "From a noise density: density · √(50 Hz) / lsb.",
            "counts",
            example=[0.75, 0.75, 1.1],
        ),
    ]
    name: Annotated[str, about("Name of the part.", default="the name of the file")] = ""
    manufacturer: Annotated[str, about("Manufacturer.")] = ""
    source: Annotated[str, about("Where the figures are from: data sheet, revision, table.")] = ""
    full_range_m_s2: Annotated[
        Positive | None, about("Largest reading of the widest range.", "m/s²", default="needed for estimates")
    ] = None
    offset_std_m_s2: Annotated[
        Triple | None,
        about("Typical 0 g offset, one standard deviation.", "m/s²", default="needed for estimates"),
    ] = None
    range_g: Annotated[
        Annotated[tuple[int, ...], msgspec.Meta(min_length=1)] | None,
        about(
            "Ranges that can be set, in units of standard gravity, ascending.",
            must_be="a list of whole numbers of g",
            default="needed for simulation",
        ),
    ] = None
    bits: Annotated[int, about("Word length at the widest range.", gt=1)] = 16
    bits_reduced: Annotated[
        int, about("Word length with full resolution off, in every range; 0: the part has no such mode.", ge=0)
    ] = 0
    noise_density_m_s2_rthz: Annotated[
        Triple | None, about("Noise density of the data sheet, not used.", "m/s²/√Hz", default="none")
    ] = None
    offset_limit_m_s2: Annotated[
        Triple | None,
        about("Largest 0 g offset.", "m/s²", default="5 × the typical one; 4 × for the limits of a diagnosis"),
    ] = None
    offset_tempco_m_s2_K: Annotated[Triple, about("Typical change of the offset with temperature.", "m/s²/K")] = (
        0.0,
        0.0,
        0.0,
    )
    sensitivity_std: Annotated[NotNegative, about("Typical gain error, one standard deviation, a ratio.")] = 0.0
    sensitivity_limit: Annotated[
        Positive | None,
        about("Largest gain error, a ratio.", default="none; 0.1 for the limits of a diagnosis"),
    ] = None
    sensitivity_tempco_K: Annotated[
        NotNegative, about("Typical relative change of the gain with temperature.", "1/K")
    ] = 0.0
    cross_axis_std: Annotated[NotNegative, about("Typical cross-axis sensitivity, a ratio.")] = 0.0
    misalignment_std_rad: Annotated[NotNegative, about("Typical tilt of a sensing axis.", "rad")] = 0.0
    nonlinearity_full_scale: Annotated[
        NotNegative, about("Typical deviation from a straight line at full scale, relative to full scale.")
    ] = 0.0
    temperature_lsb_K: Annotated[
        float | None,
        about(
            "Size of a count of the chip's own temperature reading; negative where it falls as the chip warms up.",
            "K",
            default="no such reading",
        ),
    ] = None
    temperature_zero_degC: Annotated[
        float | None, about("Temperature at which that reading is zero.", "°C", default="no such reading")
    ] = None
    output_data_rate_max_hz: Annotated[Positive, about("Highest output data rate.", "Hz")] = 3200.0
    output_data_rate_min_hz: Annotated[
        NotNegative,
        about("Lowest output data rate, where the rates are steps of two; 0: any rate up to the highest.", "Hz"),
    ] = 0.0
    bandwidth_over_output_data_rate: Annotated[
        Positive, about("−3 dB bandwidth over the output data rate, a ratio.")
    ] = 0.5
    zero_lsb_from_hz: Annotated[
        Positive | None, about("Output data rate from which the last bit is always zero.", "Hz", default="never")
    ] = None
    supply_nominal_V: Annotated[
        Positive | None, about("Supply voltage of the figures, not used.", "V", default="unknown")
    ] = None
    supply_3_3_V: Annotated[SupplyTable | None, about("Figures at 3.3 V.", default="as at the nominal supply")] = None

    @classmethod
    def load(cls, name: str, files: Mapping[str, str] | None = None, *, needs: tuple[str, ...] = ()) -> PartFile:
        """Read a part by name (in ``models/parts``) or from a TOML file.

        Parameters
        ----------
        name : str
            Name in ``models/parts``, name of one of ``files``, or path of a part file.
        files : mapping of str to str, optional
            Part files that an array carries (`gfimu.AccelerometerArray.part_files`).
        needs : tuple of str
            Keys without which the part is of no use here.

        Raises
        ------
        InputError
            If the part is unknown (the message lists the names), or a key is missing, misspelt or has a wrong value.
        """
        data, source = part_table(name, files or {})
        found = read(data, cls, source)
        for key in needs:
            if getattr(found, key) is None:
                raise InputError(f"{source}: key {key!r} is missing; add it")
        return found if found.name else msgspec.structs.replace(found, name=name)
