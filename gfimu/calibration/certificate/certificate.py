"""A calibration certificate: what is stated of an accelerometer triad or array, with its uncertainty and conditions.

Two further parts plug in by arguments of `gfimu.calibration.certificate.certify.certify`:

- ``components``: what no fit shows (errors of levelling, table and reference, by simulation: type B). Each `Component`
  names a term (``a11_K0``) and has its unit; `gfimu.calibration.certificate.quantities.stated_quantities` computes the
  same terms from any calibration, such as a simulated one.
- ``angular_sensor``: the whole array as an angular sensor (IEEE 671), a `Sheet` of `Term`.

K2 comes from the parameters ``a1_q_x`` …, K3 from ``a1_c_x`` … (1 per reading unit squared: l = b + y + q y² + c y³).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import msgspec
from numpy.typing import NDArray

from gfimu.base.declared import Table
from gfimu.base.errors import InputError
from gfimu.base.files.atomic_file import write_text
from gfimu.base.results import TableResult, columns_of, text_column

__all__ = ["FORMAT", "Certificate", "ChipCertificate", "Comparison", "ComparisonRow", "Component", "Sheet", "Term"]

FORMAT = "gfimu-certificate"
FORMAT_VERSION = 1


@dataclass(frozen=True)
class Component:
    """One line of the uncertainty budget: what one source contributes to one stated quantity (GUM, 4 and 5).

    Parameters
    ----------
    quantity : str
        Name of the `Term` it belongs to, such as ``a11_K0``.
    source : str
        Where it comes from, in words.
    kind : {"A", "B"}
        By statistics of the observations (A), or otherwise (B).
    distribution : {"normal", "t", "uniform", "triangular", "arcsine"}
        Distribution of the error.
    std : float
        Standard uncertainty of the quantity from this source, |c_i| u(x_i), in ``unit``.
    unit : str
        Unit of the quantity.
    degrees_of_freedom : float, optional
        Of ``std``; None for a standard uncertainty that is exact (infinite).
    """

    quantity: str
    source: str
    kind: Literal["A", "B"]
    distribution: Literal["normal", "t", "uniform", "triangular", "arcsine"]
    std: float
    unit: str
    degrees_of_freedom: float | None = None


@dataclass(frozen=True)
class Term:
    """A stated quantity.

    Parameters
    ----------
    name : str
        Unique in the certificate: the input axis (or chip) and the symbol, ``a11_K0``, ``a1_angle_xy``.
    symbol : str
        Symbol of the standard or paper, ``K0``.
    meaning : str
        In words.
    unit : str
        Unit of value, std and expanded.
    value : float, optional
        None: not determined, or zero by definition; ``note`` says which.
    std : float, optional
        Combined standard uncertainty, all components of the budget.
    expanded : float, optional
        Expanded uncertainty U = k u, 95 %.
    coverage_factor : float, optional
        k.
    degrees_of_freedom : float, optional
        Effective ones; None: infinite.
    familiar_unit : str
        A unit of the field, ``mg``; empty for none.
    familiar_factor : float
        Multiplies value, std and expanded into that unit.
    note : str
        Why there is no value, or how the value is meant.
    """

    name: str
    symbol: str
    meaning: str
    unit: str
    value: float | None = None
    std: float | None = None
    expanded: float | None = None
    coverage_factor: float | None = None
    degrees_of_freedom: float | None = None
    familiar_unit: str = ""
    familiar_factor: float = 1.0
    note: str = ""


@dataclass(frozen=True)
class ChipCertificate:
    """What is stated of one triad.

    Parameters
    ----------
    chip : str
        Its name.
    channels : tuple of str
        Its three input axes.
    frame : str
        Key of the reference axes of ``terms`` (a gauge of the calibration).
    frame_meaning : str
        In words.
    terms : tuple of Term
        Terms of the model equation (IEEE 1293), axis by axis.
    intrinsic : tuple of Term
        The nine parameters that don't depend on the frame (NIST).
    correlation_names : tuple of str
        Names of the terms with a value, those of ``terms`` first.
    correlation : tuple of tuple of float
        Their correlation matrix, from the covariance of the calibration.
    """

    chip: str
    channels: tuple[str, ...]
    frame: str
    frame_meaning: str
    terms: tuple[Term, ...]
    intrinsic: tuple[Term, ...]
    correlation_names: tuple[str, ...] = ()
    correlation: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class Sheet:
    """A table of quantities with its own conditions, such as that of the array as an angular sensor.

    Parameters
    ----------
    title : str
        Heading.
    terms : tuple of Term
        Its quantities.
    conditions : mapping of str to str
        What they hold for, by name.
    statements : tuple of str
        What was not determined, and other sentences.
    """

    title: str
    terms: tuple[Term, ...]
    conditions: Mapping[str, str]
    statements: tuple[str, ...] = ()


@dataclass(frozen=True)
class ComparisonRow:
    """One quantity in two certificates.

    Parameters
    ----------
    name : str
        Name of the term.
    unit : str
        Unit of the values and uncertainties.
    value, expanded : float
        In this certificate: value and expanded uncertainty.
    other_value, other_expanded : float
        In the other one.
    e_n : float
        Difference of the values over the root of the sum of squares of the expanded uncertainties.
    """

    name: str
    unit: str
    value: float
    expanded: float
    other_value: float
    other_expanded: float
    e_n: float

    @property
    def satisfactory(self) -> bool:
        """Whether E_n is between −1 and 1."""
        return abs(self.e_n) <= 1.0


@dataclass(frozen=True)
class Comparison:
    """Two certificates of one instrument, quantity by quantity.

    Parameters
    ----------
    other : str
        What it is compared with.
    rows : tuple of ComparisonRow
        Every quantity that both state with an uncertainty.
    left_out : tuple of str
        What is not compared, and why.
    """

    other: str
    rows: tuple[ComparisonRow, ...]
    left_out: tuple[str, ...] = ()

    @property
    def summary(self) -> str:
        """How many quantities agree, in words."""
        good = sum(row.satisfactory for row in self.rows)
        return f"{good} of {len(self.rows)} quantities have E_n between −1 and 1"

    def shown(self) -> Iterator[Table | str]:
        """Yield the table and sentences that people read."""
        rows = [
            (
                row.name,
                f"{row.value:.6g} ± {row.expanded:.2g}",
                f"{row.other_value:.6g} ± {row.other_expanded:.2g}",
                row.unit,
                f"{row.e_n:+.2f}",
            )
            for row in self.rows
        ]
        yield Table(f"compared with {self.other}", ("quantity", "this", "other", "unit", "E_n"), rows)
        yield self.summary
        yield from (f"not compared: {text}" for text in self.left_out)


@dataclass(frozen=True)
class Certificate(TableResult):
    """A calibration certificate of a triad or of all chips of an array.

    Parameters
    ----------
    item : str
        What was calibrated, such as part and serial number; empty if not given.
    date : str
        When; empty if not given.
    method : str
        Method of the calibration.
    unit : str
        Unit of the readings.
    gravity_m_s2 : float
        Local gravity used.
    conditions : mapping of str to str
        Further conditions, by name.
    chips : tuple of ChipCertificate
        What is stated of each chip.
    budget : tuple of Component
        All components of all terms.
    statements : tuple of str
        What was not determined, and other sentences a reader needs.
    warnings : tuple of str
        What looked wrong in the data of the calibration.
    angular_sensor : Sheet, optional
        The whole array as an angular sensor (IEEE 671).
    comparison : Comparison, optional
        With another certificate.
    model_equation : str
        Model equation of an input axis.
    software : str
        Program and version.
    format, format_version : constant
        What the file is.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.certificate("cal.json").term("a11_K0")  # doctest: +SKIP
    """

    item: str
    date: str
    method: str
    unit: str
    gravity_m_s2: float
    conditions: Mapping[str, str]
    chips: tuple[ChipCertificate, ...]
    budget: tuple[Component, ...]
    statements: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    angular_sensor: Sheet | None = None
    comparison: Comparison | None = None
    model_equation: str = ""
    software: str = ""
    format: Literal["gfimu-certificate"] = FORMAT  # type: ignore[assignment]
    format_version: Literal[1] = FORMAT_VERSION  # type: ignore[assignment]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per term: value, standard and expanded uncertainty, coverage factor, unit."""
        names = {"term": text_column(term.name for term in self.terms)}
        return names | columns_of(self.terms, "meaning value std expanded coverage_factor degrees_of_freedom unit")

    def _heading(self) -> str:
        return f"Certificate of {self.item}"

    def _facts(self) -> list[tuple[str, str]]:
        return [("date", self.date), ("method", self.method), *self.conditions.items()]

    def _notes(self) -> tuple[str, ...]:
        return (*self.warnings, *self.statements)

    @property
    def terms(self) -> tuple[Term, ...]:
        """All terms of all chips."""
        return tuple(term for chip in self.chips for term in (*chip.terms, *chip.intrinsic))

    def term(self, name: str) -> Term:
        """Look up a term by name; raises `InputError` that lists the names."""
        for term in self.terms:
            if term.name == name:
                return term
        raise InputError(f"the certificate has no term {name!r}; it has {', '.join(term.name for term in self.terms)}")

    def shown(self) -> Iterator[Table | str]:
        """Yield the tables and sentences that people read."""
        for chip in self.chips:
            terms = (*chip.terms, *chip.intrinsic)
            yield _table(f"{chip.chip}: {chip.frame_meaning}", [term for term in terms if term.value is not None])
            missing = [term.name for term in terms if term.value is None]
            if missing:
                yield f"not determined: {', '.join(missing)}"
        if self.angular_sensor is not None:
            yield _table(self.angular_sensor.title, self.angular_sensor.terms)
            yield from (f"{name}: {text}" for name, text in self.angular_sensor.conditions.items())
        if self.comparison is not None:
            yield from self.comparison.shown()
        yield from (f"note: {text}" for text in self.statements)
        yield from (f"warning: {text}" for text in self.warnings)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of the certificate file."""
        return asdict(self)

    def save(self, path: str | Path) -> None:
        """Write the certificate as JSON, whole or not at all."""
        write_text(path, json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n")

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], *, source: str = "certificate") -> Certificate:
        """Build a certificate from the content of its file.

        Raises
        ------
        InputError
            If it is not a certificate, of another version, or damaged.
        """
        if not isinstance(data, Mapping) or data.get("format") != FORMAT:
            raise InputError(f"{source}: not a certificate; make one with `gfimu certificate`")
        if data.get("format_version") != FORMAT_VERSION:
            raise InputError(
                f"{source}: format version {data.get('format_version')!r}, this program reads {FORMAT_VERSION}; "
                "make the certificate again"
            )
        try:
            found = msgspec.convert(data, cls)
        except msgspec.ValidationError as error:
            raise InputError(f"{source}: damaged certificate ({error}); make it again") from None
        for term in found.terms:
            if not all(math.isfinite(number or 0.0) for number in (term.value, term.std, term.expanded)):
                raise InputError(f"{source}: {term.name} is not finite; make the certificate again")
        return found


def _table(title: str, terms: Sequence[Term]) -> Table:
    """Return the table of terms: value, expanded uncertainty and coverage factor, or a note in place of what is not."""
    rows = []
    for term in terms:
        value = term.note if term.value is None else f"{term.value:.7g}"
        expanded, factor = "" if term.value is None else term.note, ""
        if term.value is not None and term.expanded is not None:
            expanded, factor = f"{term.expanded:.2g}", f"{term.coverage_factor:.2f}"
        rows.append((term.name, value, expanded, factor, term.unit))
    return Table(title, ("term", "value", "U (95 %)", "k", "unit"), rows)
