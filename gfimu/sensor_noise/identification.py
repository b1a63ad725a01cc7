"""Identification of noise terms by the likelihood of a record's cosine transform, without inventing terms.

The DCT-II turns a record into numbers c_k, k = 1 … n − 1, that are independent: exactly for white noise and a random
walk, because the cosines are the eigenvectors of their inverse covariance; to a few percent for flicker and
quantisation. The variance of c_k is rate · S(k rate/2n), S the sum of the spectral densities of the terms (IEEE Std
952, annex C). Its mean is that of the deterministic terms, a ramp R t and an exponential settling S exp(−t/τ). The
c_k are pooled in bands of half an octave, and the likelihood is maximised over all terms at once (P. Whittle,
"Estimation and information in stationary time series", Ark. Mat. 2, 1953; restricted likelihood where the ramp and the
settling are nuisance parameters). Frequencies that a filter or a tone shapes are left out: the terms are fitted up to
the highest frequency at which they agree with the record.

A term is found when the likelihood, maximised over all the others, drops without it by more than chance explains.
Where it drops only without each of several terms, the record shows one of them and cannot separate them, such as a
drift R and one excursion of a random walk K: each then names the others. Intervals are those of the profile likelihood
with every term free, so that they include what cannot be separated.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import combinations, product
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.fft import dct
from scipy.optimize import brentq, nnls
from scipy.stats import chi2, f

from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.sensor_noise.allan import AllanDeviation, allan_deviation
from gfimu.sensor_noise.missing import filled

__all__ = ["TERMS", "NoiseModel", "NoiseTerm", "identify_noise", "model_variance", "term_spectra"]

Floats = NDArray[np.float64]

TERMS = {
    "Q": ("quantisation", "·s"),
    "N": ("velocity random walk", "/√Hz"),
    "B": ("bias instability", ""),
    "K": ("acceleration random walk", "/√s"),
    "R": ("ramp", "/s"),
    "S": ("settling", ""),
}
"""Terms by symbol: name, and unit of the coefficient after that of the readings. R and S are deterministic."""

_RANDOM, _DRIFTS = 4, ("R", "S")  # terms with a spectrum come first; the others are deterministic
_SLOW = ("B", "K", *_DRIFTS)
_NORMAL_95 = 1.96  # numerical: half the 95 % interval of a normal number


@dataclass(frozen=True)
class _Policy:
    """What the identification of noise terms decides by."""

    shortest: int = 200  # samples; fewer give too few bands for the terms
    entry: float = 0.005  # probability that chance brings in a slow term: B, K, R or S
    quantised: float = 1e-4  # the same for Q, which few accelerometers have: they don't integrate
    drift_freedom: float = 4.0  # degrees of freedom of the noise beside a drift: of the lowest coefficients
    fit: float = 0.001  # probability at which the levels of the bands contradict the terms
    bands_per_octave: int = 2
    single: int = 4  # lowest coefficients, each a band of its own
    fewest_bands: int = 12  # below the highest frequency that is used
    settling: tuple[float, ...] = tuple(0.5 * 2.0 ** (-k / 3.0) for k in range(13))  # time constants, of the record
    smooth: float = 50.0  # mean square of the misfit at which a series without white noise is a motion
    iterations: int = 100  # numerical
    step: float = 0.1  # numerical: first step of the search for the end of an interval
    flicker_limit: float = 256.0  # numerical: samples beyond which its Allan variance is constant to 1e-5


_POLICY = _Policy()


@dataclass(frozen=True)
class NoiseTerm(Declared):
    """One coefficient of the noise; ``symbol`` is a key of `TERMS`.

    Its 95 % limits are those of the profile likelihood, all other terms free.
    """

    symbol: str
    unit: Annotated[str, figure("Unit of the coefficient.")]
    found: Annotated[bool, figure("Whether the record shows it, whatever the other terms are.")]
    value: Annotated[float, figure("Coefficient; zero if not found.")]
    low: Annotated[float, figure("Lower 95 % limit; zero if not found.", key="low_95")]
    high: Annotated[float, figure("Upper 95 % limit.", key="high_95")]
    std: Annotated[float, figure("Standard deviation, a quarter of the interval; null if not found.")]
    fitted: Annotated[float, figure("Coefficient in the model of fewest terms that fits; zero if not needed.")]
    rivals: Annotated[
        tuple[str, ...],
        figure("Terms not separable from it, where the record shows it or one of them; empty where it shows none."),
    ]

    @property
    def name(self) -> Annotated[str, figure("Name of the term.", before="unit")]:
        """Name of the term."""
        return TERMS[self.symbol][0]

    @property
    def reason(self) -> Annotated[str, figure("Why the term is reported so, in words.", before="unit")]:
        """Why the term is reported so, in words."""
        if self.found:
            return "seen"
        cause = f"not separable from {' or '.join(self.rivals)}: the record shows one" if self.rivals else "not seen"
        return f"{cause}; below {self.high:.2g} at 95 %"


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
            "R ramp, S settling (amplitude at the start of an exponential)."
        ),
    ]
    misfit: Annotated[
        float,
        figure(
            "Weighted square of the residuals over their number of degrees of freedom: near 1 where the model holds."
        ),
    ]
    highest_hz: Annotated[
        float, figure("Frequency up to which the terms were fitted; above, filters or tones shape the noise.", "Hz")
    ]
    settling_time_s: Annotated[float, figure("Time constant of the settling that fits best.", "s")]
    allan: Annotated[AllanDeviation, figure("The curve.", flat=True)]

    __repr__ = short_repr

    def __getitem__(self, symbol: str) -> NoiseTerm:
        return self.terms[symbol]

    @property
    def found(self) -> tuple[str, ...]:
        """Symbols of the terms found."""
        return tuple(symbol for symbol, term in self.terms.items() if term.found)

    def deviation(self, tau: ArrayLike) -> Floats:
        """Allan deviation of the fitted terms, settling apart, at averaging times ``tau``, s."""
        factors = np.asarray(tau, dtype=float) * self.allan.rate
        return np.sqrt(model_variance(factors, self.allan.rate) @ self.fitted_squares)

    @property
    def fitted_squares(self) -> Floats:
        """Squares of the fitted coefficients in the order of `TERMS`, shape (6,)."""
        return np.array([term.fitted**2 for term in self.terms.values()])


def model_variance(factors: ArrayLike, rate: float) -> Floats:
    """Allan variance of each term with coefficient one, columns in the order of `TERMS`, shape (k, 6).

    The forms are those of the sampled series: flicker as `gfimu.sensor_noise.flicker_noise` makes it, the random walk
    summed at the sample rate. Settling is zero, because its curve depends on its time constant.
    """
    m = np.atleast_1d(np.asarray(factors, dtype=float))
    tau = m / rate
    random_walk = tau / 3.0 * (1.0 + 0.5 / m**2)
    return np.column_stack(
        [3.0 / tau**2, 1.0 / tau, _flicker_variance(m), random_walk, tau**2 / 2.0, np.zeros_like(tau)]
    )


def term_spectra(f: ArrayLike, rate: float) -> Floats:
    """Two-sided spectral density of each term with coefficient one, rows in the order of `TERMS`, shape (6, k).

    Parameters
    ----------
    f : array_like, shape (k,)
        Frequencies above zero, Hz.
    rate : float
        Sample rate, Hz. Ramp and settling are no noise: their density is zero.
    """
    step = 2.0 * np.sin(np.pi * np.asarray(f, dtype=float) / rate)
    none = np.zeros_like(step)
    # Quantisation is the difference of white noise: S = Q² (2πf)²/rate at low f, here in its sampled form.
    return np.array([rate * step**2, np.ones_like(step), 1.0 / (rate * step), 1.0 / (rate * step) ** 2, none, none])


def identify_noise(values: ArrayLike, rate: float, *, unit: str = "m_s2") -> NoiseModel:
    """Identify the noise terms of a series at rest.

    Parameters
    ----------
    values : array_like, shape (n,)
        Evenly sampled series at rest. Isolated values may be missing (NaN) or wrong: they are left out.
    rate : float
        Sample rate, Hz.
    unit : str
        Unit of the series: ``m_s2``, ``rad_s`` or ``lsb``.

    Returns
    -------
    NoiseModel

    Raises
    ------
    InputError
        If the series is too short, lacks too many values, does not vary, or varies so smoothly that it is no noise.

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> model = gfimu.identify_noise(np.random.default_rng(1).normal(size=20000), rate=100.0)
    >>> model.found
    ('N',)
    """
    series = np.asarray(values, dtype=float)
    if len(series) < _POLICY.shortest:
        raise InputError(f"{len(series)} samples are too few to identify noise; {_POLICY.shortest} or more are needed")
    series, present = filled(series)
    allan = allan_deviation(series, rate)
    if not allan.deviation[0] > 0.0:
        raise InputError("the readings never change: a stuck channel, or noise below the resolution")
    whole = _agreeing(series, rate, present)
    if whole.misfit > _POLICY.smooth and not whole.maximum(TERMS, True)[1][1] > 0.0:
        raise InputError(
            "the readings vary too smoothly for noise: the unit moves, or they were filtered; give a recording at rest"
        )
    quantised = whole.drop("Q") > _chance("Q", _POLICY.quantised)
    spectrum = whole if quantised else replace(whole, terms=("N", *_SLOW))
    groups = spectrum.seen_groups()
    sizes = spectrum.simplest(groups)
    terms = {}
    for symbol, (_, power) in TERMS.items():
        together = {one for group in groups if symbol in group for one in group}
        found, size = together == {symbol}, sizes.get(symbol, 0.0)
        low, high = (spectrum if symbol in spectrum.terms else whole).interval(symbol)
        low, high = min(low, size) if found else 0.0, max(high, size)
        std = (high - low) / (2.0 * _NORMAL_95) if found else math.nan
        rivals = tuple(one for one in TERMS if one in together - {symbol})
        terms[symbol] = NoiseTerm(symbol, unit + power, found, size * found, low, high, std, size, rivals)
    highest_hz = 0.5 * rate * float(spectrum.count.sum()) / (len(series) - 1)
    settling_s = spectrum.settling_s if terms["S"].fitted else math.nan
    return NoiseModel(terms, spectrum.misfit, highest_hz, settling_s, allan)


@dataclass(frozen=True)
class _Spectrum:
    """Energies of a record's cosine transform in b bands, and the likelihood of the terms.

    Parameters
    ----------
    count : ndarray, shape (b,)
        Coefficients c_k in each band.
    shapes : ndarray, shape (b, 4)
        Mean variance of a coefficient by Q, N, B and K of one.
    energy : ndarray, shape (b,)
        Sums of c².
    cross : ndarray, shape (b, 2)
        Sums of c times the transforms of R and S of one.
    gram : ndarray, shape (b, 2, 2)
        Sums of the products of these transforms.
    settling_s : float
        Time constant of S, s.
    misfit : float
        Mean square of the residuals; above what chance explains, the likelihood is divided by it.
    scale : float
        That divisor.
    terms : tuple of str
        Terms that are free: Q only where it was seen, as it is confounded with N.
    """

    count: Floats
    shapes: Floats
    energy: Floats
    cross: Floats
    gram: Floats
    settling_s: float
    misfit: float = 1.0
    scale: float = 1.0
    terms: tuple[str, ...] = tuple(TERMS)

    def power(self, drifts: Floats) -> Floats:
        """Energies without R and S of the given coefficients, (b,)."""
        energy = self.energy - 2.0 * self.cross @ drifts + self.gram @ drifts @ drifts
        return np.asarray(np.maximum(energy, 0.0), dtype=np.float64)

    def maximum(self, symbols: Collection[str], restricted: bool, **fixed: float) -> tuple[float, Floats]:
        """Maximise the likelihood over the coefficients of ``symbols`` by Fisher's scoring.

        Parameters
        ----------
        symbols : collection of str
            Free terms; the others are absent.
        restricted : bool
            Integrate over R and S where they are free, so that estimating them doesn't lower K.
        **fixed : float
            Coefficients of terms that are not free.

        Returns
        -------
        loglik : float
        coefficients : ndarray, shape (6,)
            Squares of Q, N, B and K; R and S.
        """
        random = [place for place, symbol in enumerate(TERMS) if symbol in symbols and symbol not in _DRIFTS]
        drifts = [place for place, symbol in enumerate(_DRIFTS) if symbol in symbols]
        shapes, gram = self.shapes[:, random], self.gram[:, drifts][:, :, drifts]
        held = np.array([fixed.get(symbol, 0.0) for symbol in TERMS])
        held[:_RANDOM] **= 2
        given, free_cross = self.shapes @ held[:_RANDOM], (self.cross - self.gram @ held[_RANDOM:])[:, drifts]

        def scored(variance: Floats, weight: Floats) -> Floats:
            x = held.copy()
            information = np.einsum("bij,b->ij", gram, 1.0 / variance)
            x[[_RANDOM + place for place in drifts]] = np.linalg.solve(information, (1.0 / variance) @ free_cross)
            level = self.power(x[_RANDOM:])
            if restricted:
                level = level + np.einsum("bij,ij->b", gram, np.linalg.inv(information))
            x[random] = nnls(shapes * weight[:, None], (level / self.count - given) * weight)[0]
            return x

        def loglik(x: Floats) -> float:
            variance = self.shapes @ x[:_RANDOM]
            if not np.all(variance > 0.0):
                return -math.inf
            value = -0.5 * float(np.sum(self.count * np.log(variance) + self.power(x[_RANDOM:]) / variance))
            return value - 0.5 * restricted * float(np.linalg.slogdet(np.einsum("bij,b->ij", gram, 1.0 / variance))[1])

        mean = self.energy / self.count
        x = scored(np.ones(len(mean)), 1.0 / (mean + given))
        if not np.isfinite(loglik(x)):
            x[1] += float(mean.mean())
        best = loglik(x)
        for _ in range(_POLICY.iterations):
            variance, step = self.shapes @ x[:_RANDOM], 1.0
            ahead = scored(variance, np.sqrt(self.count) / variance) - x
            while (higher := loglik(x + step * ahead)) < best and step > 1e-3:  # numerical
                step /= 2.0
            gain = higher - best
            if gain > 0.0:
                x, best = x + step * ahead, higher
            if gain < 1e-4:  # numerical
                break
        return best, x

    @cached_property
    def _free(self) -> tuple[tuple[float, Floats], tuple[float, Floats]]:
        """Maxima with every term free: of the likelihood, and of the restricted one."""
        return self.maximum(self.terms, False), self.maximum(self.terms, True)

    def drop(self, absent: Collection[str], **fixed: float) -> float:
        """Twice the drop of the logarithm of the likelihood where terms are absent or fixed."""
        restricted = not {"R", "S"} & {*absent, *fixed}  # comparable where the same R and S are integrated over
        lower, _ = self.maximum(set(self.terms) - {*absent, *fixed}, restricted, **fixed)
        return max(2.0 * (self._free[restricted][0] - lower) / self.scale, 0.0)

    def seen_groups(self) -> list[frozenset[str]]:
        """Smallest groups of terms that cannot all be absent, by a closed test (Marcus, Peritz & Gabriel, 1976).

        A group is tested only where every larger one was seen, so that chance brings in a term with the probability of
        one test.
        """
        seen: set[frozenset[str]] = set()
        for size in range(len(_SLOW), 0, -1):
            for group in map(frozenset, combinations(_SLOW, size)):
                larger = [group | {other} for other in _SLOW if other not in group]
                if seen.issuperset(larger) and self.drop(group) > _chance(group, _POLICY.entry):
                    seen.add(group)
        smallest = [group for group in seen if not any(smaller < group for smaller in seen)]
        return [frozenset(symbol) for symbol in self.terms if symbol not in _SLOW] + smallest

    def simplest(self, groups: Sequence[frozenset[str]]) -> dict[str, float]:
        """Fit the fewest terms that hold one of every group, the likeliest of them; return sizes by symbol."""
        choices = {frozenset(choice) for choice in product(*groups)}
        fewest = [choice for choice in choices if len(choice) == min(map(len, choices))]
        _, x = self.maximum(max(fewest, key=lambda choice: self.maximum(choice, False)[0]), True)
        return dict(zip(TERMS, np.concatenate([np.sqrt(x[:_RANDOM]), np.abs(x[_RANDOM:])]).tolist(), strict=True))

    def interval(self, symbol: str) -> tuple[float, float]:
        """95 % interval of the size of a term by the profile likelihood."""
        place, drift = list(TERMS).index(symbol), symbol in _DRIFTS
        x = self._free[not drift][1]
        centre, floor = (float(x[place]), -math.inf) if drift else (math.sqrt(x[place]), 0.0)
        shares = self.gram[:, place - _RANDOM, place - _RANDOM] if drift else self.shapes[:, place]
        step = _POLICY.step / math.sqrt(
            np.max(shares / (self.shapes @ x[:_RANDOM]))
        )  # of what would be the whole noise

        def excess(size: float) -> float:
            return math.sqrt(self.drop((), **{symbol: size})) - math.sqrt(_chance(symbol, 0.05))

        ends = []
        for side in (-step, step):
            outer = max(centre + side, floor)
            while excess(outer) < 0.0 and outer > floor:
                outer = max(2.0 * outer - centre, floor)
            ends.append(brentq(excess, centre, outer, rtol=1e-5) if excess(outer) > 0.0 else floor)
        low, high = sorted(map(abs, ends))
        return low if ends[0] * ends[1] > 0.0 else 0.0, high


def _chance(group: Collection[str], probability: float) -> float:
    """Drop of the likelihood that chance exceeds: χ², and for R and S as Student's t, because K is uncertain."""
    size, few = len(group), _POLICY.drift_freedom
    if not set(_DRIFTS).issuperset(group):
        return float(chi2.isf(probability, size))
    return float((few + size) * math.log1p(size / few * f.isf(probability, size, few)))


def _agreeing(series: Floats, rate: float, present: float) -> _Spectrum:
    """Return the bands up to the highest frequency at which the terms agree with the record, with an octave of margin.

    ``present`` is the share of the values that were not filled; fast noise is missing from those that were.
    """
    edges, count, shapes, drifts, grams, constants = _design(len(series), rate)
    c = dct(series - series.mean(), norm="ortho")[1:]
    energy, cross = (np.add.reduceat(x, edges, axis=-1) for x in (c**2, c * drifts))
    shapes = shapes * np.where(np.arange(_RANDOM) < 2, present, 1.0)
    tried: list[_Spectrum] = []
    agreed = True
    for top in range(len(energy), min(len(energy), _POLICY.fewest_bands) - 1, -_POLICY.bands_per_octave):
        settlings = [
            _Spectrum(count[:top], shapes[:top], energy[:top], cross[[0, place], :top].T, gram[:top], constant)
            for place, (constant, gram) in enumerate(zip(constants, grams, strict=True), 1)
        ]
        spectrum = max(settlings, key=lambda one: one.maximum(TERMS, False)[0])
        _, x = spectrum.maximum(TERMS, True)
        # Levels of the bands as normal numbers by their cube root: E. B. Wilson & M. M. Hilferty, PNAS 17:684, 1931.
        level, spread = spectrum.power(x[_RANDOM:]) / (spectrum.shapes @ x[:_RANDOM]), 2.0 / (9.0 * spectrum.count)
        freedom = max(top - len(TERMS), 1)
        misfit = float(np.sum((np.cbrt(level / spectrum.count) - 1.0 + spread) ** 2 / spread)) / freedom
        spectrum = replace(spectrum, misfit=misfit)
        tried.append(spectrum)
        before, agreed = agreed, misfit < chi2.isf(_POLICY.fit, freedom) / freedom
        if before and agreed:
            return spectrum
    return replace(tried[0], scale=tried[0].misfit)


@lru_cache(maxsize=2)
def _design(n: int, rate: float) -> tuple[Any, ...]:
    """Return what the bands of records of one length and rate have in common.

    Returns
    -------
    edges : ndarray of int, shape (b,)
        First coefficient of each band.
    count : ndarray, shape (b,)
    shapes : ndarray, shape (b, 4)
    drifts : ndarray, shape (1 + s, n − 1)
        Transforms of R and, for each of s time constants, of S.
    grams : list of ndarray, shape (b, 2, 2)
    constants : ndarray, shape (s,)
        Time constants, s.
    """
    octaves = np.arange(0.0, np.log2(n / _POLICY.single), 1.0 / _POLICY.bands_per_octave)
    edges = np.concatenate([np.arange(_POLICY.single), np.round(_POLICY.single * 2.0**octaves)])
    edges = np.unique(edges[edges < n - 2].astype(int))
    count = np.diff(np.append(edges, n - 1)).astype(float)
    spectra = term_spectra(np.arange(1, n) * rate / (2 * n), rate)[:_RANDOM]
    t, constants = np.arange(n) / rate, n / rate * np.array(_POLICY.settling)
    drifts = dct(np.array([t, *(np.exp(-t / constant) for constant in constants)]), norm="ortho")[:, 1:]
    grams = [np.add.reduceat(d * d[:, None], edges, axis=-1).T for d in (drifts[[0, k]] for k in range(1, len(drifts)))]
    shapes = rate * np.add.reduceat(spectra, edges, axis=1).T / count[:, None]
    return edges, count, shapes, drifts, grams, constants


def _flicker_variance(m: Floats) -> Floats:
    """Allan variance of sampled flicker noise with B = 1: ∫ |H_m|² S df with S = 1/(2 sin πu), constant for large m."""
    u = np.linspace(0.0, 0.5, 8001)[1:]  # f/rate
    m = np.minimum(m, _POLICY.flicker_limit)[:, None]
    density = 2.0 * np.sin(np.pi * u * m) ** 4 / (m * np.sin(np.pi * u)) ** 2 / np.sin(np.pi * u)
    return np.asarray(density.sum(axis=1) * u[0] - density[:, -1] * u[0] / 2.0, dtype=np.float64)
