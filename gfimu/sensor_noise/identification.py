"""Identification of noise terms from the Allan variance, with intervals, without inventing terms.

The Allan variance is a sum of terms: quantisation 3Q²/τ², velocity random walk N²/τ, bias instability about
(2 ln 2/π) B², acceleration random walk K²τ/3, ramp R²τ²/2 (IEEE Std 952, annex C). The squares of the coefficients
are fitted by generalised least squares: estimates at different τ share their data, so that the full covariance of the
overlapping estimates is used. It follows from the fitted spectrum (Gaussian noise):

    cov(σ²_a, σ²_b) = (2/T) ∫ S(f)² |H_a(f)|² |H_b(f)|² df,   |H_m|² = 2 sin⁴(πfmδ) / (m² sin²(πfδ)).

A term enters only when it improves the fit more than chance does at 0.01 %; the others get an upper limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import nnls
from scipy.stats import chi2

from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.sensor_noise.allan import AllanDeviation, allan_deviation

__all__ = ["TERMS", "NoiseModel", "NoiseTerm", "identify_noise", "model_variance", "term_spectra"]

Floats = NDArray[np.float64]

TERMS = {
    "Q": ("quantisation", "·s"),
    "N": ("velocity random walk", "/√Hz"),
    "B": ("bias instability", ""),
    "K": ("acceleration random walk", "/√s"),
    "R": ("ramp", "/s"),
}
"""Terms by symbol: name, and unit of the coefficient after that of the readings."""

_ENTRY = 1e-4
_SHORTEST = 200
_PASSES = 4
_FREQUENCIES = 4096
_LARGEST_SHARE = 12


@dataclass(frozen=True)
class NoiseTerm(Declared):
    """One coefficient of the noise; ``symbol`` is a key of `TERMS`."""

    symbol: str
    unit: Annotated[str, figure("Unit of the coefficient.")]
    found: Annotated[bool, figure("Whether the data show it.")]
    value: Annotated[float, figure("Coefficient; zero if not found.")]
    low: Annotated[float, figure("Lower 95 % limit; zero if not found.", key="low_95")]
    high: Annotated[float, figure("Upper 95 % limit.", key="high_95")]
    std: Annotated[float, figure("Standard deviation; null if not found.")]

    @property
    def name(self) -> Annotated[str, figure("Name of the term.", before="unit")]:
        """Name of the term."""
        return TERMS[self.symbol][0]


@dataclass(frozen=True)
class NoiseModel(Declared):
    """Noise terms of one series, with their standard deviations, and the Allan deviation that they were fitted to.

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> model = gfimu.identify_noise(np.random.default_rng(1).normal(size=20000), rate=100.0)
    >>> model.found
    ('N',)
    >>> print(f"N = {model['N'].value:.3f} ± {model['N'].std:.3f} per √Hz")
    N = 0.099 ± 0.000 per √Hz
    """

    terms: Annotated[
        dict[str, NoiseTerm],
        figure(
            "Terms by symbol: Q quantisation, N velocity random walk, B bias instability, K acceleration random walk, "
            "R ramp."
        ),
    ]
    misfit: Annotated[
        float,
        figure(
            "Weighted square of the residuals over their number of degrees of freedom: near 1 where the model holds."
        ),
    ]
    allan: Annotated[AllanDeviation, figure("The curve.", flat=True)]

    __repr__ = short_repr

    def __getitem__(self, symbol: str) -> NoiseTerm:
        return self.terms[symbol]

    @property
    def found(self) -> tuple[str, ...]:
        """Symbols of the terms found."""
        return tuple(symbol for symbol, term in self.terms.items() if term.found)

    def deviation(self, tau: ArrayLike) -> Floats:
        """Allan deviation of the fitted terms at averaging times ``tau``, s."""
        factors = np.asarray(tau, dtype=float) * self.allan.rate
        squares = np.array([self.terms[symbol].value ** 2 for symbol in TERMS])
        return np.sqrt(model_variance(factors, self.allan.rate) @ squares)


def model_variance(factors: ArrayLike, rate: float) -> Floats:
    """Allan variance of each term with coefficient one, columns in the order of `TERMS`, shape (k, 5).

    The forms are those of the sampled series: flicker as `gfimu.sensor_noise.flicker_noise` makes it, the random walk
    summed at the sample rate.
    """
    m = np.atleast_1d(np.asarray(factors, dtype=float))
    tau = m / rate
    random_walk = tau / 3.0 * (1.0 + 0.5 / m**2)
    return np.column_stack([3.0 / tau**2, 1.0 / tau, _flicker_variance(m), random_walk, tau**2 / 2.0])


def term_spectra(f: ArrayLike, rate: float) -> Floats:
    """Two-sided spectral density of each term with coefficient one, rows in the order of `TERMS`, shape (5, k).

    Parameters
    ----------
    f : array_like, shape (k,)
        Frequencies above zero, Hz.
    rate : float
        Sample rate, Hz. The ramp is no noise: its density is zero.
    """
    step = 2.0 * np.sin(np.pi * np.asarray(f, dtype=float) / rate)
    # Quantisation is the difference of white noise: S = Q² (2πf)²/rate at low f, here in its sampled form.
    return np.array(
        [rate * step**2, np.ones_like(step), 1.0 / (rate * step), 1.0 / (rate * step) ** 2, np.zeros_like(step)]
    )


def identify_noise(
    values: ArrayLike, rate: float, *, candidates: Sequence[str] = tuple(TERMS), unit: str = "m_s2"
) -> NoiseModel:
    """Identify the noise terms of a series at rest.

    Parameters
    ----------
    values : array_like, shape (n,)
        Evenly sampled series at rest.
    rate : float
        Sample rate, Hz.
    candidates : sequence of str
        Symbols of the terms that may be in it; N always is.
    unit : str
        Unit of the series: ``m_s2``, ``rad_s`` or ``lsb``.

    Returns
    -------
    NoiseModel

    Raises
    ------
    InputError
        If the series is too short, does not vary, or varies so smoothly that it is no noise.

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> model = gfimu.identify_noise(np.random.default_rng(1).normal(size=20000), rate=100.0)
    >>> model.found
    ('N',)
    """
    try:
        return _identified(values, rate, candidates, unit)
    except np.linalg.LinAlgError:
        raise InputError(
            "the readings vary too smoothly for noise: the unit moves, or they were filtered; give a recording at rest"
        ) from None


def _identified(values: ArrayLike, rate: float, candidates: Sequence[str], unit: str) -> NoiseModel:
    series = np.asarray(values, dtype=float)
    if len(series) < _SHORTEST:
        raise InputError(f"{len(series)} samples are too few to identify noise; {_SHORTEST} or more are needed")
    allan = allan_deviation(series, rate)
    if not allan.deviation[0] > 0.0:
        raise InputError("the readings never change: a stuck channel, or noise below the resolution")
    fit = _Fit(series, rate)
    chosen = ["N"]
    while True:
        best, gain = "", 0.0
        for symbol in TERMS:
            if symbol in chosen or symbol not in candidates:
                continue
            improvement = fit.improvement(chosen, symbol)
            if improvement > gain:
                best, gain = symbol, improvement
        if gain <= chi2.ppf(1.0 - 2.0 * _ENTRY / max(len(candidates) - len(chosen), 1), 1):
            break
        chosen.append(best)
    chosen = fit.without_insignificant(chosen)
    squares, covariance, misfit, freedom = fit.solve(chosen)
    if freedom > 0 and misfit > chi2.ppf(0.999, freedom) / freedom:
        covariance = covariance * misfit
    terms = {}
    for symbol, (_, power) in TERMS.items():
        if symbol in chosen:
            place = chosen.index(symbol)
            std = float(np.sqrt(covariance[place, place]))
            terms[symbol] = _found_term(symbol, unit + power, squares[place], std)
        else:
            limit = fit.upper_limit(chosen, symbol)
            terms[symbol] = NoiseTerm(symbol, unit + power, False, 0.0, 0.0, limit, float("nan"))
    return NoiseModel(terms, misfit, allan)


class _Fit:
    """Generalised least squares on the Allan variance at octave-spaced averaging times."""

    def __init__(self, series: Floats, rate: float) -> None:
        n = len(series)
        self.m = 2 ** np.arange(int(np.log2(n / _LARGEST_SHARE)) + 1)
        self.rate = rate
        self.n = n
        self.variance = allan_deviation(series, rate, factors=self.m).variance
        self.shapes = model_variance(self.m, rate)  # (k, 5)
        self.f = np.geomspace(0.02 * rate / n, 0.5 * rate, _FREQUENCIES)
        self.df = np.gradient(self.f)
        x = np.pi * self.f / rate
        self.filters = 2.0 * np.sin(self.m[:, None] * x) ** 4 / (self.m[:, None] * np.sin(x)) ** 2  # (k, F)
        self.spectra = term_spectra(self.f, rate)

    def covariance(self, squares: Floats, symbols: Sequence[str]) -> Floats:
        """Covariance of the Allan variances when the terms have these squared coefficients, (k, k)."""
        spectrum = sum(
            square * self.spectra[list(TERMS).index(symbol)] for square, symbol in zip(squares, symbols, strict=True)
        )
        shaped = self.filters * spectrum  # two-sided density of the filtered series
        length = (self.n - 2 * self.m + 1) / self.rate
        matrix = 4.0 * (shaped * self.df) @ shaped.T  # both signs of f
        matrix /= np.maximum(length[:, None], length[None, :])
        return np.asarray(matrix + 1e-9 * np.diag(np.diag(matrix)), dtype=np.float64)

    def solve(self, symbols: Sequence[str]) -> tuple[Floats, Floats, float, int]:
        """Squared coefficients, their covariance, misfit per degree of freedom, degrees of freedom."""
        design = self.shapes[:, [list(TERMS).index(symbol) for symbol in symbols]]
        squares, _ = nnls(design / self.variance[:, None], np.ones(len(self.m)))
        if not np.any(squares > 0.0):
            squares[0] = self.variance[0] / design[0, 0]
        for _ in range(_PASSES):
            root = np.linalg.inv(np.linalg.cholesky(self._weights(squares, symbols)))
            white = root @ design
            squares, misfit_root = nnls(white, root @ self.variance)
        covariance = np.asarray(np.linalg.pinv(white.T @ white), dtype=np.float64)
        freedom = len(self.m) - len(symbols)
        return squares, covariance, float(misfit_root**2) / max(freedom, 1), freedom

    def _weights(self, squares: Floats, symbols: Sequence[str]) -> Floats:
        """Covariance to weight with; a ramp is no noise and does not add to it."""
        floor = np.where(squares > 0.0, squares, 0.0)
        if not np.any(floor[[symbol != "R" for symbol in symbols]] > 0.0):
            floor = floor + 1e-12 * self.variance.max()
        return self.covariance(floor, symbols)

    def improvement(self, chosen: Sequence[str], symbol: str) -> float:
        """Drop of the weighted residual square when a term is added, both weighted as if it were absent."""
        squares, _, _, _ = self.solve(chosen)
        root = np.linalg.inv(np.linalg.cholesky(self._weights(squares, chosen)))
        order = list(TERMS)
        before = nnls(root @ self.shapes[:, [order.index(s) for s in chosen]], root @ self.variance)[1]
        after = nnls(root @ self.shapes[:, [order.index(s) for s in (*chosen, symbol)]], root @ self.variance)[1]
        return float(before**2 - after**2)

    def without_insignificant(self, chosen: list[str]) -> list[str]:
        """Drop terms that others, entered later, have made superfluous."""
        kept = list(chosen)
        while len(kept) > 1:
            squares, covariance, _, _ = self.solve(kept)
            ratio = squares / np.sqrt(np.diag(covariance))
            weakest = int(np.argmin(ratio))
            others = [symbol for symbol in kept if symbol != kept[weakest]]
            if squares[weakest] > 0.0 and self.improvement(others, kept[weakest]) > chi2.ppf(1.0 - 2.0 * _ENTRY, 1):
                break
            kept = others
        return kept

    def upper_limit(self, chosen: Sequence[str], symbol: str) -> float:
        """95 % upper limit of the coefficient of an absent term."""
        squares, covariance, _, _ = self.solve([*chosen, symbol])
        return float(np.sqrt(squares[-1] + 1.645 * np.sqrt(covariance[-1, -1])))


def _found_term(symbol: str, unit: str, square: float, std: float) -> NoiseTerm:
    value = float(np.sqrt(square))
    low = float(np.sqrt(max(square - 1.96 * std, 0.0)))
    return NoiseTerm(symbol, unit, True, value, low, float(np.sqrt(square + 1.96 * std)), std / (2.0 * value))


def _flicker_variance(m: Floats) -> Floats:
    """Allan variance of sampled flicker noise with B = 1: from its spectrum, by a substitution smooth at both ends."""
    # u = f/rate; ∫ |H_m|² S df over both signs, S = 1/(2 sin πu): the oscillation of sin⁴ is resolved up to 40/m and
    # replaced by its mean 3/8 above.
    result = np.empty(len(m))
    for index, factor in enumerate(m):
        split = min(40.0 / factor, 0.5)
        u = np.linspace(0.0, split, 8001)[1:]
        low = 2.0 * np.sin(np.pi * u * factor) ** 4 / (factor * np.sin(np.pi * u)) ** 2 / np.sin(np.pi * u)
        total = float(np.trapezoid(np.concatenate([[0.0], low]), np.concatenate([[0.0], u])))
        if split < 0.5:
            v = np.geomspace(split, 0.5, 400)
            total += float(np.trapezoid(0.75 / (factor * np.sin(np.pi * v)) ** 2 / np.sin(np.pi * v), v))
        result[index] = total
    return result
