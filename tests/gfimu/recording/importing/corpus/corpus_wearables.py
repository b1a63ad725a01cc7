"""Shapes of body-worn sensors and of data sets recorded with them."""

import numpy as np
from corpus_motion import G, Right, counts, motion, ms, rows, shape, stamps, warming

XSENS = "https://www.movella.com/products/wearables (MT Manager, DOT exports)"


@shape(XSENS)
def xsens_mtw(d):
    m = motion()
    head = ["// Start Time: Unknown", "// Sample rate: 100.0Hz", "// Scenario: 4.9", "// Firmware Version: 4.0.2"]
    names = ["PacketCounter", "SampleTimeFine"]
    names += [f"{q}_{a}" for q in ("Acc", "FreeAcc", "Gyr", "Mag") for a in "XYZ"]
    free = m.force - m.gravity
    columns = [34012 + np.arange(len(m.t)), ["" for _ in m.t], *m.force.T, *free.T, *m.gyro.T, *(0.02 * m.field.T)]
    path = rows(d / "MT_0120089F.txt", [*head, "\t".join(names)], columns, "\t")
    return Right(path, (m.force,), 100.0, m.gyro)


@shape(XSENS)
def xsens_dot(d):
    m = motion(60.0)
    head = ["sep=,", "DeviceTag:,D1", "FirmwareVersion:,2.0.0", "OutputRate:,60Hz"]
    names = ["PacketCounter", "SampleTimeFine"] + [f"{q}_{a}" for q in ("Euler", "Acc", "Gyr", "Mag") for a in "XYZ"]
    euler = 10 * m.gravity
    columns = [np.arange(len(m.t)), np.round(192_856_375 + 1e6 * m.t).astype(int), *euler.T, *m.force.T, *m.deg.T]
    columns += [*(0.02 * m.field.T)]
    path = rows(d / "D1.csv", [*head, ",".join(names)], columns)
    return Right(path, (m.force,), 60.0, m.gyro)


@shape(XSENS + ", free acceleration alone")
def xsens_dot_free_acceleration(d):
    m = motion(60.0)
    head = [
        "DeviceTag:,D1",
        "PacketCounter,SampleTimeFine,Euler_X,Euler_Y,Euler_Z,FreeAcc_X,FreeAcc_Y,FreeAcc_Z,Status",
    ]
    euler, free = 10 * m.gravity, m.force - m.gravity
    columns = [np.arange(len(m.t)), np.round(1e6 * m.t).astype(int), *euler.T, *free.T, np.zeros(len(m.t), int)]
    return Right(rows(d / "D1_free.csv", head, columns), refused="acceleration")


@shape("https://shimmersensing.com/product/consensyspro-software")
def shimmer_consensys(d):
    m = motion(51.2)
    names = ["Shimmer_8665_Timestamp_Unix_CAL"] + [f"Shimmer_8665_Accel_LN_{a}_CAL" for a in "XYZ"]
    names += [f"Shimmer_8665_Gyro_{a}_CAL" for a in "XYZ"] + [f"Shimmer_8665_Mag_{a}_CAL" for a in "XYZ"]
    units = ["ms", *["m/(s^2)"] * 3, *["deg/s"] * 3, *["local_flux"] * 3]
    head = ['"sep=\t"', "\t".join(names) + "\t", "\t".join(units) + "\t"]
    columns = [1715941514123.0 + 1000 * m.t, *m.force.T, *m.deg.T, *(0.02 * m.field.T)]
    return Right(
        rows(d / "Session1_Shimmer_8665_Calibrated_SD.csv", head, columns, "\t", end="\t"), (m.force,), 51.2, m.gyro
    )


@shape("https://support.apdm.com (Moveo Explorer, Opal HDF5)")
def apdm_opal(d):
    import h5py

    m = motion(128.0, 10.0)
    with h5py.File(d / "20240517-102514.h5", "w") as file:
        file.attrs["FileFormatVersion"] = 5
        for number, chip in zip(("1234", "5678"), m.chips, strict=False):
            sensor = file.create_group(f"Sensors/{number}")
            for name, values, unit in (("Accelerometer", chip, "m/s^2"), ("Gyroscope", m.gyro, "rad/s")):
                sensor.create_dataset(name, data=values.astype("f4")).attrs["Units"] = unit
            sensor["Time"] = (1_715_941_514_123_456 + np.round(1e6 * m.t)).astype("u8")
            sensor.create_group("Configuration").attrs["Sample Rate"] = 128
    return Right(d / "20240517-102514.h5", m.chips[:2], 128.0, m.gyro)


@shape("https://mbientlab.com (MetaBase)")
def mbientlab(d):
    m = motion()
    head = ["epoc (ms),timestamp (-0700),elapsed (s),x-axis (g),y-axis (g),z-axis (g)"]
    columns = [1_715_941_514_123 + ms(m.t, 0), stamps(m.t, "{date}T{time}.{ms}"), ("{:.3f}", m.t), *m.g.T]
    return Right(rows(d / "MetaWear_Accelerometer_100.000Hz.csv", head, columns, form="{:.3f}"), (m.force,), 100.0)


@shape("https://github.com/WITMOTION")
def witmotion(d):
    m = motion()
    names = ["Time", "DeviceName", "AccX(g)", "AccY(g)", "AccZ(g)", "AsX(°/s)", "AsY(°/s)", "AsZ(°/s)"]
    names += ["AngleX(°)", "AngleY(°)", "AngleZ(°)", "HX(uT)", "HY(uT)", "HZ(uT)", "Temperature(°C)"]
    columns = [
        stamps(m.t),
        ["WT901BLE68"] * len(m.t),
        *m.g.T,
        *m.deg.T,
        *(9 * m.gravity.T),
        *m.field.T,
        warming(m, 31.2),
    ]
    path = rows(d / "wit.txt", ["\t".join(names)], columns, "\t", "{:.4f}")
    return Right(path, (m.force,), 100.0, m.gyro, {"temperature_degC": warming(m, 31.2)})


@shape("https://github.com/digitalinteraction/openmovement (OMGUI, resampled CSV)")
def axivity_csv(d):
    m = motion(50.0)
    return Right(rows(d / "CWA-DATA.csv", [], [stamps(m.t), *m.g.T]), (m.force,), 50.0)


@shape("https://github.com/actigraph/GT3X-File-Format (ActiLife raw export)")
def actigraph_raw(d):
    m = motion(30.0, 20.0)
    head = [
        (
            "------------ Data File Created By ActiGraph GT3X+ ActiLife v6.13.3 Firmware v2.5.0 "
            "date format M/d/yyyy at 30 Hz  Filter Normal -----------"
        ),
        "Serial Number: CLE2B21130054",
        "Start Time 10:25:14",
        "Start Date 5/17/2024",
        "Epoch Period (hh:mm:ss) 00:00:00",
        "Download Time 16:49:27",
        "Download Date 5/18/2024",
        "Current Memory Address: 0",
        "Current Battery Voltage: 4.21     Mode = 12",
        "--------------------------------------------------",
        "Accelerometer X,Accelerometer Y,Accelerometer Z",
    ]
    return Right(rows(d / "raw.csv", head, m.g.T, form="{:.3f}"), (m.force,), 30.0)


@shape("https://theactigraph.com (ActiLife, GT9X Link IMU export)")
def actigraph_imu(d):
    m = motion()
    head = [
        (
            "------------ Data Table File Created By ActiGraph GT9X Link ActiLife v6.13.3 Firmware v1.7.1 "
            "date format M/d/yyyy at 100 Hz -----------"
        ),
        "Serial Number: TAS1F04180054",
        "Start Time 10:25:14",
        "--------------------------------------------------",
        (
            "Timestamp,Accelerometer X,Accelerometer Y,Accelerometer Z,Temperature,"
            "Gyroscope X,Gyroscope Y,Gyroscope Z,Magnetometer X,Magnetometer Y,Magnetometer Z"
        ),
    ]
    columns = [stamps(m.t, "{date}T{time}.{us}0"), *m.g.T, warming(m, 29.5), *m.deg.T, *m.field.T]
    return Right(rows(d / "imu.csv", head, columns), (m.force,), 100.0, m.gyro, {"temperature_degC": warming(m, 29.5)})


@shape("https://github.com/wadpac/GGIR (GENEActiv CSV)")
def geneactiv_csv(d):
    m = motion()
    pairs = [
        "Device Type,GENEActiv",
        "Device Model,1.1",
        "Device Unique Serial Code,012967",
        "Measurement Frequency,100.0 Hz",
        "Start Time,2024-05-17 10:25:14:000",
        "Time Zone,GMT +01:00",
        "Device Location Code,left wrist",
        "Calibration Date,2012-06-25",
        "x gain,25475",
        "x offset,702",
        "y gain,25656",
        "y offset,-2242",
        "z gain,25465",
        "z offset,-1021",
        "Volts,300",
        "Lux,797",
    ]
    head = [*pairs, *[""] * (100 - len(pairs))]
    columns = [
        stamps(m.t, "{date} {time}:{ms}"),
        *m.g.T,
        np.zeros(len(m.t), int),
        np.zeros(len(m.t), int),
        ("{:.1f}", 0 * m.t + 26.3),
    ]
    return Right(rows(d / "geneactiv.csv", head, columns, form="{:.4f}"), (m.force,), 100.0)


@shape("https://github.com/im-ethz/flirt (Empatica E4 info.txt)")
def empatica_e4(d):
    m = motion(32.0, 20.0)
    head = ["1715941514.000000, 1715941514.000000, 1715941514.000000", "32.000000, 32.000000, 32.000000"]
    return Right(rows(d / "ACC.csv", head, counts(m.g, 64)), (m.force,), 32.0)


@shape("https://archive.ics.uci.edu/dataset/231 (PAMAP2)")
def pamap2(d):
    m = motion()
    rng = np.random.default_rng(0)
    columns = [("{:.2f}", 8.38 + m.t), np.zeros(len(m.t), int), ["NaN"] * len(m.t)]
    forces = []
    for chip in m.chips[:3]:
        second = chip + 0.05 * rng.standard_normal(chip.shape)
        forces += [chip, second]
        columns += [0 * m.t + 30.375, *chip.T, *second.T, *m.gyro.T, *m.field.T]
        columns += [[one] * len(m.t) for one in ("1.0", "0.0", "0.0", "0.0")]
    return Right(rows(d / "subject101.dat", [], columns, " "), tuple(forces), 100.0, m.gyro)


@shape("https://archive.ics.uci.edu/dataset/319 (MHEALTH)")
def mhealth(d):
    m = motion(50.0)
    ecg = np.random.default_rng(0).normal(0, 0.1, (2, len(m.t)))
    columns = [*m.chips[0].T, *ecg]
    for chip in m.chips[1:3]:
        columns += [*chip.T, *(m.gyro / np.max(np.abs(m.gyro))).T, *m.field.T]
    columns += [np.zeros(len(m.t), int)]
    return Right(rows(d / "mHealth_subject1.log", [], columns, "\t", "{:.5g}"), m.chips[:3], None, doubt=True)


@shape("http://sistemic.udea.edu.co/en/research/projects/english-falls (SisFall)")
def sisfall(d):
    m = motion(200.0, 8.0)
    columns = [*counts(m.g, 256), *counts(m.deg, 16.384), *counts(m.chips[1] / G, 1024)]
    columns = [[f"{one:4d}" for one in column] for column in columns]
    return Right(rows(d / "D01_SA01_R01.txt", [], columns, ",", end=";"), (m.chips[0], m.chips[1]), 200.0, m.gyro)


@shape("https://archive.ics.uci.edu/dataset/341 (UCI HAR, RawData)")
def uci_har_raw(d):
    m = motion(50.0)
    return Right(rows(d / "acc_exp01_user01.txt", [], m.g.T, " ", "{:.15f}", end=" "), (m.force,), None)


@shape("https://archive.ics.uci.edu/dataset/245 (Daphnet freezing of gait)")
def daphnet(d):
    m = motion(64.0, 15.0)
    forces = [one for chip in m.chips[:3] for one in counts(chip / G, 1000)]
    path = rows(d / "S01R01.txt", [], [np.floor(15 + 1000 * m.t).astype(int), *forces, np.zeros(len(m.t), int)], " ")
    return Right(path, m.chips[:3], 64.0)


@shape("https://bids-specification.readthedocs.io (motion.tsv)")
def bids_motion(d):
    m = motion(200.0, 8.0)
    return Right(
        rows(d / "sub-01_tracksys-imu_motion.tsv", [], [*m.force.T, *m.gyro.T], "\t"),
        (m.force,),
        None,
        m.gyro,
        doubt=True,
    )


@shape("https://github.com/dlaidig/broad (HDF5)")
def broad_hdf5(d):
    import h5py

    m = motion(285.714, 6.0)
    with h5py.File(d / "01_undisturbed_slow_rotation_A.hdf5", "w") as file:
        for name, values in (("imu_acc", m.force), ("imu_gyr", m.gyro), ("imu_mag", m.field)):
            file[name] = values
        file["movement"] = (m.t > 4.0).astype("i1")
        file["opt_quat"] = np.tile([1.0, 0, 0, 0], (len(m.t), 1)) + 0.01 * m.t[:, None]
        file.attrs["sampling_rate"] = 285.714
    return Right(d / "01_undisturbed_slow_rotation_A.hdf5", (m.force,), 285.714, m.gyro)


@shape("https://github.com/dlaidig/broad (MATLAB)")
def broad_matlab(d):
    from scipy.io import savemat

    m = motion(285.714, 6.0)
    content = {"imu_acc": m.force, "imu_gyr": m.gyro, "imu_mag": m.field, "sampling_rate": 285.714}
    savemat(d / "01_undisturbed_slow_rotation_A.mat", content)
    return Right(d / "01_undisturbed_slow_rotation_A.mat", (m.force,), 285.714, m.gyro)
