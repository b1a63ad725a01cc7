"""Small worlds for tests and benchmarks of rate estimation, independent of the simulator: motions known in closed
form or from Euler's equations, readings from the rigid-body formula written out chip by chip, data-sheet noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from gfimu import AccelerometerArray, Chip, SensorErrors, posterior_rate_bound
from gfimu.rate import RestTest, filter_rate, smooth_rate

GRAVITY = 9.80665
LSB = 0.0039 * GRAVITY
NOISE_LSB_100_HZ = np.array([0.75, 0.75, 1.1])
TURN_ON_BIAS = 0.035 * GRAVITY
CORNERS = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


@dataclass(frozen=True)
class Motion:
    t: np.ndarray  # (n,)
    omega: np.ndarray  # (n, 3)
    alpha: np.ndarray  # (n, 3)
    p: np.ndarray  # (n, 3)


def cube(edge: float = 0.06) -> AccelerometerArray:
    """Four triads on alternate corners; an edge of 6 cm keeps 10 rev/s within ±16 g."""
    chips = tuple(Chip(f"a{i + 1}", corner * edge / 2, np.eye(3)) for i, corner in enumerate(CORNERS))
    return AccelerometerArray("cube", chips, edge / 2)


def smooth_step(t, start, stop):
    """Rise from 0 to 1 with continuous acceleration, and its derivative."""
    u = np.clip((t - start) / (stop - start), 0, 1)
    return u - np.sin(2 * np.pi * u) / (2 * np.pi), (1 - np.cos(2 * np.pi * u)) / (stop - start) * ((u > 0) & (u < 1))


def turntable(rate: float, speed: float, duration: float = 30.0) -> Motion:
    """Rest 2 s, up to ``speed`` in 3 s, hold, through zero to −speed, hold, stop."""
    t = np.arange(round(duration * rate)) / rate
    omega, alpha = np.zeros((len(t), 3)), np.zeros((len(t), 3))
    for start, stop, change in ((2, 5, speed), (12, 18, -2 * speed), (25, 28, speed)):
        value, slope = smooth_step(t, start, stop)
        omega[:, 2] += change * value
        alpha[:, 2] += change * slope
    p = np.tile([0.0, 0.0, GRAVITY], (len(t), 1))
    return Motion(t, omega, alpha, p)


def tumble(rate: float, speed: float, duration: float = 30.0) -> Motion:
    """Rest 2 s, spun up by a smooth torque within 3 s, then torque-free with moments of inertia 1:2:3, in free fall."""
    t = np.arange(round(duration * rate)) / rate
    inertia = np.array([1.0, 2.0, 3.0])
    direction = np.array([0.5, 1.0, 0.4])
    direction /= np.linalg.norm(direction / inertia)

    def euler(time, omega, size):
        torque = direction * size * smooth_step(time, 2, 5)[1]
        return (torque - np.cross(omega, inertia * omega)) / inertia

    size = speed
    for _ in range(8):  # the torque turns with the body: find the impulse that ends at the wanted speed
        reached = np.linalg.norm(
            solve_ivp(euler, (0, 5), np.zeros(3), args=(size,), rtol=1e-6, atol=1e-6, max_step=0.2).y[:, -1]
        )
        size *= speed / reached
    solution = solve_ivp(
        euler, (0, duration), np.zeros(3), method="DOP853", t_eval=t, args=(size,), rtol=1e-11, atol=1e-11, max_step=0.1
    )
    omega = solution.y.T
    alpha = np.array([euler(time, w, size) for time, w in zip(t, omega, strict=True)])
    return Motion(t, omega, alpha, np.zeros_like(omega))


def readings(array: AccelerometerArray, motion: Motion) -> np.ndarray:
    """Specific force of each channel, chip by chip: p + α × r + ω × (ω × r)."""
    columns = []
    for chip in array.chips:
        r = chip.position
        force = motion.p + np.cross(motion.alpha, r) + np.cross(motion.omega, np.cross(motion.omega, r))
        columns.append(force @ chip.axes.T)
    return np.hstack(columns)


def noise_std(array: AccelerometerArray, rate: float) -> np.ndarray:
    """Data-sheet noise per channel, without the quantisation step's."""
    return np.concatenate([NOISE_LSB_100_HZ[: len(chip.axes)] for chip in array.chips]) * LSB * np.sqrt(rate / 100)


def measure(array, motion, rng, *, bias=TURN_ON_BIAS, scale=0.0, quantise=True):
    """Readings of ADXL345s: scale errors, turn-on bias, noise, 3.9 mg steps."""
    rate = 1 / (motion.t[1] - motion.t[0])
    values = readings(array, motion)
    c = values.shape[1]
    values = values * (1 + scale * rng.standard_normal(c)) + bias * rng.standard_normal(c)
    values += noise_std(array, rate) * rng.standard_normal(values.shape)
    return np.round(values / LSB) * LSB if quantise else values


def total_noise_std(array, rate):
    """Noise per channel with the quantisation step's."""
    return np.sqrt(noise_std(array, rate) ** 2 + LSB**2 / 12)


def sensor_errors(array, rate, **others):
    """What the estimators are told about these sensors."""
    fields = {"full_range": np.full(array.n_channels, 16 * GRAVITY - LSB), "stuck_after": 40} | others
    return SensorErrors.uniform(array, total_noise_std(array, rate), TURN_ON_BIAS, **fields)


@dataclass(frozen=True)
class Study:
    """Errors of many runs of one scenario, and the bounds."""

    motion: Motion
    error: dict  # method: (runs, n, 3)
    std: dict  # method: (runs, n, 3)
    bound: dict  # method: (n, 3)
    nees: dict  # method: (runs, n)
    nis: np.ndarray  # (runs, n)
    dof: np.ndarray

    def turning(self, share=0.5):
        """Samples at more than half the top speed (all of a rest), after the first block of the rest test."""
        speed = np.linalg.norm(self.motion.omega, axis=1)
        return ((speed > share * speed.max()) | (speed.max() == 0)) & (self.motion.t > 0.6)

    def independent(self, rows):
        """Independent errors among the samples ``rows`` of one run: the estimates forget within 1/|ω|, both ways."""
        rate = 1 / (self.motion.t[1] - self.motion.t[0])
        return rows.sum() / rate * np.linalg.norm(self.motion.omega[rows], axis=1).mean() / 2

    def ratio(self, method, rows):
        return rms(self.error[method][:, rows]) / rms(self.bound[method][rows])


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def first_rest(motion):
    """Ends of the rest test's blocks before the body moves, (n,): what a bound may take for known.

    A rest after the motion is believed after 5 s only, which these motions don't have.
    """
    window = RestTest().window(motion.t[1] - motion.t[0])
    speed = np.linalg.norm(motion.omega, axis=1)
    moves = speed > 1e-3 * speed.max()
    still = int(np.argmax(moves)) if moves.any() else len(moves)
    ends = np.zeros(len(motion.t), dtype=bool)
    ends[window - 1 : still : window] = True
    return ends


def study(array, motion, runs, *, seed=4117, methods=("filter", "smoother"), **measurement):
    """Filter and smooth ``runs`` independent measurements of a motion."""
    rate = 1 / (motion.t[1] - motion.t[0])
    errors = sensor_errors(array, rate)
    solve = {"filter": filter_rate, "smoother": smooth_rate}
    error, std, nees = ({method: [] for method in methods} for _ in range(3))
    nis, dof = [], []
    for run in range(runs):
        values = measure(array, motion, np.random.default_rng([seed, run]), **measurement)
        for method in methods:
            found = solve[method](array, motion.t, values, errors)
            difference = found.omega - motion.omega
            error[method].append(difference)
            std[method].append(found.std)
            nees[method].append(
                np.einsum("ni,ni->n", difference, np.linalg.solve(found.covariance, difference[..., None])[..., 0])
            )
        nis.append(found.nis)
        dof.append(found.nis_dof)
    bound = {
        method: np.sqrt(
            np.diagonal(
                posterior_rate_bound(
                    array, motion.t, motion.omega, errors, rest=first_rest(motion), rest_std=RestTest().rate_std,
                    smoother=method == "smoother",
                ),
                axis1=1, axis2=2,
            )
        )
        for method in methods
    }  # fmt: skip
    stack = lambda parts: {method: np.array(values) for method, values in parts.items()}  # noqa: E731
    return Study(motion, stack(error), stack(std), bound, stack(nees), np.array(nis), np.array(dof))
