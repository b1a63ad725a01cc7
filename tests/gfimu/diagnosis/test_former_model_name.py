"""A simulation of another program that implements the former `gfimu.diagnosis.model` still is a world model."""

import gfimu.diagnosis.model as former
from gfimu import world_model


def test_every_name_is_the_object_of_the_world_model():
    assert {name for name in former.__all__ if getattr(former, name) is not getattr(world_model, name)} == set()
    assert {"WorldModel", "Effect", "EffectFamily", "Spin", "Size"} <= set(former.__all__)
