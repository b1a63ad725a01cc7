"""MCAP files with a topic of `sensor_msgs/Imu` per chip, for ROS 2 and its viewers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gfimu.base.files.atomic_file import atomic_path
from gfimu.base.optional_packages import require
from gfimu.calibration.exporting.chips import ChipStream, chips_of, stamps_ns
from gfimu.recording import Recording

__all__ = ["write_mcap"]

_IMU = "sensor_msgs/msg/Imu"
_UNKNOWN = np.array([-1.0, *[0.0] * 8])
"""Covariance of what is not measured: a first element of −1, as `sensor_msgs/Imu` defines it."""


def write_mcap(file: str | Path, recording: Recording) -> None:
    """Write a recording as an MCAP file with a topic ``/imu/<chip>`` per tri-axial chip, whole or not at all.

    Raises
    ------
    GfimuError
        If mcap or rosbags are not installed.
    InputError
        If a chip has not three axes at right angles, or the file can't be written.
    """
    require(f"{file}: MCAP", "mcap", "rosbags")
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    streams, stamps = list(chips_of(recording)), stamps_ns(recording)
    definition, _ = store.generate_msgdef(_IMU, ros_version=2)
    with atomic_path(Path(file)) as temporary, temporary.open("wb") as output:
        writer = Writer(output)
        writer.start(profile="ros2", library="gfimu")
        schema = writer.register_schema(name=_IMU, encoding="ros2msg", data=definition.encode())
        topics = [
            writer.register_channel(topic=f"/imu/{one.chip.name}", message_encoding="cdr", schema_id=schema)
            for one in streams
        ]
        for row, stamp in enumerate(stamps.tolist()):
            for topic, stream in zip(topics, streams, strict=True):
                data = bytes(store.serialize_cdr(_message(store, stamp, stream, row), _IMU))
                writer.add_message(channel_id=topic, log_time=stamp, data=data, publish_time=stamp)
        writer.finish()


def _message(store: Any, stamp: int, stream: ChipStream, row: int) -> Any:
    kinds = store.types
    vector = kinds["geometry_msgs/msg/Vector3"]
    seconds, nanoseconds = divmod(stamp, 10**9)
    rate = np.zeros(3) if stream.rate is None else stream.rate[row]
    return kinds[_IMU](
        header=kinds["std_msgs/msg/Header"](
            stamp=kinds["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds), frame_id=stream.chip.name
        ),
        orientation=kinds["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=_UNKNOWN,
        angular_velocity=vector(*map(float, rate)),
        angular_velocity_covariance=_UNKNOWN if stream.rate is None else np.zeros(9),
        linear_acceleration=vector(*map(float, stream.force[row])),
        linear_acceleration_covariance=np.zeros(9),
    )
