"""Shapes written after public sources before gfimu had read any of them: boards, cameras, cars, rockets, data sets."""

import gzip
import json

import numpy as np
from corpus_motion import G, Right, counts, motion, ms, ns, rows, shape, stamps, warming
from scipy.spatial.transform import Rotation

ZEPHYR = "https://github.com/zephyrproject-rtos/zephyr/tree/main/samples/sensor"
RACECHRONO = "https://racechrono.com"


def lines(path, made):
    path.write_text("\n".join(made) + "\n", encoding="utf-8")
    return path


def same(m, text):
    """Return a column of one text."""
    return [text] * len(m.t)


def attitude(m):
    """Return roll, pitch and yaw, rad."""
    x, y, z = m.gravity.T
    return np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z)), np.cumsum(m.gyro[:, 2]) * (m.t[1] - m.t[0])


# Serial output of boards


@shape("https://playground.arduino.cc/Main/MPU-6050 (short example sketch)")
def mpu6050_bars(d):
    m = motion()
    made = [
        f"AcX = {a} | AcY = {b} | AcZ = {c} | Tmp = 26.53 | GyX = {p} | GyY = {q} | GyZ = {r}"
        for a, b, c, p, q, r in zip(*counts(m.g, 16384), *counts(m.deg, 131), strict=True)
    ]
    return Right(lines(d / "putty.log", made), (m.force,), None, m.gyro, doubt=True)


@shape("https://github.com/raspberrypi/pico-examples (i2c/mpu6050_i2c)")
def pico_examples_mpu6050(d):
    m = motion()
    made = ["Hello, MPU6050! Reading raw data from registers..."]
    for (a, b, c), (p, q, r) in zip(counts(m.g, 16384).T, counts(m.deg, 131).T, strict=True):
        made += [f"Acc. X = {a}, Y = {b}, Z = {c}", f"Gyro. X = {p}, Y = {q}, Z = {r}", "Temp. = 26.530000"]
    return Right(lines(d / "minicom.cap", made), (m.force,), None, m.gyro, doubt=True)


@shape(ZEPHYR + "/mpu6050")
def zephyr_mpu6050(d):
    m = motion()
    made = ["*** Booting Zephyr OS build v3.6.0 ***"]
    for t, f, w in zip(stamps(m.t, "{time}.{ms}"), m.force, m.gyro, strict=True):
        made += [f"[0{t[2:].replace(':25:', ':00:')}]:26.53 Cel"]
        made += ["  accel {:f} {:f} {:f} m/s/s".format(*f), "  gyro  {:f} {:f} {:f} rad/s".format(*w)]
    return Right(lines(d / "mpu6050.txt", made), (m.force,), 100.0, m.gyro)


@shape(ZEPHYR + "/accel_polling")
def zephyr_accel_polling(d):
    m = motion()
    made = ["*** Booting Zephyr OS build v3.6.0 ***"]
    for f, s in zip(*m.chips[:2], strict=True):
        made += ["{:>16s} [m/s^2]:    ({:12.6f}, {:12.6f}, {:12.6f})".format("adxl345@53", *f)]
        made += ["{:>16s} [m/s^2]:    ({:12.6f}, {:12.6f}, {:12.6f})".format("lis2dh@18", *s)]
    return Right(lines(d / "polling.txt", made), m.chips[:2], None)


@shape("https://github.com/sparkfun/SparkFun_ICM-20948_ArduinoLibrary (Example1_Basics)")
def sparkfun_icm20948(d):
    m = motion()

    def group(values):
        return ", ".join(("-" if one < 0 else " ") + f"{abs(one):08.2f}" for one in values)

    made = ["Initialization of the sensor returned: All is well."]
    for f, w, b in zip(1000 * m.g, m.deg, m.field, strict=True):
        names = zip(("Scaled. Acc (mg)", "Gyr (DPS)", "Mag (uT)", "Tmp (C)"), (f, w, b, [25.78]), strict=True)
        made += [", ".join(f"{name} [ {group(values)} ]" for name, values in names)]
    warmth = {"temperature_degC": np.full(len(m.t), 25.78)}
    return Right(lines(d / "icm20948.txt", made), (m.force,), None, m.gyro, warmth)


@shape("https://github.com/arduino-libraries/Arduino_LSM6DS3 (SimpleAccelerometer)")
def arduino_simple_accelerometer(d):
    m = motion(104.0)
    head = ["Accelerometer sample rate = 104.00 Hz", "", "Acceleration in g's", "X\tY\tZ"]
    return Right(rows(d / "nano33.txt", head, m.g.T, "\t", "{:.2f}"), (m.force,), 104.0)


@shape("https://github.com/arduino/ArduinoTensorFlowLiteTutorials (IMU_Capture)")
def arduino_imu_capture(d):
    m = motion(119.0)
    made = ["aX,aY,aZ,gX,gY,gZ"]
    for place, row in enumerate(np.column_stack([m.g, m.deg])):
        made += [",".join(f"{one:.3f}" for one in row)] + [""] * (place % 119 == 118)
    return Right(lines(d / "punch.csv", made), (m.force,), None, m.gyro)


@shape("https://github.com/kriswiner/MPU9250 (MPU9250BasicAHRS)")
def kriswiner_mpu9250(d):
    m = motion()
    made = ["MPU9250", "I AM 71 I should be 71", "MPU9250 is online..."]
    for f, w, b in zip(1000 * m.g, m.deg, 10 * m.field, strict=True):
        made += ["ax = {:.2f} ay = {:.2f} az = {:.2f} mg".format(*f)]
        made += ["gx = {:.2f} gy = {:.2f} gz = {:.2f} deg/s".format(*w)]
        made += ["mx = {:.0f} my = {:.0f} mz = {:.0f} mG".format(*b)]
    return Right(lines(d / "mpu9250.txt", made), (m.force,), None, m.gyro)


@shape("https://github.com/sparkfun/SparkFun_LSM9DS1_Arduino_Library (LSM9DS1_Basic_I2C)")
def sparkfun_lsm9ds1(d):
    m = motion()
    made = []
    for f, w, b in zip(m.g, m.deg, 0.01 * m.field, strict=True):
        made += ["G: {:.2f}, {:.2f}, {:.2f} deg/s".format(*w), "A: {:.2f}, {:.2f}, {:.2f} g".format(*f)]
        made += ["M: {:.2f}, {:.2f}, {:.2f} gauss".format(*b)]
        made += [f"Pitch, Roll: {60 * f[0]:.2f}, {60 * f[1]:.2f}", f"Heading: {90 * b[0]:.2f}", ""]
    return Right(lines(d / "lsm9ds1.txt", made), (m.force,), None, m.gyro)


@shape("https://github.com/sparkfun/9DOF_Razor_IMU (SAMD21 firmware, log on a card)")
def sparkfun_razor(d):
    m = motion()
    columns = [ms(m.t), *m.g.T, *m.deg.T, *m.field.T]
    return Right(rows(d / "log0.txt", [], columns, ", ", "{:.2f}"), (m.force,), 100.0, m.gyro)


@shape("https://github.com/adafruit/Adafruit_CircuitPython_LIS3DH (lis3dh_simpletest)")
def circuitpython_lis3dh(d):
    m = motion()
    made = ["x = {:.3f} G, y = {:.3f} G, z = {:.3f} G".format(*f) for f in m.g]
    return Right(lines(d / "lis3dh.txt", made), (m.force,), None)


@shape("https://github.com/PLab-SI/PicoQuake (acquisition CSV)")
def picoquake(d):
    m = motion(2000.0, 3.0)
    head = [
        "# PLab PicoQuake Data",
        "# Time: 2024-04-21 15:54:46.333682, Device: D4E9 (E6632891E36F2029)",
        f"# Num. samples: {len(m.t)}, Duration: 3.0 s",
        "# Config: data_rate = 2000.0 Hz, filter = 488 Hz, acc_range = 4 g, gyro_range = 250.0 dps",
        "# Integrity: True, Skipped samples: 0",
        "count,a_x,a_y,a_z,g_x,g_y,g_z",
    ]
    columns = [1 + np.arange(len(m.t)), *m.g.T, *m.deg.T]
    return Right(rows(d / "D4E9.csv", head, columns, form="{:.5f}"), (m.force,), 2000.0, m.gyro)


@shape("https://github.com/torvalds/linux/tree/master/tools/iio (iio_generic_buffer)")
def iio_generic_buffer(d):
    m = motion()
    columns = [*m.force.T, *m.gyro.T, ns(m.t)]
    return Right(rows(d / "iio.txt", [], columns, " ", end=" "), (m.force,), 100.0, m.gyro)


@shape("https://docs.gyroflow.xyz (gcsv, scales in the head)")
def gyroflow_gcsv(d):
    m = motion(200.0)
    head = [
        "GYROFLOW IMU LOG",
        "version,1.3",
        "id,custom_logger_name",
        "orientation,YxZ",
        "note,development_test",
        "fwversion,FIRMWARE_0.1.0",
        "timestamp,1644159993",
        "vendor,potatocam",
        "videofilename,videofilename.mp4",
        "lensprofile,potatocam/potatocam_mark1_prime_7_5mm_4k",
        "lens_info,wide",
        "frame_readout_time,15.23",
        "frame_readout_direction,0",
        "tscale,0.001",
        "gscale,0.00122173047",
        "ascale,0.00048828125",
        "t,gx,gy,gz,ax,ay,az",
    ]
    columns = [ms(m.t, 0), *counts(m.gyro, 1 / 0.00122173047), *counts(m.g, 2048)]
    return Right(rows(d / "video.gcsv", head, columns), (m.force,), 200.0, m.gyro)


@shape("https://dl-cdn.ryzerobotics.com/downloads/Tello (SDK 2.0, state)")
def tello_state(d):
    m = motion(10.0, 60.0)
    made = [
        f"mid:-1;x:-100;y:-100;z:-100;mpry:0,0,0;pitch:{60 * a / 1000:.0f};roll:{60 * b / 1000:.0f};yaw:2;"
        f"vgx:0;vgy:0;vgz:0;templ:62;temph:65;tof:10;h:0;bat:87;baro:47.65;time:0;agx:{a:.2f};agy:{b:.2f};agz:{c:.2f};"
        for a, b, c in np.round(1000 * m.g)
    ]
    return Right(lines(d / "state.txt", made), (m.force,), None, doubt=True)


# Cameras, glasses, cars


@shape("https://github.com/orbbec/pyorbbecsdk (save_imu_data)")
def orbbec_types_in_turn(d):
    m = motion()
    made = ["timestamp,type,x,y,z"]
    for t, f, w in zip(ms(m.t), m.force, m.gyro, strict=True):
        made += ["{},accel,{:.9f},{:.9f},{:.9f}".format(t, *f), "{},gyro,{:.9f},{:.9f},{:.9f}".format(t, *w)]
    return Right(lines(d / "imu_data.csv", made), (m.force,), 100.0, m.gyro)


@shape("own: a script with pykinect_azure, IMU of a recording")
def kinect_azure(d):
    m = motion(1000.0, 4.0)
    head = ["acc_timestamp_usec,acc_x,acc_y,acc_z,gyro_timestamp_usec,gyro_roll,gyro_pitch,gyro_yaw"]
    t = np.round(533_211 + 1e6 * m.t).astype(int)
    return Right(rows(d / "imu.csv", head, [t, *m.force.T, t + 3, *m.gyro.T]), (m.force,), 1000.0, m.gyro)


@shape("https://www.tobii.com (Pro Glasses 3, imudata.gz)")
def tobii_glasses(d):
    m = motion()
    made = []
    for place, (t, f, w, b) in enumerate(zip(m.t.tolist(), m.force, m.deg, m.field, strict=True)):
        data = {"accelerometer": f.round(5).tolist(), "gyroscope": w.round(5).tolist()}
        made += [json.dumps({"type": "imu", "timestamp": round(t + 0.037, 6), "data": data})]
        if place % 10 == 0:
            made += [
                json.dumps(
                    {"type": "imu", "timestamp": round(t + 0.039, 6), "data": {"magnetometer": b.round(4).tolist()}}
                )
            ]
    (d / "imudata.gz").write_bytes(gzip.compress(("\n".join(made) + "\n").encode()))
    return Right(d / "imudata.gz", (m.force,), 100.0, m.gyro)


@shape("https://docs.pupil-labs.com (Pupil Cloud, imu.csv)")
def pupil_cloud(d):
    m = motion(200.0)
    names = ["section id", "recording id", "timestamp [ns]", *(f"gyro {a} [deg/s]" for a in "xyz")]
    names += [*(f"acceleration {a} [g]" for a in "xyz"), "roll [deg]", "pitch [deg]"]
    key = same(m, "5b2f1a0e-1f0b-4e1c-9f6e-2d9c3c1a7f10")
    columns = [key, key, ns(m.t), *m.deg.T, *m.g.T, *(9 * m.gravity[:, :2].T)]
    return Right(rows(d / "imu.csv", [",".join(names)], columns), (m.force,), 200.0, m.gyro)


@shape("https://github.com/JuanIrache/gopro-telemetry (ACCL, CSV)")
def gopro_accl(d):
    m = motion(200.0)
    columns = [("{:.6f}", 153.538 + 1000 * m.t), stamps(m.t, "{date}T{time}.{ms}Z"), *m.force.T]
    head = ["cts,date,Accelerometer [m/s2],1,2"]
    return Right(rows(d / "GX012799_ACCL.csv", head, columns, form="{:.12f}"), (m.force,), 200.0)


@shape("https://torque-bhp.com (Torque Pro, track log)")
def torque_pro(d):
    m = motion(10.0, 60.0)
    names = "GPS Time, Device Time, Longitude, Latitude,GPS Speed (Meters/second), Horizontal Dilution of Precision,"
    names += " Altitude, Bearing, G(x), G(y), G(z), G(calibrated),Engine RPM(rpm)"
    columns = [same(m, "Fri May 17 10:25:14 GMT+02:00 2024"), stamps(m.t, "17-May-2024 {time}.{ms}")]
    columns += [("{:.8f}", 11.5 + 1e-5 * m.t), ("{:.8f}", 48.1 + 1e-5 * m.t), ("{:.2f}", 13 + np.sin(m.t))]
    columns += [same(m, "4.0"), same(m, "512.0"), same(m, "33.1"), *(("{:.8f}", one) for one in m.force.T)]
    columns += [("{:.2f}", m.g[:, 2] - 1), same(m, "-")]
    return Right(rows(d / "trackLog.csv", [names], columns), (m.force,), 10.0)


@shape(RACECHRONO + " (CSV, version 3)")
def racechrono(d):
    m = motion(50.0)
    head = [
        "This file is created using RaceChrono v9.1.3 ( http://racechrono.com/ ).",
        "Format,3",
        'Session title,"Barber Motorsports Park"',
        "Session type,Lap timing",
        'Track name,"Barber Motorsports Park"',
        "Driver name,",
        "Created,21/02/2026,22:12",
        "Note,",
        "",
    ]
    names = ["timestamp", "fragment_id", "lap_number", "elapsed_time", "distance_traveled", "accuracy", "latitude"]
    names += ["longitude", "satellites", "speed", "combined_acc", "device_update_rate", "lateral_acc", "lean_angle"]
    names += ["longitudinal_acc", "device_update_rate", "x_acc", "y_acc", "z_acc", "device_update_rate"]
    names += [f"{a}_rate_of_rotation" for a in "xyz"]
    sources = [""] * 5 + ["100: gps"] * 5 + ["calc"] * 5 + ["101: acc"] * 4 + ["102: gyro"] * 4
    units = "unix time,,,s,m,m,deg,deg,sats,m/s,G,Hz,G,deg,G,Hz,G,G,G,Hz,deg/s,deg/s,deg/s"
    head += [",".join(names), units, ",".join(sources)]
    slow = np.sin(0.3 * m.t)
    columns = [("{:.3f}", 1715941514.123 + m.t), same(m, "0"), same(m, "4"), ("{:.3f}", 343.1 + m.t), 3596 + 13 * m.t]
    columns += [same(m, "0.9"), 56.599 + 1e-6 * m.t, 23.69 + 1e-6 * m.t, same(m, "13"), 13 + slow, np.abs(slow)]
    columns += [same(m, "20.0"), slow, 20 * slow, 0.3 * np.cos(m.t), same(m, "50.0"), *m.g.T, same(m, "50.0"), *m.deg.T]
    return Right(rows(d / "session_v3.csv", head, columns, form="{:.5f}"), (m.force,), 50.0, m.gyro)


@shape("https://www.aim-sportline.com (Race Studio, CSV)")
def aim_csv(d):
    m = motion(20.0, 40.0)
    head = [
        '"Format","AiM CSV File"',
        '"Session","Practice"',
        '"Vehicle","CT-16EV"',
        '"Racer","Test"',
        '"Championship",""',
        '"Comment",""',
        '"Date","Friday, May 17, 2024"',
        '"Time","10:25 AM"',
        '"Sample Rate","20"',
        f'"Duration","{len(m.t) / 20:.3f}"',
        '"Segment","Session"',
        f'"Beacon Markers","{len(m.t) / 20:.3f}"',
        "",
        '"Time","GPS Speed","RPM","InlineAcc","LateralAcc","VerticalAcc","RollRate","PitchRate","YawRate"',
        '"s","km/h","rpm","g","g","g","deg/s","deg/s","deg/s"',
        "",
    ]
    columns = [m.t, 40 + 3 * np.sin(m.t), 0 * m.t, *m.g.T, *m.deg.T]
    columns = [[f'"{one:.4f}"' for one in column] for column in columns]
    return Right(rows(d / "aim.csv", head, columns), (m.force,), 20.0, m.gyro)


@shape("https://www.motec.com.au (i2 Pro, CSV)")
def motec_csv(d):
    m = motion(50.0, 20.0)
    head = [
        '"Format","MoTeC CSV File",,,"Workbook",""',
        '"Venue","Winton",,,"Worksheet",""',
        '"Vehicle","Car",,,"Vehicle Desc",""',
        '"Driver","Test",,,"Engine ID",""',
        '"Device","ADL3"',
        '"Comment","",,,"Session","2"',
        '"Log Date","17/05/2024",,,"Origin Time","0.000","s"',
        '"Log Time","10:25:14",,,"Start Time","0.000","s"',
        '"Sample Rate","50.000","Hz",,"End Time","20.000","s"',
        '"Duration","20.000","s",,"Start Distance","0","m"',
        '"Range","entire outing",,,"End Distance","512","m"',
        '"Beacon Markers",""',
        "",
        "",
        '"Time","Ground Speed","G Force Long","G Force Lat","G Force Vert"',
        '"s","km/h","G","G","G"',
        "",
        "",
    ]
    columns = [("{:.3f}", m.t), ("{:.1f}", 40 + 3 * np.sin(m.t)), *(("{:.3f}", one) for one in m.g.T)]
    columns = [[f'"{form.format(one)}"' for one in values] for form, values in columns]
    return Right(rows(d / "motec.csv", head, columns), (m.force,), 50.0)


@shape("https://racelogic.support (VBOX, .vbo)")
def racelogic_vbo(d):
    m = motion(100.0)
    head = ["File created on 17/05/2024 at 10:25:14", "", "[header]", "satellites", "time", "latitude", "longitude"]
    head += ["velocity kmh", "heading", "height", "X_Accel", "Y_Accel", "Z_Accel", "", "[channel units]", "g", "g", "g"]
    head += ["", "[comments]", "(c) 2001 2003 Racelogic", "VBOX Version 2.5", "", "[column names]"]
    head += ["sats time lat long velocity heading height X_Accel Y_Accel Z_Accel ", "", "[data]"]
    columns = [same(m, "011"), stamps(m.t, "{time}.{ms}"), same(m, "+03119.09973"), same(m, "+00058.49277")]
    columns[1] = [one.replace(":", "")[:-1] for one in columns[1]]
    columns += [
        ("{:07.3f}", 10 + np.sin(m.t)),
        same(m, "347.92"),
        same(m, "+00103.45"),
        *(("{:+.5E}", a) for a in m.g.T),
    ]
    return Right(rows(d / "VBOX0001.vbo", head, columns, " ", line="\r\n"), (m.force,), 100.0)


# Rockets, drones


@shape("https://www.featherweightaltimeters.com (Blue Raven, high rate)")
def blue_raven(d):
    m = motion(500.0, 8.0)
    names = "Year,Month,Day,Time,Flight_Time_(s),Sync,Gyro_X,Gyro_Y,Gyro_Z,Accel_X,Accel_Y,Accel_Z"
    names += ",Quat_1,Quat_2,Quat_3,Quat_4"
    columns = [same(m, "2024"), same(m, "5"), same(m, "17"), stamps(m.t, "{time}.{ms}"), ("{:.3f}", m.t - 0.1)]
    columns += [same(m, "0"), *(("{:.2f}", w) for w in m.deg.T), *(("{:.3f}", a) for a in m.g.T)]
    columns += [np.cos(0.1 * m.t), np.sin(0.1 * m.t), 0 * m.t, 0 * m.t]
    return Right(rows(d / "high_rate.csv", [names], columns, form="{:.5f}"), (m.force,), 500.0, m.gyro)


@shape("https://altusmetrum.org/AltOS (CSV of a flight)")
def altos_csv(d):
    m = motion()
    names = "#version,serial,flight,call,time,state,state_name,acceleration,pressure,altitude,height,speed,temperature"
    names += ",battery_voltage,drogue_voltage,main_voltage,accel_along,accel_across,accel_through,gyro_roll,gyro_pitch"
    names += ",gyro_yaw,mag_along,mag_across,mag_through"
    columns = [same(m, "6"), same(m, "4225"), same(m, "15"), same(m, "KD7SQG"), ("{:8.2f}", m.t), same(m, " 2")]
    columns += [same(m, "     pad"), ("{:8.2f}", m.force[:, 0] - G), ("{:9.2f}", 101325 + 3 * np.sin(m.t))]
    columns += [("{:7.2f}", 120 + 0.3 * np.sin(m.t)), ("{:7.2f}", 0.3 * np.sin(m.t)), ("{:8.2f}", 0.3 * np.cos(m.t))]
    columns += [same(m, "  24.1"), same(m, " 4.02"), same(m, " 3.98"), same(m, " 3.97")]
    columns += [*(("{:7.2f}", one) for one in (*m.force.T, *m.deg.T)), *(("{:7.3f}", one) for one in 0.01 * m.field.T)]
    return Right(rows(d / "flight.csv", [names], columns), (m.force,), 100.0, m.gyro)


@shape("https://datfile.net (DatCon, CSV of a DJI log)")
def dji_datcon(d):
    m = motion(200.0)
    names = ["Clock:Tick#", "Clock:offsetTime", "IMU_ATTI(0):Longitude", "IMU_ATTI(0):Latitude"]
    names += [f"IMU_ATTI(0):{q}{a}" for q in ("accel", "gyro", "mag") for a in "XYZ"]
    names += ["IMU_ATTI(0):accelComposite:C", "IMU_ATTI(0):temperature", "Motor:Speed:RFront"]
    size = np.linalg.norm(m.g, axis=1)
    columns = [np.round(3_211_455 + 4.5e6 * m.t).astype(int), ("{:.3f}", m.t - 1.2), 0 * m.t + 11.5, 0 * m.t + 48.1]
    columns += [*m.g.T, *m.deg.T, *(10 * m.field.T), size, 0 * m.t + 65.0, np.zeros(len(m.t), int)]
    return Right(rows(d / "FLY125.csv", [",".join(names)], columns), (m.force,), 200.0, m.gyro)


@shape("https://github.com/PX4/pyulog (ulog2csv, vehicle_imu: increments)")
def px4_vehicle_imu(d):
    m = motion(200.0)
    names = ["timestamp", "timestamp_sample", *(f"delta_angle[{k}]" for k in range(3))]
    names += [*(f"delta_velocity[{k}]" for k in range(3)), "delta_angle_dt", "delta_velocity_dt", "accel_device_id"]
    t = np.round(1e6 * m.t).astype(int) + 8_123_456
    columns = [t + 300, t, *(m.gyro.T / 200), *(m.force.T / 200), same(m, "5000"), same(m, "5000"), same(m, "3670026")]
    path = rows(d / "log_vehicle_imu_0.csv", [",".join(names)], columns, form="{:.9f}")
    return Right(path, refused="acceleration", doubt=True)


@shape("https://github.com/ArduPilot/pymavlink (mavlogdump.py --types SCALED_IMU --format csv)")
def mavlink_scaled_imu(d):
    m = motion(50.0, 20.0)
    head = ["timestamp,time_boot_ms,xacc,yacc,zacc,xgyro,ygyro,zgyro,xmag,ymag,zmag,temperature"]
    columns = [("{:.8f}", 1715941514.123 + m.t), ms(m.t), *counts(m.g, 1000), *counts(m.gyro, 1000)]
    columns += [*counts(m.field, 10), same(m, "3150")]
    return Right(rows(d / "tlog.csv", head, columns), (m.force,), 50.0, m.gyro, doubt=True)


@shape("https://github.com/jmscslgroup/bagpy (message_by_topic)")
def bagpy_csv(d):
    m = motion(200.0)
    names = ["Time", "header.seq", "header.stamp.secs", "header.stamp.nsecs", "header.frame_id"]
    names += [f"orientation.{a}" for a in "xyzw"] + [f"orientation_covariance_{k}" for k in range(9)]
    names += [f"angular_velocity.{a}" for a in "xyz"] + [f"angular_velocity_covariance_{k}" for k in range(9)]
    names += [f"linear_acceleration.{a}" for a in "xyz"] + [f"linear_acceleration_covariance_{k}" for k in range(9)]
    stamp = ns(m.t)
    zeros = [same(m, "0.0")] * 9
    late = ("{:.9f}", 1715941514.125 + m.t + 0.0004 * np.random.default_rng(0).random(len(m.t)))
    columns = [late, np.arange(len(m.t)), stamp // 10**9, stamp % 10**9, same(m, "imu_link")]
    columns += [np.sin(0.1 * m.t), 0 * m.t, 0 * m.t, np.cos(0.1 * m.t), *zeros, *m.gyro.T, *zeros, *m.force.T, *zeros]
    return Right(rows(d / "imu-data.csv", [",".join(names)], columns, form="{:.9f}"), (m.force,), 200.0, m.gyro)


@shape("https://github.com/facontidavide/PlotJuggler (export to CSV)")
def plotjuggler_csv(d):
    m = motion()
    names = ["__time", *(f"/imu/data/angular_velocity/{a}" for a in "xyz"), "/imu/data/header/seq"]
    names += [f"/imu/data/linear_acceleration/{a}" for a in "xyz"] + ["/odom/twist/twist/linear/x"]
    speed = [f"{np.sin(t):.6f}" if place % 5 == 0 else "" for place, t in enumerate(m.t)]
    columns = [("{:.9f}", 1715941514.123 + m.t), *m.gyro.T, np.arange(len(m.t)), *m.force.T, speed]
    return Right(rows(d / "export.csv", [",".join(names)], columns), (m.force,), 100.0, m.gyro)


@shape("https://docs.novatel.com (RAWIMUSA, counts)")
def novatel_rawimu(d):
    m = motion()
    made = [
        f"%RAWIMUSA,2314,{440714.123 + t:.3f};2314,{440714.1234 + t:.9f},00000077,"
        f"{z},{-y},{x},{r},{-q},{p}*{17 * k % 2**32:08x}"
        for k, (t, x, y, z, p, q, r) in enumerate(
            zip(m.t, *counts(m.force, 0.01 * 2**15 / 0.05), *counts(m.deg, 36 * 256 / 0.1), strict=True)
        )
    ]
    return Right(lines(d / "span.ASC", made), refused="acceleration|scale", doubt=True)


# Data sets


@shape("https://sensor.informatik.uni-mannheim.de (RealWorld HAR)")
def realworld_har(d):
    m = motion(50.0)
    columns = [1 + np.arange(len(m.t)), ms(m.t, 1_435_993_890_111), *m.force.T]
    return Right(rows(d / "acc_walking_waist.csv", ["id,attr_time,attr_x,attr_y,attr_z"], columns), (m.force,), 50.0)


@shape("https://archive.ics.uci.edu/dataset/344 (heterogeneity HAR)")
def hhar(d):
    m = motion()
    late = np.random.default_rng(0).integers(0, 8, len(m.t))
    columns = [np.arange(len(m.t)), ms(m.t, 1_424_696_633_908) + late, ns(m.t), *m.force.T]
    columns += [same(m, one) for one in ("a", "nexus4", "nexus4_1", "stand")]
    head = ["Index,Arrival_Time,Creation_Time,x,y,z,User,Model,Device,gt"]
    return Right(rows(d / "Phones_accelerometer.csv", head, columns), (m.force,), 100.0)


@shape("https://doi.org/10.6084/m9.figshare.4214283 (UMAFall)")
def umafall(d):
    m = motion(20.0, 20.0)
    made = [
        "% Universidad de Malaga - ETSI de Telecomunicacion (Spain) ",
        "%",
        "% Date: 2016-06-13_20-23-52",
        "% ID: Subject_01",
        "% Age: 51",
        "%",
        "% Sensor Types: ",
        "% 0; Accelerometer; G ",
        "% 1; Gyroscope; degrees/second ",
        "% 2; Magnetometer; microTesla ",
        "%",
        "% Sensor ID; Position; Device Model",
        "% 1; WRIST; SensorTag",
        "% 2; WAIST; SensorTag",
        "%",
        "% TimeStamp; Sample No; X-Axis; Y-Axis; Z-Axis; Sensor Type; Sensor ID; ",
    ]
    for k, t in enumerate(ms(m.t, 812)):
        for number, chip in zip((1, 2), m.chips[:2], strict=True):
            for kind, values in enumerate((chip[k] / G, m.deg[k], m.field[k])):
                made += ["{};{};{:.6f};{:.6f};{:.6f};{};{};".format(t, k + 1, *values, kind, number)]
    path = lines(d / "UMAFall_Subject_01_ADL_Walking_1.csv", made)
    return Right(path, m.chips[:2], 20.0, m.gyro)


@shape("https://archive.ics.uci.edu/dataset/779 (HARTH)")
def harth(d):
    m = motion(50.0, 20.0)
    columns = [stamps(m.t, "{date} {time}.{us}"), *(m.chips[0].T / G), *(m.chips[1].T / G), same(m, "6")]
    head = ["timestamp,back_x,back_y,back_z,thigh_x,thigh_y,thigh_z,label"]
    return Right(rows(d / "S006.csv", head, columns), m.chips[:2], 50.0)


@shape("http://deepio.cs.ox.ac.uk (OxIOD, imu1.csv without names)")
def oxiod(d):
    m = motion()
    user = (m.force - m.gravity) / G
    columns = [("{:.4f}", 1715941514.123 + m.t), *attitude(m), *m.gyro.T, *(m.gravity.T / G), *user.T, *m.field.T]
    return Right(rows(d / "imu1.csv", [], columns), refused="acceleration", doubt=True)


@shape("https://archive.ics.uci.edu/dataset/256 (daily and sports activities)")
def dsads(d):
    m = motion(25.0, 5.0)
    rng = np.random.default_rng(0)
    chips = (*m.chips, m.chips[0] + 0.03 * rng.standard_normal(m.force.shape))
    columns = [column for chip in chips for column in (*chip.T, *m.gyro.T, *(0.01 * m.field.T))]
    return Right(rows(d / "s01.txt", [], columns, form="{:.5g}"), chips, None, m.gyro)


@shape("http://sipi.usc.edu/had (USC-HAD)")
def usc_had(d):
    from scipy.io import savemat

    m = motion()
    texts = {"title": "USC Human Motion Database", "version": "1.0", "date": "2010-11-30", "subject": "1", "age": "34"}
    texts |= {"height": "170cm", "weight": "80kg", "activity_name": "walk-forward", "trial": "1"}
    texts |= {"sensor_location": "front-right-hip", "sensor_readings": np.column_stack([m.g, m.deg])}
    savemat(d / "a1t1.mat", texts)
    return Right(d / "a1t1.mat", (m.force,), None, m.gyro)


@shape("https://ora.ox.ac.uk (Capture-24)")
def capture24(d):
    m = motion()
    columns = [stamps(m.t, "{date} {time}.{us}"), *m.g.T, same(m, "7030 sleeping;MET 0.95")]
    path = rows(d / "P001.csv", ["time,x,y,z,annotation"], columns)
    (d / "P001.csv.gz").write_bytes(gzip.compress(path.read_bytes()))
    path.unlink()
    return Right(d / "P001.csv.gz", (m.force,), 100.0)


@shape("http://hasc.jp (HASC corpus, -acc.csv)")
def hasc(d):
    m = motion()
    columns = [("{:.6f}", 1297231712.436523 + m.t), *m.g.T]
    return Right(rows(d / "HASC1001-acc.csv", [], columns), (m.force,), 100.0)


@shape("https://sites.google.com/up.edu.mx/har-up (UP-Fall)")
def up_fall(d):
    m = motion(20.0, 20.0)
    first, second = ["TimeStamps"], ["Time"]
    for place in ("Ankle", "RightPocket", "Belt"):
        first += [f"{place}Accelerometer", "", "", f"{place}AngularVelocity", "", "", f"{place}Luminosity"]
        second += [*(f"{a}-axis (g)" for a in "xyz"), *(f"{a}-axis (deg/s)" for a in "xyz"), "illuminance (lux)"]
    first, second = [*first, "Subject", "Activity", "Trial"], [*second, "", "", ""]
    columns = [stamps(m.t, "{date}T{time}.{us}")]
    for chip in m.chips[:3]:
        columns += [*(("{:.3f}", one) for one in chip.T / G), *(("{:.3f}", one) for one in m.deg.T), same(m, "11.05")]
    columns += [same(m, "1"), same(m, "7"), same(m, "1")]
    path = rows(d / "CompleteDataSet.csv", [",".join(first), ",".join(second)], columns)
    return Right(path, m.chips[:3], 20.0, m.gyro)


@shape("https://bmi.hmu.gr/the-mobifall-and-mobiact-datasets (MobiAct)")
def mobiact(d):
    m = motion()
    head = ["#Acceleration force along the x y z axes (including gravity).", "#timestamp(ns),x,y,z(m/s^2)"]
    head += ["#Datetime: 17/05/2024 10:25:14", "#-----", "#Activity: 12 - Walking - WAL", "#Subject ID: 1", "#Age: 32"]
    head += ["", "@DATA"]
    columns = [1_912_214_321_000 + np.round(1e9 * m.t).astype(int), *m.force.T]
    return Right(rows(d / "WAL_acc_1_1.txt", head, columns, form="{:.7f}"), (m.force,), 100.0)


@shape("http://robots.engin.umich.edu/nclt (ms25.csv)")
def nclt_ms25(d):
    m = motion(50.0)
    columns = [np.round(1.326030975726043e15 + 1e6 * m.t).astype(np.int64), *(0.01 * m.field.T), *m.force.T, *m.gyro.T]
    return Right(rows(d / "ms25.csv", [], columns), (m.force,), 50.0, m.gyro)


@shape("https://sites.google.com/view/complex-urban-dataset (KAIST Urban, xsens_imu.csv)")
def kaist_urban(d):
    m = motion()
    turn = Rotation.from_euler("xyz", np.column_stack(attitude(m))).as_quat()
    columns = [ns(m.t), *turn.T, *attitude(m), *m.gyro.T, *m.force.T, *(0.02 * m.field.T)]
    return Right(rows(d / "xsens_imu.csv", [], columns), (m.force,), 100.0, m.gyro)


@shape("https://fpv.ifi.uzh.ch (UZH-FPV, imu.txt)")
def uzh_fpv(d):
    m = motion(500.0, 8.0)
    head = ["# id timestamp ang_vel_x ang_vel_y ang_vel_z lin_acc_x lin_acc_y lin_acc_z"]
    columns = [np.arange(len(m.t)), ("{:.16f}", 1540821117.5 + m.t), *m.gyro.T, *m.force.T]
    return Right(rows(d / "imu.txt", head, columns, " ", "{:.16f}"), (m.force,), 500.0, m.gyro)


@shape("https://rpg.ifi.uzh.ch/davis_data.html (imu.txt)")
def davis_imu(d):
    m = motion(1000.0, 4.0)
    columns = [("{:.9f}", 0.001 + m.t), *m.force.T, *m.gyro.T]
    return Right(rows(d / "imu.txt", [], columns, " "), (m.force,), 1000.0, m.gyro)


# Sensors of laboratories and of the body


@shape("https://x-io.co.uk (x-IMU GUI, CalInertialAndMag.csv)")
def x_imu(d):
    m = motion(256.0, 8.0)
    names = ["Packet number", *(f"Gyroscope {a} (deg/s)" for a in "XYZ"), *(f"Accelerometer {a} (g)" for a in "XYZ")]
    names += [f"Magnetometer {a} (G)" for a in "XYZ"]
    columns = [3 + np.arange(len(m.t)), *m.deg.T, *m.g.T, *(0.01 * m.field.T)]
    path = rows(d / "LoggedData_CalInertialAndMag.csv", [",".join(names)], columns, form="{:.7f}")
    return Right(path, (m.force,), None, m.gyro)


@shape("https://x-io.co.uk (NGIMU, sensors.csv)")
def ngimu(d):
    m = motion()
    names = ["Time (s)", *(f"Gyroscope {a} (deg/s)" for a in "XYZ"), *(f"Accelerometer {a} (g)" for a in "XYZ")]
    names += [*(f"Magnetometer {a} (uT)" for a in "XYZ"), "Barometer (hPa)"]
    columns = [m.t, *m.deg.T, *m.g.T, *m.field.T, 1013.2 + 0.1 * np.sin(m.t)]
    return Right(rows(d / "sensors.csv", [",".join(names)], columns), (m.force,), 100.0, m.gyro)


@shape("https://www.polar.com (Polar Sensor Logger, ACC)")
def polar_sensor_logger(d):
    m = motion(50.0, 20.0)
    batch = np.repeat(m.t[35::36], 36)
    batch = np.concatenate([batch, np.full(len(m.t) - len(batch), m.t[-1])])
    phone = batch + 0.002 * (np.arange(len(m.t)) % 36)
    sensor = 769_000_000_000_000_000 + np.round(1e9 * m.t).astype(np.int64)
    columns = [stamps(phone, "{date}T{time}.{ms}"), sensor, *counts(m.g, 1000)]
    head = ["Phone timestamp;sensor timestamp [ns];X [mg];Y [mg];Z [mg]"]
    return Right(rows(d / "Polar_H10_ACC.txt", head, columns, ";"), (m.force,), 50.0)


@shape("https://mind-monitor.com (Muse, CSV)")
def mind_monitor(d):
    m = motion(250.0, 8.0)
    rng = np.random.default_rng(0)
    channels = ("TP9", "AF7", "AF8", "TP10")
    names = ["TimeStamp", *(f"{band}_{one}" for band in ("Delta", "Alpha") for one in channels)]
    names += [*(f"RAW_{one}" for one in channels), "AUX_RIGHT", *(f"Accelerometer_{a}" for a in "XYZ")]
    names += [*(f"Gyro_{a}" for a in "XYZ"), "HeadBandOn", "Battery", "Elements"]
    columns = [stamps(m.t), *rng.normal(0.5, 0.1, (8, len(m.t))), *rng.normal(800, 15, (5, len(m.t))), *m.g.T, *m.deg.T]
    columns += [same(m, "1"), same(m, "87.00"), same(m, "")]
    path = rows(d / "mindMonitor.csv", [",".join(names)], columns)
    text = path.read_text().splitlines()
    text.insert(300, f"{stamps(m.t)[298]}," + "," * (len(names) - 2) + "/muse/elements/blink")
    return Right(lines(path, text), (m.force,), 250.0, m.gyro)


@shape("https://docs.openbci.com (OpenBCI GUI, raw text)")
def openbci_raw(d):
    m = motion(250.0, 8.0)
    rng = np.random.default_rng(0)
    held = m.force[np.arange(len(m.t)) // 10 * 10]
    head = ["%OpenBCI Raw EXG Data", "%Number of channels = 8", "%Sample Rate = 250 Hz"]
    head += ["%Board = OpenBCI_GUI$BoardCytonSerial"]
    names = ["Sample Index", *(f"EXG Channel {k}" for k in range(8)), *(f"Accel Channel {k}" for k in range(3))]
    names += ["Other"] * 7 + [*(f"Analog Channel {k}" for k in range(3)), "Timestamp", "Other", "Timestamp (Formatted)"]
    columns = [
        ("{:.1f}", np.arange(len(m.t)) % 256),
        *np.cumsum(rng.normal(0, 9, (8, len(m.t))), axis=1),
        *(held / G).T,
    ]
    columns += [same(m, "0.0")] * 10 + [("{:.6f}", 1715941514.123 + m.t), same(m, "0.0"), stamps(m.t)]
    path = rows(d / "OpenBCI-RAW.txt", [*head, ", ".join(names)], columns, ", ")
    return Right(path, (held,), 250.0)


@shape("https://www.pluxbiosignals.com (OpenSignals, raw text)")
def opensignals(d):
    m = motion()
    about = {
        "sensor": ["RAW", "XYZ", "XYZ", "XYZ"],
        "device name": "20:16:04:12:01:40",
        "column": ["nSeq", "I1", "I2", "O1", "O2", "A1", "A2", "A3", "A4"],
        "time": "10:25:14.123",
        "channels": [1, 2, 3, 4],
        "date": "2024-5-17",
        "sampling rate": 100,
        "label": ["A1", "A2", "A3", "A4"],
        "resolution": [4, 1, 1, 1, 1, 10, 10, 10, 10],
    }
    head = ["# OpenSignals Text File Format", "# " + json.dumps({"20:16:04:12:01:40": about}), "# EndOfHeader"]
    raw = np.round(512 + 104 * m.g).astype(int).T
    noise = np.random.default_rng(0).integers(480, 540, len(m.t))
    columns = [np.arange(len(m.t)) % 16, *[np.zeros(len(m.t), int)] * 4, noise, *raw]
    return Right(rows(d / "opensignals.txt", head, columns, "\t", end="\t"), refused="acceleration", doubt=True)


@shape("https://opensim.stanford.edu (OpenSense, linear accelerations, .sto)")
def opensim_sto(d):
    m = motion()
    head = ["DataRate=100.000000", "DataType=Vec3", "version=3", "OpenSimVersion=4.4", "endheader"]
    head += ["time\tpelvis_imu\ttorso_imu"]
    cells = [["{:.8f},{:.8f},{:.8f}".format(*f) for f in chip] for chip in m.chips[:2]]
    return Right(rows(d / "walk_linearAccelerations.sto", head, [m.t, *cells], "\t"), m.chips[:2], 100.0)


@shape("https://base.movella.com (MVN Analyze, workbook)")
def mvn_workbook(d):
    from openpyxl import Workbook

    m = motion(60.0)
    book = Workbook()
    book.active.title = "General Information"
    book.active.append(["MVN version", "2023.2"])
    book.active.append(["Frame Rate", 60])
    free = m.force - m.gravity
    for title, names in (("Segment Acceleration", ("Pelvis", "T8")), ("Sensor Free Acceleration", ("Pelvis", "T8"))):
        sheet = book.create_sheet(title)
        sheet.append(["Frame", *(f"{one} {a}" for one in names for a in "xyz")])
        for k, f in enumerate(free.tolist()):
            sheet.append([k, *f, *f])
    book.save(d / "walk.xlsx")
    return Right(d / "walk.xlsx", refused="acceleration")


@shape("https://www.technosmart.eu (Axy, X Manager, CSV)")
def technosmart(d):
    m = motion(25.0, 20.0)
    names = ["TagID", "Timestamp", "X", "Y", "Z", "Activity", "Temp. (?C)", "location-lat", "location-lon"]
    names += ["Battery Voltage (V)", "Metadata"]
    once = [place % 25 == 0 for place in range(len(m.t))]
    columns = [same(m, "Axy-5XS_1"), stamps(m.t, "17/05/2024 {time}.{ms}"), *(("{:.3f}", one) for one in m.g.T)]
    columns += [["Active" if one else "" for one in once], ["24.3" if one else "" for one in once]]
    columns += [same(m, ""), same(m, ""), ["4.02" if one else "" for one in once], same(m, "")]
    return Right(rows(d / "Axy-5XS_1_S1.csv", ["\t".join(names)], columns, "\t"), (m.force,), 25.0)


@shape("https://mbientlab.com (MetaBase, gyroscope alone)")
def mbientlab_gyroscope(d):
    m = motion()
    head = ["epoc (ms),timestamp (-0700),elapsed (s),x-axis (deg/s),y-axis (deg/s),z-axis (deg/s)"]
    columns = [1_715_941_514_123 + ms(m.t, 0), stamps(m.t, "{date}T{time}.{ms}"), ("{:.3f}", m.t), *m.deg.T]
    path = rows(d / "MetaWear_Gyroscope_100.000Hz.csv", head, columns, form="{:.3f}")
    return Right(path, refused="acceleration")


@shape("https://github.com/tszheichoi/awesome-sensor-logger (Gyroscope.csv alone)")
def sensor_logger_gyroscope(d):
    m = motion()
    columns = [ns(m.t), m.t, *m.gyro.T[::-1]]
    path = rows(d / "Gyroscope.csv", ["time,seconds_elapsed,z,y,x"], columns, form="{:.15f}")
    return Right(path, refused="acceleration", doubt=True)


@shape("https://www.movebank.org (e-obs, bursts)")
def eobs_bursts(d):
    m = motion(20.0, 60.0)
    raw = np.round(2048 + 500 * m.g).astype(int)
    head = ["event-id,timestamp,eobs:acceleration-axes,eobs:acceleration-sampling-frequency-per-axis,"]
    head[0] += "eobs:accelerations-raw,sensor-type,individual-local-identifier"
    bursts = [raw[place : place + 40].ravel() for place in range(0, len(raw), 40)]
    times = stamps(2.0 * np.arange(len(bursts)))
    made = [
        f'{311_200 + k},{t},XYZ,20.0,"{" ".join(map(str, burst))}",acceleration,Stork 3'
        for k, (t, burst) in enumerate(zip(times, bursts, strict=True))
    ]
    return Right(lines(d / "acc.csv", [*head, *made]), refused="acceleration|number", doubt=True)


# Analysers, oscilloscopes, programs


@shape("https://www.iso-mme.org (ISO 13499, one channel)")
def iso_mme_channel(d):
    m = motion(1000.0, 4.0)
    pairs = [
        ("Test object number", "1"),
        ("Name of the channel", "Head Acceleration X"),
        ("Laboratory channel code", "NOVALUE"),
        ("Customer channel code", "NOVALUE"),
        ("Channel code", "11HEAD0000H3ACXP"),
        ("Unit", "m/(s*s)"),
        ("Reference system", "NOVALUE"),
        ("Pre-filter type", "CFC1000"),
        ("Sampling interval", "0.001"),
        ("Bit resolution", "NOVALUE"),
        ("Time of first sample", "-0.05"),
        ("Number of samples", str(len(m.t))),
    ]
    head = [f"{key:28s}:{value}" for key, value in pairs]
    return Right(rows(d / "S001.001", head, [m.force[:, 0]]), refused="acceleration", doubt=True)


@shape("https://www.picotech.com (PicoScope, CSV: volts of an analog accelerometer)")
def picoscope_volts(d):
    m = motion(1000.0, 4.0)
    head = ["Time,Channel A,Channel B,Channel C", "(ms),(V),(V),(V)", ""]
    columns = [("{:.8f}", 1000 * m.t), *(1.5 + 0.3 * m.g.T)]
    return Right(rows(d / "scope.csv", head, columns, form="{:.8f}"), refused="acceleration|sensitivity", doubt=True)


@shape("https://www.mathworks.com/help/matlab/ref/writetimetable.html (durations)")
def matlab_timetable(d):
    m = motion()
    times = [f"{t:.5g} sec" for t in m.t]
    return Right(rows(d / "Acceleration.csv", ["Timestamp,X,Y,Z"], [times, *m.force.T]), (m.force,), 100.0)


@shape("https://pandas.pydata.org (DataFrame.to_csv with a DatetimeIndex)")
def pandas_time_index(d):
    m = motion(62.5)
    columns = [stamps(m.t, "{date} {time}.{us}+00:00"), *m.force.T, *m.gyro.T]
    return Right(rows(d / "run.csv", [",ax,ay,az,gx,gy,gz"], columns), (m.force,), 62.5, m.gyro)


@shape("https://www.mfpt.org (bearing fault data, MATLAB)")
def mfpt_bearing(d):
    from scipy.io import savemat

    m = motion(1000.0, 4.0)
    content = {"sr": 1000.0, "gs": m.g[:, :1], "load": 270.0, "rate": 25.0}
    savemat(d / "baseline_1.mat", {"bearing": content})
    return Right(d / "baseline_1.mat", refused="acceleration", doubt=True)


@shape("https://www.klipper3d.org/Measuring_Resonances.html (calibration_data: spectra)")
def klipper_spectra(d):
    freq = np.arange(1, 140) * 1.526
    rng = np.random.default_rng(0)
    psd = [(1 + k) * 2e3 / (1 + (0.1 * (freq - 45)) ** 2) + 40 * rng.random(len(freq)) for k in range(3)]
    head = ["freq,psd_x,psd_y,psd_z,psd_xyz,zv(59.0),mzv(52.8),ei(70.4)"]
    columns = [("{:.1f}", freq), *(("{:.3e}", one) for one in (*psd, sum(psd))), *rng.random((3, len(freq)))]
    return Right(rows(d / "calibration_data_x.csv", head, columns, form="{:.3f}"), refused="acceleration")


@shape("https://github.com/STMicroelectronics (ST BLE Sensor, log of a feature)")
def st_ble_sensor(d):
    m = motion(50.0, 20.0)
    head = ["Log start on:,20240517_102514,", "Feature:,Accelerometer,", "Nodes:,BCN-FF1 @FF1A2B,"]
    head += ["Date,HostTimestamp (ms),NodeName,NodeTimestamp,RawData,X (mg),Y (mg),Z (mg),"]
    mg = counts(m.g, 1000)
    raw = ["".join(f"{value & 0xFF:02X}{value >> 8 & 0xFF:02X}" for value in row.tolist()) for row in mg.T]
    columns = [stamps(m.t, "{date} {time}.{ms}"), ms(m.t, 0), same(m, "BCN-FF1"), (ms(m.t, 0) // 10) % 65536, raw, *mg]
    return Right(rows(d / "Accelerometer.csv", head, columns, end=","), (m.force,), 50.0)


@shape("own: Core Motion with ISO times, °F")
def core_motion_iso(d):
    m = motion()
    head = ["Timestamp,AccelerationX,AccelerationY,AccelerationZ,RotationRateX,RotationRateY,RotationRateZ,Temp (F)"]
    warm = warming(m, 24)
    columns = [stamps(m.t, "{date}T{time}.{ms}Z"), *m.g.T, *m.gyro.T, ("{:.2f}", 32 + 1.8 * warm)]
    path = rows(d / "motion.csv", head, columns)
    return Right(path, (m.force,), 100.0, m.gyro, {"temperature_degC": warm})
