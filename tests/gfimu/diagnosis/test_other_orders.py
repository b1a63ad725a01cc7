"""A ripple has to be better than orders that nothing on a shaft has: friction of a rocked table explains these too."""

from pathlib import Path

from gfimu.diagnosis import diagnose, pruning
from sim.study.cases import Case
from sim.study.outcome import draw_world

ROCKED = f"{Path(__file__).resolve().parents[2] / 'independent_profiles.py'}:hide_rocked"


def named():
    world = draw_world(Case("reduced", 1, ("misalignment",), 300.0, duration=12.0), ROCKED)
    return [cause.effect for cause in diagnose([world.recording], world.twin).causes]


def test_friction_where_a_table_turns_back_is_no_ripple():
    assert named() == ["misalignment"]


def test_without_other_orders_it_would_be_one(monkeypatch):
    monkeypatch.setattr(pruning, "is_ripple", lambda cause: False)
    assert named() == ["misalignment", "cogging"]
