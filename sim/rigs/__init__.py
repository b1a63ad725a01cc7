"""Rigs as MuJoCo models: a world becomes a model, its motion is prescribed or motor-driven; arrays from and to MJCF.

`rig_model` builds the turntable and the free cube; `turntable` reads its sensors in a prescribed motion; `driven` turns
it by a motor, such as that of `dc_motor` (`motor_file`: its table in a scenario); `mjcf_array` and `mjcf_export` read
and write an array as MJCF.
"""

from gfimu.optional_packages import require

require("a scenario or a MuJoCo model", "mujoco")  # every module of this package imports it
