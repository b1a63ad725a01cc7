"""Logs of flight controllers and robots: ULog of PX4, MCAP files and ROS bags with ``sensor_msgs/Imu``."""

from __future__ import annotations

import contextlib
import io
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gfimu.base.errors import InputError
from gfimu.base.files.input_file import MOST_COLUMNS, parsing
from gfimu.base.files.memory import MemoryLimit
from gfimu.base.optional_packages import require
from gfimu.recording.importing.column_map import TextSpec
from gfimu.recording.importing.raw_table import RawFile, RawTable

__all__ = ["IMU_COLUMNS", "read_bag", "read_mcap", "read_ulog"]

_IMU = "sensor_msgs/msg/Imu"
IMU_COLUMNS = (
    "stamp_ns",
    *(f"linear_acceleration.{axis}" for axis in "xyz"),
    *(f"angular_velocity.{axis}" for axis in "xyz"),
    *(f"orientation.{axis}" for axis in "xyzw"),
)
"""Columns of a topic with `sensor_msgs/Imu`."""

_MOST_READ = 8 << 20  # numerical: bytes that a parser may read of any file, and times the size besides
_MOST_TIMES_READ = 8
_LEAST_READ = 16  # numerical: bytes that a call costs as much as
_TIMES_ULOG = 3  # numerical: memory for a byte of a ULog file, measured
_TIMES_CHUNK = 3  # numerical: memory for a byte of the largest chunk of an MCAP file, unpacked
_ROW = 100  # numerical: bytes of a message in memory, while its column grows
_LOOKED_AT = 10_000  # messages between two looks at the limit


def read_ulog(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read a ULog file: each topic and instance is a table, ``sensor_accel/0`` say."""
    require(f"{path}: ULog", "pyulog")
    from pyulog import ULog

    MemoryLimit.of(path).needs(_TIMES_ULOG * path.stat().st_size)

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
    others: set[str] = set()

    def messages(reader: Any) -> Iterator[tuple[str, Any]]:
        for schema, channel, message in reader.iter_messages():
            if schema is None or schema.name not in {_IMU, "sensor_msgs/Imu"} or channel.message_encoding != "cdr":
                others.add(channel.topic)
            else:
                yield channel.topic, store.deserialize_cdr(message.data, _IMU)

    with parsing(path, "MCAP file", "mcap recover may repair it"), path.open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        if summary is not None:
            unpacked = max((index.uncompressed_size for index in summary.chunk_indexes), default=0)
            count = summary.statistics.message_count if summary.statistics else 0
            MemoryLimit.of(path).needs(_ROW * count + _TIMES_CHUNK * unpacked)
        return _topics(path, "mcap", messages(reader), others)


def read_bag(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the topics with ``sensor_msgs/Imu`` of a ROS bag: a ROS 1 file, or a folder of ROS 2."""
    require(f"{path}: a ROS bag", "rosbags")
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_typestore

    # The message as ROS defines it: of definitions in the bag rosbags would make Python code, and run it.
    if path.suffix == ".bag":
        opened, decode = rosbag1.Reader, get_typestore(Stores.ROS1_NOETIC).deserialize_ros1
    else:
        opened, decode = rosbag2.Reader, get_typestore(Stores.ROS2_HUMBLE).deserialize_cdr
    folder = path.parent if path.suffix == ".db3" else path
    with parsing(path, "ROS bag", "record it again"), opened(folder) as reader:
        imu = [connection for connection in reader.connections if connection.msgtype == _IMU]
        others = {one.topic for one in reader.connections} - {one.topic for one in imu}
        MemoryLimit.of(path).needs(_ROW * sum(one.msgcount for one in imu))
        found = reader.messages(connections=imu) if imu else ()
        return _topics(path, "rosbag", ((one.topic, decode(data, _IMU)) for one, _, data in found), others)


def _topics(path: Path, kind: str, messages: Iterable[tuple[str, Any]], others: set[str]) -> RawFile:
    """Gather the messages of ``sensor_msgs/Imu`` by topic, as far as memory is allowed."""
    limit = MemoryLimit.of(path)
    stamps: dict[str, array[int]] = {}
    values: dict[str, array[float]] = {}
    for count, (topic, message) in enumerate(messages):
        if count % _LOOKED_AT == 0:
            limit.needs(_ROW * count, at_least=True)
        stamp = message.header.stamp
        stamps.setdefault(topic, array("q")).append(stamp.sec * 10**9 + stamp.nanosec)
        values.setdefault(topic, array("d")).extend(
            getattr(getattr(message, name), axis) for name, _, axis in (one.partition(".") for one in IMU_COLUMNS[1:])
        )
    if not stamps:
        listed = ", ".join(sorted(others)[:8]) or "no topic at all"
        raise InputError(f"{path}: no topic with sensor_msgs/Imu; it has {listed}")
    tables = {}
    for topic, times in stamps.items():
        rows = np.frombuffer(values[topic]).reshape(len(times), -1)
        columns = dict(zip(IMU_COLUMNS, [np.frombuffer(times, dtype=np.int64), *rows.T], strict=True))
        tables[topic] = RawTable(topic, columns)
    return RawFile(str(path), kind, tables)
