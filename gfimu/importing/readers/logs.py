"""Logs of flight controllers and robots: ULog of PX4, MCAP files and ROS bags with ``sensor_msgs/Imu``."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.errors import InputError
from gfimu.files.input_file import MOST_COLUMNS, parsing
from gfimu.importing.column_map import TextSpec
from gfimu.importing.raw_table import RawFile, RawTable
from gfimu.optional_packages import require

__all__ = ["IMU_COLUMNS", "read_bag", "read_mcap", "read_ulog"]

_IMU = "sensor_msgs/msg/Imu"
IMU_COLUMNS = (
    "stamp_ns",
    *(f"linear_acceleration.{axis}" for axis in "xyz"),
    *(f"angular_velocity.{axis}" for axis in "xyz"),
    *(f"orientation.{axis}" for axis in "xyzw"),
)
"""Columns of a topic with `sensor_msgs/Imu`."""

_MOST_READ = 64 << 20  # numerical: bytes that a parser may read of any file, and times the size besides
_MOST_TIMES_READ = 8
_LEAST_READ = 512  # numerical: bytes that a call costs as much as


def read_ulog(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read a ULog file: each topic and instance is a table, ``sensor_accel/0`` say."""
    require(f"{path}: ULog", "pyulog")
    from pyulog import ULog

    with parsing(path, "ULog file", "download it again"), contextlib.redirect_stdout(io.StringIO()):
        formats = ULog(_BoundedFile(path), parse_header_only=True).message_formats
        _check_fields(path, {name: one.fields for name, one in formats.items()})
        log = ULog(_BoundedFile(path))
    tables = {}
    for topic in log.data_list:
        name = f"{topic.name}/{topic.multi_id}"
        columns = {key: np.asarray(values) for key, values in topic.data.items() if not key.startswith("_padding")}
        tables[name] = RawTable(name, columns)
    if not tables:
        raise InputError(f"{path}: a ULog file without a topic; log sensor_accel or sensor_combined")
    return RawFile(str(path), "ulog", tables)


class _BoundedFile(io.FileIO):
    """A file whose parser may read some times its size: pyulog goes back in damaged files, in some without end."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._left = _MOST_READ + _MOST_TIMES_READ * path.stat().st_size

    def read(self, size: int | None = -1, /) -> bytes:
        """Read as many bytes, while the parser may read more at all."""
        data = super().read(-1 if size is None else size) or b""
        self._left -= _LEAST_READ + len(data)
        if self._left < 0:
            raise OSError("its messages can't be followed to the end")
        return data


def _check_fields(path: Path, formats: Mapping[str, Sequence[tuple[str, int, str]]]) -> None:
    """Refuse formats within formats that are more fields than any message has: they are laid out one by one."""
    counts: dict[str, int] = {}

    def fields(name: str) -> int:
        if name not in formats:
            return 1
        if name not in counts:
            counts[name] = MOST_COLUMNS  # of one within itself
            counts[name] = sum(max(size, 1) * fields(kind) for kind, size, _ in formats[name])
        return counts[name]

    for name in formats:
        if fields(name) > MOST_COLUMNS:
            raise InputError(f"{path}: topic {name[:40]} has more than {MOST_COLUMNS} fields; download it again")


def read_mcap(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the topics with ``sensor_msgs/Imu`` of an MCAP file that ROS 2 wrote."""
    require(f"{path}: MCAP", "mcap", "rosbags")
    from mcap.reader import make_reader
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    rows: dict[str, list[tuple[float, ...]]] = {}
    others: set[str] = set()
    with parsing(path, "MCAP file", "mcap recover may repair it"), path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            if schema is None or schema.name not in {_IMU, "sensor_msgs/Imu"} or channel.message_encoding != "cdr":
                others.add(channel.topic)
                continue
            rows.setdefault(channel.topic, []).append(_row(store.deserialize_cdr(message.data, _IMU)))
    return _topics(path, "mcap", rows, others)


def read_bag(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the topics with ``sensor_msgs/Imu`` of a ROS bag: a ROS 1 file, or a folder of ROS 2."""
    require(f"{path}: a ROS bag", "rosbags")
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    rows: dict[str, list[tuple[float, ...]]] = {}
    folder = path.parent if path.suffix == ".db3" else path
    store = get_typestore(Stores.ROS1_NOETIC if path.suffix == ".bag" else Stores.ROS2_HUMBLE)
    with parsing(path, "ROS bag", "record it again"), AnyReader([folder], default_typestore=store) as reader:
        imu = [one for one in reader.connections if one.msgtype == _IMU]
        others = {one.topic for one in reader.connections} - {one.topic for one in imu}
        for connection, _, data in reader.messages(connections=imu) if imu else ():
            rows.setdefault(connection.topic, []).append(_row(reader.deserialize(data, connection.msgtype)))
    return _topics(path, "rosbag", rows, others)


def _row(message: Any) -> tuple[float, ...]:
    stamp, force, rate, turn = (
        message.header.stamp,
        message.linear_acceleration,
        message.angular_velocity,
        message.orientation,
    )
    return (
        stamp.sec * 10**9 + stamp.nanosec,
        *(getattr(force, axis) for axis in "xyz"),
        *(getattr(rate, axis) for axis in "xyz"),
        *(getattr(turn, axis) for axis in "xyzw"),
    )


def _topics(path: Path, kind: str, rows: dict[str, list[tuple[float, ...]]], others: set[str]) -> RawFile:
    if not rows:
        listed = ", ".join(sorted(others)[:8]) or "no topic at all"
        raise InputError(f"{path}: no topic with sensor_msgs/Imu; it has {listed}")
    return RawFile(str(path), kind, {topic: RawTable(topic, dict(_columns(found))) for topic, found in rows.items()})


def _columns(rows: list[tuple[float, ...]]) -> Iterator[tuple[str, NDArray[Any]]]:
    for place, name in enumerate(IMU_COLUMNS):
        kind = np.int64 if place == 0 else float
        yield name, np.array([row[place] for row in rows], dtype=kind)
