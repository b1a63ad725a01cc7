"""Dependence: on what the residual depends, tested against the noise with every look counted.

Each quantity (rate, table angle, temperature, …) becomes one or two regressors. Residual and regressors are divided by
the noise's spectrum in the cosine basis, where inner products are plain sums; a constant is projected out. The F
statistic of the regression is compared with chance after Bonferroni's correction for all quantities and channels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.stats import f as f_distribution

from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.policy import Policy

__all__ = ["BINS", "Dependence", "Fingerprint", "Quantity", "dependences", "fingerprint", "listed", "quantities"]

_HIGHEST_ORDER = 12  # numerical: cycles per revolution that are looked at
BINS = 40
"""Numerical: of a plot."""
_FEWEST_IN_BIN = 5  # numerical: samples in each of them
_FEWEST_SAMPLES = 50  # numerical: for a regression


@dataclass(frozen=True)
class Quantity:
    """Something that the residual may depend on.

    Parameters
    ----------
    name : str
        For people: ``"the rate squared"``.
    symbol : str
        For axes: ``"ω²"``.
    unit : str
        Unit of ``at``.
    view : str
        View that shows it: time, rate, rate squared, acceleration, angle, temperature, reading.
    regressors : tuple of ndarray, each (n,) or (n, c)
        Functions of it that the residual is regressed on.
    at : ndarray, shape (n,) or (n, c)
        Where a plot puts each sample.
    """

    name: str
    symbol: str
    unit: str
    view: str
    regressors: tuple[NDArray[np.float64], ...]
    at: NDArray[np.float64]


@dataclass(frozen=True)
class Dependence:
    """The residual as a function of one quantity.

    Parameters
    ----------
    quantity : str
        Name for people.
    symbol, unit : str
        For the axis.
    view : str
        See `Quantity`.
    centres : ndarray, shape (b, c)
        Bins of the quantity.
    before, after : ndarray, shape (b, c)
        Mean residual per bin and channel, m/s²; NaN in bins with too few samples.
    amplitude_before : ndarray, shape (c,)
        Rms of the part of the residual before that follows the quantity, m/s².
    share_before : ndarray, shape (c,)
        Share of the residual beyond noise that it is, 0 to 1.
    p_before, p_after : ndarray, shape (c,)
        Probability of as much dependence by chance, for one look.
    looks : int
        Number of looks over all quantities and channels.
    sentence : str
        What matters, or empty.
    """

    quantity: str
    symbol: str
    unit: str
    view: str
    centres: NDArray[np.float64]
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    amplitude_before: NDArray[np.float64]
    share_before: NDArray[np.float64]
    p_before: NDArray[np.float64]
    p_after: NDArray[np.float64]
    looks: int
    sentence: str

    @property
    def strength(self) -> float:
        """Power of the residual that follows the quantity, over all channels, (m/s²)²."""
        return float(np.nansum(self.amplitude_before**2))


@dataclass(frozen=True)
class Fingerprint:
    """How strongly each channel follows each basic term beside all others, in standard deviations of chance, signed.

    ``before`` and ``after`` have the shape (c, k): c channels, k terms.
    """

    channels: tuple[str, ...]
    terms: tuple[str, ...]
    before: NDArray[np.float64]
    after: NDArray[np.float64]


def quantities(run: RunView) -> list[Quantity]:
    """Return what a run's residual may depend on; quantities that hardly vary are left out."""
    since = run.t - run.t[0]
    scaled = 2 * since / max(since[-1], 1e-12) - 1
    rate, acceleration = run.rate, run.acceleration
    word, omega, alpha, unit = ("speed", "v", "a", "m") if run.linear else ("rate", "ω", "α", "rad")
    kind = "" if run.linear else "angular "
    found = [
        Quantity("time", "t", "s", "time", (scaled, scaled**2), since),
        Quantity(f"the {word}", omega, f"{unit}/s", "rate", (rate,), rate),
        Quantity(f"the {word} squared", f"{omega}²", f"{unit}²/s²", "rate squared", (rate**2,), rate**2),
        Quantity(f"the {kind}acceleration", alpha, f"{unit}/s²", "acceleration", (acceleration,), acceleration),
        Quantity(
            "its own reading (as predicted)",
            "reading",
            "m/s²",
            "reading",
            (run.before, run.before**2),
            run.before,
        ),
    ]
    if run.temperature is not None:
        warm = run.temperature
        found.append(Quantity("the temperature", "T", "°C", "temperature", (warm - warm.mean(),), warm))
    if np.ptp(run.angle) >= 2 * np.pi and not run.linear:
        turn = np.mod(run.angle, 2 * np.pi)
        for order in range(1, _HIGHEST_ORDER + 1):
            name = f"the table's angle, {_times(order)} per revolution"
            waves = (np.cos(order * run.angle), np.sin(order * run.angle))
            found.append(Quantity(name, "θ", "rad", "angle", waves, turn))
    return [quantity for quantity in found if _varies(quantity)]


def dependences(
    run: RunView,
    channels: Sequence[str],
    gain: NDArray[np.float64],
    before: NDArray[np.float64],
    after: NDArray[np.float64],
) -> tuple[Dependence, ...]:
    """Test the residuals of a run against every quantity.

    Parameters
    ----------
    run : RunView
        The run.
    channels : sequence of str
        Names of the c channels.
    gain : ndarray, shape (n, c)
        What whitens each cosine coefficient (`gfimu.diagnosis.criticism.views.whiteness.whitening_gain`).
    before, after : ndarray, shape (n, c)
        Residuals, m/s²; zero where invalid.
    """
    tested = quantities(run)
    alive = run.valid.any(axis=0)
    looks = len(tested) * max(int(alive.sum()), 1)
    old_residual, new_residual = (_Regressions(run.valid, gain, residual) for residual in (before, after))
    found = []
    for quantity in tested:
        old, new = old_residual.on(quantity.regressors), new_residual.on(quantity.regressors)
        centres, (mean_before, mean_after) = _binned(quantity, run.valid, (before, after))
        sentence = _sentence(quantity, channels, old, new, looks)
        found.append(
            Dependence(
                quantity.name,
                quantity.symbol,
                quantity.unit,
                quantity.view,
                centres,
                mean_before,
                mean_after,
                old.amplitude,
                old.share,
                old.p_value,
                new.p_value,
                looks,
                sentence,
            )
        )
    return tuple(found)


def fingerprint(
    run: RunView,
    channels: Sequence[str],
    gain: NDArray[np.float64],
    before: NDArray[np.float64],
    after: NDArray[np.float64],
) -> Fingerprint:
    """Return the strength of each basic term in each channel before and after."""
    terms: dict[str, NDArray[np.float64]] = {"constant": np.ones_like(run.t), "t": run.t - run.t.mean()}
    if run.linear:
        terms |= {"v": run.rate, "v²": run.rate**2, "a": run.acceleration, "a²": run.acceleration**2, "x": run.angle}
    else:
        terms |= {
            "ω": run.rate,
            "ω²": run.rate**2,
            "ω⁴": run.rate**4,
            "α": run.acceleration,
            "ωα": run.rate * run.acceleration,
            "cos θ": np.cos(run.angle),
            "sin θ": np.sin(run.angle),
            "cos 2θ": np.cos(2 * run.angle),
            "sin 2θ": np.sin(2 * run.angle),
        }
    if run.temperature is not None and np.ptp(run.temperature) > 0:
        terms["T"] = run.temperature - run.temperature.mean()
    design = np.nan_to_num(np.column_stack(list(terms.values())))  # (n, k); a free body has no angle
    scores = [_Regressions(run.valid, gain, residual).together(design) for residual in (before, after)]
    return Fingerprint(tuple(channels), tuple(terms), scores[0], scores[1])


def listed(names: Sequence[str], most: int = 4) -> str:
    """Return names in words: the first few, and how many more."""
    if len(names) > most:
        return f"{', '.join(names[:most])} and {len(names) - most} more"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


@dataclass(frozen=True)
class _Regression:
    """Per channel: rms of the part explained, share of the excess, p-value, signed score."""

    amplitude: NDArray[np.float64]
    share: NDArray[np.float64]
    p_value: NDArray[np.float64]
    score: NDArray[np.float64]


class _Regressions:
    """Residuals in the cosine basis, ready to be regressed on many things."""

    def __init__(self, valid: NDArray[np.bool_], gain: NDArray[np.float64], residual: NDArray[np.float64]) -> None:
        self.valid = valid
        self.weight = gain**2  # (n, c)
        self.target = dct(residual, type=2, norm="ortho", axis=0)
        self.power = np.sum(self.weight * self.target**2, axis=0)
        groups: dict[bytes, list[int]] = {}
        for channel, mask in enumerate(valid.T):
            groups.setdefault(mask.tobytes(), []).append(channel)
        self.groups = list(groups.values())  # channels that share one mask

    def on(self, regressors: Sequence[NDArray[np.float64]]) -> _Regression:
        """Regress each channel on regressors, each (n,) or (n, c), beside a constant; on the constant if none."""
        c = self.target.shape[1]
        out = _Regression(np.zeros(c), np.zeros(c), np.ones(c), np.zeros(c))
        if regressors and regressors[0].ndim == 2:
            for channel in range(c):
                self._fill(out, np.array([channel]), [regressor[:, channel] for regressor in regressors])
            return out
        for channels in self.groups:
            self._fill(out, np.array(channels), regressors)
        return out

    def together(self, design: NDArray[np.float64]) -> NDArray[np.float64]:
        """Regress each channel on all columns (n, k) at once; returns each coefficient over its error, (c, k)."""
        out = np.zeros((self.target.shape[1], design.shape[1]))
        for channels in self.groups:
            valid = self.valid[:, channels[0]]
            scale = np.linalg.norm(design * valid[:, None], axis=0)
            used = np.flatnonzero(scale > 1e-9 * np.sqrt(len(valid)))
            if valid.sum() < max(_FEWEST_SAMPLES, 2 * design.shape[1]):
                continue
            columns = dct(design[:, used] * valid[:, None] / scale[used], type=2, norm="ortho", axis=0)
            for channel in channels:
                weighted = columns * self.weight[:, [channel]]
                gram = columns.T @ weighted
                covariance = np.linalg.inv(gram + 1e-9 * np.trace(gram) * np.eye(len(used)))
                score = weighted.T @ self.target[:, channel]
                coefficients = covariance @ score
                left = max(float(self.power[channel]) - float(score @ coefficients), 0.0)
                variance = max(1.0, left / max(int(valid.sum()) - len(used), 1))
                out[channel, used] = coefficients / np.sqrt(covariance.diagonal() * variance)
        return out

    def _fill(self, out: _Regression, channels: NDArray[np.intp], regressors: Sequence[NDArray[np.float64]]) -> None:
        """Fill in the result of channels that share one mask."""
        valid = self.valid[:, channels[0]]
        count = int(valid.sum())
        if count < _FEWEST_SAMPLES:
            return
        columns = [np.where(valid, regressor - regressor[valid].mean(), 0.0) for regressor in regressors]
        if any(not column.any() for column in columns):
            return
        design = dct(np.column_stack([valid.astype(float), *columns]), type=2, norm="ortho", axis=0)  # (n, k)
        design /= np.linalg.norm(design, axis=0)
        k = design.shape[1]
        weight = self.weight[:, channels]
        pairs = [(i, j) for i in range(k) for j in range(i, k)]
        products = np.column_stack([design[:, i] * design[:, j] for i, j in pairs]).T @ weight  # (pairs, c)
        scores = design.T @ (weight * self.target[:, channels])  # (k, c)
        for index, channel in enumerate(channels):
            gram = np.empty((k, k))
            for (i, j), value in zip(pairs, products[:, index], strict=True):
                gram[i, j] = gram[j, i] = value
            factor = np.linalg.cholesky(gram + 1e-9 * np.trace(gram) * np.eye(k))
            half = np.linalg.solve(factor, scores[:, index])  # (k,): the first is the constant's
            skipped = min(1, k - 1)
            explained = float(np.sum(half[skipped:] ** 2))
            left = max(float(self.power[channel]) - float(half @ half), 0.0)
            # The noise is known: what is left may be more than noise, never less.
            variance = max(1.0, left / max(count - k, 1))
            out.p_value[channel] = f_distribution.sf(explained / (k - skipped) / variance, k - skipped, count - k)
            out.share[channel] = explained / max(explained + left - count, explained, 1e-300)
            out.score[channel] = half[-1] / np.sqrt(variance)
            # Back from whitened to m/s²: the coefficients times the regressors.
            fitted = design[:, skipped:] @ np.linalg.solve(factor.T, half)[skipped:]
            out.amplitude[channel] = np.sqrt(fitted @ fitted / count)


def _sentence(quantity: Quantity, channels: Sequence[str], old: _Regression, new: _Regression, looks: int) -> str:
    """One sentence where a dependence is more than chance and a fair share of what is wrong; else empty."""
    strong = (old.p_value < Policy.chance / looks) & (old.share > Policy.sizeable)
    still = new.p_value < Policy.chance / looks
    names = [channels[k] for k in np.argsort(-old.amplitude) if strong[k]]
    after = (
        f"after: {new.amplitude[still].max():.2g} m/s² left in {_names(channels, still, new)}" if still.any() else ""
    )
    if names:
        top = int(np.argmax(np.where(strong, old.amplitude, -1.0)))
        return (
            f"Before, the residual follows {quantity.name} in {listed(names)} "
            f"({old.amplitude[top]:.2g} m/s² rms in {channels[top]}, "
            f"{100 * old.share[top]:.0f} % of what is beyond noise there); {after or 'after: gone'}."
        )
    if after:
        return f"The residual follows {quantity.name}; {after}."
    return ""


def _names(channels: Sequence[str], chosen: NDArray[np.bool_], regression: _Regression) -> str:
    return listed([channels[k] for k in np.argsort(-regression.amplitude) if chosen[k]])


def _binned(
    quantity: Quantity, valid: NDArray[np.bool_], residuals: Sequence[NDArray[np.float64]]
) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
    """Centres of equal bins of a quantity, and the mean of each residual in them, all of shape (b, c)."""
    at = np.broadcast_to(quantity.at.reshape(len(valid), -1), valid.shape)
    low, high = at.min(axis=0), at.max(axis=0)
    place = np.clip(((at - low) / np.maximum(high - low, 1e-300) * BINS).astype(int), 0, BINS - 1)  # (n, c)
    channels = range(valid.shape[1])
    count = np.column_stack([np.bincount(place[:, k], valid[:, k], BINS) for k in channels])
    means = []
    for residual in residuals:
        total = np.column_stack([np.bincount(place[:, k], residual[:, k], BINS) for k in channels])
        means.append(np.where(count >= _FEWEST_IN_BIN, total / np.maximum(count, 1), np.nan))
    return low + (high - low) * ((np.arange(BINS) + 0.5) / BINS)[:, None], means


def _varies(quantity: Quantity) -> bool:
    first: NDArray[np.float64] = quantity.regressors[0]
    return bool(np.isfinite(first).all() and np.ptp(first, axis=0).max() > 1e-9)


def _times(order: int) -> str:
    words: Mapping[int, str] = {1: "once", 2: "twice"}
    return words.get(order, f"{order} times")
