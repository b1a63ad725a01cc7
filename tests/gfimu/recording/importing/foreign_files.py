"""One motion of one chip with a gyro, written as the programs of others write it."""

import struct
import zipfile

import numpy as np

RATE = 100.0
N = 300
T = np.arange(N) / RATE
FORCE = np.column_stack(
    [9.7 + 0.5 * np.sin(3 * T), 0.8 * np.cos(2 * T) + 0.3, 1.2 * np.sin(5 * T + 1.0)]
)  # (n, 3), m/s²


def gyro(t):
    """Rates at times, (n, 3), rad/s."""
    return np.column_stack([0.4 * np.sin(4 * t), 1.5 * np.cos(3 * t), 0.1 + 0.2 * np.sin(t)])


GYRO = gyro(T)
START_NS = 1_403_636_579_758_555_392


def rows(path, header, columns, *, separator=",", end="", form="{:.9g}"):
    """Write a text file of columns."""
    lines = [separator.join(form.format(value) for value in row) + end for row in zip(*columns, strict=True)]
    path.write_text("\n".join([*header, *lines]) + "\n")
    return path


def klipper(path, start=1234.5, force=FORCE):
    times = [f"{start + t:.6f}" for t in T[: len(force)]]
    lines = [f"{t},{x:.6f},{y:.6f},{z:.6f}" for t, (x, y, z) in zip(times, 1000.0 * force, strict=True)]
    path.write_text("\n".join(["#time,accel_x,accel_y,accel_z", *lines]) + "\n")
    return path


def euroc(path):
    names = [f"w_RS_S_{axis} [rad s^-1]" for axis in "xyz"] + [f"a_RS_S_{axis} [m s^-2]" for axis in "xyz"]
    stamps = START_NS + np.round(T * 1e9).astype(np.int64)
    lines = [
        f"{stamp}," + ",".join(f"{value:.9f}" for value in (*rate, *force))
        for stamp, rate, force in zip(stamps, GYRO, FORCE, strict=True)
    ]
    path.write_text("\n".join([f"#timestamp [ns],{','.join(names)}", *lines]) + "\n")
    return path


def xsens_dot(path, first=4_294_000_000):
    header = ["sep=,", "PacketCounter,SampleTimeFine,Euler_X,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z,"]
    stamps = (first + np.round(T * 1e6).astype(np.int64)) % 2**32
    values = [np.arange(N), stamps, 10.0 * T, *FORCE.T, *np.degrees(GYRO).T]
    return rows(path, header, values, separator=", ", end=", ", form="{:.12g}")


def xsens_mt(path):
    header = [
        "// General information:",
        "//  MT Manager version: 2019.2",
        "// Update Rate: 100.0Hz",
        "\t".join(["PacketCounter", "SampleTimeFine", *(f"Acc_{a}" for a in "XYZ"), *(f"Gyr_{a}" for a in "XYZ")]),
    ]
    return rows(path, header, [np.arange(N), 7000 + np.arange(N) * 100, *FORCE.T, *GYRO.T], separator="\t")


def gcdc(path, counts_per_g=2048.0):
    header = [
        ";Title, http://www.gcdataconcepts.com, x16-1d, ADXL345",
        ";Start_time, 2016-01-04, 10:25:14.000",
        ";Temperature, -999.00, deg C, Vbat, 1444, mv",
        ";SampleRate, 100,Hz",
        ";Headers, time,Ax,Ay,Az",
    ]
    lines = [f"{t:.3f},{x:.0f},{y:.0f},{z:.0f}" for t, (x, y, z) in zip(T, FORCE / 9.80665 * counts_per_g, strict=True)]
    path.write_text("\n".join([*header, *lines, ";shutdown: switched off"]) + "\n")
    return path


def phyphox(path):
    """An experiment with two sensors, each with times of its own."""
    with zipfile.ZipFile(path, "w") as archive:
        text = ['"Time (s)","X (m/s^2)","Y (m/s^2)","Z (m/s^2)"']
        text += [f"{t:.9E}," + ",".join(f"{value:.9E}" for value in row) for t, row in zip(T, FORCE, strict=True)]
        archive.writestr("Accelerometer.csv", "\n".join(text))
        late = T + 0.003
        text = ['"Time (s)","X (rad/s)","Y (rad/s)","Z (rad/s)"']
        text += [f"{t:.9E}," + ",".join(f"{v:.9E}" for v in row) for t, row in zip(late, gyro(late), strict=True)]
        archive.writestr("Gyroscope.csv", "\n".join(text))
        archive.writestr("meta/device.csv", '"property","value"\n"deviceModel","phone"\n')
    return path


def sisfall(path):
    counts = np.round(
        np.column_stack([FORCE / 9.80665 * 256.0, np.degrees(GYRO) / 0.06103515625, FORCE / 9.80665 * 1024])
    )
    path.write_text("".join(",".join(f"{value:4.0f}" for value in row) + ";\n" for row in counts))
    return path


def ulog(path):
    """A log of PX4 with one topic, byte by byte as its file format says."""

    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    form = b"sensor_combined:uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;"
    content = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    content += message("F", form) + message("A", struct.pack("<BH", 0, 7) + b"sensor_combined")
    for t, rate, force in zip(T, GYRO, FORCE, strict=True):
        content += message("D", struct.pack("<HQ6f", 7, round(5e6 + t * 1e6), *rate, *force))
    path.write_bytes(content)
    return path


WARM = 30.0 + np.round(2.0 * np.sin(0.7 * T), 2)  # (n,), °C


def ulog_accel(path, *, warm=True):
    """A log of PX4 with the topic of one chip, with its temperature or, as some had it, without."""

    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    form = b"sensor_accel:uint64_t timestamp;float x;float y;float z;" + (b"float temperature;" if warm else b"")
    content = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    content += message("F", form) + message("A", struct.pack("<BH", 0, 7) + b"sensor_accel")
    for t, force, degrees in zip(T, FORCE, WARM, strict=True):
        values = (*force, degrees) if warm else force
        content += message("D", struct.pack(f"<HQ{len(values)}f", 7, round(5e6 + t * 1e6), *values))
    path.write_bytes(content)
    return path


def mpu6050(path):
    """What a usual sketch prints of an MPU-6050: g, °/s and °C."""
    header = ["time_ms,ax_g,ay_g,az_g,gx_deg_s,gy_deg_s,gz_deg_s,Temp"]
    return rows(path, header, [1e3 * T, *(FORCE / 9.80665).T, *np.degrees(GYRO).T, WARM])


def _messages(store):
    imu, header, stamp, vector, turn = (
        store.types[name]
        for name in (
            "sensor_msgs/msg/Imu",
            "std_msgs/msg/Header",
            "builtin_interfaces/msg/Time",
            "geometry_msgs/msg/Vector3",
            "geometry_msgs/msg/Quaternion",
        )
    )
    for t, rate, force in zip(T, GYRO, FORCE, strict=True):
        stamped = START_NS + round(t * 1e9)
        time = stamp(sec=stamped // 10**9, nanosec=stamped % 10**9)
        fields = {"seq": 0} if "seq" in header.__dataclass_fields__ else {}
        yield (
            stamped,
            imu(
                header=header(stamp=time, frame_id="imu", **fields),
                orientation=turn(x=0.0, y=0.0, z=0.0, w=1.0),
                orientation_covariance=np.zeros(9),
                angular_velocity=vector(*map(float, rate)),
                angular_velocity_covariance=np.zeros(9),
                linear_acceleration=vector(*map(float, force)),
                linear_acceleration_covariance=np.zeros(9),
            ),
        )


def mcap(path):
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="test")
        schema = writer.register_schema(name="sensor_msgs/msg/Imu", encoding="ros2msg", data=b"")
        channel = writer.register_channel(topic="/imu/data", message_encoding="cdr", schema_id=schema)
        for stamped, message in _messages(store):
            data = bytes(store.serialize_cdr(message, "sensor_msgs/msg/Imu"))
            writer.add_message(channel_id=channel, log_time=stamped, data=data, publish_time=stamped)
        writer.finish()
    return path


def bag_of_ros1(path):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer(path) as writer:
        connection = writer.add_connection("/imu/data", "sensor_msgs/msg/Imu", typestore=store)
        for stamped, message in _messages(store):
            writer.write(connection, stamped, store.serialize_ros1(message, "sensor_msgs/msg/Imu"))
    return path


def bag_of_ros2(path):
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(path, version=9) as writer:
        connection = writer.add_connection("/imu/data", "sensor_msgs/msg/Imu", typestore=store)
        for stamped, message in _messages(store):
            writer.write(connection, stamped, store.serialize_cdr(message, "sensor_msgs/msg/Imu"))
    return path
