"""The ``[drive.motor]`` table of a scenario: the figures of its motor."""

from __future__ import annotations

from typing import Annotated, Literal

from gfimu.base.files.schema import NotNegative, Positive, Table, about
from sim.rigs.dc_motor import DcMotor

__all__ = ["MotorTable"]


class MotorTable(Table, frozen=True):
    """The motor of a drive in mode dcmotor: on the table's shaft, with cogging and LuGre friction."""

    control: Annotated[
        Literal["servo", "voltage"],
        about(
            "A controller of angle and rate that commands torque; or a voltage proportional to the rate, no feedback."
        ),
    ] = "servo"
    stiffness_Nm_rad: Annotated[NotNegative, about("Torque of the servo per error of the angle.", "N·m/rad")] = (
        DcMotor.stiffness
    )
    damping_Nms_rad: Annotated[NotNegative, about("Torque of the servo per error of the rate.", "N·m·s/rad")] = (
        DcMotor.damping
    )
    resistance_ohm: Annotated[Positive, about("Resistance of the winding.", "Ω")] = DcMotor.resistance
    inductance_H: Annotated[
        NotNegative, about("Inductance of the winding; 0: the current follows the voltage at once.", "H")
    ] = DcMotor.inductance
    constant_Nm_A: Annotated[Positive, about("Torque per current, and voltage per rate in V·s/rad.", "N·m/A")] = (
        DcMotor.constant
    )
    supply_V: Annotated[Positive, about("Largest voltage.", "V")] = DcMotor.supply
    torque_limit_Nm: Annotated[Positive, about("Largest torque of the motor.", "N·m")] = DcMotor.torque_limit
    rotor_inertia_kgm2: Annotated[NotNegative, about("Inertia of the rotor.", "kg·m²")] = DcMotor.rotor_inertia
    cogging_Nm: Annotated[NotNegative, about("Amplitude of the cogging torque.", "N·m")] = DcMotor.cogging
    cogging_periods: Annotated[
        int, about("Periods of cogging per turn: the least common multiple of slots and poles.", ge=1)
    ] = DcMotor.cogging_periods
    cogging_phase_rad: Annotated[float, about("Phase of the cogging at the angle zero.", "rad")] = DcMotor.cogging_phase
    coulomb_Nm: Annotated[Positive, about("Friction torque of sliding.", "N·m")] = DcMotor.coulomb
    static_Nm: Annotated[Positive, about("Friction torque of breaking away.", "N·m")] = DcMotor.static
    stribeck_rad_s: Annotated[Positive, about("Rate scale of the change from breaking away to sliding.", "rad/s")] = (
        DcMotor.stribeck_rate
    )
    bristle_stiffness_Nm_rad: Annotated[
        NotNegative, about("Stiffness of the friction before it slides; 0: no dry friction.", "N·m/rad")
    ] = DcMotor.bristle_stiffness
    bristle_damping_Nms_rad: Annotated[NotNegative, about("Damping of the friction before it slides.", "N·m·s/rad")] = (
        DcMotor.bristle_damping
    )
    viscous_Nms_rad: Annotated[NotNegative, about("Viscous friction.", "N·m·s/rad")] = DcMotor.viscous

    def motor(self) -> DcMotor:
        """Return the motor; raises `InputError` where breaking away is easier than sliding."""
        return DcMotor(
            resistance=self.resistance_ohm,
            inductance=self.inductance_H,
            constant=self.constant_Nm_A,
            cogging=self.cogging_Nm,
            cogging_periods=self.cogging_periods,
            cogging_phase=self.cogging_phase_rad,
            bristle_stiffness=self.bristle_stiffness_Nm_rad,
            bristle_damping=self.bristle_damping_Nms_rad,
            coulomb=self.coulomb_Nm,
            static=self.static_Nm,
            stribeck_rate=self.stribeck_rad_s,
            viscous=self.viscous_Nms_rad,
            rotor_inertia=self.rotor_inertia_kgm2,
            control=self.control,
            stiffness=self.stiffness_Nm_rad,
            damping=self.damping_Nms_rad,
            supply=self.supply_V,
            torque_limit=self.torque_limit_Nm,
        )
