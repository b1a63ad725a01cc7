"""What a calibration by spin takes for granted of the table and of the plateaus."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["SpinPolicy"]


@dataclass(frozen=True)
class SpinPolicy:
    """Priors of what the table adds (IEEE Std 836, clause 6), and what counts as a plateau.

    Parameters
    ----------
    radius_std_m : float
        Each coordinate of a chip against its drawing, m. The sensing element is up to 0.4 mm from the middle of its
        package (the MIMU4444 of docs/accuracy/calibration.md), and a board is soldered to some 0.2 mm.
    stretch_std_s2_rad2 : float
        Arm stretch s, s²/rad²: arms r (1 + s ω²). An aluminium arm of 0.3 m stretches by ρ ω² r²/3E = 1e-9 ω², and its
        joints by more; 1e-7 is one part in 10⁴ at 30 rad/s.
    dynamic_levelling_std_s2_rad : float
        Lean of the array against the axis with the load, rad per (rad/s)², per direction: 1e-8 is 9 µrad at 30 rad/s,
        what an imbalance of 0.01 kg m at 0.1 m above a bearing of 1e5 N m/rad makes.
    shift_std_m_s2_rad2 : float
        Shift of the array across the axis with the load, m per (rad/s)², per direction: that lean at 0.1 m.
    tacho_scale_std : float
        Scale error of the tachometer, a ratio; 1e-4 is that of a crystal.
    lean_std_rad : float
        Angle between the table's axis and the vertical, rad, per direction; 1° is a table that nobody levelled.
    axis_std_rad, offset_std_m : float
        Direction (rad) and place (m) of the axis in the array's frame about what the readings themselves show of them;
        wide, so that the data decide.
    frame_std_rad : float
        Frame of a calibration against the drawing, rad: cross-axis pick-up of 1 % makes it, and soldering.
    cubic_of_poses : float
        Share c (K1 g)² of the gain that poses take for gain where their model has no c: 2/3 to 1 by the poses.
    unknown_nonlinearity : float
        Deviation from a straight line at the largest input, a ratio, where no data sheet states one.
    slope_rad_s2, slope_share_s, slope_window_s : float
        Largest rate of change of a plateau over a window of that length, s: this much, rad/s², and this share of the
        rate per second (tables ripple once per turn; the mean of ω² holds that), beside four standard deviations of the
        tachometer's noise in it.
    spread, spread_rad_s : float
        Largest deviation of the smoothed rate from its mean over a plateau: this share of it and this much, rad/s.
    rest_rad_s : float
        Rate below which a plateau is a rest, rad/s.
    saturated_share, own_extreme_share : float
        Share of a plateau's samples at the channel's extreme from which it is saturated there, if the typical share at
        a plateau's own extreme is below the other: then noise spreads its readings over several counts.
    distinct : float
        Ratio from which two speeds are two.
    undetermined : float
        Share of its prior standard deviation above which a coefficient counts as not determined.
    """

    radius_std_m: float = 5e-4
    stretch_std_s2_rad2: float = 1e-7
    dynamic_levelling_std_s2_rad: float = 1e-8
    shift_std_m_s2_rad2: float = 1e-9
    tacho_scale_std: float = 1e-4
    lean_std_rad: float = 0.0175
    axis_std_rad: float = 0.1
    offset_std_m: float = 0.03
    frame_std_rad: float = 0.02
    cubic_of_poses: float = 0.8
    unknown_nonlinearity: float = 0.05
    slope_rad_s2: float = 0.1
    slope_share_s: float = 0.02
    slope_window_s: float = 0.5
    spread: float = 0.02
    spread_rad_s: float = 0.05
    rest_rad_s: float = 0.05
    saturated_share: float = 0.2
    own_extreme_share: float = 0.1
    distinct: float = 1.1
    undetermined: float = 0.9
