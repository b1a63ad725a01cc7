"""From a calibration to its certificate: terms, budget, expanded uncertainties, conditions."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.version import __version__
from gfimu.calibration.certificate.certificate import Certificate, ChipCertificate, Component, Sheet, Term
from gfimu.calibration.certificate.chip_parameters import ChipParameters, chip_parameters
from gfimu.calibration.certificate.coverage import Uncertainty, uncertainties
from gfimu.calibration.certificate.quantities import MODEL_EQUATION, Quantities, intrinsic_quantities, model_quantities
from gfimu.calibration.certificate.words import intrinsic_terms, model_terms
from gfimu.calibration.fit_quality import mean_factor
from gfimu.calibration.result import Calibration

__all__ = ["certify"]

Floats = NDArray[np.float64]

_NOISE = "fit: noise of the readings, priors"
_MISFIT = "fit: misfit of the poses"


def certify(
    calibration: Calibration,
    *,
    components: Iterable[Component] = (),
    explained_misfit: float = 0.0,
    angular_sensor: Sheet | None = None,
    conditions: Mapping[str, str] | None = None,
    date: str = "",
    item: str = "",
    source: str = "calibration",
) -> Certificate:
    """State what a calibration determined, in the terms of the standards.

    Parameters
    ----------
    calibration : Calibration
        Of accelerometers.
    components : iterable of Component
        Further components of the budget, by name of the term (those of type B); what the covariance of the calibration
        already holds must not be among them.
    explained_misfit : float
        What of the misfit of the fit these components explain, vᵀPv over the redundancy; it is not counted again.
    angular_sensor : Sheet, optional
        The array as an angular sensor.
    conditions : mapping of str to str, optional
        Further conditions, by name.
    date, item : str
        When it was calibrated, and what.
    source : str
        File of the calibration, for messages.

    Raises
    ------
    InputError
        If the calibration is of a gyro or has no covariance, or a component names no term or has another unit.
    """
    _check(calibration, source)
    chips = chip_parameters(calibration)
    stated = [(chip, model_quantities(chip), intrinsic_quantities(chip)) for chip in chips]
    blank = [_terms(chip, model, intrinsic) for chip, model, intrinsic in stated]
    units = {term.name: term.unit for terms in blank for one in terms for term in one}
    further = tuple(components)
    _check_components(further, units, source)
    fitted = [part for chip, *parts in stated for part in _fit(calibration, chip.chip, parts, units, explained_misfit)]
    budget = (*fitted, *further)
    known = uncertainties(budget)
    return Certificate(
        item,
        date,
        calibration.method,
        calibration.unit,
        calibration.gravity,
        {**_conditions(calibration), **(conditions or {})},
        tuple(
            _chip(calibration, chip, model + intrinsic, terms, known)
            for (chip, model, intrinsic), terms in zip(stated, blank, strict=True)
        ),
        budget,
        calibration.statements,
        calibration.warnings,
        angular_sensor,
        model_equation=MODEL_EQUATION,
        software=f"gfimu {__version__}",
    )


def _check(calibration: Calibration, source: str) -> None:
    if calibration.unit == "rad_s":
        raise InputError(f"{source}: is of a gyro; a certificate is of accelerometers")
    if not np.any(calibration.covariance):
        raise InputError(f"{source}: the covariance is zero; a certificate needs uncertainties: calibrate again")


def _check_components(components: Iterable[Component], units: Mapping[str, str], source: str) -> None:
    for one in components:
        if one.quantity not in units:
            raise InputError(f"{source}: no term {one.quantity!r} for {one.source!r}; terms: {', '.join(units)}")
        if one.unit != units[one.quantity] or not (math.isfinite(one.std) and one.std >= 0.0):
            raise InputError(
                f"{source}: {one.source!r} of {one.quantity} is {one.std} {one.unit}; "
                f"give a standard uncertainty in {units[one.quantity]}"
            )


def _terms(chip: ChipParameters, model: Quantities, intrinsic: Quantities) -> tuple[tuple[Term, ...], tuple[Term, ...]]:
    """Terms with their values and without uncertainty."""
    defined = {name for name, row in zip(model.names, model.jacobian, strict=True) if not row.any()}
    values = dict(zip((model + intrinsic).names, (model + intrinsic).values.tolist(), strict=True))
    return (
        tuple(_valued(term, values, defined) for term in model_terms(chip)),
        tuple(_valued(term, values, defined) for term in intrinsic_terms(chip)),
    )


def _valued(term: Term, values: Mapping[str, float], defined: set[str]) -> Term:
    if term.name not in values:
        return replace(term, note="not determined")
    note = "zero by definition of the frame" if term.name in defined else ""
    return replace(term, value=values[term.name] + 0.0, note=note)  # 0.0: no −0


def _fit(
    calibration: Calibration, chip: str, parts: Iterable[Quantities], units: Mapping[str, str], explained: float
) -> Iterator[Component]:
    """Components of the fit: its noise, and what the misfit adds to it (degrees of freedom: the redundancy).

    The covariance of the calibration is the cofactor of the noise times a factor that the misfit of the poses gave. The
    share 1 / factor has the many degrees of freedom of the samples, the rest the few of the misfit. What other
    components explain of the misfit is left out.
    """
    factor = max(_statistic(calibration, chip, "covariance_factor", 1.0), 1.0)
    further = _unexplained(calibration, explained, factor)
    freedom = _statistic(calibration, chip, "redundancy", 0.0)
    for part in parts:
        variance = np.diag(part.covariance(calibration.covariance))
        for name, std in zip(part.names, np.sqrt(np.maximum(variance, 0.0)).tolist(), strict=True):
            if std == 0.0:
                continue
            yield Component(name, _NOISE, "A", "normal", std / math.sqrt(factor), units[name])
            if further > 1.0:
                misfit = std * math.sqrt((further - 1.0) / factor)
                yield Component(name, _MISFIT, "A", "t", misfit, units[name], freedom if freedom > 0.0 else None)


def _unexplained(calibration: Calibration, explained: float, factor: float) -> float:
    """Return the factor of the noise that the misfit of all chips gives, less what other components explain of it."""
    freedom = [_statistic(calibration, chip, "redundancy", 0.0) for chip in calibration.chips]
    misfit = [_statistic(calibration, chip, "variance_factor", math.nan) for chip in calibration.chips]
    if explained <= 0.0 or min(freedom) <= 0.0 or not all(map(math.isfinite, misfit)):
        return factor
    return mean_factor(float(np.average(misfit, weights=freedom)), int(sum(freedom)), explained)


def _statistic(calibration: Calibration, chip: str, key: str, default: float) -> float:
    """Statistic of a chip, or of the whole calibration."""
    for name in (f"{chip}_{key}", key):
        value = calibration.statistics.get(name, math.nan)
        if isinstance(value, int | float) and math.isfinite(value):
            return float(value)
    return default


def _chip(
    calibration: Calibration,
    chip: ChipParameters,
    stated: Quantities,
    terms: tuple[tuple[Term, ...], tuple[Term, ...]],
    known: Mapping[str, Uncertainty],
) -> ChipCertificate:
    covariance = stated.covariance(calibration.covariance)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    free = np.flatnonzero(std > 0.0)
    correlation = covariance[np.ix_(free, free)] / np.outer(std[free], std[free])
    model, intrinsic = (tuple(_with_uncertainty(term, known) for term in group) for group in terms)
    return ChipCertificate(
        chip.chip,
        chip.channels,
        chip.frame,
        chip.frame_meaning,
        model,
        intrinsic,
        tuple(stated.names[k] for k in free),
        tuple(map(tuple, correlation.tolist())),
    )


def _with_uncertainty(term: Term, known: Mapping[str, Uncertainty]) -> Term:
    found = known.get(term.name)
    if found is None:
        return replace(term, note=term.note or "no uncertainty in the calibration")
    return replace(
        term,
        std=found.std,
        expanded=found.expanded,
        coverage_factor=found.coverage_factor,
        degrees_of_freedom=found.degrees_of_freedom,
    )


def _conditions(calibration: Calibration) -> dict[str, str]:
    """Return what the calibration was made from: its statistics, those of several chips in one text."""
    found: dict[str, list[float | str]] = {}
    for name, value in calibration.statistics.items():
        chip, _, rest = name.partition("_")
        if isinstance(value, str) or math.isfinite(value):
            found.setdefault(rest if chip in calibration.chips else name, []).append(value)
    return {key: _of_all(values) for key, values in found.items()}


def _of_all(values: Sequence[float | str]) -> str:
    """Return one text for the values of all chips: the value, their range, or all texts."""
    numbers = [value for value in values if not isinstance(value, str)]
    texts = [value for value in values if isinstance(value, str)]
    if not numbers or texts:
        return ", ".join(dict.fromkeys(map(str, values)))
    low, high = f"{min(numbers):.4g}", f"{max(numbers):.4g}"
    return low if low == high else f"{low} to {high}"
