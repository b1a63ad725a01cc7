"""One motion for all shapes of the corpus: a rest, turns of gravity through several poses, then motion by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline

G = 9.80665
START_S = 1_715_941_514.123
PLACES_M = 0.05 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])


@dataclass(frozen=True)
class Motion:
    """Times (n,), s; (n, 3) each: readings of four chips and gravity, m/s², rates, rad/s, a magnetic field, µT."""

    t: np.ndarray
    chips: tuple[np.ndarray, ...]
    gyro: np.ndarray
    gravity: np.ndarray
    field: np.ndarray

    @property
    def force(self) -> np.ndarray:
        return self.chips[0]

    @property
    def g(self) -> np.ndarray:
        """Readings of the first chip in g."""
        return self.chips[0] / G

    @property
    def deg(self) -> np.ndarray:
        """Rates in °/s."""
        return np.degrees(self.gyro)


@cache
def motion(rate: float = 100.0, seconds: float = 10.0, seed: int = 8) -> Motion:
    """Return the motion: a quarter of its time at rest, a half in six poses, then by hand."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(rate * seconds)) / rate
    share = t / seconds
    size = min(1.0, seconds / 10.0)  # of the turns: short files have no faster ones
    knots, turns, pose = [], [], Rotation.identity()
    for begin, end in [
        (0.0, 0.25),
        *((0.25 + (place + 0.5) / 12.0, 0.25 + (place + 1.0) / 12.0) for place in range(6)),
    ]:
        still = np.linspace(begin, end, max(4, round(60 * (end - begin))))
        knots += still.tolist()
        turns += [pose] * len(still)
        pose = Rotation.from_rotvec(size * rng.normal(0.0, 0.8, 3)) * pose
    for place in range(5):
        knots.append(0.80 + 0.055 * place)
        turns.append(pose)
        pose = Rotation.from_rotvec(size * rng.normal(0.0, 0.5, 3)) * pose
    spline = RotationSpline(np.array(knots) * seconds, Rotation.concatenate(turns))
    turned, omega, alpha = spline(t).inv(), spline(t, 1), spline(t, 2)
    pushed = (share > 0.78)[:, None] * np.column_stack([np.sin(7 * t), np.cos(5 * t), np.sin(9 * t)])
    gravity = turned.apply(np.tile([0.0, 0.0, G], (len(t), 1)))
    chips = []
    for position in PLACES_M:
        force = gravity + turned.apply(pushed) + np.cross(alpha, position)
        force += np.cross(omega, np.cross(omega, position))
        errors = rng.normal(0.0, 0.05, 3) + 0.004 * rng.standard_normal(3) * force
        chips.append(force + errors + 0.015 * rng.standard_normal(force.shape))
    gyro = omega + rng.normal(0.0, 0.003, 3) + 0.002 * rng.standard_normal(omega.shape)
    field = turned.apply(np.tile([18.0, 2.0, -44.0], (len(t), 1))) + np.array([6.0, -9.0, 4.0])
    return Motion(t, tuple(chips), gyro, gravity, field + 0.3 * rng.standard_normal(field.shape))


@dataclass(frozen=True)
class Right:
    """The right reading of a file.

    ``chips`` are the readings of each, m/s²; ``rate`` is None where the file does not state it, and ``refused`` names
    what is missing where nothing can be read. ``doubt`` holds where the file leaves a doubt that is to be marked.
    """

    path: Path
    chips: tuple[np.ndarray, ...] = ()
    rate: float | None = None
    gyro: np.ndarray | None = None
    references: dict[str, np.ndarray] = field(default_factory=dict)
    refused: str = ""
    doubt: bool = False
    note: str = ""


@dataclass(frozen=True)
class Shape:
    """A public format: its writer, from a folder to the right reading, and where the shape comes from."""

    name: str
    write: Callable[[Path], Right]
    source: str


SHAPES: dict[str, Shape] = {}
SEEN = frozenset(
    {
        "phyphox_csv",
        "phyphox_without_gravity",
        "sensor_logger_total_acceleration",
        "sensor_logger_zip",
        "sensorlog_ios",
        "androsensor",
        "android_sensor_logger",
        "xsens_mtw",
        "xsens_dot",
        "xsens_dot_free_acceleration",
        "shimmer_consensys",
        "mbientlab",
        "witmotion",
        "actigraph_raw",
        "empatica_e4",
        "ronin_hdf5",
        "klipper",
        "reprapfirmware",
        "betaflight",
        "betaflight_units",
        "ardupilot_csv",
        "ardupilot_log",
        "px4_sensor_combined",
        "rostopic_csv",
        "unico",
        "unicleo",
        "hsdatalog_csv",
        "zephyr_lis2dh",
        "labview_one_x",
        "labview_segments_without_x",
        "catman_ascii",
        "vibrometra",
        "tspair",
        "peer_at2",
        "knet_ascii",
        "vernier_text",
        "mpu6050_bars",
        "pico_examples_mpu6050",
        "zephyr_mpu6050",
        "zephyr_accel_polling",
        "sparkfun_icm20948",
        "arduino_simple_accelerometer",
        "kriswiner_mpu9250",
        "gyroflow_gcsv",
        "picoquake",
        "tello_state",
        "orbbec_types_in_turn",
        "racechrono",
        "aim_csv",
        "motec_csv",
        "polar_sensor_logger",
        "mind_monitor",
        "openbci_raw",
        "realworld_har",
        "hhar",
        "umafall",
        "harth",
        "x_imu",
        "up_fall",
        "kaist_urban",
        "opensim_sto",
        "eobs_bursts",
    }
)
"""Shapes whose head was compared with public files, or with programs that write or read them; others follow the
documentation of their source."""


def shape(source: str) -> Callable[[Callable[[Path], Right]], Callable[[Path], Right]]:
    """Add a writer to the corpus."""

    def added(write: Callable[[Path], Right]) -> Callable[[Path], Right]:
        SHAPES[write.__name__] = Shape(write.__name__, write, source)
        return write

    return added


def rows(
    path, head, columns, separator=",", form="{:.6f}", end="", tail=(), line="\n", code="utf-8", mark=".", start=""
):
    """Write lines of columns; whole numbers and texts as they are; a column may bring its form as (form, values)."""

    def texts(column):
        own, values = column if isinstance(column, tuple) else (form, column)
        return [
            one
            if isinstance(one, str)
            else str(one)
            if isinstance(one, np.integer)
            else own.format(one).replace(".", mark)
            for one in values
        ]

    cells = [texts(column) for column in columns]
    lines = [start + separator.join(row) + end for row in zip(*cells, strict=True)]
    path.write_bytes((line.join([*head, *lines, *tail]) + line).encode(code))
    return path


def counts(values: np.ndarray, scale: float) -> np.ndarray:
    """Return values times a scale as whole numbers, one row per axis."""
    return np.round(np.asarray(values) * scale).astype(int).T


def stamps(t: np.ndarray, form: str = "{date} {time}.{ms}") -> list[str]:
    """Return dates with times of day."""
    found = []
    for one in np.datetime64("2024-05-17T10:25:14.000", "us") + np.round(1e6 * t).astype("timedelta64[us]"):
        date, time = str(one).split("T")
        second, _, part = time.partition(".")
        found.append(form.format(date=date, time=second, ms=(part + "000")[:3], us=(part + "000000")[:6]))
    return found


def ns(t: np.ndarray) -> np.ndarray:
    """Return times as nanoseconds since 1970."""
    return 1_715_941_514_123_456_789 + np.round(1e9 * t).astype(np.int64)


def ms(t: np.ndarray, start: float = 5123.0) -> np.ndarray:
    """Return times as whole milliseconds of a board."""
    return np.round(start + 1000 * t).astype(int)


def warming(m: Motion, start: float) -> np.ndarray:
    """Return a temperature that rises by half a degree, °C."""
    return np.round(start + 0.5 * (1.0 - np.exp(-3.0 * m.t / m.t[-1])), 2)
