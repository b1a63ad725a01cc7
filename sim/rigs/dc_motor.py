"""The motor of a driven table by MuJoCo's ``dcmotor``: winding, back EMF, cogging and LuGre friction.

Equations: "MuJoCo DC Motor Model" (mujoco.readthedocs.io, _static/dcmotor.pdf). The motor sits on the table's shaft,
without a gear.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import mujoco

from gfimu.base.errors import InputError
from sim.rigs.rig_model import SPIN_JOINT

__all__ = ["MOTOR_FILE", "DcMotor"]

MOTOR_FILE = "motor_turntable"
"""Its model in ``models/mjcf``, with the figures of `DcMotor`'s defaults."""

_ACTUATOR = "motor"


@dataclass(frozen=True)
class DcMotor:
    """A brushless or brushed motor and its controller.

    The defaults are chosen, not those of one motor: the size of a flat brushless motor of 90 mm for 24 V and 90 W.

    Parameters
    ----------
    resistance : float
        Of the winding, Ω.
    inductance : float
        Of the winding, H; 0: the current follows the voltage at once.
    constant : float
        Torque per current, N·m/A, and voltage per rate, V·s/rad.
    cogging : float
        Amplitude of the cogging torque, N·m.
    cogging_periods : int
        Its periods per turn: the least common multiple of slots and poles.
    cogging_phase : float
        Its phase at the angle zero, rad.
    bristle_stiffness : float
        LuGre friction: stiffness σ₀ before it slides, N·m/rad; 0: no dry friction.
    bristle_damping : float
        Damping σ₁ before it slides, N·m·s/rad.
    coulomb, static : float
        Torque of sliding and of breaking away, N·m.
    stribeck_rate : float
        Rate at which the one becomes the other, rad/s.
    viscous : float
        Viscous friction, N·m·s/rad.
    rotor_inertia : float
        Inertia of the rotor, kg·m².
    control : {"servo", "voltage"}
        ``servo``: a controller of angle and rate that commands torque. ``voltage``: no feedback, the winding gets
        the voltage at which the ideal motor turns at the commanded rate.
    stiffness, damping : float
        Of the servo: torque per error of the angle, N·m/rad, and of the rate, N·m·s/rad.
    supply : float
        Largest voltage, V.
    torque_limit : float
        Largest torque of the current, N·m.

    Raises
    ------
    InputError
        If a figure is not possible; MuJoCo says which.
    """

    resistance: float = 0.35
    inductance: float = 2.6e-4
    constant: float = 0.07
    cogging: float = 0.005
    cogging_periods: int = 24
    cogging_phase: float = 0.0
    bristle_stiffness: float = 100.0
    bristle_damping: float = 0.002
    coulomb: float = 0.02
    static: float = 0.03
    stribeck_rate: float = 0.05
    viscous: float = 0.002
    rotor_inertia: float = 3e-4
    control: Literal["servo", "voltage"] = "servo"
    stiffness: float = 8.0
    damping: float = 1.0
    supply: float = 24.0
    torque_limit: float = 2.0

    def __post_init__(self) -> None:
        if self.static < self.coulomb:
            raise InputError(
                f"motor: static friction {self.static:g} N·m is below the sliding one of {self.coulomb:g} N·m; "
                "give static_Nm at least coulomb_Nm"
            )

    def fit(self, spec: mujoco.MjSpec) -> None:
        """Give a spec of `MOTOR_FILE` these figures."""
        joint, actuator = spec.joint(SPIN_JOINT), spec.actuator(_ACTUATOR)
        joint.armature, joint.damping[0] = self.rotor_inertia, self.viscous
        servo = self.control == "servo"
        actuator.set_to_dcmotor(
            motorconst=[self.constant, self.constant],
            resistance=self.resistance,
            saturation=[self.torque_limit, 0.0, 0.0],
            inductance=[self.inductance, 0.0],
            cogging=[self.cogging, self.cogging_periods, self.cogging_phase],
            controller=[self.stiffness, 0.0, self.damping, 0.0, 0.0, self.supply] if servo else [0.0] * 6,
            lugre=[self.bristle_stiffness, self.bristle_damping, self.coulomb, self.static, self.stribeck_rate],
            ctrlspec=int(mujoco.mjtCtrlInput.mjINPUT_POS | mujoco.mjtCtrlInput.mjINPUT_VEL)
            if servo
            else int(mujoco.mjtCtrlInput.mjINPUT_VOLTAGE),
        )
