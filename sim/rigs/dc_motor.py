"""The motor of a driven table by MuJoCo's ``dcmotor``: winding, back EMF, cogging and LuGre friction.

Equations: "MuJoCo DC Motor Model" (mujoco.readthedocs.io, _static/dcmotor.pdf). The motor sits on the table's shaft,
without a gear.
"""

from __future__ import annotations

from typing import Annotated, Literal

import mujoco

from gfimu.base.files.schema import NotNegative, Positive, Table, about
from sim.rigs.rig_model import SPIN_JOINT

__all__ = ["MOTOR_FILE", "MotorTable"]

MOTOR_FILE = "motor_turntable"
"""Its model in ``models/mjcf``, with the figures of `MotorTable`'s defaults."""

_ACTUATOR = "motor"


class MotorTable(Table, frozen=True):
    """The motor of a drive in mode dcmotor: on the table's shaft, with cogging and LuGre friction."""

    # The defaults are chosen, not those of one motor: the size of a flat brushless motor of 90 mm for 24 V and 90 W.

    control: Annotated[
        Literal["servo", "voltage"],
        about(
            "A controller of angle and rate that commands torque; or a voltage proportional to the rate, no feedback."
        ),
    ] = "servo"
    stiffness_Nm_rad: Annotated[NotNegative, about("Torque of the servo per error of the angle.", "N·m/rad")] = 8.0
    damping_Nms_rad: Annotated[NotNegative, about("Torque of the servo per error of the rate.", "N·m·s/rad")] = 1.0
    resistance_ohm: Annotated[Positive, about("Resistance of the winding.", "Ω")] = 0.35
    inductance_H: Annotated[
        NotNegative, about("Inductance of the winding; 0: the current follows the voltage at once.", "H")
    ] = 2.6e-4
    constant_Nm_A: Annotated[Positive, about("Torque per current, and voltage per rate in V·s/rad.", "N·m/A")] = 0.07
    supply_V: Annotated[Positive, about("Largest voltage.", "V")] = 24.0
    torque_limit_Nm: Annotated[Positive, about("Largest torque of the motor.", "N·m")] = 2.0
    rotor_inertia_kgm2: Annotated[NotNegative, about("Inertia of the rotor.", "kg·m²")] = 3e-4
    cogging_Nm: Annotated[NotNegative, about("Amplitude of the cogging torque.", "N·m")] = 0.005
    cogging_periods: Annotated[
        int, about("Periods of cogging per turn: the least common multiple of slots and poles.", ge=1)
    ] = 24
    cogging_phase_rad: Annotated[float, about("Phase of the cogging at the angle zero.", "rad")] = 0.0
    coulomb_Nm: Annotated[Positive, about("Friction torque of sliding.", "N·m")] = 0.02
    static_Nm: Annotated[Positive, about("Friction torque of breaking away.", "N·m")] = 0.03
    stribeck_rad_s: Annotated[Positive, about("Rate scale of the change from breaking away to sliding.", "rad/s")] = (
        0.05
    )
    bristle_stiffness_Nm_rad: Annotated[
        NotNegative, about("Stiffness of the friction before it slides; 0: no dry friction.", "N·m/rad")
    ] = 100.0
    bristle_damping_Nms_rad: Annotated[NotNegative, about("Damping of the friction before it slides.", "N·m·s/rad")] = (
        0.002
    )
    viscous_Nms_rad: Annotated[NotNegative, about("Viscous friction.", "N·m·s/rad")] = 0.002

    def fit(self, spec: mujoco.MjSpec) -> None:
        """Give a spec of `MOTOR_FILE` these figures."""
        joint, actuator = spec.joint(SPIN_JOINT), spec.actuator(_ACTUATOR)
        joint.armature, joint.damping[0] = self.rotor_inertia_kgm2, self.viscous_Nms_rad
        servo = self.control == "servo"
        actuator.set_to_dcmotor(
            motorconst=[self.constant_Nm_A, self.constant_Nm_A],
            resistance=self.resistance_ohm,
            saturation=[self.torque_limit_Nm, 0.0, 0.0],
            inductance=[self.inductance_H, 0.0],
            cogging=[self.cogging_Nm, self.cogging_periods, self.cogging_phase_rad],
            controller=[self.stiffness_Nm_rad, 0.0, self.damping_Nms_rad, 0.0, 0.0, self.supply_V]
            if servo
            else [0.0] * 6,
            lugre=[
                self.bristle_stiffness_Nm_rad,
                self.bristle_damping_Nms_rad,
                self.coulomb_Nm,
                self.static_Nm,
                self.stribeck_rad_s,
            ],
            ctrlspec=int(mujoco.mjtCtrlInput.mjINPUT_POS | mujoco.mjtCtrlInput.mjINPUT_VEL)
            if servo
            else int(mujoco.mjtCtrlInput.mjINPUT_VOLTAGE),
        )
