"""Lines of serial monitors and logs become columns: labels with or without marks, lists, units, kinds in turn."""

import pytest

from gfimu.recording import table_of_text

LOGS = {
    "labels without marks": ("#{k} @ {t} ms: x 0.01 , y 0.2 , z 9.8", ("host_time", "x", "y", "z")),
    "a unit after each number": ("x = 0.0{k} G, y = -0.2 G, z = 0.98 G", ("x [G]", "y [G]", "z [G]")),
    "lists in brackets": (
        "Acc (mg) [ {k}.5, 0.2, 980.0 ], Gyr (DPS) [ 0.1, 0.2, 0.3 ]",
        (*(f"Acc {axis} [mg]" for axis in "XYZ"), *(f"Gyr {axis} [DPS]" for axis in "XYZ")),
    ),
    "a list among pairs": ("mid:-1;mpry:0,{k},0;agx:6.0", ("mid", "mpry X", "mpry Y", "mpry Z", "agx")),
    "kinds in turn": (
        "accel 0.{k} 0.2 9.8 m/s/s\ngyro 0.1 0.2 0.3 rad/s",
        (*(f"accel {axis} [m/s/s]" for axis in "XYZ"), *(f"gyro {axis} [rad/s]" for axis in "XYZ")),
    ),
}


@pytest.mark.parametrize(("form", "names"), LOGS.values(), ids=LOGS)
def test_a_log_becomes_columns(form, names):
    table = table_of_text("\n".join(form.format(k=k, t=12000 + 10 * k) for k in range(9)).encode(), "file")
    assert tuple(table.columns) == names
    assert len(table) == 9


@pytest.mark.parametrize("row", ["walk 0.{k} 0.2 9.8", "33,Jogging,{k},0.2,9.8", "2024-05-17 10:25:1{k}.5,0.1,0.2"])
def test_words_among_numbers_make_no_log(row):
    table = table_of_text("\n".join(row.format(k=k) for k in range(9)).encode(), "file")
    assert not table.named
    assert len(table.columns) == len(row.replace("17 ", "17_").replace(",", " ").split())


HEADS = {
    "names above units": ("time,InlineAcc,Speed\ns,g,km/h", ("time [s]", "InlineAcc [g]", "Speed")),
    "units above sources": ("t,x_acc,y_acc\ns,G,G\n100: gps,101: acc,101: acc", ("t [s]", "x_acc [G]", "y_acc [G]")),
}


@pytest.mark.parametrize(("head", "names"), HEADS.values(), ids=HEADS)
def test_names_stand_above_units(head, names):
    table = table_of_text(f"{head}\n0.0,1.5,2\n0.1,1.6,3\n".encode(), "file")
    assert tuple(table.columns) == names


def test_groups_stand_above_repeated_names():
    head = "Time,Ankle,,Waist,\n,x (g),y (g),x (g),y (g)"
    table = table_of_text(f"{head}\n0.0,1.5,2,3,4\n0.1,1.6,3,3,4\n".encode(), "file")
    assert tuple(table.columns)[1:] == ("Ankle x (g)", "Ankle y (g)", "Waist x (g)", "Waist y (g)")


def test_repeated_names_keep_their_units():
    table = table_of_text(b"t,x (g),x (g)\n0.0,1.5,2\n0.1,1.6,3\n", "file")
    assert tuple(table.columns) == ("t", "x_2 (g)", "x_3 (g)")
