"""The ``[motion]`` table of a scenario: one struct per kind, which builds the motion that its keys describe.

A new kind is a struct here with its ``kind`` as tag, added to `MotionTable`; reader, messages, reference page and
editor completion follow.
"""

from __future__ import annotations

from typing import Annotated, Literal

from gfimu.base.files.schema import NotNegative, Positive, Table, Triple, about
from sim.motions.carried import Carriage, HandTable, Wheel
from sim.motions.motion import BodyMotion, SpinMotion
from sim.motions.pose_sequence import PoseSequence
from sim.motions.profiles import Chirp, Hold, Ramp, Segment, Sine, Tumble, spin_profile

__all__ = ["MotionTable", "ProfileTable"]

_Duration = Annotated[Positive, about("Length.", "s", example=1.0)]
_Amplitude = Annotated[float, about("Amplitude of the rate.", "rad/s", example=1.0)]
_Speed = Annotated[float, about("Amplitude of the speed.", "m/s", example=0.1)]
_StartAngle = Annotated[float, about("Table angle at time zero.", "rad")]


class HoldTable(Table, frozen=True, tag_field="kind", tag="hold"):
    """Keep the rate; a rest is a hold at rate zero."""

    duration_s: _Duration

    def segment(self) -> Segment:
        """Return the piece of a profile."""
        return Hold(self.duration_s)


class RampTable(Table, frozen=True, tag_field="kind", tag="ramp"):
    """Change the rate along a quintic without angular acceleration at its ends."""

    to_rad_s: Annotated[float, about("Rate at the end.", "rad/s", example=2.0)]
    duration_s: _Duration

    def segment(self) -> Segment:
        """Return the piece of a profile."""
        return Ramp(self.to_rad_s, self.duration_s)


class SineTable(Table, frozen=True, tag_field="kind", tag="sine"):
    """Swing the rate about the one held, under a smooth window."""

    amplitude_rad_s: _Amplitude
    frequency_hz: Annotated[Positive, about("Frequency.", "Hz", example=1.0)]
    duration_s: _Duration

    def segment(self) -> Segment:
        """Return the piece of a profile."""
        return Sine(self.amplitude_rad_s, self.frequency_hz, self.duration_s)


class ChirpTable(Table, frozen=True, tag_field="kind", tag="chirp"):
    """Swing the rate about the one held, the frequency moving exponentially."""

    amplitude_rad_s: _Amplitude
    start_hz: Annotated[Positive, about("First frequency.", "Hz", example=0.5)]
    stop_hz: Annotated[Positive, about("Last frequency.", "Hz", example=5.0)]
    duration_s: _Duration

    def segment(self) -> Segment:
        """Return the piece of a profile."""
        return Chirp(self.amplitude_rad_s, self.start_hz, self.stop_hz, self.duration_s)


SegmentTable = HoldTable | RampTable | SineTable | ChirpTable
"""One entry of ``[[motion.segment]]``."""


class ProfileTable(Table, frozen=True, tag_field="kind", tag="profile"):
    """The table turns by a profile of its rate, put together from segments."""

    segment: Annotated[
        tuple[SegmentTable, ...], about("Pieces in a row; each begins at the rate at which the one before ends.")
    ] = ()
    start_rate_rad_s: Annotated[float, about("Rate before the first piece.", "rad/s")] = 0.0
    start_angle_rad: _StartAngle = 0.0

    def motion(self) -> SpinMotion:
        """Return the spin of the table; raises `InputError` if there is no segment."""
        pieces = [table.segment() for table in self.segment]
        return spin_profile(pieces, start_rate=self.start_rate_rad_s, start_angle=self.start_angle_rad)

    @property
    def length(self) -> float:
        """Length of all segments, s."""
        return sum(table.duration_s for table in self.segment)


class RestTable(Table, frozen=True, tag_field="kind", tag="rest"):
    """The table stands still."""

    start_angle_rad: _StartAngle = 0.0

    def motion(self) -> SpinMotion:
        """Return a spin at rate zero."""
        return spin_profile([Hold(1.0)], start_angle=self.start_angle_rad)

    @property
    def length(self) -> float:
        """Zero: the motion has no length of its own."""
        return 0.0


class TumbleTable(Table, frozen=True, tag_field="kind", tag="tumble"):
    """A free body tumbles without torque, started smoothly from rest."""

    rate_rad_s: Annotated[Positive, about("Magnitude of the angular rate at full speed, at its start.", "rad/s")] = (
        Tumble.rate
    )
    inclination_rad: Annotated[
        Positive,
        about("Angle between the rate and the axis of the largest inertia at the start.", "rad"),
    ] = Tumble.inclination
    rest_s: Annotated[NotNegative, about("Time at rest before the start.", "s")] = Tumble.rest
    spin_up_s: Annotated[Positive, about("Time from rest to full speed.", "s")] = Tumble.spin_up
    inertia: Annotated[Triple, about("Ratio of the moments of inertia about body x, y, z, ascending.")] = Tumble.inertia
    sway_m: Annotated[Triple, about("Amplitude of the body origin's oscillation along world x, y, z.", "m")] = (
        Tumble.sway
    )
    sway_hz: Annotated[Triple, about("Frequencies of that oscillation.", "Hz")] = Tumble.sway_frequency

    def motion(self) -> BodyMotion:
        """Return the motion of the body."""
        return Tumble(
            rate=self.rate_rad_s,
            inclination=self.inclination_rad,
            rest=self.rest_s,
            spin_up=self.spin_up_s,
            inertia=self.inertia,
            sway=self.sway_m,
            sway_frequency=self.sway_hz,
        )

    @property
    def length(self) -> float:
        """Zero: the motion has no length of its own."""
        return 0.0


class PosesTable(Table, frozen=True, tag_field="kind", tag="poses"):
    """A free body rests with each of a set of directions up in turn, as in a calibration by hand."""

    poses: Annotated[
        Literal["faces", "faces_edges", "faces_edges_corners"],
        about("Directions: the 6 faces of a cube, with its 12 edges, with its 8 corners."),
    ] = "faces_edges"
    rest_s: Annotated[Positive, about("Time at rest in each pose.", "s")] = PoseSequence.rest
    turn_s: Annotated[Positive, about("Time of a turn to the next pose.", "s")] = PoseSequence.turn

    def motion(self) -> PoseSequence:
        """Return the motion of the body."""
        return PoseSequence(self.poses, self.rest_s, self.turn_s)

    @property
    def length(self) -> float:
        """Time until the last rest is over, s."""
        return self.motion().duration


class WheelTable(Table, frozen=True, tag_field="kind", tag="wheel"):
    """A wheel rolls along the world's x axis over rough ground; its axle is level and its hub moves freely."""

    segment: Annotated[
        tuple[SegmentTable, ...], about("Pieces of the rate about the axle; positive rates roll forwards.")
    ] = ()
    radius_m: Annotated[NotNegative, about("Rolling radius; 0: a wheel on a stand.", "m")] = Wheel.radius
    axis: Annotated[Triple, about("Direction of the axle in the body.")] = Wheel.axis
    shake_m_s2: Annotated[
        NotNegative, about("Rms acceleration of the hub up and down, and along x besides rolling.", "m/s²")
    ] = Wheel.shake
    shake_hz: Annotated[Positive, about("Highest frequency of it, approximately.", "Hz")] = Wheel.shake_frequency
    seed: Annotated[int, about("Seed of the ground.")] = Wheel.seed
    start_rate_rad_s: Annotated[float, about("Rate before the first piece.", "rad/s")] = 0.0
    start_angle_rad: _StartAngle = 0.0

    def motion(self) -> BodyMotion:
        """Return the motion of the body; raises `InputError` if there is no segment."""
        pieces = [table.segment() for table in self.segment]
        spin = spin_profile(pieces, start_rate=self.start_rate_rad_s, start_angle=self.start_angle_rad)
        return Wheel(spin, self.radius_m, self.axis, self.shake_m_s2, self.shake_hz, self.seed)

    @property
    def length(self) -> float:
        """Length of all segments, s."""
        return sum(table.duration_s for table in self.segment)


class CarriageRampTable(Table, frozen=True, tag_field="kind", tag="ramp"):
    """Change the speed along a quintic without acceleration at its ends."""

    to_m_s: Annotated[float, about("Speed at the end.", "m/s", example=0.2)]
    duration_s: _Duration

    def segment(self) -> Segment:
        """Return the piece of a profile."""
        return Ramp(self.to_m_s, self.duration_s)


class CarriageSineTable(Table, frozen=True, tag_field="kind", tag="sine"):
    """Swing the speed about the one held, under a smooth window."""

    amplitude_m_s: _Speed
    frequency_hz: Annotated[Positive, about("Frequency.", "Hz", example=1.0)]
    duration_s: _Duration

    def segment(self) -> Segment:
        """Return the piece of a profile."""
        return Sine(self.amplitude_m_s, self.frequency_hz, self.duration_s)


class CarriageChirpTable(Table, frozen=True, tag_field="kind", tag="chirp"):
    """Swing the speed about the one held, the frequency moving exponentially."""

    amplitude_m_s: _Speed
    start_hz: Annotated[Positive, about("First frequency.", "Hz", example=1.0)]
    stop_hz: Annotated[Positive, about("Last frequency.", "Hz", example=12.0)]
    duration_s: _Duration

    def segment(self) -> Segment:
        """Return the piece of a profile."""
        return Chirp(self.amplitude_m_s, self.start_hz, self.stop_hz, self.duration_s)


class CarriageTable(Table, frozen=True, tag_field="kind", tag="carriage"):
    """A carriage moves along a linear axis by a profile of its speed: a printer's toolhead or bed."""

    segment: Annotated[
        tuple[HoldTable | CarriageRampTable | CarriageSineTable | CarriageChirpTable, ...],
        about("Pieces in a row; each begins at the speed at which the one before ends."),
    ] = ()
    axis: Annotated[Triple, about("Direction of positive places in the world.")] = Carriage.axis
    start_m: Annotated[float, about("Place at time zero.", "m")] = 0.0

    def motion(self) -> SpinMotion:
        """Return the course of the carriage; raises `InputError` if there is no segment."""
        return Carriage(spin_profile([table.segment() for table in self.segment], start_angle=self.start_m), self.axis)

    @property
    def length(self) -> float:
        """Length of all segments, s."""
        return sum(table.duration_s for table in self.segment)


MotionTable = ProfileTable | RestTable | TumbleTable | PosesTable | WheelTable | CarriageTable | HandTable
"""The ``[motion]`` table of a scenario, by its ``kind``."""
