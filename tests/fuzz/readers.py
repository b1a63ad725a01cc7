"""Every reader of gfimu as a function of a path, with valid files to begin from."""

from __future__ import annotations

import gzip
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["Target", "targets"]

_LONGEST = 20_000  # bytes of a text, so that most inputs take milliseconds
_IMPORTING = Path(__file__).parents[1] / "gfimu" / "recording" / "importing"


@dataclass(frozen=True)
class Target:
    """A reader under test.

    Parameters
    ----------
    call : callable
        Reads a path; returns nothing of interest.
    seeds : tuple of (bytes, str)
        Valid files with the ending of their names.
    share : float
        Of the inputs, relative to other readers.
    """

    call: Callable[[Path], Any]
    seeds: tuple[tuple[bytes, str], ...]
    share: float = 1.0


def targets(folder: Path) -> dict[str, Target]:
    """Return the readers by name; their valid files are made in a folder."""
    sys.path.insert(0, str(_IMPORTING))
    import field_chips  # noqa: F401  adds its cases
    import field_files
    import foreign_files as foreign

    from gfimu import AccelerometerArray, load_calibration, load_map, open_recording
    from gfimu.array import Part
    from gfimu.base import list_models
    from gfimu.calibration import read_text_triad
    from gfimu.recording import inspect_file, open_reference, open_run
    from sim import array_from_mjcf
    from sim.scenarios import Scenario
    from sim.twin import Twin

    own = _own_recordings(folder)
    text, binary = _foreign(folder, foreign, field_files)
    models = Path(__file__).parents[2] / "models"

    def toml(kind: str, *names: str) -> tuple[tuple[bytes, str], ...]:
        files = [models / kind / f"{name}.toml" for name in names]
        return tuple((file.read_bytes(), ".toml") for file in files)

    made = {
        "csv": Target(open_run, own["csv"], 3.0),
        "parquet": Target(open_run, own["parquet"], 2.0),
        "mimu4444": Target(open_recording, own["mimu4444"], 2.0),
        "text": Target(inspect_file, text, 2.0),
        "json": Target(inspect_file, binary["json"], 1.0),
        "zip": Target(inspect_file, binary["zip"], 0.5),
        "excel": Target(inspect_file, binary["excel"], 0.15),
        "matlab": Target(inspect_file, binary["matlab"], 0.05),
        "hdf5": Target(inspect_file, binary["hdf5"], 0.7),
        "ulog": Target(inspect_file, binary["ulog"], 0.7),
        "mcap": Target(inspect_file, binary["mcap"], 0.15),
        "rosbag": Target(inspect_file, binary["rosbag"], 0.15),
        "map": Target(load_map, toml("maps", "klipper", "euroc", "sisfall", "xsens_dot"), 2.0),
        "array": Target(AccelerometerArray.load, toml("arrays", "cube12", "wheel_pair", "mimu4444"), 2.0),
        "part": Target(_part(Part), toml("parts", "adxl345", "mpu9250"), 2.0),
        "scenario": Target(Scenario.load, toml("scenarios", "paper_run", "hand", "wheel", "linear_axis"), 2.0),
        "twin": Target(Twin.load, toml("twins", *list_models("twins")[:4]), 2.0),
        "mjcf": Target(array_from_mjcf, _mjcf(), 1.0),
        "calibration": Target(load_calibration, _calibration(folder), 2.0),
        "reference": Target(open_reference, own["reference"], 2.0),
        "triad": Target(read_text_triad, own["triad"], 2.0),
        "frames": Target(_frames, _sent(), 2.0),
        "stream": Target(_live, own["stream"], 1.0),
    }
    return {name: one for name, one in made.items() if one.seeds}


def _part(part: Any) -> Callable[[Path], Any]:
    def read(path: Path) -> Any:
        return part.load(str(path))

    return read


def _own_recordings(folder: Path) -> dict[str, tuple[tuple[bytes, str], ...]]:
    """Return recordings in gfimu's own formats and in those that hold a whole one."""
    import gfimu

    run = gfimu.simulate("rest", seed=1, changes=["duration_s=0.4"])
    raw = gfimu.simulate("rest", seed=1, changes=["duration_s=0.4"], raw=True)
    found: dict[str, list[tuple[bytes, str]]] = {"csv": [], "parquet": []}
    for suffix, files in found.items():
        for number, one in enumerate((run, raw)):
            file = folder / f"own{number}.{suffix}"
            one.write(file)
            files.append((file.read_bytes(), f".{suffix}"))
    rng = np.random.default_rng(0)
    packets = bytearray(b"\xa0\x28\x00\xc8")
    for number in range(60):
        body = b"\xaa" + number.to_bytes(2, "big") + b"\x64" + (number * 1_024_000).to_bytes(4, "big")
        body += (2048 * rng.normal(0.3, 0.2, 48)).astype(">i2").tobytes()
        packets += body + (sum(body) & 0xFFFF).to_bytes(2, "big")
    t = np.arange(60) / 50.0
    tacho = "t_s,tacho_rad_s\n" + "".join(f"{one:.3f},{np.sin(one):.5f}\n" for one in t)
    triad = "".join(f"{one:.3f} {33000 + 10 * np.sin(one):.0f} 33200 32400\n" for one in t)
    lines = "\n".join(f"# {key}: {value}" for key, value in (("sample_rate_hz", 100),))
    names = "t_s," + ",".join(f"{name}_m_s2" for name in run.channels)
    rows = "\n".join(",".join(f"{one:.4f}" for one in row) for row in np.column_stack([run.t_s, run.readings]))
    return {
        **{key: tuple(value) for key, value in found.items()},
        "mimu4444": ((bytes(packets), ".bin"), (gzip.compress(bytes(packets)), ".bin.gz")),
        "reference": ((tacho.encode(), ".csv"), (tacho.replace("tacho_rad_s", "angle_deg").encode(), ".csv")),
        "triad": ((triad.encode(), ".txt"), (gzip.compress(triad.encode()), ".txt.gz")),
        "stream": ((f"{lines}\n{names}\n{rows}\n".encode(), ".csv"),),
    }


def _foreign(folder: Path, foreign: Any, field: Any) -> tuple[tuple[tuple[bytes, str], ...], Mapping[str, Any]]:
    """Return foreign text files, and foreign files of other formats by the name of the format."""
    from gfimu.recording import format_of

    found: dict[str, list[tuple[bytes, str]]] = {
        key: [] for key in ("text", "json", "zip", "excel", "matlab", "hdf5", "ulog", "mcap", "rosbag")
    }
    names = ("klipper", "euroc", "xsens_dot", "gcdc", "phyphox", "sisfall", "ulog", "mcap", "bag_of_ros1")
    writers = [getattr(foreign, name) for name in names]
    for number, write in enumerate(writers):
        one = folder / f"foreign{number}"
        try:
            write(one)
        except ImportError:
            continue
        if one.is_file():
            found[format_of(one)].append((one.read_bytes(), ""))
    cases = folder / "cases"
    for number, write in enumerate(field.CASES.values() if isinstance(field.CASES, dict) else field.CASES):
        place = cases / str(number)
        place.mkdir(parents=True)
        try:
            write(place)
        except Exception:  # noqa: BLE001  a case that needs what is not installed is no seed
            continue
        for file in place.rglob("*"):
            if file.is_file():
                data = file.read_bytes()
                kind = format_of(file)
                found[kind].append((data[:_LONGEST] if kind in {"text", "json"} else data, file.suffix))
    _more(folder, found)
    return tuple(found["text"]), {key: tuple(value) for key, value in found.items()}


def _more(folder: Path, found: dict[str, list[tuple[bytes, str]]]) -> None:
    """Add small files of formats that few cases are of."""
    import json
    import zipfile

    import h5py
    import scipy.io

    t = np.arange(80) / 100.0
    axes = {"ax": np.sin(t), "ay": np.cos(t), "az": 9.8 + 0 * t}
    scipy.io.savemat(folder / "more.mat", {"t": t, **axes})
    found["matlab"].append(((folder / "more.mat").read_bytes(), ".mat"))
    with h5py.File(folder / "more.h5", "w") as made:
        for name, values in {"t": t, **axes}.items():
            made[name] = values
    found["hdf5"].append(((folder / "more.h5").read_bytes(), ".h5"))
    rows = [{"t": float(one), "acc": {"x": 0.1, "y": 0.2, "z": 9.8}} for one in t]
    found["json"] += [(json.dumps(rows).encode(), ".json"), ("\n".join(map(json.dumps, rows)).encode(), ".json")]
    text = "t,ax,ay,az\n" + "".join(f"{one:.3f},0.1,0.2,9.8\n" for one in t)
    with zipfile.ZipFile(folder / "more.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("acc.csv", text)
    found["zip"].append(((folder / "more.zip").read_bytes(), ".zip"))
    try:
        import openpyxl
    except ImportError:
        return
    book = openpyxl.Workbook()
    for line in text.splitlines():
        book.active.append(line.split(","))
    book.save(folder / "more.xlsx")
    found["excel"].append(((folder / "more.xlsx").read_bytes(), ".xlsx"))


def _mjcf() -> tuple[tuple[bytes, str], ...]:
    sites = "".join(
        f"<site name='a{chip}{axis}' pos='0.{chip} 0 0.{axis}' zaxis='{int(axis == 1)} {int(axis == 2)} 1'/>"
        for chip in range(1, 5)
        for axis in range(1, 4)
    )
    plain = f"<mujoco><worldbody><body name='b'><geom size='0.1'/>{sites}</body></worldbody></mujoco>"
    many = (
        "<mujoco><worldbody><replicate count='3' offset='0.1 0 0'><body><geom size='0.1'/><site name='s'/>"
        "</body></replicate></worldbody></mujoco>"
    )
    return ((plain.encode(), ".xml"), (many.encode(), ".xml"))


def _calibration(folder: Path) -> tuple[tuple[bytes, str], ...]:
    import gfimu

    poses = gfimu.simulate("calibration_poses", seed=1)
    found = gfimu.calibrate("multi-position", poses, out=folder / "calibration.json")
    assert found.chips
    return (((folder / "calibration.json").read_bytes(), ".json"),)


def _sent() -> tuple[tuple[bytes, str], ...]:
    from firmware_bridge import encode_samples

    counts = np.arange(40 * 12).reshape(40, 12).astype(np.int16)
    times = np.arange(40) * 10_000
    return ((encode_samples(np.arange(40), times, counts), ".bin"),)


def _frames(path: Path) -> None:
    from firmware_bridge import SampleDecoder
    from gfimu.recording import read_bytes

    decoder = SampleDecoder()
    data = read_bytes(path)
    middle = len(data) // 2
    decoder.feed(data[:middle])
    decoder.feed(data[middle:])
    decoder.finish()


def _live(path: Path) -> None:
    from gfimu import live

    for _ in live("cube12", 100.0, source=path):
        pass
