"""The lines of a certificate's budget that the stage contributes: type B of every stated quantity."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gfimu.calibration.certificate.certificate import Certificate, Component
from gfimu.calibration.certificate.certify import certify
from gfimu.calibration.certificate.chip_parameters import chip_parameters
from gfimu.calibration.certificate.quantities import stated_quantities
from gfimu.calibration.certificate.stage.simulated_calibration import simulated_method
from gfimu.calibration.certificate.stage.stage import Stage
from gfimu.calibration.certificate.stage.type_b import RUNS, type_b
from gfimu.calibration.certificate.words import intrinsic_terms, model_terms
from gfimu.calibration.result import Calibration

__all__ = ["StageComponents", "stage_components"]


@dataclass(frozen=True)
class StageComponents:
    """What the stage contributes to a certificate.

    Parameters
    ----------
    components : tuple of Component
        Every source that the stage file states, and gravity, of every stated quantity.
    misfit : float
        What of the misfit of the fit they explain (`gfimu.calibration.certificate.certify.certify`,
        ``explained_misfit``).
    statements : tuple of str
        What the budget holds of the stage.
    """

    components: tuple[Component, ...]
    misfit: float
    statements: tuple[str, ...]

    def certify(self, calibration: Calibration, *, components: Iterable[Component] = (), **stated: Any) -> Certificate:
        """Certify a calibration (`gfimu.calibration.certificate.certify`) with these components, and others."""
        both = (*components, *self.components)
        found = certify(calibration, components=both, explained_misfit=self.misfit, **stated)
        return replace(found, statements=(*found.statements, *self.statements))


def stage_components(
    calibration: Calibration, stage: Stage | None, *, rng: np.random.Generator, runs: int = RUNS
) -> StageComponents:
    """Simulate what the errors of the stage and of gravity contribute to the quantities of a certificate.

    Parameters
    ----------
    calibration : Calibration
        Of accelerometers; to that of a gyro a stage contributes nothing.
    stage : Stage, optional
        What the laboratory states; without it, gravity alone contributes.
    rng : numpy.random.Generator
        Random number generator.
    runs : int
        Simulated calibrations per source.
    """
    if calibration.unit == "rad_s":
        return StageComponents((), 0.0, ())
    names = stated_quantities(calibration).names
    units = {
        term.name: term.unit
        for chip in chip_parameters(calibration)
        for term in (*model_terms(chip), *intrinsic_terms(chip))
    }
    found = type_b(calibration, stage or Stage(stage=""), lambda one: stated_quantities(one).values, rng=rng, runs=runs)
    dof = None if stage is None or stage.reliability == 0.0 else 0.5 / stage.reliability**2  # JCGM 100, eq. G.3
    components = tuple(
        Component(name, share.source, "B", "normal", std, units[name], dof)
        for share in found.shares
        for name, std in zip(names, share.standard.tolist(), strict=True)
    )
    return StageComponents(components, found.misfit, tuple(_statements(calibration, stage)))


def _statements(calibration: Calibration, stage: Stage | None) -> Iterator[str]:
    method = simulated_method(calibration)
    if stage is not None:
        yield f"stage: {stage.stage}" + (f"; {stage.source}" if stage.source else "")
    elif method is not None and "face" in method.needs:
        yield "no stage file was given: errors of levelling, angles and mounting are not in the budget"
