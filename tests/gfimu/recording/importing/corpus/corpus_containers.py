"""Shapes of containers: matrices, archives, packed files, tables by rows; and what is refused by name."""

import gzip
import json
import lzma

import numpy as np
from corpus_motion import Right, motion, ms, rows, shape

SCIPY = "https://docs.scipy.org/doc/scipy/reference/io.html"
NUMPY = "https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html"


@shape(SCIPY)
def matlab_matrix(d):
    from scipy.io import savemat

    m = motion()
    savemat(d / "accel.mat", {"accelBuffer": np.column_stack([m.t, m.g])})
    return Right(d / "accel.mat", (m.force,), 100.0)


@shape(NUMPY)
def npz_matrix_lying(d):
    m = motion()
    np.savez(d / "accel.npz", data=np.column_stack([m.t, m.force, m.gyro]).T)
    return Right(d / "accel.npz", (m.force,), 100.0, m.gyro)


@shape(SCIPY)
def matlab_struct_array(d):
    from scipy.io import savemat

    m = motion(50.0)
    kind = [("t", object), ("ax", object), ("ay", object), ("az", object)]
    savemat(
        d / "samples.mat", {"samples": np.array([tuple(row) for row in np.column_stack([m.t, m.force])], dtype=kind)}
    )
    return Right(d / "samples.mat", (m.force,), 50.0)


@shape(SCIPY)
def matlab_vectors_and_fs(d):
    from scipy.io import savemat

    m = motion(256.0, 5.0)
    savemat(d / "run.mat", {"Ax": m.force[:, 0], "Ay": m.force[:, 1], "Az": m.force[:, 2], "Fs": 256.0})
    return Right(d / "run.mat", (m.force,), 256.0)


@shape(NUMPY)
def npy_matrix(d):
    m = motion()
    np.save(d / "imu.npy", np.column_stack([m.t, m.force, m.gyro]))
    return Right(d / "imu.npy", (m.force,), 100.0, m.gyro)


@shape(NUMPY)
def npz_with_rate(d):
    m = motion(200.0, 6.0)
    np.savez(d / "imu.npz", acc=m.force, gyro=m.gyro, fs=200)
    return Right(d / "imu.npz", (m.force,), 200.0, m.gyro)


@shape(NUMPY)
def npy_structured(d):
    m = motion()
    values = np.zeros(len(m.t), dtype=[("t", "f8"), ("acc", "f4", 3), ("gyro", "f4", 3)])
    values["t"], values["acc"], values["gyro"] = m.t, m.force, m.gyro
    np.save(d / "imu.npy", values)
    return Right(d / "imu.npy", (m.force,), 100.0, m.gyro)


@shape("https://arrow.apache.org/docs/python/feather.html")
def feather(d):
    import pyarrow as pa
    from pyarrow.feather import write_feather

    m = motion()
    write_feather(
        pa.table({"timestamp_ms": ms(m.t), **{f"acc_{a}": m.force[:, k] for k, a in enumerate("xyz")}}),
        str(d / "run.feather"),
    )
    return Right(d / "run.feather", (m.force,), 100.0)


@shape("https://parquet.apache.org")
def parquet(d):
    import pyarrow as pa
    import pyarrow.parquet as pq

    m = motion()
    stamp = np.datetime64("2024-05-17T10:25:14", "us") + np.round(1e6 * m.t).astype("timedelta64[us]")
    pq.write_table(
        pa.table({"time": stamp, **{f"accel_{a}_g": m.g[:, k] for k, a in enumerate("xyz")}}), d / "run.parquet"
    )
    return Right(d / "run.parquet", (m.force,), 100.0)


@shape("https://openpyxl.readthedocs.io (workbook of a logger)")
def workbook(d):
    import openpyxl

    m = motion(50.0)
    book = openpyxl.Workbook()
    for row in [
        ["Time (s)", "X (m/s^2)", "Y (m/s^2)", "Z (m/s^2)"],
        *np.column_stack([m.t, m.force]).round(5).tolist(),
    ]:
        book.active.append(row)
    book.save(d / "run.xlsx")
    return Right(d / "run.xlsx", (m.force,), 50.0)


@shape("https://docs.h5py.org (a group per sensor, attributes)")
def hdf5_groups(d):
    import h5py

    m = motion(104.0)
    with h5py.File(d / "run.h5", "w") as file:
        group = file.create_group("imu")
        group.attrs["sample_rate_hz"] = 104.0
        group["accel"], group["gyro"] = m.force, m.gyro
    return Right(d / "run.h5", (m.force,), 104.0, m.gyro)


@shape("https://docs.h5py.org (one matrix)")
def hdf5_matrix(d):
    import h5py

    m = motion()
    with h5py.File(d / "run.h5", "w") as file:
        file["data"] = np.column_stack([m.t, m.g])
    return Right(d / "run.h5", (m.force,), 100.0)


@shape("https://jsonlines.org")
def json_lines(d):
    m = motion()
    made = [
        json.dumps({"ts": int(t), "acc": {"x": x, "y": y, "z": z}})
        for t, (x, y, z) in zip(ms(m.t), m.force.round(5), strict=True)
    ]
    (d / "run.jsonl").write_text("\n".join(made))
    return Right(d / "run.jsonl", (m.force,), 100.0)


@shape("https://pandas.pydata.org (DataFrame.to_json, orient='list')")
def json_lists(d):
    m = motion()
    content = {
        "meta": {"device": "node 3"},
        "data": {"time": m.t.tolist(), **{f"acc_{a}": m.force[:, k].tolist() for k, a in enumerate("xyz")}},
    }
    (d / "run.json").write_text(json.dumps(content, indent=1))
    return Right(d / "run.json", (m.force,), 100.0)


@shape("https://developer.mozilla.org/docs/Web/API/DeviceMotionEvent")
def json_device_motion(d):
    m = motion(60.0)
    records = [
        {
            "timeStamp": 1000 * t + 812.4,
            "accelerationIncludingGravity": dict(zip("xyz", f, strict=True)),
            "rotationRate": dict(zip(("alpha", "beta", "gamma"), w, strict=True)),
            "interval": 16,
        }
        for t, f, w in zip(m.t.tolist(), m.force.tolist(), m.deg.tolist(), strict=True)
    ]
    (d / "motion.json").write_text(json.dumps(records))
    return Right(d / "motion.json", (m.force,), 60.0)


@shape("https://www.gnu.org/software/gzip")
def csv_gzip(d):
    m = motion()
    path = rows(d / "run.csv", ["time_s,ax,ay,az"], [m.t, *m.force.T])
    (d / "run.csv.gz").write_bytes(gzip.compress(path.read_bytes()))
    return Right(d / "run.csv.gz", (m.force,), 100.0)


@shape("https://tukaani.org/xz")
def csv_xz(d):
    m = motion()
    path = rows(d / "run.csv", ["time_s,ax,ay,az"], [m.t, *m.force.T])
    (d / "run.csv.xz").write_bytes(lzma.compress(path.read_bytes()))
    return Right(d / "run.csv.xz", (m.force,), 100.0)


@shape("own: a line per series")
def transposed(d):
    m = motion(50.0)
    series = {"time [s]": m.t, "ax [m/s^2]": m.force[:, 0], "ay [m/s^2]": m.force[:, 1], "az [m/s^2]": m.force[:, 2]}
    (d / "series.csv").write_text(
        "".join(f"{name},{','.join(f'{one:.5f}' for one in values)}\n" for name, values in series.items())
    )
    return Right(d / "series.csv", (m.force,), 50.0)


@shape("https://www.r-project.org (write.table with row names)")
def row_names(d):
    m = motion(50.0)
    columns = [[f'"{k}"' for k in range(1, len(m.t) + 1)], m.t, *m.force.T]
    return Right(rows(d / "frame.txt", ['"t" "ax" "ay" "az"'], columns, " "), (m.force,), 50.0)


@shape("https://git-lfs.com")
def lfs_pointer(d):
    text = f"version https://git-lfs.github.com/spec/v1\noid sha256:{'0123456789abcdef' * 4}\nsize 1360251\n"
    (d / "pointer.csv").write_text(text)
    return Right(d / "pointer.csv", refused="git lfs pull")


@shape("https://learn.microsoft.com (compound file, Excel 97)")
def excel_97(d):
    (d / "phone.xls").write_bytes(bytes.fromhex("d0cf11e0a1b11ae1") + bytes(2048))
    return Right(d / "phone.xls", refused=r"save it as \.xlsx or \.csv")


@shape("https://www.ni.com (TDMS)")
def tdms(d):
    (d / "run.tdms").write_bytes(b"TDSm\x0e\x00\x00\x00\x69\x12\x00\x00" + bytes(2048))
    return Right(d / "run.tdms", refused=r"TDMS file; export it as")
