"""Raw files with several chips or several tables: archives, a row per chip, JSON, columns by axis."""

import json
import zipfile

import numpy as np
from field_files import Field, G, case, hand, nanoseconds, rows, stamps, table


@case
def phone_without_gravity_in_one_file(d):
    t, f, w = hand()
    free = 0.02 * np.random.default_rng(3).standard_normal(f.shape)
    with zipfile.ZipFile(d / "phone.zip", "w") as archive:
        for name, values in (("Accelerometer", free), ("TotalAcceleration", f), ("Gyroscope", w), ("Gravity", f)):
            rows(d / "member", ["time,seconds_elapsed,z,y,x"], [nanoseconds(t), t, *values[:, ::-1].T])
            archive.write(d / "member", f"{name}.csv")
        archive.writestr("Metadata.csv", "version,device name\n3,phone\n")
    return Field(d / "phone.zip", t, (f,), w)


@case
def a_file_per_chip_in_one_archive(d):
    t, chips, _ = table()
    with zipfile.ZipFile(d / "run.zip", "w") as archive:
        for number, values in enumerate(chips, start=1):
            rows(d / "member", ["time,x,y,z"], [t, *values.T])
            archive.write(d / "member", f"chip{number}.csv")
    return Field(d / "run.zip", t, tuple(chips))


@case
def a_row_per_chip(d):
    t, chips, _ = table()
    lines = [
        "{:.3f},{},{:.4f},{:.4f},{:.4f}".format(a, k + 1, *one[n])
        for n, a in enumerate(t)
        for k, one in enumerate(chips)
    ]
    (d / "long.csv").write_text("time,sensor,x,y,z\n" + "\n".join(lines))
    return Field(d / "long.csv", t, tuple(chips))


@case
def json_per_line_and_chip(d):
    t, chips, _ = table()
    records = [
        json.dumps(
            {
                "node": f"n{k}",
                "ts": 1715941514123 + 10 * n,
                "a": {c: round(v, 4) for c, v in zip("xyz", one[n], strict=True)},
            }
        )
        for n in range(len(t))
        for k, one in enumerate(chips[:2])
    ]
    (d / "mqtt.jsonl").write_text("\n".join([*records, '{"node": "n0", "ts": 17159']))
    return Field(d / "mqtt.jsonl", t, tuple(chips[:2]))


@case
def json_of_columns(d):
    t, f, w = hand()
    content = {"meta": {"rate": 100}, "time": t.tolist(), "acc": f.tolist(), "gyro": w.tolist()}
    (d / "c.json").write_text(json.dumps(content))
    return Field(d / "c.json", t, (f,), w)


@case
def four_chips_by_axis(d):
    t, chips, omega = table()
    head = [",".join(["t", *(f"{a}{k}" for a in "xyz" for k in range(1, 5)), "omega_dps"])]
    columns = [t, *(one[:, a] for a in range(3) for one in chips), np.degrees(omega)]
    return Field(rows(d / "byaxis.csv", head, columns), t, tuple(chips), None, omega)


@case
def four_chips_by_name(d):
    t, chips, omega = table()
    head = [";".join(["Time (ms)", *(f"Sensor{k}.{a} (g)" for k in range(1, 5) for a in "XYZ"), "Tacho (1/min)"])]
    columns = [1000 * t, *(np.column_stack(chips) / G).T, omega * 30 / np.pi]
    return Field(rows(d / "four.csv", head, columns, ";"), t, tuple(chips), None, omega)


@case
def single_axes(d):
    t, chips, omega = table()
    columns = [
        t,
        *(one[:, k] for one, k in zip((*chips, *chips[:2]), (0, 0, 1, 1, 2, 2), strict=True)),
        omega * 30 / np.pi,
    ]
    path = rows(d / "six.csv", ["t,a1,a2,a3,a4,a5,a6,rpm"], columns)
    six = np.column_stack(columns[1:7])
    return Field(path, t, (six[:, :3], six[:, 3:]), None, omega, doubt="holds the place, give the unit")


@case
def two_axes_per_chip(d):
    t, chips, omega = table()
    path = rows(
        d / "two.csv", ["t_ms,ax1,ay1,ax2,ay2,rpm"], [1000 * t, *chips[0].T[:2], *chips[1].T[:2], omega * 30 / np.pi]
    )
    return Field(path, t, (chips[0][:, :2], chips[1][:, :2]), None, omega, doubt="holds the place, give the unit")


@case
def whole_seconds_and_milliseconds(d):
    t, f, _ = hand()
    times = stamps(t, "{time}")
    columns = [[one[:-4] for one in times], np.array([int(one[-3:]) for one in times]), *f.T]
    return Field(rows(d / "ms.csv", ["Time,ms,ax,ay,az"], columns), t, (f,))


@case
def ros_2_without_names(d):
    t, f, w = hand()
    still = [0 * t] * 9
    columns = [nanoseconds(t) // 10**9, nanoseconds(t) % 10**9, ["imu"] * len(t), *still, *w.T, *still, *f.T, *still]
    return Field(rows(d / "ros2.csv", [], columns), t, (f,), w)


@case
def log_of_an_esp32(d):
    t, f, _ = hand()
    lines = [
        "\x1b[0;32mI ({:.0f}) imu: ax={:.4f}, ay={:.4f}, az={:.4f}\x1b[0m".format(1000 * a + 345, *row)
        for a, row in zip(t, f, strict=True)
    ]
    (d / "esp.log").write_text("\n".join(["I (12) boot: ESP-IDF v5.1", *lines]))
    return Field(d / "esp.log", t, (f,))


@case
def a_remark_behind_each_row(d):
    t, f, _ = hand()
    lines = ["{:.3f};{:.4f};{:.4f};{:.4f} // ok".format(a, *row) for a, row in zip(t, f, strict=True)]
    (d / "remark.txt").write_text("\n".join(lines))
    return Field(d / "remark.txt", t, (f,))
