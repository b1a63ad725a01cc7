"""Position error of a unit that stands still, from a recording of one's own (GF-IMU paper, figure 11).

While nothing moves, all that navigation finds is error. Each stretch of rest is cut into windows: a lead, over which
tilt and biases are read off, and the time of navigation after it. Beside the errors stands what the noise of the same
recording predicts. The error is linear in the samples e of the channels: at rest an error of p at time s before the end
moves the position by s, one of α by g s³/6 across it, and the mean over the lead is taken off. With W(f) the spectrum
of these weights, and S(f) that of a term of the noise (`gfimu.sensor_noise`), its share of the variance is
∫ S(f) |W(f)|² df. For white noise after a perfect start these are the laws of `gfimu.budget.drift.closed_forms`.
Tilt also loses gravity, to second order: the fall that this makes is in the prediction of z, which is not Gaussian.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from gfimu.array.array import AccelerometerArray
from gfimu.array.integration import integrate_rate
from gfimu.array.kinematics import pseudo_inverse
from gfimu.base.declared import Declared, Line, Table, figure
from gfimu.base.errors import InputError
from gfimu.base.results import Panel, PlottedResult, Series
from gfimu.base.short_repr import short_repr
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.budget.drift.budget import TILT_LIMIT
from gfimu.budget.drift.closed_forms import position_from_rate
from gfimu.motion.attitude import integrate_attitude, to_rotation
from gfimu.motion.equivalent_errors import equivalent_p_bias, equivalent_rate_drift
from gfimu.motion.navigation import level, navigate
from gfimu.rate.sensing import SensorErrors, calibrated_bias_std
from gfimu.rate.start import start_of_still
from gfimu.recording import Recording
from gfimu.recording.rest import detect_rest
from gfimu.sensor_noise import RecordingNoise, recording_noise
from gfimu.sensor_noise.identification import TERMS, term_spectra

__all__ = ["NoiseResponse", "RestDrift", "rest_drift"]

Floats = NDArray[np.float64]

# Even weights: Simpson's alternating ones would raise the variance of integrated white noise by a ninth.
_METHOD = "centred4"
_TIMES = 60  # at which the prediction is worked out
_PADDING = 4  # numerical: length of the Fourier transform, of that of the weights


@dataclass(frozen=True)
class RestWindow(Declared):
    """One window of a recording at rest."""

    start_s: Annotated[float, figure("Its start.", "s")]
    position_m: Annotated[Floats, figure("Position error at its end, world axes.", "m")]
    predicted_std_m: Annotated[Floats, figure("Standard deviation that the noise predicts.", "m")]


@dataclass(frozen=True)
class RestDrift(Declared, PlottedResult):
    """Position errors of a unit at rest, window by window, beside the prediction from the recording's noise.

    Parameters
    ----------
    start_s : ndarray, shape (w,)
        Start of navigation of each window, s.
    t_s : ndarray, shape (n,)
        Time since the start of navigation, s.
    error_m : ndarray, shape (w, n, 3)
        Position error x, y, z, m: z up, x the heading of the body's x-axis.
    predicted_t_s : ndarray, shape (m,)
        Times of the prediction, s.
    predicted_mean_m, predicted_std_m : ndarray, shape (w, m, 3)
        Mean and standard deviation that the noise predicts for each window, m; the mean is that of the fall.
    noise : RecordingNoise
        Noise of the channels, from the longest rest.
    gravity : float
        Local gravity, m/s².

    Examples
    --------
    >>> import gfimu
    >>> gfimu.drift_of_rest("rest.csv", array="cube12", duration=10.0).rms_m  # doctest: +SKIP
    """

    array: Annotated[str, figure("Name of the array.")]
    time_s: Annotated[float, figure("Time of navigation in each window.", "s")]
    lead_s: Annotated[float, figure("Rest before it, from which tilt and biases are read off.", "s")]
    start_s: Floats
    t_s: Floats
    error_m: Floats
    predicted_t_s: Floats
    predicted_mean_m: Floats
    predicted_std_m: Floats
    tilt_std_rad: Annotated[float, figure("Tilt at the end, 1 σ, in which the prediction is of first order.", "rad")]
    noise: RecordingNoise
    gravity: float

    __repr__ = short_repr

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per window: its start, the final position error and its predicted standard deviation."""
        columns = {"start_s": self.start_s}
        for name, values in (("position", self.final_m), ("predicted_std", self.predicted_std_m[:, -1])):
            columns |= {f"{name}_{axis}_m": values[:, index] for index, axis in enumerate("xyz")}
        return columns

    def _heading(self) -> str:
        return f"Position error of {self.array} at rest after {self.time_s:g} s, biases read off over {self.lead_s:g} s"

    def _facts(self) -> list[tuple[str, str]]:
        low, high = self.ratio_interval
        rms, predicted = (", ".join(f"{one:.3g}" for one in values) for values in (self.rms_m, self.predicted_m))
        return [
            ("windows", str(len(self.start_s))),
            ("error, rms of x, y, z", f"({rms}) m"),
            ("predicted from the noise", f"({predicted}) m"),
            ("error over prediction", f"{self.ratio:.3g} (95 % of right predictions: {low:.2g} to {high:.2g})"),
        ]

    def _panels(self) -> list[Panel]:
        mean = np.mean(self.predicted_mean_m, axis=0)  # (m, 3)
        std = np.sqrt(np.mean(self.predicted_std_m**2, axis=0))
        panels = []
        for place, axis in enumerate("xyz"):
            size, likely_size = self.rms_m[place], self.predicted_m[place]
            predicted = Series(
                f"predicted from the noise, {likely_size:.3g} m",
                mean[:, place],
                std[:, place],
                x=self.predicted_t_s,
                role="noise",
            )
            windows = [
                Series("" if index else f"{len(self.start_s)} windows, rms {size:.3g} m", error[:, place], role=axis)
                for index, error in enumerate(self.error_m)
            ]
            panels.append(Panel(f"position error, {axis}", "m", (predicted, *windows), self.t_s))
        return panels

    @property
    def final_m(self) -> Floats:
        """Position error of each window at the end, shape (w, 3), m."""
        return self.error_m[:, -1]

    @property
    def windows(self) -> Annotated[list[RestWindow], figure("The windows.", before="tilt_std_rad")]:
        """The figures of each window at its end."""
        return [
            RestWindow(*one)
            for one in zip(self.start_s.tolist(), self.final_m, self.predicted_std_m[:, -1], strict=True)
        ]

    @property
    def rms_m(self) -> Annotated[Floats, figure("Position error, rms over the windows.", "m", before="tilt_std_rad")]:
        """Root mean square of the final errors over the windows, shape (3,), m."""
        return np.asarray(np.sqrt(np.mean(self.final_m**2, axis=0)))

    @property
    def predicted_m(
        self,
    ) -> Annotated[Floats, figure("What the noise predicts.", "m", key="predicted_rms_m", before="tilt_std_rad")]:
        """Root mean square that is predicted for the final errors, shape (3,), m."""
        squares = self.predicted_mean_m[:, -1] ** 2 + self.predicted_std_m[:, -1] ** 2
        return np.asarray(np.sqrt(squares.mean(axis=0)))

    @property
    def valid(
        self,
    ) -> Annotated[bool, figure("Whether the prediction, of first order in the tilt, holds.", before="tilt_std_rad")]:
        """Whether the tilt stays within the limit to which the prediction holds."""
        return self.tilt_std_rad <= TILT_LIMIT

    @property
    def ratio(self) -> Annotated[float, figure("Error over prediction, horizontal.", before="tilt_std_rad")]:
        """Root mean square of error over prediction at the end, over windows and the two horizontal axes."""
        return float(np.sqrt(np.mean((self.final_m / self.predicted_std_m[:, -1])[:, :2] ** 2)))

    @property
    def ratio_interval(
        self,
    ) -> Annotated[
        tuple[float, float],
        figure("Interval of that ratio of 95 % of right predictions.", key="ratio_interval_95", before="tilt_std_rad"),
    ]:
        """Interval that holds `ratio` in 95 % of the cases where the prediction is right: √(χ²/k), k = 2 w."""
        k = 2 * len(self.start_s)
        return math.sqrt(chdtri(k, 0.975) / k), math.sqrt(chdtri(k, 0.025) / k)

    @property
    def found_terms(
        self,
    ) -> Annotated[tuple[str, ...], figure("Terms of the noise that were found.", key="noise_terms")]:
        """Symbols of the terms of the noise that were found on a channel."""
        models = self.noise.accelerometers.values()
        return tuple(symbol for symbol in TERMS if any(model[symbol].found for model in models))

    @property
    def p_bias_m_s2(
        self,
    ) -> Annotated[
        Floats,
        figure("Constant bias of p that explains the first window.", "m/s²", key="equivalent_p_bias_m_s2"),
    ]:
        """Constant bias of p that would explain the error of the first window, m/s²."""
        return equivalent_p_bias(self.final_m[0], self.time_s)

    @property
    def rate_drift_deg_h(
        self,
    ) -> Annotated[
        float, figure("Constant drift of the rate that explains it.", "°/h", key="equivalent_rate_drift_deg_h")
    ]:
        """Rate drift that would explain the horizontal error of the first window, °/h (the paper's inversion)."""
        horizontal = math.hypot(*self.final_m[0, :2])
        return float(equivalent_rate_drift(horizontal, self.time_s, gravity=self.gravity))

    def shown(self) -> Iterator[Table | Line]:
        """Yield the errors beside their prediction, and whether they are as predicted."""
        rows = [("first window", self.final_m[0]), ("rms predicted from the noise", self.predicted_m)]
        if len(self.start_s) > 1:
            rows.insert(1, (f"rms of {len(self.start_s)} windows", self.rms_m))
        yield Table(
            f"Position error after {self.time_s:g} s at rest, {self.array}, biases read off over {self.lead_s:g} s, m",
            ("", "x", "y", "z"),
            [(name, *(f"{value:.4g}" for value in values)) for name, values in rows],
        )
        low, high = self.ratio_interval
        good = self.valid and low <= self.ratio <= high
        verdict = "as predicted" if good else "NOT AS PREDICTED" if self.valid else "beyond first order"
        yield Line(
            f"Error over prediction, horizontal, rms over the windows: {self.ratio:.2f}, {verdict} (95 % of right "
            f"predictions: {low:.2f} to {high:.2f}). Terms of the noise found: {', '.join(self.found_terms)}.",
            "" if good else "yellow",
        )
        if not self.valid:
            yield Line(
                f"The prediction is of first order in the tilt, which reaches {self.tilt_std_rad:.2g} rad (1 σ); it "
                f"holds to {TILT_LIMIT} rad: give a shorter --duration.",
                "yellow",
            )
        where = " ".join(f"{value:.4g}" for value in self.final_m[0])
        yield Line(
            f"The first window's error is that of a rate drift of {self.rate_drift_deg_h:.4g} °/h: gfimu drift "
            f"--from-position {where} --duration {self.time_s:g}"
        )


def rest_drift(
    recording: Recording,
    array: AccelerometerArray,
    *,
    time: float = 30.0,
    lead: float = 10.0,
    gravity: float = STANDARD_GRAVITY,
) -> RestDrift:
    """Navigate through every rest of a recording that is long enough, and predict the errors from its noise.

    Parameters
    ----------
    recording : Recording
        Readings in m/s², with one or more rests of ``lead + time`` or more, in any pose.
    array : AccelerometerArray
        Geometry of the channels.
    time, lead : float
        Time of navigation, and of the rest before it over which tilt and biases are read off, s.
    gravity : float
        Local gravity, m/s².

    Raises
    ------
    InputError
        If no rest is long enough (the message has the longest), or the noise can't be identified.
    GeometryError
        If the array can't see all six motions.
    """
    for name, value in (("--duration", time), ("--lead", lead)):
        if not 2.0 <= value * recording.sample_rate < math.inf:
            raise InputError(f"{name} is {value:g} s; it must be two samples or more ({2 / recording.sample_rate:g} s)")
    if not 0.0 < gravity < math.inf:
        raise InputError(f"gravity is {gravity:g} m/s²; it must be a number above zero")
    inverse = pseudo_inverse(array)  # (6, c)
    readings = recording.for_array(array)
    before, after = round(lead * recording.sample_rate), round(time * recording.sample_rate)
    starts = _windows(recording, readings, before + after + 1)
    _refuse_spin(recording, array, [readings[start : start + before] for start in starts])
    noise = recording_noise(recording, gyros=False)
    squares = np.array([noise.models[name].fitted_squares for name in array.channels]).T
    t = np.arange(after + 1, dtype=np.float64) * recording.sample_period
    times = np.linspace(0.0, t[-1], _TIMES + 1)[1:]
    response = NoiseResponse.of(times, before, recording.sample_rate, gravity)
    errors, means, stds, tilts = [], [], [], []
    for start in starts:
        mean = readings[start : start + before].mean(axis=0)
        p = inverse[3:] @ mean
        attitude = level(p)
        up = p / np.linalg.norm(p)
        bias = mean - array.regression_matrix[:, 3:] @ (gravity * up)  # (c,)
        motion = (readings[start + before : start + before + after + 1] - bias) @ inverse.T  # (n, 6)
        omega = integrate_rate(t, motion[:, :3], np.zeros(3), method=_METHOD)
        quaternion = integrate_attitude(t, omega, motion[:, :3], attitude)
        errors.append(navigate(t, motion[:, 3:], quaternion, gravity=gravity, method=_METHOD).position)
        turn = np.kron(np.eye(2), to_rotation(attitude).as_matrix())  # (6, 6): α and p into the world
        drop, spread, tilt = response.prediction(np.einsum("ic,sc,jc->sij", turn @ inverse, squares, turn @ inverse))
        means.append(drop)
        stds.append(np.sqrt(np.einsum("mii->mi", spread)))
        tilts.append(math.sqrt(tilt[-1].max()))
    return RestDrift(
        array.name,
        float(t[-1]),
        lead,
        np.asarray(recording.t_s[np.array(starts) + before]),
        t,
        np.array(errors),
        times,
        np.array(means),
        np.array(stds),
        max(tilts),
        noise,
        gravity,
    )


@dataclass(frozen=True)
class NoiseResponse:
    """How the terms of the noise grow into tilt and position of a unit at rest whose biases were read off before.

    Each integral is of the weights of two outputs times the spectrum of each term with coefficient one.

    Parameters
    ----------
    t_s : ndarray, shape (m,)
        Times since the start of navigation, evenly spaced from the first step on, s.
    once : ndarray, shape (5, m, m)
        Covariance of two integrations between two times: of α in tilt, of p in position, s⁴ per squared coefficient.
    from_alpha, crossed : ndarray, shape (5, m)
        Variance of α in position, and its covariance with that of p.
    gravity : float
        Local gravity, m/s².
    """

    t_s: Floats
    once: Floats
    from_alpha: Floats
    crossed: Floats
    gravity: float

    @classmethod
    def of(cls, t_s: Floats, lead: int, rate: float, gravity: float) -> NoiseResponse:
        """Integrate for times (m,), s, after a lead of so many samples at a rate, Hz."""
        after = np.arange(round(float(t_s[-1]) * rate) + 1) / rate
        left = np.maximum(t_s[:, None] - after, 0.0)  # time from each sample to each end, (m, k)
        weights = np.array([left, gravity * left**3 / 6.0]) / rate  # of two integrations, and of four with gravity
        mean = np.repeat(-weights.sum(axis=2, keepdims=True) / lead, lead, axis=2)
        weights = np.concatenate([mean, weights], axis=2)  # (2, m, k)
        length = _PADDING * weights.shape[2]
        spectra = term_spectra(np.fft.rfftfreq(length, 1.0 / rate)[1:], rate) * (2.0 * rate / length)  # both signs, df
        twice, four = np.fft.rfft(weights, length)[:, :, 1:]  # (m, f)
        once = np.array([((twice * one) @ twice.conj().T).real for one in spectra])
        from_alpha, crossed = spectra @ np.abs(four.T) ** 2, spectra @ (twice * four.conj()).real.T
        ramp, ramp_of_alpha = weights @ np.arange(weights.shape[2]) / rate  # no noise: its slope has an unknown sign
        place = list(TERMS).index("R")
        once[place], from_alpha[place], crossed[place] = np.outer(ramp, ramp), ramp_of_alpha**2, ramp * ramp_of_alpha
        return cls(t_s, once, from_alpha, crossed, gravity)

    def prediction(self, squares: Floats) -> tuple[Floats, Floats, Floats]:
        """Predict the errors that terms of the noise make.

        Parameters
        ----------
        squares : ndarray, shape (6, 6, 6)
            Squared coefficients of the terms, in the order of `gfimu.sensor_noise.identification.TERMS`, as covariance
            of α and p in world axes.

        Returns
        -------
        mean : ndarray, shape (m, 3)
            Mean position error, m: tilt ψ leaves g (1 − ψ²/2) of gravity, so that the unit seems to fall.
        covariance : ndarray, shape (m, 3, 3)
            Covariance of the position, m².
        tilt_variance : ndarray, shape (m, 2)
            Variance of the tilt about the world's x and y, rad².
        """
        to_position = position_from_rate(np.asarray(1.0), 0.0, 0.0j, self.gravity) / (self.gravity / 6.0)  # of signs
        own = np.einsum("smm->sm", self.once)
        alpha = to_position @ np.einsum("sm,sij->mij", self.from_alpha, squares[:, :3, :3]) @ to_position.T
        crossed = to_position @ np.einsum("sm,sij->mij", self.crossed, squares[:, :3, 3:])  # (m, 3, 3)
        covariance = alpha + crossed + crossed.transpose(0, 2, 1) + np.einsum("sm,sij->mij", own, squares[:, 3:, 3:])
        tilt = np.einsum("smn,sab->abmn", self.once, squares[:, :2, :2])
        twice = np.maximum(self.t_s[:, None] - self.t_s, 0.0) * (self.t_s[1] - self.t_s[0])  # ∫∫, by trapezoids
        mean = np.zeros((len(self.t_s), 3))
        mean[:, 2] = -0.5 * self.gravity * twice @ np.einsum("aamm->m", tilt)
        # Of a Gaussian tilt: cov(ψ², ψ′²) = 2 Σ cov(θ_a, θ′_b)².
        covariance[:, 2, 2] += 0.5 * self.gravity**2 * np.einsum("jm,abmn,jn->j", twice, tilt**2, twice)
        return mean, covariance, np.einsum("aamm->ma", tilt)


def _refuse_spin(recording: Recording, array: AccelerometerArray, leads: list[Floats]) -> None:
    """Refuse windows whose leads are constant by a steady spin: the products of the rate show in their null space."""
    known = calibrated_bias_std(recording.metadata, array)
    errors = SensorErrors.from_parts(array, recording.sample_rate)
    errors = errors if known is None else replace(errors, bias_std=known)
    if any(start_of_still(array, lead, errors).kind == "spin" for lead in leads):
        raise InputError(
            "the array turns steadily in what looks like a rest: its null space shows products of the rate; record it "
            "standing still, or check its biases (gfimu calibrate array)"
        )


def _windows(recording: Recording, readings: Floats, samples: int) -> list[int]:
    """Return the first sample of each window of so many samples, side by side in the rests; raises if there is none."""
    rest = detect_rest(recording)
    complete = np.concatenate([[0], np.cumsum(~np.isfinite(readings).all(axis=1))])
    starts = [
        first
        for start, stop in zip(rest.start.tolist(), rest.stop.tolist(), strict=True)
        for first in range(start, stop - samples + 1, samples)
        if complete[first] == complete[first + samples]
    ]
    if not starts:
        longest = float(rest.lengths.max(initial=0)) / recording.sample_rate
        raise InputError(
            f"no complete rest of {samples / recording.sample_rate:.4g} s (--lead and --duration together); the "
            f"longest is {longest:.4g} s: record longer at rest, or give a shorter --duration or --lead"
        )
    return starts
