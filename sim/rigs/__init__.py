"""Rigs as MuJoCo models.

In: a world, a motor, an array as MJCF.
Out: specific force at the twelve sites in prescribed (`turntable`) or motor-driven motion (`driven`), MJCF files.
"""

from gfimu.base.optional_packages import require

require("a scenario or a MuJoCo model", "mujoco")  # every module of this package imports it
