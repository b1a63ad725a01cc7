"""An effect that is taken out of the library turns its own row red and no other.

Four effects by lot in each run, every effect in the study. The lot is the text ``GFIMU_LOT``: the date unless set.
Pytest prints it at the end.
"""

import os
import random

import pytest
from hidden_check import diagnosed, problems
from hidden_table import MECHANICAL, ONCE, row_of

from sim.effects import EFFECTS

LOT = random.Random(os.environ["GFIMU_LOT"])
DRAWN = frozenset(LOT.sample(list(EFFECTS), 4))
BY_LOT = [pytest.param(name, marks=() if name in DRAWN else pytest.mark.study) for name in EFFECTS]


@pytest.mark.parametrize("effect", BY_LOT)
def test_an_effect_out_of_the_library_turns_its_own_row_red_and_another_stays_green(effect):
    own = row_of(effect)
    assert problems(own, diagnosed(own, without={effect})), f"the row of {effect} does not notice that it is missing"
    others = [row for row in (*ONCE, *MECHANICAL) if effect not in row.names]
    other = random.Random(f"{os.environ['GFIMU_LOT']} {effect}").choice(others)
    assert not problems(other, diagnosed(other, without={effect})), f"{other} needs {effect}"
