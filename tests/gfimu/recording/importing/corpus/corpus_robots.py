"""Shapes of flight controllers, robots, printers and visual-inertial data sets."""

import numpy as np
from corpus_motion import Right, counts, motion, ms, ns, rows, shape, warming

ROS = "https://wiki.ros.org/rostopic"
EUROC = "https://projects.asl.ethz.ch/datasets/doku.php?id=kmavvisualinertialdatasets"


@shape(EUROC)
def euroc(d):
    m = motion(200.0, 8.0)
    names = [f"w_RS_S_{a} [rad s^-1]" for a in "xyz"] + [f"a_RS_S_{a} [m s^-2]" for a in "xyz"]
    path = rows(d / "data.csv", ["#timestamp [ns]," + ",".join(names)], [ns(m.t), *m.gyro.T, *m.force.T], line="\r\n")
    return Right(path, (m.force,), 200.0, m.gyro)


@shape("https://cvg.cit.tum.de/data/datasets/visual-inertial-dataset (TUM-VI, text for Basalt)")
def tum_vi_text(d):
    m = motion(200.0, 8.0)
    head = ["# timestamp[ns] w.x w.y w.z a.x a.y a.z"]
    return Right(rows(d / "imu.txt", head, [ns(m.t), *m.gyro.T, *m.force.T], " "), (m.force,), 200.0, m.gyro)


@shape("https://github.com/Sachini/ronin")
def ronin_hdf5(d):
    import h5py

    m = motion(200.0, 8.0)
    with h5py.File(d / "data.hdf5", "w") as file:
        file["synced/time"] = 84.2 + m.t
        file["synced/acce"] = m.force
        file["synced/gyro"] = m.gyro
        file["synced/linacce"] = m.force - m.gravity
        file["synced/grav"] = m.gravity
        file["pose/tango_pos"] = np.cumsum(m.gyro, axis=0) / 200.0
        file["pose/tango_ori"] = np.tile([1.0, 0, 0, 0], (len(m.t), 1)) + 0.01 * m.t[:, None]
    return Right(d / "data.hdf5", (m.force,), 200.0, m.gyro)


@shape("https://github.com/higerra/ridi_imu (RIDI)")
def ridi_csv(d):
    m = motion(200.0, 8.0)
    names = ["", "time"] + [f"{q}_{a}" for q in ("gyro", "acce", "linacce", "grav", "magnet", "pos") for a in "xyz"]
    values = [m.gyro, m.force, m.force - m.gravity, m.gravity, m.field, np.cumsum(m.gyro, axis=0) / 200.0]
    columns = [np.arange(len(m.t)), ns(m.t), *(column for one in values for column in one.T)]
    return Right(rows(d / "data.csv", [",".join(names)], columns), (m.force,), 200.0, m.gyro)


@shape("https://github.com/Klipper3d/klipper/blob/master/klippy/extras/adxl345.py")
def klipper(d):
    m = motion(3200.0, 1.5)
    path = rows(d / "raw_data_x.csv", ["#time,accel_x,accel_y,accel_z"], [1234.5 + m.t, *(1000 * m.force).T])
    return Right(path, (m.force,), 3200.0)


@shape("https://docs.duet3d.com (RepRapFirmware M956)")
def reprapfirmware(d):
    m = motion(1344.0, 1.5)
    tail = ["Rate 1344, overflows 3"]
    path = rows(d / "0_2024-05-17.csv", ["Sample,X,Y,Z"], [np.arange(len(m.t)), *m.g.T], form="{:.3f}", tail=tail)
    return Right(path, (m.force,), 1344.0, note="overflows 3")


@shape("https://github.com/betaflight/blackbox-tools (blackbox_decode)")
def betaflight(d):
    m = motion(250.0, 6.0)
    head = [
        '"Product","Blackbox flight data recorder by Nicholas Sherlock"',
        '"acc_1G",2048',
        '"gyro_scale","0x3f800000"',
        '"looptime",4000',
    ]
    names = [
        "loopIteration",
        "time",
        *(f"{q}[{k}]" for q in ("axisP", "rcCommand", "gyroADC", "accSmooth", "motor") for k in range(3)),
    ]
    noise = np.random.default_rng(0).integers(200, 1800, (9, len(m.t)))
    columns = [
        4 * np.arange(len(m.t)),
        np.round(1e6 * m.t).astype(int),
        *noise[:6],
        *counts(m.deg, 1),
        *counts(m.g, 2048),
        *noise[6:],
    ]
    return Right(rows(d / "LOG00001.01.csv", [*head, ",".join(names)], columns), (m.force,), 250.0, m.gyro)


@shape("https://github.com/betaflight/blackbox-tools (blackbox_decode with units)")
def betaflight_units(d):
    m = motion(250.0, 6.0)
    names = [
        "loopIteration",
        "time (us)",
        *(f"gyroADC[{k}] (deg/s)" for k in range(3)),
        *(f"accSmooth[{k}] (g)" for k in range(3)),
    ]
    columns = [4 * np.arange(len(m.t)), np.round(1e6 * m.t).astype(int), *counts(m.deg, 1), *m.g.T]
    return Right(rows(d / "LOG00001.01.csv", [", ".join(names)], columns, ", "), (m.force,), 250.0, m.gyro)


@shape("https://github.com/ArduPilot/pymavlink (mavlogdump.py --types IMU --format csv)")
def ardupilot_csv(d):
    m = motion(50.0)
    names = "timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz"
    whole = [np.full(len(m.t), k) for k in (0, 0)]
    columns = [("{:.8f}", 1_715_941_514.1 + m.t), np.round(98_231_412 + 1e6 * m.t).astype(int), np.zeros(len(m.t), int)]
    columns += [*m.gyro.T, *m.force.T, *whole, 0 * m.t + 45.2, np.ones(len(m.t), int), np.ones(len(m.t), int)]
    columns += [np.full(len(m.t), 1000), np.full(len(m.t), 1000)]
    return Right(rows(d / "IMU.csv", [names], columns), (m.force,), 50.0, m.gyro)


@shape("https://ardupilot.org/copter/docs/common-downloading-and-analyzing-data-logs-in-mission-planner.html (.log)")
def ardupilot_log(d):
    m = motion(50.0)
    lines = [
        "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
        "FMT, 131, 47, IMU, QBffffffIIfBBHH, TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz",
        "FMT, 132, 27, ATT, QccccCCBB, TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw",
        "PARM, 98000000, INS_GYR_ID, 2752772",
    ]
    for k, (t, w, f) in enumerate(zip(m.t, m.gyro, m.force, strict=True)):
        stamp = round(98_231_412 + 1e6 * t)
        cells = ", ".join(f"{one:.7f}" for one in (*w, *f))
        lines.append(f"IMU, {stamp}, 0, {cells}, 0, 0, 45.2, 1, 1, 1000, 1000")
        if k % 5 == 0:
            lines.append(f"ATT, {stamp}, 0.0, {f[0]:.2f}, 0.0, {f[1]:.2f}, 0, 12.5, 0, 0")
    (d / "00000012.log").write_text("\n".join(lines) + "\n")
    return Right(d / "00000012.log", (m.force,), 50.0, m.gyro)


@shape("https://github.com/PX4/pyulog (ulog2csv)")
def px4_sensor_combined(d):
    m = motion(200.0, 6.0)
    names = ["timestamp", *(f"gyro_rad[{k}]" for k in range(3)), "gyro_integral_dt", "accelerometer_timestamp_relative"]
    names += [*(f"accelerometer_m_s2[{k}]" for k in range(3)), "accelerometer_integral_dt", "accelerometer_clipping"]
    still = [np.full(len(m.t), k) for k in (5000, 0, 5000, 0)]
    columns = [np.round(31_412_345 + 1e6 * m.t).astype(int), *m.gyro.T, *still[:2], *m.force.T, *still[2:]]
    return Right(rows(d / "log_sensor_combined_0.csv", [",".join(names)], columns), (m.force,), 200.0, m.gyro)


@shape("https://github.com/PX4/pyulog (ulog2csv, sensor_accel)")
def px4_sensor_accel(d):
    m = motion(200.0, 6.0)
    names = "timestamp,timestamp_sample,device_id,x,y,z,temperature,error_count,"
    names += "clip_counter[0],clip_counter[1],clip_counter[2],samples"
    stamp = np.round(31_412_345 + 1e6 * m.t).astype(int)
    still = [np.full(len(m.t), k) for k in (2_490_378, 0, 0, 0, 0, 1)]
    columns = [stamp, stamp - 312, still[0], *m.force.T, warming(m, 44.125), *still[1:]]
    path = rows(d / "log_sensor_accel_0.csv", [names], columns)
    return Right(path, (m.force,), 200.0, references={"temperature_degC": warming(m, 44.125)})


@shape(ROS + " (rostopic echo -p)")
def rostopic_csv(d):
    m = motion()
    names = [
        "%time",
        "field.header.seq",
        "field.header.stamp",
        "field.header.frame_id",
        *(f"field.orientation.{a}" for a in "xyzw"),
    ]
    names += [f"field.orientation_covariance{k}" for k in range(9)] + [f"field.angular_velocity.{a}" for a in "xyz"]
    names += [f"field.angular_velocity_covariance{k}" for k in range(9)] + [
        f"field.linear_acceleration.{a}" for a in "xyz"
    ]
    names += [f"field.linear_acceleration_covariance{k}" for k in range(9)]
    still = [0 * m.t] * 9
    columns = [
        ns(m.t) + 120_000,
        np.arange(len(m.t)),
        ns(m.t),
        ["imu_link"] * len(m.t),
        *[0 * m.t] * 3,
        0 * m.t + 1,
        *still,
    ]
    columns += [*m.gyro.T, *still, *m.force.T, *still]
    return Right(rows(d / "imu.csv", [",".join(names)], columns), (m.force,), 100.0, m.gyro)


@shape("https://docs.ros.org (ros2 topic echo --csv)")
def ros2_topic_csv(d):
    m = motion()
    stamp = ns(m.t)
    covariance = [0 * m.t] * 9
    columns = [stamp // 10**9, stamp % 10**9, ["imu_link"] * len(m.t), *[0 * m.t] * 3, 0 * m.t + 1, *covariance]
    columns += [*m.gyro.T, *covariance, *m.force.T, *covariance]
    return Right(rows(d / "imu.csv", [], columns), (m.force,), 100.0, m.gyro)


@shape("https://github.com/bitcraze/crazyflie-clients-python (log to CSV)")
def crazyflie(d):
    m = motion()
    names = "Timestamp,acc.x,acc.y,acc.z,gyro.x,gyro.y,gyro.z"
    return Right(rows(d / "crazyflie.csv", [names], [ms(m.t, 10210), *m.g.T, *m.deg.T]), (m.force,), 100.0, m.gyro)


@shape("https://www.vectornav.com (ASCII $VNIMU)")
def vectornav_ascii(d):
    m = motion(40.0, 20.0)
    lines = []
    for k, (f, w, b) in enumerate(zip(m.force, m.gyro, m.field, strict=True)):
        cells = ",".join(f"{one:+.4f}" for one in (*(0.01 * b), *f, *w))
        lines.append(f"$VNIMU,{cells},+24.9,+101.303*{k % 256:02X}")
    (d / "vn.txt").write_text("\n".join(lines) + "\n")
    return Right(d / "vn.txt", (m.force,), None, m.gyro, doubt=True)


@shape("https://www.cvlibs.net/datasets/kitti (oxts, one line per frame)")
def kitti_oxts(d):
    m = motion(100.0)
    rng = np.random.default_rng(0)
    place = [49.011 + 1e-6 * m.t, 8.42 + 1e-6 * m.t, 112.8 + 0.01 * rng.standard_normal(len(m.t))]
    angles = [0.01 * m.gravity[:, 0], 0.01 * m.gravity[:, 1], np.cumsum(m.gyro[:, 2]) / 100.0]
    speeds = [*(np.cumsum(m.gyro, axis=0) / 30.0).T, *(0.02 * rng.standard_normal((2, len(m.t))))]
    state = [np.full(len(m.t), k) for k in (4, 11, 6, 6, 6)]
    columns = [
        *place,
        *angles,
        *speeds,
        *m.force.T,
        *m.force.T,
        *m.gyro.T,
        *m.gyro.T,
        0 * m.t + 0.05,
        0 * m.t + 0.01,
        *state,
    ]
    return Right(rows(d / "oxts.txt", [], columns, " ", "{:.9f}"), (m.force, m.force), None, m.gyro, doubt=True)
