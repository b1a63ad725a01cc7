"""The certificate as one self-contained, print-ready HTML page: A4 for one chip, and for the array of four."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, select_autoescape
from markupsafe import Markup, escape

from gfimu.base.errors import printable
from gfimu.base.files.atomic_file import atomic_folder
from gfimu.calibration.certificate.certificate import Certificate, ChipCertificate, Component, Term
from gfimu.calibration.certificate.numbers import plain_number, plus_minus
from gfimu.visual.page import STILL_POLICY, page_basics

__all__ = ["certificate_html", "write_certificate"]

_CONDITIONS = {
    "temperature_degC": "temperature, °C",
    "poses": "poses",
    "readings": "readings",
    "input": "rows of the fit",
    "redundancy": "redundancy of the fit",
    "variance_factor": "variance factor of the fit",
    "covariance_factor": "factor on the covariance",
    "magnitude_residual_rms_m_s2": "rms of |a| − g, m/s²",
    "disagreement_rms_m_s2": "disagreement of the chips, rms, m/s²",
    "levelling_std_rad": "levelling of the poses, standard deviation, rad",
}
"""Conditions that the page shows, in words; the others are in the JSON file."""

_UNITS = {"lsb": "counts (lsb)", "m_s2": "m/s²"}

_ROUNDING = 1e-6  # numerical: a share of the combined uncertainty that is nothing

_CORRELATED = 0.9
_MOST_PAIRS = 6
"""Correlations shown: largest ones from this size on, so many at most (of the layout)."""


@dataclass(frozen=True)
class _Row:
    """One line of a table: symbol, meaning, unit, and a cell per input axis or pair of axes."""

    symbol: str
    meaning: str
    unit: str
    cells: tuple[str, ...]


def write_certificate(directory: str | Path, certificate: Certificate) -> dict[str, Path]:
    """Write all files of a certificate to a folder; what stands there is replaced only when all are made."""
    folder = Path(directory)
    page = certificate_html(certificate)
    with atomic_folder(folder) as made:
        certificate.save(made / "certificate.json")
        (made / "certificate.html").write_text(page, encoding="utf-8")
    return {"certificate": folder / "certificate.json", "page": folder / "certificate.html"}


def certificate_html(certificate: Certificate) -> str:
    """Return the certificate as HTML without references to anything outside it."""
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=select_autoescape(default=True, default_for_string=True),
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["symbol"] = _symbol
    return printable(environment.get_template("certificate.html.j2").render(_content(certificate)))


def _symbol(text: str) -> Markup:
    """Symbol or equation with its indices below the line: ``K_ip``, ``K0``."""
    index = r"_([A-Za-zα-ω]+)|(?<=K)(\d)"
    lowered = re.sub(index, lambda found: f"<sub>{found[1] or found[2]}</sub>", str(escape(text)))
    return Markup(lowered)  # noqa: S704  the text was escaped


def _content(certificate: Certificate) -> Mapping[str, Any]:
    both = len(certificate.chips) == 1
    sheet, comparison = certificate.angular_sensor, certificate.comparison
    return {
        "basics": page_basics(),
        "policy": STILL_POLICY,
        "certificate": certificate,
        "unit": _UNITS[certificate.unit],
        "single": both,
        "chips": [_chip(chip, both=both) for chip in certificate.chips],
        "frames": list(dict.fromkeys(chip.frame_meaning for chip in certificate.chips)),
        "conditions": {
            word: certificate.conditions[key] for key, word in _CONDITIONS.items() if key in certificate.conditions
        },
        "statements": _merged(certificate.statements, certificate.chips),
        "missing": list(_missing(certificate.chips).items()),
        "factors": _range([term.coverage_factor for term in certificate.terms if term.coverage_factor is not None]),
        "budget": _budget(certificate),
        "correlations": _correlations(certificate.chips),
        "sheet_rows": [] if sheet is None else list(_sheet_rows(sheet.terms)),
        "comparison_rows": []
        if comparison is None
        else [
            (
                row.name,
                plus_minus(row.value, row.expanded),
                plus_minus(row.other_value, row.other_expanded),
                row.unit,
                f"{row.e_n:+.2f}".replace("-", "−"),
                row.satisfactory,
            )
            for row in comparison.rows
        ],
    }


def _chip(chip: ChipCertificate, *, both: bool) -> Mapping[str, Any]:
    """Tables of a chip; ``both``: in SI units and in those of the field, else in one of them."""
    return {
        "name": chip.chip,
        "channels": chip.channels,
        "model": list(_rows(chip.terms, both=both)),
        "intrinsic": list(_rows(chip.intrinsic, both=both)),
    }


def _rows(terms: Sequence[Term], *, both: bool) -> Iterator[_Row]:
    """Rows of the determined terms: the three axes, or pairs of axes, side by side."""
    groups: dict[str, list[Term]] = {}
    for term in terms:
        groups.setdefault(_kind(term), []).append(term)
    for symbol, group in groups.items():
        if all(term.value is None for term in group):
            continue
        first = group[0]
        units = [(first.unit, 1.0)]
        if first.familiar_unit:
            familiar = (first.familiar_unit, first.familiar_factor)
            units = [*units, familiar] if both else [familiar]
        for line, (unit, factor) in enumerate(units):
            head = ("", "") if line else (symbol, first.meaning)
            yield _Row(*head, unit, tuple(_cell(term, factor) for term in group))


def _kind(term: Term) -> str:
    """Symbol without its axis: ``s`` of ``s_x``, ``φ`` of ``φ_xy``; that of the model as it is."""
    return term.symbol[0] if term.symbol[0] in "srφ" else term.symbol


def _cell(term: Term, factor: float) -> str:
    if term.value is None:
        return "n. d."
    if term.expanded is None:
        return "0 (by definition)" if term.value == 0.0 else plain_number(term.value * factor)
    return plus_minus(term.value * factor, term.expanded * factor)


def _sheet_rows(terms: Sequence[Term]) -> Iterator[tuple[_Row, str]]:
    """Rows of a sheet, axes side by side, each with where it is from; a quantity of the whole has one cell."""
    groups: dict[tuple[str, str], list[Term]] = {}
    for term in terms:
        groups.setdefault((term.symbol, term.meaning), []).append(term)
    for (symbol, meaning), group in groups.items():
        cells = tuple(_cell(term, 1.0) for term in group)
        notes = "; ".join(dict.fromkeys(term.note for term in group if term.note))
        yield _Row(symbol, meaning, group[0].unit, cells), notes


def _missing(chips: Sequence[ChipCertificate]) -> Mapping[str, str]:
    """Symbols that no axis has a value of, with their meanings."""
    terms = [term for chip in chips for term in (*chip.terms, *chip.intrinsic)]
    stated = {_kind(term) for term in terms if term.value is not None}
    return {_kind(term): term.meaning for term in terms if _kind(term) not in stated}


def _merged(statements: Sequence[str], chips: Sequence[ChipCertificate]) -> list[str]:
    """Print a sentence that several chips have with other figures once, with the figures of the first."""
    groups: dict[str, dict[str, str]] = {}
    for statement in statements:
        chip, _, text = statement.partition(": ")
        if chip not in {one.chip for one in chips}:
            chip, text = "", statement
        groups.setdefault(re.sub(r"\d[\d.e−-]*", "", text), {})[chip] = text
    lines = []
    for texts in groups.values():
        first = next(iter(texts.values()))
        others = "" if len(set(texts.values())) == 1 else f" (figures of {next(iter(texts))})"
        lines.append(f"{', '.join(texts)}: {first}{others}".removeprefix(": "))
    return lines


def _range(values: Sequence[float]) -> str:
    low, high = f"{min(values):.2f}", f"{max(values):.2f}"
    return low if low == high else f"{low} to {high}"


def _budget(certificate: Certificate) -> Mapping[str, Any]:
    """Return the budget by source: the largest standard uncertainty of each kind of quantity over axes and chips."""
    kinds = {term.name: _kind(term) for term in certificate.terms}
    stated = {_kind(term) for term in certificate.terms if term.std is not None}
    units = {_kind(term): term.unit for term in certificate.terms if _kind(term) in stated}
    largest: dict[tuple[str, str, str], dict[str, Component]] = {}
    for one in certificate.budget:
        row = largest.setdefault((one.source, one.kind, one.distribution), {})
        kind = kinds[one.quantity]
        if kind not in row or one.std > row[kind].std:
            row[kind] = one
    combined = {
        kind: max(term.std for term in certificate.terms if _kind(term) == kind and term.std is not None)
        for kind in units
    }
    return {
        "kinds": units,
        "rows": [
            (
                *key,
                _freedom(row.values()),
                [_share(row[kind].std, combined[kind]) if kind in row else "" for kind in units],
            )
            for key, row in largest.items()
        ],
        "combined": [f"{combined[kind]:.2g}" for kind in units],
    }


def _share(std: float, combined: float) -> str:
    return f"{std:.2g}" if std > _ROUNDING * combined else "0"


def _freedom(components: Iterable[Component]) -> str:
    values = [component.degrees_of_freedom for component in components]
    finite = [value for value in values if value is not None]
    return f"{min(finite):.3g}" if finite else "∞"


def _correlations(chips: Sequence[ChipCertificate]) -> list[tuple[str, str, str]]:
    """Return the strongest correlations between terms of the model, largest first."""
    found = []
    for chip in chips:
        model = {term.name for term in chip.terms}
        place = [k for k, name in enumerate(chip.correlation_names) if name in model]
        for row, i in enumerate(place):
            for j in place[:row]:
                value = chip.correlation[i][j]
                if abs(value) > _CORRELATED:
                    found.append((abs(value), chip.correlation_names[j], chip.correlation_names[i], value))
    found.sort(key=lambda one: -one[0])
    return [(first, second, f"{value:+.3f}".replace("-", "−")) for _, first, second, value in found[:_MOST_PAIRS]]
