"""Files of one's own become a recording with map, array and twin: on a pendulum, a table and a printer's axis.

The files follow from formulas here, not from the project's simulation: chips on their side, counts of a logger, a
reference of a clock of its own.
"""

import json

import numpy as np
import pytest

import gfimu
from gfimu import InputError
from gfimu.diagnosis import chip_axes
from sim.twin import Twin

G = 9.80665
MOUNTED = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Sensing axes of the chip: x of the chip along z of the rig, and so on."""


def rows(path, head, columns, form="%.6f"):
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=head, comments="", fmt=form)
    return path


def readings(force, seed=1, mounted=MOUNTED):
    """What the chip reads, g, with the noise of an ADXL345 at 200 Hz."""
    noise = 0.004 * np.random.default_rng(seed).standard_normal(force.shape)
    return force @ mounted.T / G + noise


def pendulum(folder, arm=0.35, rate=200.0):
    t = np.arange(0.0, 40.0, 1.0 / rate)
    decay, swing = np.exp(-t / 60.0), 2.0 * np.pi / 1.2
    angle = 0.8 * decay * np.cos(swing * t)
    speed = np.gradient(angle, t)
    turning = np.gradient(speed, t)
    # Along the arm upwards y, along the swing x; the chip hangs below the axis.
    force = np.column_stack([G * np.sin(angle) + arm * turning, G * np.cos(angle) + arm * speed**2, 0.0 * t])
    read = readings(force)
    return rows(folder / "swing.csv", "time_s,ax_g,ay_g,az_g,encoder_deg", [t, *read.T, np.degrees(angle)])


def table(folder, radius=0.12, rate=100.0, late=3.7, drift=1e-3):
    """The tachometer is logged by another computer: its clock is 3.7 s behind and 0.1 % slow."""

    def speed(t):
        return 3.0 * np.sin(0.35 * t) + 1.5 * np.sin(0.11 * t + 1.0)

    t = np.arange(0.0, 80.0, 1.0 / rate)
    turning = np.gradient(speed(t), t)
    force = np.column_stack([-radius * speed(t) ** 2, radius * turning, G + 0.0 * t])
    chips = rows(folder / "chip.csv", "ms,x,y,z", [1000.0 * t, *readings(force).T * 256.0], "%.0f")
    own = np.arange(0.0, 70.0, 0.05)
    rpm = speed(late + own * (1.0 + drift)) * 30.0 / np.pi
    return chips, rows(folder / "tacho.csv", "time_s,rpm", [own, rpm], "%.4f")


def axis(folder, rate=400.0):
    t = np.arange(0.0, 30.0, 1.0 / rate)
    place = 0.08 * np.sin(2.0 * np.pi * 0.8 * t) + 0.03 * np.sin(2.0 * np.pi * 2.1 * t)
    pushed = np.gradient(np.gradient(place, t), t)
    read = readings(np.column_stack([pushed, 0.0 * t, G + 0.0 * t]))
    return rows(folder / "tool.csv", "time_s,ax_g,ay_g,az_g,carriage_mm", [t, *read.T, 1000.0 * place])


def phone(folder, arm=0.6, second=0.0):
    """A phone on an arm: accelerations with gravity, a gyro with a bias, stamps of its system; no encoder."""
    rng = np.random.default_rng(3)
    t = np.sort(np.arange(0.0, 40.0, 0.01) + 0.001 * rng.standard_normal(4000))
    even = np.linspace(t[0], t[-1], 200_000)
    begun = np.clip((even - 4.0) / 2.0, 0.0, 1.0)
    angle = 0.6 * begun**3 * (10.0 - 15.0 * begun + 6.0 * begun**2) * np.exp(-even / 80.0) * np.cos(3.9 * even)
    speed = np.gradient(angle, even)
    turning = np.gradient(speed, even)
    angle, speed, turning = (np.interp(t, even, one) for one in (angle, speed, turning))
    force = np.column_stack([G * np.sin(angle) + arm * turning, G * np.cos(angle) + arm * speed**2, 0.0 * t])
    read = force @ MOUNTED.T + [0.05, -0.08, 0.1] + 0.02 * rng.standard_normal((len(t), 3))
    turned = np.column_stack([0.0 * t, second * np.sin(7.0 * t), speed]) @ MOUNTED.T
    turned = turned + [0.01, -0.005, 0.008] + 0.002 * rng.standard_normal((len(t), 3))
    head = "time_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s"
    return rows(folder / "phone.csv", head, [t, *read.T, *turned.T])


def array_of(folder):
    return gfimu.AccelerometerArray.load(folder / "array.toml")


def test_a_pendulum_in_one_file(tmp_path, gfimu_command):
    done = gfimu_command("start", pendulum(tmp_path), "--part", "adxl345", "--out", tmp_path / "made", "--json")
    assert done.code == 0, done.stderr
    made = json.loads(done.stdout)
    assert made["rig"] == "pendulum"
    [chip] = array_of(tmp_path / "made").chips
    assert chip.position == pytest.approx([0.0, -0.35, 0.0], abs=2e-3)
    assert chip.axes == pytest.approx(MOUNTED)
    check, diagnose = made["next"]
    assert check.startswith("gfimu check ")
    seen = gfimu_command(*check.split()[1:], "--json")
    assert seen.code == 0, seen.stderr
    assert "gfimu diagnose" in diagnose


def test_a_phone_on_a_pendulum_takes_its_rate_from_the_gyro(tmp_path):
    made = gfimu.start(phone(tmp_path), rig="pendulum", part="generic", out=tmp_path / "made")
    [chip] = array_of(tmp_path / "made").chips
    assert chip.position == pytest.approx([0.0, -0.6, 0.0], abs=0.01)
    assert np.abs(chip.axes) == pytest.approx(MOUNTED, abs=1e-6)
    assert any("no encoder: the rate is that of the gyro" in line for line in made.reasons)
    run, twin = gfimu.Recording.read(tmp_path / "made" / "run.parquet"), Twin.load(tmp_path / "made" / "twin.toml")
    assert twin.drive_source == "tacho"
    assert np.nanmean(run.reference["tacho_rad_s"]) == pytest.approx(0.0, abs=0.01)  # without the bias of the gyro
    [mounted] = chip_axes(run, twin)
    assert mounted.rms < 0.2


def test_a_phone_that_turns_about_two_axes_is_no_pendulum(tmp_path):
    with pytest.raises(InputError, match=r"more than one axis.*--rig body"):
        gfimu.start(phone(tmp_path, second=1.0), rig="pendulum", part="generic", out=tmp_path / "made")


def test_a_phone_on_a_pendulum_has_the_biases_that_it_has(tmp_path):
    gfimu.start(phone(tmp_path), rig="pendulum", part="generic", out=tmp_path / "made")
    verdict = gfimu.diagnose(tmp_path / "made" / "run.parquet", tmp_path / "made" / "twin.toml")
    [bias] = [cause for cause in verdict.causes if cause.effect == "bias"]
    for key, value in {"a11_m_s2": 0.05, "a12_m_s2": -0.08, "a13_m_s2": 0.1}.items():
        assert bias.parameters[key] == pytest.approx(value, abs=max(4.0 * bias.std[key], 0.01))


def test_a_table_with_a_tachometer_of_another_clock(tmp_path):
    made = gfimu.start(table(tmp_path), part="adxl345", out=tmp_path / "made")
    assert made.rig == "table"
    [chip] = array_of(tmp_path / "made").chips
    assert np.linalg.norm(chip.position) == pytest.approx(0.12, abs=2e-3)
    assert chip.axes == pytest.approx(MOUNTED)
    clock = next(line for line in made.reasons if "its clock is" in line)
    assert float(clock.split("its clock is ")[1].split()[0]) == pytest.approx(3.7, abs=0.02)
    assert set(made.written) == {"run.parquet", "array.toml", "map.toml", "reference_map.toml", "twin.toml"}
    twin, run = Twin.load(tmp_path / "made" / "twin.toml"), gfimu.Recording.read(tmp_path / "made" / "run.parquet")
    [seen] = gfimu.check(run, twin).runs
    assert seen.fastest_rad_s == pytest.approx(4.5, abs=0.1)  # the tachometer has a value in one row of five
    [mounted] = chip_axes(run, twin)
    assert mounted.rms < 3.0 * 0.004 * G * np.sqrt(3.0)


def test_an_axis_of_a_printer(tmp_path):
    made = gfimu.start(axis(tmp_path), part="adxl345", out=tmp_path / "made")
    assert made.rig == "axis"
    assert array_of(tmp_path / "made").chips[0].axes == pytest.approx(MOUNTED)


def test_a_chip_that_is_turned_by_more_than_a_mounting_keeps_its_angle(tmp_path):
    turned = np.array([[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    t = np.arange(0.0, 40.0, 0.01)
    speed = 3.0 * np.sin(0.35 * t)
    force = np.column_stack([-0.1 * speed**2, 0.1 * np.gradient(speed, t), G + 0.0 * t])
    path = rows(
        tmp_path / "turned.csv", "t_s,ax_g,ay_g,az_g,rpm", [t, *readings(force, 2, turned).T, speed * 30 / np.pi]
    )
    gfimu.start(path, part="adxl345", out=tmp_path / "made")
    assert array_of(tmp_path / "made").chips[0].axes == pytest.approx(turned, abs=0.01)


def test_what_is_open_is_asked_for(tmp_path):
    t = np.arange(0.0, 40.0, 0.01)
    speed = 3.0 * np.sin(0.35 * t)
    force = np.column_stack([-0.1 * speed**2, 0.1 * np.gradient(speed, t), G + 0.0 * t])
    path = rows(tmp_path / "no_rate.csv", "ax_g,ay_g,az_g,rpm", [*readings(force, 2, np.eye(3)).T, speed * 30 / np.pi])
    with pytest.raises(InputError, match="--rate-hz"):
        gfimu.start(path, out=tmp_path / "made")
    asked = []

    def answer(question, default):
        asked.append(question)
        return "100" if "samples per second" in question else default

    made = gfimu.start(path, part="adxl345", out=tmp_path / "made", ask=answer)
    assert made.rig == "table"
    words = ("samples per second", "What moved", "Distance of the chip")
    assert [sum(word in one for one in asked) for word in words] == [1, 1, 1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--rig", "boat"], "unknown rig 'boat'"),
        (["--rig", "axis"], "no reference of the rig 'axis'"),
        (["--part", "adxl999"], "adxl999"),
        (["--place-m", "1,2"], "three numbers in metres"),
        (["--place-m", "0,0,0", "--place-m", "0,0,1"], "2 places"),
    ],
)
def test_wrong_answers_end_in_one_line_and_nothing_is_written(options, words, tmp_path, gfimu_command):
    done = gfimu_command("start", pendulum(tmp_path), "--out", tmp_path / "made", *options)
    assert done.code == 2
    assert words in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "made").exists()


def test_files_without_accelerations_are_refused(tmp_path, gfimu_command):
    _, tacho = table(tmp_path)
    done = gfimu_command("start", tacho, "--out", tmp_path / "made")
    assert done.code == 2
    assert "no accelerations found" in done.stderr


@pytest.mark.parametrize("answer", ["", "fast", "-5", "nan"])
def test_an_answer_that_is_no_number_ends_in_one_line(answer, tmp_path):
    rng = np.random.default_rng(1)
    columns = [*readings(np.tile([0.0, 0.0, G], (2000, 1)), 2).T, rng.standard_normal(2000)]
    path = rows(tmp_path / "no_rate.csv", "ax_g,ay_g,az_g,rpm", columns)
    with pytest.raises(InputError, match="--rate-hz"):
        gfimu.start(path, out=tmp_path / "made", ask=lambda *_: answer)
    assert not (tmp_path / "made").exists()


def test_a_word_that_is_none_of_the_offered_ones_is_asked_for_again(tmp_path):
    answers = {"What moved": iter(["boat", "pendulum"])}

    def answer(question, default):
        return next((next(given) for words, given in answers.items() if words in question), default)

    assert gfimu.start(pendulum(tmp_path), part="adxl345", out=tmp_path / "made", ask=answer).rig == "pendulum"
