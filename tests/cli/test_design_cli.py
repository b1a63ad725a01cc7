"""`gfimu design` as a user calls it."""

import json

import pytest

from gfimu.recording import Recording

QUICK = ("--twin", "cube12_turntable", "--duration", 12, "--evaluations", 3)


def test_a_proposal_is_printed_and_its_scenario_simulates(gfimu_command, tmp_path):
    out, run = tmp_path / "next.toml", tmp_path / "run.parquet"
    result = gfimu_command("design", "eccentricity", "sensor_position", *QUICK, "--out", out)
    assert result.code == 0
    assert "Mount the array" in result.stdout
    assert "ramp to" in result.stdout
    assert gfimu_command("simulate", out, "--out", run).code == 0
    recording = Recording.read(run)
    assert len(recording) == 1200
    assert abs(recording.mounting_rotvec).max() > 1.5
    # The same profile upright, as the proposal asks.
    assert gfimu_command("simulate", out, "--out", run, "--set", "mounting_rotvec_rad=[0, 0, 0]").code == 0


def test_json_for_machines(gfimu_command):
    result = gfimu_command("design", "table_tilt", "bias", *QUICK, "--max-rate", 5, "--max-acceleration", 8, "--json")
    proposal = json.loads(result.stdout)
    assert proposal["separates"]
    assert proposal["peak_rate_rad_s"] <= 5
    assert proposal["peak_acceleration_rad_s2"] <= 8 * (1 + 1e-9)
    assert proposal["duration_s"] == 12
    assert sum(segment["duration_s"] for segment in proposal["segments"]) == pytest.approx(12)
    assert {(pair["effect"], pair["rival"]) for pair in proposal["pairs"]} == {
        ("table_tilt", "bias"),
        ("bias", "table_tilt"),
    }


def test_an_ambiguous_verdict_and_its_recording(gfimu_command, tmp_path):
    run = tmp_path / "run.parquet"
    gfimu_command("simulate", "eccentric_mount", "--out", run, "--set", "sensor.errors=false")
    (tmp_path / "verdict.json").write_text(
        json.dumps(
            {
                "verdict": "ambiguous",
                "causes": [
                    {
                        "effect": "eccentricity",
                        "parameters": {"x_m": {"value": 0.003, "std": 1e-5}, "y_m": {"value": -0.002, "std": 1e-5}},
                        "not_distinguishable_from": ["sensor_position"],
                    }
                ],
            }
        )
    )
    result = gfimu_command("design", "--verdict", tmp_path, "--run", run, *QUICK, "--json")
    proposal = json.loads(result.stdout)
    assert proposal["effects"] == ["eccentricity", "sensor_position"]
    assert proposal["pairs"][0]["nats_before"] < 1 < proposal["pairs"][0]["nats_after"]
    assert not proposal["upright_too"]  # the recording at hand is that


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("bias", *QUICK), "at least two effects"),
        (("bias", "nonsense", *QUICK), "unknown effect 'nonsense'; valid: "),
        (("bias", "stuck_channel", *QUICK), "'stuck_channel' has no size"),
        (QUICK, "one of the two"),
        (("bias", "gravity", "--verdict", "verdict.json", *QUICK), "one of the two"),
        (("--verdict", "nowhere", *QUICK), "nowhere: No such file"),
        (("bias", "gravity", "--twin", "nonsense"), "nonsense"),
        (("bias", "gravity", *QUICK, "--max-rate", -1), "limit of rate -1.0: give a positive number"),
        (("bias", "gravity", *QUICK, "--duration", 2), "too short"),
        (("bias", "gravity", *QUICK, "--out", "next.csv"), "ends in .toml"),
        (("bias", "gravity", *QUICK, "--run", "nowhere.csv"), "nowhere.csv"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_two(gfimu_command, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    result = gfimu_command("design", *arguments)
    assert result.code == 2
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert not list(tmp_path.iterdir())
