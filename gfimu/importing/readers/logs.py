"""Logs of flight controllers and robots: ULog of PX4, MCAP files and ROS bags with ``sensor_msgs/Imu``."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.errors import GfimuError, InputError
from gfimu.files.input_file import parsing
from gfimu.importing.column_map import TextSpec
from gfimu.importing.raw_table import RawFile, RawTable

__all__ = ["IMU_COLUMNS", "read_bag", "read_mcap", "read_ulog"]

_NEEDS = "which is not installed: pip install 'gfimu[formats]'"
_IMU = "sensor_msgs/msg/Imu"
IMU_COLUMNS = (
    "stamp_ns",
    *(f"linear_acceleration.{axis}" for axis in "xyz"),
    *(f"angular_velocity.{axis}" for axis in "xyz"),
    *(f"orientation.{axis}" for axis in "xyzw"),
)
"""Columns of a topic with `sensor_msgs/Imu`."""


def read_ulog(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read a ULog file: each topic and instance is a table, ``sensor_accel/0`` say."""
    try:
        from pyulog import ULog
    except ImportError:
        raise GfimuError(f"{path}: ULog needs pyulog, {_NEEDS}") from None
    with parsing(path, "ULog file", "download it again"), contextlib.redirect_stdout(io.StringIO()):
        log = ULog(str(path))
    tables = {}
    for topic in log.data_list:
        name = f"{topic.name}/{topic.multi_id}"
        columns = {key: np.asarray(values) for key, values in topic.data.items() if not key.startswith("_padding")}
        tables[name] = RawTable(name, columns)
    if not tables:
        raise InputError(f"{path}: a ULog file without a topic; log sensor_accel or sensor_combined")
    return RawFile(str(path), "ulog", tables)


def read_mcap(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the topics with ``sensor_msgs/Imu`` of an MCAP file that ROS 2 wrote."""
    try:
        from mcap.reader import make_reader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise GfimuError(f"{path}: MCAP needs mcap and rosbags, {_NEEDS}") from None
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
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise GfimuError(f"{path}: a ROS bag needs rosbags, {_NEEDS}") from None
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
