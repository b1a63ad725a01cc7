"""Raw files as loggers, phones and serial monitors write them, with the motion that they hold (numpy alone)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline

G = 9.80665
START = np.datetime64("2024-05-17T23:59:50", "us")
CASES = {}


@dataclass(frozen=True)
class Field:
    """A file with its times (s), chips ((n, 3) each, m/s²), gyro (rad/s) and tachometer; ``doubt`` is to be checked."""

    path: Path
    t: np.ndarray
    chips: tuple
    gyro: np.ndarray | None = None
    tacho: np.ndarray | None = None
    force: float = 0.04  # m/s², tolerance
    doubt: str = ""


def case(function):
    CASES[function.__name__] = function
    return function


def hand(rate=100.0, seconds=16.0, seed=3):
    """One chip held still in ten poses, then turned about: times, readings and rates."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(rate * seconds)) / rate
    knots, turns = [], []
    pose, time = Rotation.identity(), 0.0
    while time < seconds + 2.0:
        pose = Rotation.from_rotvec(rng.normal(0.0, 1.0, 3)) * pose
        rest = (0.0, 0.35, 0.7) if time < 10.0 else (0.0,)
        knots += [time + wait for wait in rest]
        turns += [pose] * len(rest)
        time += 1.1 if time < 10.0 else 0.5
    spline = RotationSpline(np.array(knots), Rotation.concatenate(turns))
    rates = spline(t, 1)
    pushed = (t > 12.0)[:, None] * np.column_stack([np.sin(7 * t), np.cos(5 * t), np.sin(9 * t)])
    force = spline(t).inv().apply(pushed + np.array([0.0, 0.0, G]))
    return t, force + 0.01 * rng.standard_normal(force.shape), rates + 0.002 * rng.standard_normal(rates.shape)


def table(rate=100.0, seconds=12.0):
    """Four chips on a table: times, readings of each and the rate of the table."""
    rng = np.random.default_rng(5)
    t = np.arange(int(rate * seconds)) / rate
    omega = np.where(t > 2.0, 3.0 * (1.0 - np.cos(0.6 * (t - 2.0))), 0.0)
    alpha = np.gradient(omega, t)
    chips = [
        np.column_stack([-(omega**2) * x - alpha * y, -(omega**2) * y + alpha * x, np.full(len(t), G)])
        for x, y in 0.05 * np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
    ]
    return t, [one + 0.01 * rng.standard_normal(one.shape) for one in chips], omega


def rows(path, head, columns, separator=",", form="{:.5f}", end="", tail=(), line="\n", code="utf-8", mark="."):
    """Write lines of columns; whole numbers and texts as they are."""
    lines = list(head)
    for row in zip(*columns, strict=True):
        cells = [
            one
            if isinstance(one, str)
            else str(one)
            if isinstance(one, np.integer)
            else form.format(one).replace(".", mark)
            for one in row
        ]
        lines.append(separator.join(cells) + end)
    path.write_bytes((line.join([*lines, *tail]) + line).encode(code))
    return path


def counts(values, scale):
    return np.round(np.asarray(values) * scale).astype(int).T


def stamps(t, form="{date} {time}"):
    """Dates with times of day of a recording that goes on over midnight."""
    found = []
    for one in START + np.round(1e6 * t).astype("timedelta64[us]"):
        date, time = str(one).split("T")
        found.append(form.format(date=date, time=f"{time.partition('.')[0]}.{(time.partition('.')[2] + '000')[:3]}"))
    return found


def nanoseconds(t):
    return (1_715_941_514_123_456_789 + np.round(1e9 * t)).astype(np.int64)


@case
def serial_log_with_start_up_lines(d):
    t, f, w = hand()
    head = ["=~=~= PuTTY log =~=~=", "Testing device connections...", "MPU6050 connection successful", "offsets: 3;4;5"]
    columns = [(1000 * t + 5123).astype(int), *counts(f / G, 16384), *counts(np.degrees(w), 131)]
    return Field(rows(d / "putty.log", head, columns, ";"), t, (f,), w)


@case
def named_cells(d):
    t, f, _ = hand()
    cells = [f"t:{1000 * a:.0f}\tax:{x:.3f}\tay:{y:.3f}\taz:{z:.3f}" for a, (x, y, z) in zip(t, f, strict=True)]
    (d / "serial.txt").write_text("\r\n".join(["MPU6050 Found!", *cells]))
    return Field(d / "serial.txt", t, (f,))


@case
def a_sample_over_several_lines(d):
    t, f, w = hand()
    lines = ["Adafruit MPU6050 test!"]
    for a, b in zip(f, w, strict=True):
        lines += [
            "Acceleration X: {:.2f}, Y: {:.2f}, Z: {:.2f} m/s^2".format(*a),
            "Rotation X: {:.2f}, Y: {:.2f}, Z: {:.2f} rad/s".format(*b),
            "",
        ]
    (d / "lines.txt").write_text("\n".join(lines))
    return Field(d / "lines.txt", t, (f,), w, doubt="rate_hz = 100")


@case
def times_of_the_serial_monitor(d):
    t, f, _ = hand()
    lines = [
        f"{s} -> {1000 * a:.0f},{x:.4f},{y:.4f},{z:.4f}"
        for s, a, (x, y, z) in zip(stamps(t, "{time}"), t, f / G, strict=True)
    ]
    (d / "ide.txt").write_text("\n".join([f"{stamps(t[:1], '{time}')[0]} -> millis,x,y,z", *lines]))
    return Field(d / "ide.txt", t, (f,))


@case
def log_of_a_program(d):
    t, f, _ = hand()
    lines = [
        "{} INFO imu: ax={:.4f} ay={:.4f} az={:.4f}".format(s.replace(".", ","), *row)
        for s, row in zip(stamps(t), f, strict=True)
    ]
    (d / "imu.log").write_text("\n".join(lines))
    return Field(d / "imu.log", t, (f,))


@case
def tuples(d):
    t, f, _ = hand()
    (d / "mu.txt").write_text(
        "\n".join(f"({a:.3f}, {x:.4f}, {y:.4f}, {z:.4f})" for a, (x, y, z) in zip(t, f, strict=True))
    )
    return Field(d / "mu.txt", t, (f,))


@case
def sentences_with_checksums(d):
    t, f, w = hand()
    lines = [
        "$IMU,{:.0f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}*{:02X}".format(1000 * a, *b, *c, k % 256)
        for k, (a, b, c) in enumerate(zip(t, f, w, strict=True))
    ]
    (d / "nmea.txt").write_text("\n".join(lines))
    return Field(d / "nmea.txt", t, (f,), w)


@case
def decimal_commas_and_thousands(d):
    t, f, _ = hand()
    times = [f"{1000 * a:,.1f}".replace(",", " ").replace(".", ",").replace(" ", ".") for a in t]
    columns = [times, *f.T]
    head = ["Zeit [ms];ax [m/s²];ay [m/s²];az [m/s²]"]
    return Field(rows(d / "mess.csv", head, columns, ";", mark=",", code="latin-1", line="\r\n"), t, (f,))


@case
def decimal_commas_in_quotes(d):
    t, f, _ = hand()
    lines = [",".join(f'"{v:.4f}"'.replace(".", ",") for v in (a, *row)) for a, row in zip(t, f, strict=True)]
    (d / "q.csv").write_text('"Zeit","X","Y","Z"\n' + "\n".join(lines))
    return Field(d / "q.csv", t, (f,))


@case
def dates(d):
    t, f, _ = hand()
    return Field(rows(d / "iso.csv", ["timestamp,x,y,z"], [stamps(t, "{date}T{time}Z"), *f.T]), t, (f,))


@case
def times_of_day_over_midnight(d):
    t, f, _ = hand()
    return Field(rows(d / "day.csv", ["Time,X,Y,Z"], [stamps(t, "{time}"), *(f / G).T]), t, (f,))


@case
def date_and_time_in_two_columns(d):
    t, f, w = hand()
    head = ["rtcDate,rtcTime,aX,aY,aZ,gX,gY,gZ,mX,mY,mZ,imu_degC,"]
    columns = [
        stamps(t, "{date}"),
        stamps(t, "{time}"),
        *(1000 * f / G).T,
        *np.degrees(w).T,
        *(20 * f / G).T,
        0 * t + 24,
    ]
    path = rows(d / "dataLog00001.TXT", head, columns, end=",", form="{:.3f}")
    return Field(path, t, (f,), w, doubt="cm/s^2 is possible")


@case
def whole_seconds(d):
    t, f, _ = hand()
    times = [one[:-4] for one in stamps(t, "{time}")]
    return Field(rows(d / "s.csv", ["time,ax,ay,az"], [times, *f.T]), t, (f,), doubt="rounded")


@case
def millis_that_start_anew(d):
    t, f, _ = hand()
    millis = (2**32 - 7000 + np.round(1000 * t).astype(np.int64)) % 2**32
    return Field(rows(d / "wrap.csv", ["millis,ax,ay,az"], [millis, *counts(f / G, 256)]), t, (f,), force=0.06)


@case
def counter_with_lost_samples(d):
    t, f, _ = hand()
    kept = np.flatnonzero(np.random.default_rng(0).random(len(t)) > 0.03)
    path = rows(d / "lost.csv", ["# rate 100 Hz", "n,ax,ay,az"], [kept % 256, *f[kept].T])
    return Field(path, t[kept], (f[kept],))


@case
def a_rate_in_the_preamble_alone(d):
    t, f, _ = hand(rate=30.0, seconds=30.0)
    head = [
        "--- Data File Created By ActiGraph GT3X+ date format M/d/yyyy at 30 Hz  Filter Normal ---",
        "Start Time 18:00:00",
    ]
    return Field(rows(d / "acti.csv", [*head, "Accelerometer X,Accelerometer Y,Accelerometer Z"], (f / G).T), t, (f,))


@case
def start_and_rate_in_the_first_rows(d):
    t, f, _ = hand(rate=32.0, seconds=30.0)
    head = ["1715941514.0, 1715941514.0, 1715941514.0", "32.000000, 32.000000, 32.000000"]
    return Field(rows(d / "ACC.csv", head, counts(f / G, 64)), t, (f,), force=0.12)


@case
def no_times_at_all(d):
    t, f, _ = hand()
    return Field(rows(d / "none.txt", [], (f / G).T, "\t"), t, (f,), doubt="rate_hz = 100 only holds the place")


@case
def units_below_the_names(d):
    t, f, w = hand()
    head = [
        '"sep=\\t"',
        "S_Unix_CAL\tS_Accel_LN_X_CAL\tS_Accel_LN_Y_CAL\tS_Accel_LN_Z_CAL\tS_Gyro_X_CAL\tS_Gyro_Y_CAL\tS_Gyro_Z_CAL\t",
    ]
    head.append("ms\tm/(s^2)\tm/(s^2)\tm/(s^2)\tdeg/s\tdeg/s\tdeg/s\t")
    columns = [1715941514123.0 + 1000 * t, *f.T, *np.degrees(w).T]
    return Field(rows(d / "shimmer.csv", head, columns, "\t", end="\t"), t, (f,), w)


@case
def units_in_the_names(d):
    t, f, w = hand()
    head = ["timestamp[us],acc_x[mg],acc_y[mg],acc_z[mg],gyro_x_mdps,gyro_y_mdps,gyro_z_mdps"]
    columns = [np.round(1e6 * t).astype(int), *(1000 * f / G).T, *(1000 * np.degrees(w)).T]
    return Field(rows(d / "lsm.csv", head, columns, form="{:.1f}"), t, (f,), w)


@case
def axes_in_another_order(d):
    t, f, _ = hand()
    head = ['"cts","date","Accelerometer (z) [m/s2]","Accelerometer (x) [m/s2]","Accelerometer (y) [m/s2]","temp [°C]"']
    columns = [176.3 + 1000 * t, stamps(t, "{date}T{time}Z"), f[:, 2], f[:, 0], f[:, 1], ["40.1", *[""] * (len(t) - 1)]]
    return Field(rows(d / "gopro.csv", head, columns), t, (f,))


@case
def centimetres(d):
    t, f, _ = hand()
    return Field(rows(d / "cm.csv", ["t,X acc,Y acc,Z acc"], [t, *(100 * f).T]), t, (f,), doubt="mg is possible")


@case
def names_in_chinese(d):
    t, f, w = hand()
    head = ["时间,设备名称,加速度X(g),加速度Y(g),加速度Z(g),角速度X(°/s),角速度Y(°/s),角速度Z(°/s)"]
    columns = [stamps(t), ["WT"] * len(t), *(f / G).T, *np.degrees(w).T]
    return Field(rows(d / "wit.csv", head, columns, code="gb18030"), t, (f,), w)


@case
def utf_16_with_angles(d):
    t, f, w = hand()
    head = ["Time(s)\tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\tAngleX(deg)\tAngleY(deg)\tAngleZ(deg)\t"]
    columns = [stamps(t, " {time}"), *(f / G).T, *np.degrees(w).T, t, t, t]
    return Field(rows(d / "wit.txt", head, columns, "\t", code="utf-16"), t, (f,), w)


@case
def rostopic_echo(d):
    t, f, w = hand()
    names = ["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id"]
    names += [f"field.orientation.{a}" for a in "xyzw"] + [f"field.orientation_covariance{k}" for k in range(9)]
    names += [f"field.angular_velocity.{a}" for a in "xyz"] + [f"field.linear_acceleration.{a}" for a in "xyz"]
    still = [0 * t] * 13
    late = nanoseconds(t) + np.random.default_rng(0).integers(0, 300_000, len(t))
    columns = [late, np.arange(len(t)), nanoseconds(t), ["imu"] * len(t), *still, *w.T, *f.T]
    return Field(rows(d / "imu.csv", [",".join(names)], columns), t, (f,), w)


@case
def flight_controller(d):
    t, f, w = hand(rate=250.0)
    head = ['"firmwareType","Cleanflight"', '"acc_1G",2048', '"gyro_scale","0x3f800000"']
    names = ["loopIteration", "time"] + [
        f"{q}[{k}]" for q in ("axisP", "gyroADC", "accSmooth", "motor") for k in range(3)
    ]
    noise = np.random.default_rng(0).integers(200, 1800, (6, len(t)))
    columns = [
        4 * np.arange(len(t)),
        np.round(1e6 * t).astype(int),
        *noise[:3],
        *counts(np.degrees(w), 1),
        *counts(f / G, 2048),
        *noise[3:],
    ]
    return Field(rows(d / "btfl.csv", [*head, ",".join(f'"{one}"' for one in names)], columns), t, (f,), w)


@case
def a_damaged_file(d):
    t, f, _ = hand()
    head = "time_s,acc_x,acc_y,acc_z,"
    lines = ["{:.3f},{:.4f},{:.4f},{:.4f},".format(a, *row) for a, row in zip(t, f, strict=True)]
    for place, word in enumerate(("nan", "-", "null", "", "N/A", "-9999")):
        lines[300 + place] = f"{t[300 + place]:.3f},{f[300 + place, 0]:.4f},{word},{f[300 + place, 2]:.4f},"
    lines[-1] = lines[-1][:8]
    lines = [head, *lines[:700], head, *lines[700:], "# stopped by the user"]
    (d / "dirty.csv").write_bytes(b"\xef\xbb\xbf" + "\r\n".join(lines).encode())
    return Field(d / "dirty.csv", t[:-1], (f[:-1],))


@case
def a_restart(d):
    t, f, _ = hand()
    millis = np.where(t < 10.0, 1000 * t, 1000 * t - 9700).round().astype(int)
    lines = ["{},{:.4f},{:.4f},{:.4f}".format(a, *row) for a, row in zip(millis, f, strict=True)]
    (d / "restart.csv").write_text(
        "\n".join(["Boot v1.2", "millis,ax,ay,az", *lines[:1000], "Boot v1.2", *lines[1000:]])
    )
    return Field(d / "restart.csv", t[:1000], (f[:1000],))
