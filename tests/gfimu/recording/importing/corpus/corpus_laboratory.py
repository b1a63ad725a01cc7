"""Shapes of laboratory systems, vibration analysers, seismology and motion capture."""

import numpy as np
from corpus_motion import G, Right, counts, motion, rows, shape, stamps

LVM = "https://www.ni.com (Specification for the LabVIEW Measurement File .lvm)"


@shape("https://www.pasco.com (Capstone, rotary motion)")
def pasco_rotary(d):
    t = np.arange(100) / 20.0
    omega = np.clip(8.0 * (t - 1.0), 0.0, 8.0)
    head = ["Auto,Run #7", "Time (s),Angular Velocity (rad/s)"]
    path = rows(d / "pasco.csv", head, [("{:.2f}", t), ("{:.3f}", omega)])
    return Right(path, rate=20.0, references={"tacho_rad_s": omega})


@shape("https://www.pasco.com (Capstone, acceleration sensor)")
def pasco_acceleration(d):
    m = motion(50.0)
    names = ["Time (s) Run #1"] + [f"Acceleration - {a} (m/s²) Run #1" for a in "xyz"]
    return Right(rows(d / "capstone.csv", [",".join(names)], [m.t, *m.force.T], form="{:.4f}"), (m.force,), 50.0)


@shape("https://www.vernier.com (Logger Pro, CSV)")
def vernier_csv(d):
    m = motion(50.0)
    names = ["Latest: Time (s)"] + [f"Latest: {a} Acceleration (m/s²)" for a in "XYZ"]
    return Right(
        rows(d / "vernier.csv", [",".join(f'"{one}"' for one in names)], [m.t, *m.force.T], form="{:.4f}"),
        (m.force,),
        50.0,
    )


@shape("https://www.vernier.com (Vernier Format 2)")
def vernier_text(d):
    m = motion(50.0)
    head = [
        "Vernier Format 2",
        "Untitled.cmbl 5/17/2024 10:25:14 .",
        "Run 1",
        "Time\tX Acceleration\tY Acceleration\tZ Acceleration",
    ]
    head += ["t\tax\tay\taz", "s\tm/s²\tm/s²\tm/s²", ""]
    return Right(
        rows(d / "vernier.txt", head, [m.t, *m.force.T], "\t", "{:.4f}", code="latin-1", line="\r\n"), (m.force,), 50.0
    )


def lvm(columns, x_columns, mark="."):
    return [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Reader_Version\t2",
        "Separator\tTab",
        f"Decimal_Separator\t{mark}",
        "Multi_Headings\tNo",
        f"X_Columns\t{x_columns}",
        "Time_Pref\tRelative",
        "Operator\tlab",
        "Date\t2024/05/17",
        "Time\t10:25:14.123",
        "***End_of_Header***\t",
        "\t",
        *columns,
    ]


def segment(samples, step, names, unit):
    each = len(names)
    return [
        f"Channels\t{each}" + "\t" * each,
        "\t".join(["Samples", *[str(samples)] * each, ""]),
        "\t".join(["Date", *["2024/05/17"] * each, ""]),
        "\t".join(["Time", *["10:25:14.123"] * each, ""]),
        "\t".join(["Y_Unit_Label", *[unit] * each, ""]),
        "\t".join(["X_Dimension", *["Time"] * each, ""]),
        "\t".join(["X0", *["0.0000000000000000E+0"] * each, ""]),
        "\t".join(["Delta_X", *[f"{step:.6f}"] * each, ""]),
        "***End_of_Header***" + "\t" * (each + 1),
        "\t".join(["X_Value", *names, "Comment"]),
    ]


@shape(LVM)
def labview_one_x(d):
    m = motion(500.0, 4.0)
    head = lvm(segment(len(m.t), 0.002, ["acc_x", "acc_y", "acc_z"], "g"), "One")
    return Right(rows(d / "run.lvm", head, [m.t, *m.g.T], "\t", end="\t"), (m.force,), 500.0)


@shape(LVM)
def labview_segments_without_x(d):
    m = motion(500.0, 4.0)
    names = ["Acceleration_0", "Acceleration_1", "Acceleration_2"]
    lines = lvm([], "No", ",")
    for first in range(0, len(m.t), 500):
        part = m.g[first : first + 500]
        lines += [
            line.replace(".", ",") if line[0] in "XD" and "Da" not in line[:2] else line
            for line in segment(500, 0.002, names, "g")
        ]
        lines += ["\t" + "\t".join(f"{one:.6f}".replace(".", ",") for one in row) for row in part] + [""]
    (d / "segments.lvm").write_text("\n".join(lines) + "\n")
    return Right(d / "segments.lvm", (m.force,), 500.0)


@shape("https://www.ni.com (SignalExpress, CSV with a header)")
def ni_daq_csv(d):
    m = motion(1000.0, 2.0)
    head = [
        "channel names:,cDAQ1Mod1_ai0,cDAQ1Mod1_ai1,cDAQ1Mod1_ai2",
        "start times:,05/17/2024 10:25:14,,",
        "sample rate:,1000 Hz,,",
        "Time (s),ai0 (g),ai1 (g),ai2 (g)",
    ]
    return Right(rows(d / "daq.csv", head, [m.t, *m.g.T]), (m.force,), 1000.0)


@shape("https://dewesoft.com (DewesoftX, text export)")
def dewesoft_text(d):
    m = motion(500.0, 4.0)
    head = [
        "Data Info",
        "File name: run.dxd",
        "Start time: 5/17/2024 10:25:14.123",
        "Number of channels: 3",
        "Sample rate: 500 Hz",
        "",
        "Events",
        "",
        "Data1",
    ]
    head += ["Time (s)\tAX (g)\tAY (g)\tAZ (g)"]
    return Right(rows(d / "run.txt", head, [m.t, *m.g.T], "\t"), (m.force,), 500.0)


@shape("https://www.imc-tm.com (FAMOS, ASCII)")
def imc_famos_ascii(d):
    m = motion(500.0, 4.0)
    head = ["Zeit\tKanal_a_x\tKanal_a_y\tKanal_a_z", "s\tm/s^2\tm/s^2\tm/s^2"]
    return Right(rows(d / "imc.asc", head, [m.t, *m.force.T], "\t", mark=","), (m.force,), 500.0)


@shape("https://www.siemens.com (Simcenter Testlab, ASCII)")
def testlab_ascii(d):
    m = motion(512.0, 4.0)
    head = ["Time\tBase:1:+X\tBase:1:+Y\tBase:1:+Z", "s\tg\tg\tg"]
    return Right(rows(d / "testlab.txt", head, [m.t, *m.g.T], "\t", "{:.6e}"), (m.force,), 512.0)


@shape("https://www.hbkworld.com (catman, ASCII)")
def catman_ascii(d):
    m = motion(300.0, 5.0)
    head = [
        "HBM;catmanEasy;5.4.1",
        "Messung;run_01",
        "Datum;17.05.2024 10:25:14",
        "Zeit  1 - Standardmessrate [s];Acc_X [m/s²];Acc_Y [m/s²];Acc_Z [m/s²]",
    ]
    return Right(
        rows(d / "catman.asc", head, [m.t, *m.force.T], ";", mark=",", code="latin-1", line="\r\n"), (m.force,), 300.0
    )


@shape("https://mmf.de (VM-REC, header with SampleRate)")
def vibrometra(d):
    m = motion(1000.0, 2.0)
    head = [
        "Version=1.8",
        "SampleRate=1000",
        "NumChannels=3",
        "MeasurandName_1=acceleration",
        "UnitName_1=m/s²",
        "DataType=text",
        "X [m/s²]\tY [m/s²]\tZ [m/s²]",
    ]
    return Right(rows(d / "rec.txt", head, m.force.T, "\t"), (m.force,), 1000.0)


@shape("https://docs.obspy.org (TSPAIR)")
def tspair(d):
    m = motion()
    head = [
        f"TIMESERIES NZ_TEST__HNZ_R, {len(m.t)} samples, 100 sps, 2024-05-17T10:25:14.000000, TSPAIR, FLOAT, M/S**2"
    ]
    path = rows(d / "hnz.tspair", head, [stamps(m.t, "{date}T{time}.{us}"), ("{:+.10e}", m.force[:, 2])], "  ")
    return Right(path, refused="acceleration", doubt=True)


def wrapped(values, each, form):
    return ["".join(form.format(one) for one in values[at : at + each]) for at in range(0, len(values), each)]


@shape("https://ngawest2.berkeley.edu (PEER NGA .AT2)")
def peer_at2(d):
    m = motion()
    head = [
        "PEER NGA STRONG MOTION DATABASE RECORD",
        "Imperial Valley-02, 5/19/1940, El Centro Array #9, 180",
        "ACCELERATION TIME SERIES IN UNITS OF G",
    ]
    head += [f"NPTS= {len(m.t)}, DT= .0100 SEC,"]
    (d / "RSN6.AT2").write_text("\n".join([*head, *wrapped(m.g[:, 0], 5, "{:15.7E}")]) + "\n")
    return Right(d / "RSN6.AT2", refused="acceleration", doubt=True)


@shape("https://www.kyoshin.bosai.go.jp (K-NET ASCII)")
def knet_ascii(d):
    m = motion()
    pairs = [
        ("Origin Time", "2024/05/17 10:25:00"),
        ("Lat.", "34.8158"),
        ("Long.", "139.0546"),
        ("Depth. (km)", "10"),
        ("Mag.", "4.1"),
        ("Station Code", "SZO001"),
        ("Station Lat.", "34.8158"),
        ("Station Long.", "139.0546"),
        ("Station Height(m)", "149"),
        ("Record Time", "2024/05/17 10:25:29"),
        ("Sampling Freq(Hz)", "100Hz"),
        ("Duration Time(s)", "12"),
        ("Dir.", "E-W"),
        ("Scale Factor", "3920(gal)/6182761"),
        ("Max. Acc. (gal)", "980.1"),
        ("Last Correction", "2024/05/17 10:25:14"),
        ("Memo.", ""),
    ]
    values = np.round(100 * m.force[:, 0] * 6182761 / 3920).astype(int)
    (d / "SZO001.EW").write_text(
        "\n".join([*(f"{key:18s}{value}" for key, value in pairs), *wrapped(values, 8, "{:9d}")]) + "\n"
    )
    return Right(d / "SZO001.EW", refused="acceleration", doubt=True)


@shape("https://docs.qualisys.com (TSV export of markers)")
def qualisys_markers(d):
    m = motion()
    head = [
        f"NO_OF_FRAMES\t{len(m.t)}",
        "NO_OF_CAMERAS\t8",
        "NO_OF_MARKERS\t2",
        "FREQUENCY\t100",
        "DATA_INCLUDED\t3D",
        "MARKER_NAMES\thead\thand",
    ]
    head += ["Frame\tTime\thead X\thead Y\thead Z\thand X\thand Y\thand Z"]
    moved = np.cumsum(m.gyro, axis=0)
    places = [500 + moved, 900 - 2 * moved[:, ::-1]]
    columns = [1 + np.arange(len(m.t)), ("{:.5f}", m.t), *(column for one in places for column in one.T)]
    return Right(rows(d / "markers.tsv", head, columns, "\t", "{:.3f}"), refused="acceleration")


@shape("https://docs.vicon.com (Nexus, CSV of devices)")
def vicon_devices(d):
    m = motion()
    head = [
        "Devices",
        "100",
        ",,IMU #1 - Accelerometer,,,IMU #1 - Gyro,,",
        "Frame,Sub Frame,ACCX,ACCY,ACCZ,GYROX,GYROY,GYROZ",
        ",,mm/s^2,mm/s^2,mm/s^2,deg/s,deg/s,deg/s",
    ]
    columns = [1 + np.arange(len(m.t)), np.zeros(len(m.t), int), *(1000 * m.force).T, *m.deg.T]
    return Right(rows(d / "trial.csv", head, columns, form="{:.3f}"), (m.force,), None, m.gyro, doubt=True)


@shape("https://www.msr.ch (MSR145, CSV)")
def msr_logger(d):
    m = motion(50.0)
    head = [
        "*CREATOR",
        "MSR Electronics",
        "*STARTTIME",
        "2024-05-17;10:25:14;",
        "*NAME",
        ";ACC x;ACC y;ACC z",
        "*UNIT",
        "TIME;G;G;G",
        "*DATA",
    ]
    return Right(rows(d / "msr.csv", head, [stamps(m.t), *m.g.T], ";", "{:.3f}"), (m.force,), 50.0)


@shape("own: totals below the rows")
def counts_with_totals(d):
    m = motion(200.0, 6.0)
    tail = ["", "Samples,1200,,", "Mean,0.1,0.2,9.8", "# end"]
    path = rows(d / "totals.csv", ["t [s],x [m/s^2],y [m/s^2],z [m/s^2]"], [m.t, *m.force.T], tail=tail)
    return Right(path, (m.force,), 200.0)


@shape("own: twelve axes in mg")
def evaluation_board_mg(d):
    m = motion(125.0)
    names = ["Time [ms]"] + [f"S{chip}_{a} [mg]" for chip in range(1, 5) for a in "XYZ"]
    columns = [("{:.0f}", 1000 * m.t), *(column for chip in m.chips for column in counts(chip / G, 1000))]
    return Right(rows(d / "eval.txt", ["\t".join(names)], columns, "\t"), m.chips, 125.0)
