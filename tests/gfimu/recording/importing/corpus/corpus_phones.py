"""Shapes of phones and watches."""

import io
import json
import zipfile

import numpy as np
from corpus_motion import Right, motion, ms, ns, rows, shape, stamps

SENSOR_LOGGER = "https://github.com/tszheichoi/awesome-sensor-logger"
PHYPHOX = "https://phyphox.org/wiki/index.php/Export_data_formats"


@shape(PHYPHOX)
def phyphox_csv(d):
    m = motion()
    head = [
        (
            '"Time (s)","Acceleration x (m/s^2)","Acceleration y (m/s^2)","Acceleration z (m/s^2)",'
            '"Absolute acceleration (m/s^2)"'
        )
    ]
    columns = [m.t + 0.0123, *m.force.T, np.linalg.norm(m.force, axis=1)]
    return Right(rows(d / "Raw Data.csv", head, columns, form="{:.9E}"), (m.force,), 100.0)


@shape(PHYPHOX)
def phyphox_without_gravity(d):
    m = motion()
    head = [
        (
            '"Time (s)","Linear Acceleration x (m/s^2)","Linear Acceleration y (m/s^2)",'
            '"Linear Acceleration z (m/s^2)","Absolute acceleration (m/s^2)"'
        )
    ]
    linear = m.force - m.gravity
    path = rows(d / "Raw Data.csv", head, [m.t, *linear.T, np.linalg.norm(linear, axis=1)], form="{:.9E}")
    return Right(path, refused="acceleration")


@shape(PHYPHOX)
def phyphox_semicolons_decimal_comma(d):
    m = motion()
    head = [
        (
            '"Time (s)";"Acceleration x (m/s^2)";"Acceleration y (m/s^2)";"Acceleration z (m/s^2)";'
            '"Absolute acceleration (m/s^2)"'
        )
    ]
    columns = [m.t, *m.force.T, np.linalg.norm(m.force, axis=1)]
    return Right(rows(d / "Raw Data.csv", head, columns, ";", "{:.9E}", mark=","), (m.force,), 100.0)


def sensor_logger(m, values):
    text = io.StringIO()
    text.write("time,seconds_elapsed,z,y,x\n")
    for stamp, t, (x, y, z) in zip(ns(m.t), m.t, values, strict=True):
        text.write(f"{stamp},{t + 0.0838:.7f},{z:.9f},{y:.9f},{x:.9f}\n")
    return text.getvalue()


@shape(SENSOR_LOGGER)
def sensor_logger_total_acceleration(d):
    m = motion()
    (d / "TotalAcceleration.csv").write_text(sensor_logger(m, m.force))
    return Right(d / "TotalAcceleration.csv", (m.force,), 100.0)


@shape(SENSOR_LOGGER)
def sensor_logger_zip(d):
    m = motion()
    with zipfile.ZipFile(d / "2024-05-17.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("Accelerometer.csv", sensor_logger(m, m.force - m.gravity))
        archive.writestr("Gravity.csv", sensor_logger(m, m.gravity))
        archive.writestr("Gyroscope.csv", sensor_logger(m, m.gyro))
        archive.writestr("TotalAcceleration.csv", sensor_logger(m, m.force))
    return Right(d / "2024-05-17.zip", (m.force,), 100.0, m.gyro)


@shape(SENSOR_LOGGER + "#json")
def sensor_logger_json(d):
    m = motion(50.0)
    records = [{"sensor": "Metadata", "version": "3", "device name": "phone"}]
    for stamp, t, f, w in zip(ns(m.t), m.t, m.force, m.gyro, strict=True):
        for name, (x, y, z) in (("TotalAcceleration", f), ("Gyroscope", w)):
            records.append(
                {
                    "sensor": name,
                    "time": str(stamp),
                    "seconds_elapsed": f"{t:.7f}",
                    "z": f"{z:.9f}",
                    "y": f"{y:.9f}",
                    "x": f"{x:.9f}",
                }
            )
    (d / "phone.json").write_text(json.dumps(records))
    return Right(d / "phone.json", (m.force,), 50.0, m.gyro)


@shape("https://www.vieyrasoftware.net (Physics Toolbox Sensor Suite)")
def physics_toolbox(d):
    m = motion()
    head = ["time,gFx,gFy,gFz,TgF"]
    columns = [m.t + 0.004, *m.g.T, np.linalg.norm(m.g, axis=1)]
    return Right(rows(d / "g-force.csv", head, columns, form="{:.4f}"), (m.force,), 100.0)


@shape("https://www.vieyrasoftware.net (Physics Toolbox Sensor Suite, several sensors)")
def physics_toolbox_roller_coaster(d):
    m = motion()
    head = ["time;gFx;gFy;gFz;wx;wy;wz;p;Bx;By;Bz;Azimuth;Pitch;Roll"]
    other = [0 * m.t + 1013.25, *m.field.T, *(18 + 9 * m.gravity.T)]
    columns = [m.t, *m.g.T, *m.gyro.T, *other]
    return Right(rows(d / "coaster.csv", head, columns, ";", "{:.4f}", mark=","), (m.force,), 100.0, m.gyro)


@shape("https://sensorlog.berndthomas.net")
def sensorlog_ios(d):
    m = motion()
    names = ["loggingTime(txt)", "loggingSample(N)", "locationSpeed(m/s)", "accelerometerTimestamp_sinceReboot(s)"]
    names += [f"accelerometerAcceleration{a}(G)" for a in "XYZ"] + ["gyroTimestamp_sinceReboot(s)"]
    names += [f"gyroRotation{a}(rad/s)" for a in "XYZ"] + [f"motionUserAcceleration{a}(G)" for a in "XYZ"]
    names += [f"motionGravity{a}(G)" for a in "XYZ"]
    user, gravity = (m.force - m.gravity) / 9.80665, m.gravity / 9.80665
    columns = [stamps(m.t, "{date}T{time}.{ms}+02:00"), np.arange(len(m.t)), 0 * m.t - 1.0, 81234.5 + m.t, *m.g.T]
    columns += [81234.502 + m.t, *m.gyro.T, *user.T, *gravity.T]
    return Right(rows(d / "sensorlog.csv", [",".join(names)], columns), (m.force,), 100.0, m.gyro)


@shape("https://play.google.com/store/apps/details?id=com.fivasim.androsensor")
def androsensor(d):
    m = motion(50.0)
    names = [f"{what} {a} (m/s²)" for what in ("ACCELEROMETER", "GRAVITY", "LINEAR ACCELERATION") for a in "XYZ"]
    names += [f"GYROSCOPE {a} (rad/s)" for a in "XYZ"] + [
        "SOUND LEVEL (dB)",
        "Time since start in ms ",
        "YYYY-MO-DD HH-MI-SS_SSS",
    ]
    other = [0 * m.t + 40.1, ms(m.t, 12.0), stamps(m.t, "{date} {time}:{ms}")]
    columns = [*m.force.T, *m.gravity.T, *(m.force - m.gravity).T, *m.gyro.T, *other]
    return Right(rows(d / "Sensor_record.csv", [";".join(names)], columns, ";", "{:.4f}"), (m.force,), 50.0, m.gyro)


@shape("https://github.com/AhmedHamedTN/SensorLogger")
def android_sensor_logger(d):
    m = motion(50.0)
    head = ["#walk", "time[ms]; x-axis[m/s^2]; y-axis[m/s^2]; z-axis[m/s^2]"]
    return Right(rows(d / "walk.csv", head, [ms(m.t, 728), *m.force.T], ";"), (m.force,), 50.0)


@shape("https://www.cis.fordham.edu/wisdm/dataset.php")
def wisdm_raw(d):
    m = motion(20.0, 24.0)
    columns = [["33"] * len(m.t), ["Jogging"] * len(m.t), ns(m.t) // 1000 * 1000, *m.force.T]
    return Right(rows(d / "WISDM_ar_v1.1_raw.txt", [], columns, end=";"), (m.force,), 20.0)


@shape("https://github.com/mmalekzadeh/motion-sense")
def motionsense(d):
    m = motion(50.0)
    names = ["", *(f"attitude.{a}" for a in ("roll", "pitch", "yaw")), *(f"gravity.{a}" for a in "xyz")]
    names += [f"rotationRate.{a}" for a in "xyz"] + [f"userAcceleration.{a}" for a in "xyz"]
    gravity, user = m.gravity / 9.80665, (m.force - m.gravity) / 9.80665
    columns = [np.arange(len(m.t)), *(0.1 * m.gravity.T), *gravity.T, *m.gyro.T, *user.T]
    return Right(rows(d / "sub_1.csv", [",".join(names)], columns), refused="acceleration")


@shape("https://github.com/espruino/BangleApps/tree/master/apps/accellog")
def bangle_accellog(d):
    m = motion(12.5, 48.0)
    return Right(
        rows(d / "accellog.1.csv", ["Time (ms),X,Y,Z"], [ms(m.t, 80), *m.g.T], form="{:.4f}"), (m.force,), 12.5
    )


@shape("https://github.com/AaltoVision/ADVIO")
def advio_accelerometer(d):
    m = motion()
    return Right(rows(d / "accelerometer.csv", [], [m.t + 0.1, *m.force.T]), (m.force,), 100.0)
