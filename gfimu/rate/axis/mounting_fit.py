"""The uncertain constants of a mounting, found together with the motion: values, covariance, what stays open."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from gfimu.base.declared import Declared, figure
from gfimu.rate.axis.mounting import Mounting
from gfimu.rate.axis.problem import AxisProblem, Settings
from gfimu.rate.axis.recursion import FilterRun, Slopes

__all__ = ["FittedConstant", "MountingFit", "fit_mounting", "mounting_information"]

_STEPS = 15  # of Gauss and Newton; numerical
_SETTLED = 0.02  # posterior standard deviations: a step below it ends the search; numerical
_OPEN = 0.5  # share of the prior variance of a combination that remains, above which it counts as not determined
_NAMED = 0.1  # coefficient of a combination, in prior standard deviations, below which a constant is not named


@dataclass(frozen=True)
class FittedConstant(Declared):
    """A constant of a mounting that was estimated."""

    name: Annotated[str, figure("Name, with its unit.", head="constant")]
    value: Annotated[float, figure("Correction to the array file, in the unit of the name.", head="value", form="+.4g")]
    std: Annotated[float, figure("Its standard deviation.", head="± std", form=".2g")]
    prior_std: Annotated[float, figure("Its standard deviation before.", head="prior std", form=".2g")]


@dataclass(frozen=True)
class MountingFit(Declared):
    """Posterior of the constants of a mounting that were estimated with the rotation.

    Parameters
    ----------
    mounting : Mounting
        What was uncertain, with its priors.
    values : ndarray, shape (m,)
        Values of greatest posterior density.
    covariance : ndarray, shape (m, m)
        Their covariance.
    density : float
        Log of likelihood times prior (without its constant) there, nats.
    """

    mounting: Mounting
    values: NDArray[np.float64]
    covariance: NDArray[np.float64]
    density: float

    @property
    def constants(self) -> Annotated[list[FittedConstant], figure("The constants.")]:
        """The constants with their standard deviations, before and after."""
        rows = zip(self.mounting.constants, self.values, self.std, strict=True)
        return [FittedConstant(one.name, float(value), float(std), float(one.std)) for one, value, std in rows]

    @property
    def determined_combinations(self) -> Annotated[int, figure("Combinations that these data determine.")]:
        """How many combinations these data determine."""
        return len(self.values) - len(self.undetermined)

    @property
    def std(self) -> NDArray[np.float64]:
        """Standard deviations, shape (m,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def values_of(self, mounting: Mounting) -> NDArray[np.float64]:
        """Return the values for the constants of another mounting, whose inclination contains that found here."""
        found = {one.name: value for one, value in zip(self.mounting.constants, self.values, strict=True)}
        return np.array([0.0 if one.kind == "inclination" else found.get(one.name, 0.0) for one in mounting.constants])

    @property
    def undetermined(
        self,
    ) -> Annotated[
        list[str],
        figure(
            "Combinations that they do not, in units of the prior standard deviations.",
            key="undetermined_combinations_in_prior_std",
        ),
    ]:
        """The combinations of which more than half of the prior variance remains, one line each.

        Each constant counts in units of its prior standard deviation. The combinations span the eigenvectors of the
        posterior covariance with such eigenvalues; each begins with a constant that is in no other.
        """
        prior = self.mounting.prior_std
        values, vectors = np.linalg.eigh(self.covariance / np.outer(prior, prior))
        space = vectors[:, values > _OPEN].T  # (d, m)
        if not len(space):
            return []
        _, triangle, order = qr(space, mode="economic", pivoting=True)
        reduced = np.linalg.solve(triangle[:, : len(space)], triangle)  # identity on the pivots
        names = [self.mounting.constants[place].name for place in order]
        lines = []
        for row in reduced:
            terms = [
                (("− " if value < 0.0 else "+ ") + ("" if np.isclose(abs(value), 1.0) else f"{abs(value):.2g} ") + name)
                for value, name in zip(row, names, strict=True)
                if abs(value) > _NAMED
            ]
            lines.append(" ".join(terms).removeprefix("+ "))
        return lines


def fit_mounting(
    problem: AxisProblem,
    mounting: Mounting,
    settings: Settings,
    start: NDArray[np.float64],
    covariance: NDArray[np.float64],
    first: NDArray[np.float64],
) -> MountingFit:
    """Find the constants of greatest posterior density by Gauss and Newton over all samples.

    The motion is integrated out by the filter; gradient and information of its innovations come from the same pass.

    Parameters
    ----------
    problem : AxisProblem
        Readings; its channels are replaced.
    mounting : Mounting
        The constants and their priors.
    settings : Settings
        Numbers of the filter.
    start, covariance : ndarray, shapes (3,) and (3, 3)
        State before the first sample and its covariance.
    first : ndarray, shape (m,)
        Values to begin with.
    """
    precision = np.diag(1.0 / mounting.prior_std**2)

    def run(values: NDArray[np.float64]) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        try:
            found, information = mounting_information(problem, mounting, settings, start, covariance, values)
        except np.linalg.LinAlgError:  # a point whose equations have no solution is no better than any
            return -np.inf, np.zeros_like(values), precision
        density = found.likelihood - 0.5 * float(values @ precision @ values)
        return density, found.gradient - precision @ values, information

    values = first
    density, gradient, information = run(values)
    for _ in range(_STEPS):
        step = np.linalg.solve(information, gradient)
        size = float(np.sqrt(step @ information @ step / max(len(step), 1)))
        if size < _SETTLED:
            break
        for shrink in (1.0, 0.5, 0.2, 0.05):
            tried = run(values + shrink * step)
            if np.isfinite(tried[0]) and tried[0] > density:
                values = values + shrink * step
                density, gradient, information = tried
                break
        else:
            break
    return MountingFit(mounting, values, np.asarray(np.linalg.inv(information), dtype=np.float64), density)


def mounting_information(
    problem: AxisProblem,
    mounting: Mounting,
    settings: Settings,
    start: NDArray[np.float64],
    covariance: NDArray[np.float64],
    values: NDArray[np.float64],
) -> tuple[FilterRun, NDArray[np.float64]]:
    """Return the filter's run with the constants at given values, and the information on them with their priors (m, m).

    Arguments as those of `fit_mounting`.
    """
    slopes, channels = mounting.slopes(values), mounting.channels(values)
    found = replace(problem, channels=channels).run(
        replace(settings, inclination=mounting.tilt(values)), start, covariance, slopes=slopes
    )
    samples = found.readings / max(problem.y.shape[1], 1)
    by_size = _by_size(slopes, channels.force, settings.hub, settings.noise_scale * problem.noise)
    return found, found.information + samples * by_size + np.diag(1.0 / mounting.prior_std**2)


def _by_size(slopes: Slopes, force: NDArray[np.float64], hub: float, noise: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the information of one sample that lies in the covariance of the readings, ½ tr(R⁻¹ R′ᵢ R⁻¹ R′ⱼ), (m, m).

    The hub's own force enters all channels at once: two chips that read it differently are turned to one another.
    """
    if hub <= 0.0:
        return np.zeros((len(slopes.force), len(slopes.force)))
    precision = np.linalg.inv(hub**2 * force @ force.T + np.diag(noise**2))
    changes = hub**2 * (slopes.force @ force.T)
    changes = precision @ (changes + np.swapaxes(changes, 1, 2))
    return 0.5 * np.einsum("iab,jba->ij", changes, changes)
