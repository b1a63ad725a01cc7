"""The worlds of the benchmark: fixed lists, fixed recordings, truth kept apart, generators that agree, ties by data."""

import json

import numpy as np
import pytest

from sim.effects import EFFECTS
from sim.trials.benchmark.drawing import draw, effects_of, fresh_motion
from sim.trials.benchmark.generators.foreign_effects import FOREIGN
from sim.trials.benchmark.generators.independent_effects import DRAWS, EXOTICS
from sim.trials.benchmark.release import RELEASE, SETS, SPLITS, cases, find_case, release_hash
from sim.trials.benchmark.ties import LEAST_SEPARABLE, free_distance_and_ties
from sim.trials.benchmark.truth_file import LEAST_VISIBLE, digest_of, fixed_world, make, task_of, truths
from sim.trials.benchmark.unlisted import PLACES, UNLISTED_TRUTH

DRAWN = [case for split in SPLITS for name in SETS if name != "real" for case in cases(name, split)]


def test_a_release_that_was_published_does_not_change():
    assert (RELEASE, release_hash()) == ("gfimu-bench-1", "3f8cc59e91cc98ce")
    assert {name: len(cases(name, "test")) for name in SETS} == {
        "own": 60,
        "independent": 40,
        "unlisted": 16,
        "dcmotor": 12,
        "real": 2,
    }
    assert set(truths()) == {case.world for case in DRAWN}


@pytest.mark.parametrize("world", ["own/test/000", "independent/dev/003", "unlisted/dev/005", "dcmotor/test/005"])
def test_a_world_drawn_again_is_the_published_one(world):
    assert digest_of(task_of(world).recording) == fixed_world(world).digest


@pytest.mark.parametrize("world", ["own/dev/005", "independent/dev/001"])
def test_the_truth_file_is_what_its_program_writes(world):
    entry = json.loads(json.dumps(make(find_case(world))))
    fixed = fixed_world(world)
    assert (entry["attempt"], entry["digest"]) == (fixed.attempt, fixed.digest)
    assert [one["effect"] for one in entry["hidden"]] == [name for name, _ in fixed.truth.hidden]
    for hidden, (_, parameters) in zip(entry["hidden"], fixed.truth.hidden, strict=True):
        assert hidden["parameters"] == pytest.approx(parameters, rel=1e-14)  # a cosine's last digit is the processor's
    assert {name: tuple(rivals) for name, rivals in entry["ties"].items()} == fixed.truth.ties


def test_splits_share_no_seed_and_no_unlisted_effect():
    seeds = [case.seed(fixed_world(case.world).attempt) for case in DRAWN]
    assert len(set(seeds)) == len(seeds)
    dev, test = ({case.effects for case in cases("unlisted", split)} for split in SPLITS)
    assert not dev & test


def test_every_effect_of_the_library_is_hidden_alone_and_some_worlds_hide_nothing():
    alone = {case.effects[0] for case in cases("own", "test") if len(case.effects) == 1}
    assert alone == set(EFFECTS) == set(DRAWS)
    for name in ("own", "independent", "dcmotor"):
        assert sum(not case.effects for case in cases(name, "test")) >= 3


def test_the_right_answers_for_unlisted_effects_exist():
    assert set(UNLISTED_TRUTH) == set(FOREIGN) | set(EXOTICS)
    for name, truth in UNLISTED_TRUTH.items():
        assert truth.place in PLACES
        assert set(truth.near) <= set(EFFECTS)
        if name in FOREIGN:
            assert (truth.place, set(FOREIGN[name].kin) - set(truth.near)) == (FOREIGN[name].place, set())


def test_what_is_hidden_can_be_seen():
    for fixed in truths().values():
        seen = fixed.truth.distance_drive_unknown
        assert np.isnan(seen) or seen >= LEAST_VISIBLE, fixed.case.world


def test_a_task_holds_no_truth():
    task = task_of("own/test/005")
    text = (
        repr(vars(task)) + repr(task.recording.metadata) + " ".join(task.recording.to_columns()) + task.twin.to_toml()
    )
    assert not [name for name in set(EFFECTS) - {"gravity"} if name in text]  # each twin has a gravity_m_s2
    assert task.twin.effects == ()


@pytest.mark.parametrize("name", ["table_tilt", "channel_skew", "resonance"])
def test_the_generators_agree_in_a_fresh_motion(name):
    """What an effect does in the independent generator is what the same parameters do in the twin."""
    found = [fixed for fixed in truths().values() if fixed.case.set_name == "independent"]
    for fixed in [one for one in found if one.case.effects == (name,)]:
        fresh = fresh_motion(fixed.case, fixed.truth, fixed.case.seed(fixed.attempt))
        twin = task_of(fixed.case.world).twin
        before, after = fresh.distance(twin), fresh.distance(twin, effects_of(fixed.truth))
        assert after < max(3.0, 0.05 * before), (fixed.case.world, before, after)


def test_ties_are_what_the_data_cannot_separate():
    """Gravity is an offset of the vertical channels of a level table; the tilt of the table is nothing else."""
    gravity = next(case for case in cases("own", "dev") if case.effects == ("gravity",))
    seen, ties = free_distance_and_ties(draw(gravity), gravity.tacho_noise, 0.0)
    assert seen > 10 * LEAST_SEPARABLE
    assert {"bias", "scale_factor"} <= set(ties["gravity"])
    assert all("table_tilt" not in fixed.truth.ties for fixed in truths().values())
    assert free_distance_and_ties(draw(gravity), gravity.tacho_noise, 1e9)[1] == {}
