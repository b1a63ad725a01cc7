"""A wrong name is one line, code 2, and names the one that was probably meant, whatever its case."""

from __future__ import annotations

import pytest

import gfimu
from gfimu.base import nearest_name


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """A folder with a recording at rest, a CSV of another layout, and a campaign's plan."""
    folder = tmp_path_factory.mktemp("names")
    gfimu.simulate("rest", changes=["duration_s=2"], out=folder / "run.csv")
    rows = "".join(f"{10 * k},0.0,0.0,1.0\n" for k in range(50))
    (folder / "log.csv").write_text("millis,ax,ay,az\n" + rows)
    plan = 'repeats = 1\nkind = "measure"\n[factors]\ntwin = ["cube12_turntable"]\nduration_s = [2.0, 3.0]\n'
    (folder / "plan.toml").write_text(plan)
    gfimu.campaign(folder / "plan.toml", out=folder / "camp", workers=1)
    return folder


CALLS = {
    "esitmate run.csv": "'estimate'",
    "ESTIMATE run.csv": "'estimate'",
    "firmware chek": "'check'",
    "campaign stats camp": "gfimu campaign status",
    "score --speed 3": "--speed-rad-s",
    "score --Speed-Rad-S 3": "--speed-rad-s",
    "estimate run.csv --ot x.csv": "--out",
    "score Cube12": "'cube12'",
    "score cube-12": "'cube12'",
    "simulate PAPER-RUN --out x.csv": "'paper_run'",
    "check run.csv --twin cube12_turntabel": "'cube12_turntable'",
    "design tacho_scal gravity --twin cube12_turntable": "'tacho_scale'",
    "estimate run.csv --method Fliter --out x.csv": "'filter'",
    "estimate run.csv --form lnear --out x.csv": "'linear'",
    "estimate run.csv --axis z --hub fre --out x.csv": "'free'",
    "calibrate six_position run.csv --out x.json": "'six-position'",
    "tolerance cube12 --closed-form --part ADXL35": "'adxl375'",
    "tolerance cube12 --closed-form --calibrated pose": "'poses'",
    "optimize --chips 4 --objective gdpo": "'gdop'",
    "list array": "'arrays'",
    "new arry": "'array'",
    "show adxl34": "'adxl345'",
    "schema campain": "'campaign'",
    "convert log.csv x.csv --map kliper": "'klipper'",
    "convert log.csv x.csv --map-set time.colum=millis": "'column'",
    "convert log.csv x.csv --map-set time.column=milis --map-set unit=g --map-set channels.a11=ax": "'millis'",
    "convert log.csv x.csv --map-set time.column=millis --map-set unit=g --map-set channels.a11=axx": "'ax'",
    "convert log.csv x.csv --drop corupt": "'corrupt'",
    "simulate rest --out x.csv --set duraton_s=1": "'duration_s'",
    "simulate rest --out x.csv --set sensor.rnge_g=4": "'range_g'",
    "noise run.csv --stretch al": "'all'",
    "impact run.csv --standard iso6": "'iso'",
    "campaign camp --by twn": "'twin'",
    "campaign table camp --by duration": "'duration_s'",
    "firmware build gfmu": "'gfimu'",
}


@pytest.mark.parametrize("line", CALLS)
def test_a_wrong_name_names_the_right_one(gfimu_command, here, monkeypatch, line):
    monkeypatch.chdir(here)
    result = gfimu_command(*line.split())
    assert (result.code, result.stdout) == (2, "")
    assert result.stderr.count("\n") == 1
    assert f"did you mean {CALLS[line]}" in result.stderr
    assert not list(here.glob("x.*"))


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("CUBE12", "cube12"),
        ("cube-12x", "cube_12x"),
        ("alpha", "alpha_rms"),
        ("nonsense", None),
        ("cu", None),
        ("", None),
    ],
)
def test_what_is_near(name, meant):
    assert nearest_name(name, ["cube12", "cube_12x", "alpha_rms", "omega_rms"]) == meant


def test_nothing_is_proposed_for_nonsense(gfimu_command):
    assert "did you mean" not in gfimu_command("score", "qqqq").stderr
    assert "did you mean" not in gfimu_command("qqqq").stderr
