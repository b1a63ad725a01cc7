"""The tolerance command: tables, JSON, picture, bad input."""

from __future__ import annotations

import json

import pytest

import gfimu

FEW = ("--units", 10, "--workers", 1)


def test_tables_name_tolerances_causes_and_what_to_pay_for(gfimu_command):
    result = gfimu_command("tolerance", "cube12", "--closed-form")
    assert result.code == 0
    for words in (
        "±0.2 mm",
        "±0.5°",
        "35 to 40 mg",
        "data sheet",
        "Calibration none",
        "Calibration poses+rest",
        "halve",
    ):
        assert words in result.stdout
    assert "simulated" not in result.stdout


def test_simulated_units_stand_beside_first_order(gfimu_command, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    how = ("--calibrated", "none", "--calibrated", "rest", "--duration", 2.5)
    result = gfimu_command("tolerance", "cube12", *FEW, *how)
    assert result.code == 0
    for words in (
        "10 simulated",
        "simulated / first order",
        "FIRST ORDER FAILS for position",
        "attitude error reaches",
    ):
        assert words in result.stdout


def test_json_is_the_result_of_the_function(gfimu_command):
    chip = gfimu.ChipErrors(bias_m_s2=0.0980665)
    call = {"units": 10, "workers": 1, "calibrated": ["rest"], "duration": 2.5, "seed": 3, "chip": chip}
    data = json.loads(
        gfimu_command(
            "tolerance", "p1_face_diagonals", "--units", 10, "--workers", 1, "--calibrated", "rest", "--duration", 2.5,
            "--seed", 3, "--bias-mg", 10, "--json",
        ).stdout
    )  # fmt: skip
    result = gfimu.tolerance("p1_face_diagonals", **call)
    rest = data["calibrations"]["rest"]["quantities"]
    assert set(rest) == {"alpha", "omega", "position"}
    for name, one in rest.items():
        assert one["rms"] == pytest.approx(result.budgets["rest"].quantities[name].rms)
        assert one["simulated"]["rms"] == pytest.approx(result.comparisons["rest"][name].rms)
        assert sum(one["share"].values()) == pytest.approx(1.0)
    assert data["tolerances"]["bias_std_m_s2"][0] == pytest.approx(0.0980665)
    assert data["tolerances"]["placement_m"] == 2e-4


def test_a_scenario_and_another_part(gfimu_command):
    result = gfimu_command(
        "tolerance",
        "cube12",
        "--closed-form",
        "--scenario",
        "paper_run",
        "--duration",
        8,
        "--part",
        "adxl355",
        "--json",
    )
    data = json.loads(result.stdout)
    assert data["motion"] == "scenario paper_run, 8 s"
    assert data["levelled_at_start"] is True
    assert data["tolerances"]["noise_std_m_s2"][0] < 0.01


def test_a_body_in_free_motion(gfimu_command):
    result = gfimu_command("tolerance", "cube12", *FEW, "--scenario", "tumble", "--duration", 3, "--calibrated", "none")
    assert result.code == 0
    assert "scenario tumble" in result.stdout


def test_an_array_of_which_no_unit_can_be_estimated(gfimu_command, tmp_path):
    result = gfimu_command(
        "tolerance", "p2_face_centres", *FEW, "--calibrated", "none", "--picture", tmp_path / "diverged.png"
    )
    assert result.code == 0
    assert "10 units could not be estimated: the rate diverges" in result.stdout
    assert "no unit" in result.stdout


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_picture(gfimu_command, tmp_path, suffix):
    file = tmp_path / f"tolerance.{suffix}"
    result = gfimu_command("tolerance", "cube12", *FEW, "--calibrated", "rest", "--duration", 2.5, "--picture", file)
    assert result.code == 0
    assert file.stat().st_size > 10_000


def test_picture_of_nothing(gfimu_command, tmp_path):
    zero = ["--position-mm", "--angle-deg", "--bias-mg", "--gain-percent", "--cross-axis-percent", "--noise-ug"]
    zero += ["--nonlinearity-percent", "--temperature-k"]
    words = [word for option in zero for word in (option, 0)]
    result = gfimu_command("tolerance", "cube12", "--closed-form", *words, "--picture", tmp_path / "nothing.png")
    assert result.code == 0
    assert (tmp_path / "nothing.png").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("cube12 --position-mm -0.1", "--position-mm -0.1"),
        ("cube12 --angle-deg nan", "--angle-deg nan"),
        ("cube12 --bias-mg inf", "--bias-mg inf"),
        ("cube12 --noise-ug -1", "--noise-ug -1"),
        ("cube12 --position-mm 1e9", "placement_m"),
        ("cube12 --units 0", "--units 0"),
        ("cube12 --units 1000000000", "--units 1000000000"),
        ("cube12 --workers 0", "--workers 0"),
        ("cube12 --seed -1", "--seed"),
        ("cube12 --duration 1", "--duration 1"),
        ("cube12 --duration nan", "--duration nan"),
        ("cube12 --speed-rad-s 0", "--speed-rad-s 0"),
        ("cube12 --duration 1e9", "samples"),
        ("cube12 --scenario paper_run --duration 31", "lasts 30 s"),
        ("cube12 --scenario nonsense", "nonsense"),
        ("cube12 --calibrated nonsense", "poses+rest"),
        ("cube12 --part nonsense", "nonsense"),
        ("nonsense", "nonsense"),
        ("p1_face_diagonals --calibrated poses", "three orthogonal axes"),
        ("cube12 --scenario calibration_poses --duration 20 --calibrated rest --speed-rad-s 3 --set x", "--set"),
        ("one_chip", "can't see"),
    ],
)
def test_bad_input_is_one_line(gfimu_command, words, said):
    result = gfimu_command("tolerance", *words.split(), "--closed-form" if "--units" not in words else "--normal")
    assert result.code == 2
    assert said in result.stderr
    assert result.stdout == ""
