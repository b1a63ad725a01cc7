"""`gfimu campaign status`, `table`, `plot`: what a folder holds; and a campaign that is stopped from the keyboard."""

import csv
import json
import os
import signal
import subprocess
import sys
import time

import pytest
from matplotlib.image import imread

from sim.trials import Dataset
from sim.trials.sweep.pace import running

PLAN = """
kind = "measure"
design = "sobol"
points = 32
repeats = 2
batch = 16
[factors]
sample_rate_hz = [20, 40]
duration_s = [10.0]
[factors.bias_instability_mg]
low = 0.1
high = 10.0
scale = "log"
"""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Folder of a campaign that is done."""
    import gfimu

    folder = tmp_path_factory.mktemp("campaigns")
    (folder / "plan.toml").write_text(PLAN)
    gfimu.campaign(folder / "plan.toml", out=folder / "out", workers=1)
    return folder / "out"


@pytest.fixture
def part(campaign, tmp_path):
    """A campaign of which the last batch is missing."""
    folder = tmp_path / "part"
    folder.mkdir()
    for file in (*sorted(campaign.iterdir())[:3], campaign / "plan.toml"):
        (folder / file.name).write_bytes(file.read_bytes())
    return folder


def test_status_of_a_part_says_how_to_go_on(gfimu_command, part):
    found = gfimu_command("campaign", "status", part)
    assert found.code == 0
    assert "48 of 64 cases (75.0 %), 0 failed" in found.stdout
    assert "goes on with it" in found.stdout


def test_status_sees_a_campaign_that_runs(gfimu_command, part):
    with running(Dataset.open(part)) as note:
        note(16)
        time.sleep(1.1)  # longer than between two notes
        note(32)
        found = json.loads(gfimu_command("campaign", "status", part, "--json").stdout)
        assert [run["pid"] for run in found["runs"]] == [os.getpid()]
        assert found["rate_per_s"] == pytest.approx(16 / 1.1, rel=0.2)  # the start does not count
        assert found["left_s"] == pytest.approx(16 / found["rate_per_s"])
        assert "cases/s" in gfimu_command("campaign", "status", part).stdout
    found = json.loads(gfimu_command("campaign", "status", part, "--json").stdout)
    assert (found["runs"], found["left_s"]) == ([], None)


def test_a_misspelt_command_is_named(gfimu_command, part):
    refused = gfimu_command("campaign", "stats", part)
    assert refused.code == 2
    assert "did you mean gfimu campaign status?" in refused.stderr


def test_a_killed_run_is_no_run(gfimu_command, part):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    with running(Dataset.open(part)):
        (note,) = part.glob(".running-*")
        text = note.read_text().replace(str(os.getpid()), str(ended.pid))
    note.write_text(text)
    assert json.loads(gfimu_command("campaign", "status", part, "--json").stdout)["runs"] == []
    with running(Dataset.open(part)):
        pass
    assert not list(part.glob(".running-*"))  # the next run tidies up


def test_table_has_quantiles_and_sensitivities(gfimu_command, campaign, tmp_path):
    out = tmp_path / "quantiles.csv"
    found = gfimu_command("campaign", "table", campaign, "--csv", out, "--json")
    assert found.code == 0, found.stderr
    content = json.loads(found.stdout)
    rows = list(csv.DictReader(out.open()))
    assert [row["sample_rate_hz"] for row in rows] == ["20"] * 6 + ["40"] * 6
    assert float(rows[0]["median_or_share"]) == content["groups"][0]["median"]
    first = {one["factor"]: one["first"] for one in content["sensitivities"] if one["result"] == "deviation_over_noise"}
    assert first["bias_instability_mg"] > 0.5
    assert abs(first["sample_rate_hz"]) < 0.2
    assert 0.0 < content["seed_shares"]["alpha_rms_rad_s2"] < 1.0
    text = gfimu_command("campaign", "table", campaign, "--by", "bias_instability_mg").stdout
    assert "given data" in text
    assert "0.1" in text
    assert text.count("…") == 30  # five parts of the range, of six results each


def test_plot_draws_every_kind_of_file(gfimu_command, campaign, tmp_path):
    for name in ("one.png", "one.svg", "one.html"):
        assert gfimu_command("campaign", "plot", campaign, "--out", tmp_path / name).code == 0
    assert imread(tmp_path / "one.png").std() > 0.1
    page = (tmp_path / "one.html").read_text()
    assert "<svg" in page
    assert "64 of 64 cases" in page
    refused = gfimu_command("campaign", "plot", campaign, "--out", tmp_path / "x.png", "--result", "alfa")
    assert refused.code == 2
    assert "unknown result 'alfa'" in refused.stderr


def test_a_damaged_shard_is_one_line_and_is_made_again(gfimu_command, part, tmp_path):
    shard = sorted(part.glob("*.parquet"))[1]
    whole = shard.read_bytes()
    shard.write_bytes(whole[:200])
    for words in (("status",), ("table",), ("plot", "--out", tmp_path / "x.png"), ()):
        refused = gfimu_command("campaign", *words[:1], part, *words[1:])
        assert refused.code == 2
        assert refused.stderr.count("\n") == 1
        assert shard.name in refused.stderr
        assert "delete it and run the campaign again" in refused.stderr
    shard.unlink()
    plan = tmp_path / "again.toml"
    plan.write_text(PLAN)
    assert gfimu_command("campaign", plan, "--out", part, "--workers", 1).code == 0
    assert shard.read_bytes() == whole


@pytest.mark.parametrize(
    ("factors", "message"),
    [
        ("sample_rate = [20]\n", "unknown factor of kind 'measure' 'sample_rate'"),
        ('"table_tild.x_rad" = [0.1]\n', "unknown effect 'table_tild'"),
        ('"table_tilt.x_m" = [0.1]\n', "x_m"),
        ('"misalignment.std_m" = [0.1]\n', "drawn by std_rad"),
        ("bias_instability_mg = [-1]\n", "below zero"),
        ('duration_s = ["long"]\n', "no number"),
        ('twin = ["single_chip_carriage"]\n', ""),
        ("d_prime = [3]\n", "give effect too"),
        ('sample_rate_hz = [20, "40"]\n', "mixes numbers"),
        ("sample_rate_hz = [20, 20]\n", "given twice"),
    ],
)
def test_a_wrong_world_is_one_line(gfimu_command, tmp_path, factors, message):
    (tmp_path / "plan.toml").write_text(f'kind = "measure"\n[factors]\n{factors}')
    refused = gfimu_command("campaign", tmp_path / "plan.toml", "--out", tmp_path / "out")
    assert refused.code == 2, refused
    assert message in refused.stderr
    assert refused.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_cluster_that_is_not_there_writes_nothing(gfimu_command, tmp_path):
    (tmp_path / "plan.toml").write_text(PLAN)
    for address, message in (("127.0.0.1:1", "no Dask scheduler answers"), ("foo://x", "scheme")):
        refused = gfimu_command("campaign", tmp_path / "plan.toml", "--out", tmp_path / "out", "--cluster", address)
        assert refused.code == 2
        assert message in refused.stderr
        assert refused.stderr.count("\n") == 1
        assert not (tmp_path / "out").exists()


def ends(group, within):
    """Whether no process of a group is there any more, after some seconds at most."""
    until = time.monotonic() + within
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


@pytest.mark.skipif(sys.platform == "win32", reason="no process groups")
def test_ctrl_c_ends_the_workers_at_once_and_what_is_there_stays(tmp_path):
    """A process of its own: the signal goes to the group, as from a terminal."""
    (tmp_path / "plan.toml").write_text(PLAN.replace("points = 32", "points = 65536"))
    code = """
if __name__ == "__main__":
    import signal
    from gfimu.commands.shell.program import main
    signal.signal(signal.SIGINT, signal.default_int_handler)  # which a job in the background ignores
    main()
"""
    (tmp_path / "go.py").write_text(code)
    words = ["campaign", tmp_path / "plan.toml", "--out", tmp_path / "out", "--workers", "2"]
    started = subprocess.Popen(
        [sys.executable, tmp_path / "go.py", *words], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    until = time.monotonic() + 60.0
    while not list((tmp_path / "out").glob("[0-9]*.parquet")) and time.monotonic() < until:
        time.sleep(0.05)
    os.killpg(started.pid, signal.SIGINT)
    _, said = started.communicate(timeout=20.0)
    assert started.returncode == 130
    assert said == "gfimu: interrupted\n"
    assert ends(started.pid, within=5.0)
    names = [file.name for file in (tmp_path / "out").iterdir()]
    assert len(names) > 1
    assert all(name == "plan.toml" or name.endswith(".parquet") for name in names)


def test_a_share_is_not_called_a_median(capsys):
    from gfimu import CampaignTable
    from gfimu.commands import print_blocks
    from sim.trials.sweep.summary import Group

    groups = (Group({}, "exact", 4, 0, 0.3, 0.75, 0.95, share=True), Group({}, "size_m", 4, 0, 1.0, 2.0, 3.0))
    print_blocks(CampaignTable(groups, (), {}).shown())
    of_share, of_size = capsys.readouterr().out.split("size_m")
    assert "share" in of_share
    assert "median" not in of_share
    assert "median" in of_size
