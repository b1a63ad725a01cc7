"""Shapes of evaluation boards, sketches and serial logs."""

import numpy as np
from corpus_motion import G, Right, counts, motion, ms, rows, shape, stamps, warming

ST = "https://www.st.com (Unico, Unicleo-GUI, HSDatalog)"
ADAFRUIT = "https://github.com/adafruit/Adafruit_MPU6050"


def lines(path, head, made):
    path.write_text("\n".join([*head, *made]) + "\n")
    return path


@shape("https://github.com/jrowberg/i2cdevlib (MPU6050_raw)")
def i2cdevlib_raw(d):
    m = motion()
    head = ["Initializing I2C devices...", "Testing device connections...", "MPU6050 connection successful"]
    path = rows(d / "putty.log", head, [*counts(m.g, 16384), *counts(m.deg, 131)], "\t", start="a/g:\t")
    return Right(path, (m.force,), None, m.gyro, doubt=True)


@shape("https://github.com/arduino/arduino-ide (serial plotter)")
def arduino_plotter(d):
    m = motion()
    made = [f"t:{t},ax:{x:.3f},ay:{y:.3f},az:{z:.3f}" for t, (x, y, z) in zip(ms(m.t), m.force, strict=True)]
    return Right(lines(d / "plot.txt", [], made), (m.force,), 100.0)


@shape("https://github.com/arduino/arduino-ide (serial monitor with time stamps)")
def arduino_monitor_times(d):
    m = motion()
    made = [
        f"{s} -> {x:.3f}\t{y:.3f}\t{z:.3f}" for s, (x, y, z) in zip(stamps(m.t, "{time}.{ms}"), m.force, strict=True)
    ]
    return Right(lines(d / "monitor.txt", [], made), (m.force,), 100.0)


@shape(ADAFRUIT)
def adafruit_mpu6050(d):
    m = motion()
    made = []
    for f, w, k in zip(m.force, m.gyro, warming(m, 26.53), strict=True):
        made += [
            "Acceleration X: {:.2f}, Y: {:.2f}, Z: {:.2f} m/s^2".format(*f),
            "Rotation X: {:.2f}, Y: {:.2f}, Z: {:.2f} rad/s".format(*w),
        ]
        made += [f"Temperature: {k:.2f} degC", ""]
    return Right(
        lines(d / "serial.txt", ["Adafruit MPU6050 test!", "MPU6050 Found!"], made),
        (m.force,),
        None,
        m.gyro,
        {"temperature_degC": warming(m, 26.53)},
        doubt=True,
    )


@shape("https://github.com/adafruit/Adafruit_ADXL345 (sensortest)")
def adafruit_adxl345(d):
    m = motion()
    made = ["X: {:.2f}  Y: {:.2f}  Z: {:.2f}  m/s^2 ".format(*f) for f in m.force]
    return Right(lines(d / "adxl.txt", ["Accelerometer Test", ""], made), (m.force,), None, doubt=True)


@shape("https://github.com/nesnes/teleplot")
def teleplot(d):
    m = motion()
    made = []
    for t, f in zip(ms(m.t, 1_715_941_514_123), m.force, strict=True):
        made += [f">{name}:{t}:{value:.4f}" for name, value in zip(("ax", "ay", "az"), f, strict=True)]
    return Right(lines(d / "teleplot.txt", [], made), (m.force,), 100.0)


@shape("https://freeware.the-meiers.org (CoolTerm capture with time stamps)")
def coolterm(d):
    m = motion()
    made = [f"{s} {x:.4f},{y:.4f},{z:.4f}" for s, (x, y, z) in zip(stamps(m.t), m.g, strict=True)]
    return Right(lines(d / "CoolTerm Capture.txt", [], made), (m.force,), 100.0)


@shape("https://github.com/markrad/ADXL355 (Raspberry Pi)")
def adxl355_raspberry(d):
    m = motion(125.0)
    columns = [("{:.6f}", 1715941514.123456 + m.t), *m.g.T]
    return Right(rows(d / "adxl355.csv", ["time,x,y,z"], columns), (m.force,), 125.0)


@shape("https://github.com/sparkfun/OpenLog_Artemis")
def openlog_artemis(d):
    m = motion()
    head = ["rtcDate,rtcTime,aX,aY,aZ,gX,gY,gZ,mX,mY,mZ,imu_degC,output_Hz,"]
    columns = [
        stamps(m.t, "{date}"),
        stamps(m.t, "{time}.{ms}"),
        *(1000 * m.g).T,
        *m.deg.T,
        *m.field.T,
        warming(m, 24),
        0 * m.t + 99.8,
    ]
    path = rows(d / "dataLog00001.TXT", head, columns, end=",", form="{:.2f}")
    return Right(path, (m.force,), 100.0, m.gyro, {"temperature_degC": warming(m, 24)}, doubt=True)


@shape("https://microbit.org (data log)")
def microbit_log(d):
    m = motion(20.0, 20.0)
    path = rows(d / "microbit.csv", ["Time (seconds),x,y,z"], [("{:.2f}", 0.05 + m.t), *counts(m.g, 1000)])
    return Right(path, (m.force,), 20.0)


@shape(ST)
def unico(d):
    m = motion(104.0)
    head = ["STEVAL-MKI197V1 (LSM6DSOX)", "", "A_X [mg]\tA_Y [mg]\tA_Z [mg]\tG_X [dps]\tG_Y [dps]\tG_Z [dps]"]
    return Right(
        rows(d / "lsm6dsox.txt", head, [*(1000 * m.g).T, *m.deg.T], "\t", "{:.2f}"),
        (m.force,),
        None,
        m.gyro,
        doubt=True,
    )


@shape(ST)
def unicleo(d):
    m = motion(104.0)
    head = ["Timestamp [us],A_X [mg],A_Y [mg],A_Z [mg],G_X [dps],G_Y [dps],G_Z [dps],QVAR [LSB]"]
    columns = [np.round(1e6 * m.t).astype(int), *counts(m.g, 1000), *m.deg.T, np.full(len(m.t), 312)]
    return Right(rows(d / "log.csv", head, columns, form="{:.2f}"), (m.force,), 104.0, m.gyro)


@shape(ST)
def hsdatalog_csv(d):
    m = motion(833.0, 3.0)
    path = rows(d / "ISM330DHCX_ACC.csv", ["Time,A_x [g],A_y [g],A_z [g]"], [m.t, *m.g.T])
    return Right(path, (m.force,), 833.0)


@shape("https://docs.espressif.com (ESP-IDF log)")
def esp_idf_log(d):
    m = motion()
    head = ["I (312) cpu_start: Starting scheduler.", "I (401) MPU6050: found"]
    made = [f"I ({t}) IMU: {x:.4f}, {y:.4f}, {z:.4f}" for t, (x, y, z) in zip(ms(m.t), m.force, strict=True)]
    return Right(lines(d / "monitor.log", head, made), (m.force,), 100.0)


@shape("https://docs.zephyrproject.org (logging)")
def zephyr_log(d):
    m = motion()
    made = [
        f"[{s},000] <inf> imu: {x:.4f}, {y:.4f}, {z:.4f}"
        for s, (x, y, z) in zip(stamps(m.t, "00:{time}.{ms}"), m.force, strict=True)
    ]
    made = [one.replace("[00:10:", "[00:", 1) for one in made]
    return Right(lines(d / "zephyr.log", ["*** Booting Zephyr OS build v3.6.0 ***"], made), (m.force,), 100.0)


@shape("https://github.com/zephyrproject-rtos/zephyr/tree/main/samples/sensor/lis2dh")
def zephyr_lis2dh(d):
    m = motion()
    made = [
        f"#{k} @ {t} ms: x {x:f} , y {y:f} , z {z:f}"
        for k, (t, (x, y, z)) in enumerate(zip(ms(m.t, 12), m.force, strict=True))
    ]
    return Right(lines(d / "lis2dh.txt", ["Polling at 100 Hz"], made), (m.force,), 100.0)


@shape("https://docs.python.org/3/library/logging.html")
def python_logging(d):
    m = motion()
    made = [
        f"{s.replace('.', ',')} - imu - INFO - {x:.4f},{y:.4f},{z:.4f}"
        for s, (x, y, z) in zip(stamps(m.t), m.force, strict=True)
    ]
    return Right(lines(d / "imu.log", [], made), (m.force,), 100.0)


@shape("https://wiki.ros.org/rosconsole")
def rosconsole_log(d):
    m = motion()
    made = [
        f"[INFO] [{1715941514.123 + t:.9f}] [imu_node]: {x:.4f} {y:.4f} {z:.4f}"
        for t, (x, y, z) in zip(m.t, m.force, strict=True)
    ]
    return Right(lines(d / "rosout.log", [], made), (m.force,), 100.0)


@shape("own: lines of two sensors in turn")
def two_sensors_in_turn(d):
    m = motion()
    made = []
    for t, f, w in zip(stamps(m.t, "{time}.{ms}"), m.force, m.gyro, strict=True):
        made += ["{} acc: {:.4f} {:.4f} {:.4f}".format(t, *f), "{} gyro: {:.4f} {:.4f} {:.4f}".format(t, *w)]
    return Right(lines(d / "mpu.log", [], made), (m.force,), 100.0, m.gyro)


@shape("https://astro-pi.org (Sense HAT)")
def sense_hat(d):
    m = motion(10.0, 60.0)
    names = "temp,pres,hum,pitch,roll,yaw,mag_x,mag_y,mag_z,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,datetime"
    columns = [
        warming(m, 27.3),
        0 * m.t + 1013.2,
        0 * m.t + 41.0,
        *(18 + 9 * m.gravity.T),
        *m.field.T,
        *m.g.T,
        *m.gyro.T,
    ]
    columns += [stamps(m.t, "{date} {time}.{us}")]
    return Right(
        rows(d / "sense.csv", [names], columns), (m.force,), 10.0, m.gyro, {"temperature_degC": warming(m, 27.3)}
    )


@shape("https://docs.edgeimpulse.com/reference/data-acquisition-format")
def edge_impulse_json(d):
    import json

    m = motion()
    sensors = [{"name": f"acc{a}", "units": "m/s2"} for a in "XYZ"]
    payload = {
        "device_name": "ac:87",
        "device_type": "DISCO-L475VG-IOT01A",
        "interval_ms": 10,
        "sensors": sensors,
        "values": m.force.round(4).tolist(),
    }
    (d / "idle01.json").write_text(
        json.dumps({"protected": {"ver": "v1", "alg": "none"}, "signature": "00", "payload": payload})
    )
    return Right(d / "idle01.json", (m.force,), 100.0, doubt=True)


@shape("https://docs.edgeimpulse.com (CSV)")
def edge_impulse_csv(d):
    m = motion(62.5)
    return Right(
        rows(d / "idle.csv", ["timestamp,accX,accY,accZ"], [("{:.0f}", 1000 * m.t), *m.force.T]), (m.force,), 62.5
    )


@shape("https://github.com/adafruit/Adafruit_CircuitPython_LSM6DS (tuples)")
def circuitpython_tuples(d):
    m = motion()
    made = ["({:.3f}, {:.4f}, {:.4f}, {:.4f})".format(t, *f) for t, f in zip(m.t, m.force, strict=True)]
    return Right(lines(d / "mu.txt", [], made), (m.force,), 100.0)


@shape("own: epoch in ms, decimal commas")
def epoch_decimal_commas(d):
    m = motion(50.0)
    head = ["timestamp;acc_x [g];acc_y [g];acc_z [g];gyro_x [deg/s];gyro_y [deg/s];gyro_z [deg/s]"]
    columns = [ms(m.t, 1_715_941_514_123), *m.g.T, *m.deg.T]
    return Right(rows(d / "log.csv", head, columns, ";", "{:.4f}", mark=","), (m.force,), 50.0, m.gyro)


@shape("https://github.com/boschsensortec/COINES_SDK (example log)")
def bosch_coines(d):
    m = motion()
    head = [
        "BMI270 accelerometer and gyroscope example",
        "Range: 4 G, ODR: 100 Hz",
        "Data set, Acc_gX, Acc_gY, Acc_gZ, Gyro_X, Gyro_Y, Gyro_Z",
    ]
    path = rows(d / "bmi270.txt", head, [np.arange(len(m.t)), *m.g.T, *m.deg.T], ", ", "{:.2f}")
    return Right(path, (m.force,), 100.0, m.gyro)


@shape("https://www.gcdataconcepts.com (X16-1D)")
def gulf_coast(d):
    m = motion(200.0, 6.0)
    head = [
        ";Title, http://www.gcdataconcepts.com, X16-1D, Analog Dev ADXL345",
        ";Version, 1113, Build date, Mar 19 2015, SN:CCDC10161A4D0D1",
        ";Start_time, 2024-05-17, 10:25:14.000",
        ";Temperature, -999.00, deg C,  Vbat, 4079, mv",
        ";SampleRate, 200,Hz",
        ";Deadband, 0, counts",
        ";DeadbandTimeout, 0,sec",
        ";Headers, time,Ax,Ay,Az",
    ]
    return Right(rows(d / "DATA-001.CSV", head, [m.t, *counts(m.g, 2048)]), (m.force,), 200.0)


@shape("own: four ADXL345, counts")
def twelve_axes(d):
    m = motion()
    names = ["ms"] + [f"a{chip}{a}" for chip in range(1, 5) for a in "xyz"]
    columns = [ms(m.t), *(column for chip in m.chips for column in counts(chip / G, 256))]
    return Right(rows(d / "array.csv", [",".join(names)], columns), m.chips, 100.0)


@shape("own: a row per sensor")
def long_table(d):
    m = motion()
    order = np.argsort(np.concatenate([m.t, m.t + 0.001]), kind="stable")
    stacked = np.concatenate([m.chips[0], m.chips[1]])[order]
    times = np.concatenate([ms(m.t), ms(m.t) + 1])[order]
    path = rows(d / "long.csv", ["t_ms,sensor,x,y,z"], [times, np.repeat([1, 2], len(m.t))[order], *stacked.T])
    return Right(path, m.chips[:2], 100.0)


@shape("own: a rig with an encoder")
def encoder_and_rpm(d):
    m = motion()
    angle, speed = np.degrees(np.cumsum(m.gyro[:, 2]) / 100.0), m.gyro[:, 2] * 30.0 / np.pi
    path = rows(d / "rig.csv", ["time_ms,ax_g,ay_g,az_g,angle_deg,speed_rpm"], [ms(m.t), *m.g.T, angle, speed])
    return Right(path, (m.force,), 100.0, references={"angle_rad": np.radians(angle), "tacho_rad_s": m.gyro[:, 2]})
