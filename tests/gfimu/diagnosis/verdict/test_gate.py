"""The gate: what it withdraws, by which figure, and which sizes it takes for impossible."""

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, NamedCause
from gfimu.diagnosis import Policy
from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.verdict.gate import impossible_sizes, judge, measurable
from gfimu.diagnosis.verdict.parts import Residual, Unexplained
from gfimu.diagnosis.verdict.wording import verdict_sentences
from sim.effects import EFFECTS
from sim.twin import Twin

CAUSES = (NamedCause("tacho_scale", {"ratio": 0.02}, {"ratio": 1e-3}, 0.997),)
FITS = Residual(0.11, 0.034, 0.0335, {}, {})
GOOD = Gain("blocks", 0.11, 0.034, 0.98, 1.2, 0.1, share_std=0.01)


@pytest.fixture(scope="module")
def twin():
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


@pytest.mark.parametrize(
    ("gain", "residual", "figure"),
    [
        (replace(GOOD, share_of_excess_removed=0.12), FITS, "12 % of the excess removed"),
        (
            replace(GOOD, share_of_excess_removed=-9.4, rms_after=0.328, log_likelihood_per_sample=-30.0),
            FITS,
            "the error there rises from 0.11 to 0.328 m/s²",
        ),
        (
            replace(GOOD, share_of_excess_removed=np.nan, log_likelihood_per_sample=-0.3),
            FITS,
            "log-likelihood per sample -0.3 ± 0.1",
        ),
        (replace(GOOD, share_std=np.nan, share_of_excess_removed=0.4), FITS, "40 % of the excess removed"),
        (replace(GOOD, share_of_excess_removed=-0.01, rms_after=0.11), FITS, ": 0 % of the excess removed"),
        (GOOD, replace(FITS, rms_after=0.135), "the prediction error rises from 0.11 to 0.135 m/s²"),
    ],
)
def test_causes_are_withdrawn_by_the_figure_that_speaks_against_them(gain, residual, figure):
    found = judge(gain, residual, CAUSES)
    assert found.withdrawn
    assert found.why.startswith("the causes found (tacho_scale) ")
    assert found.why.endswith(figure)


@pytest.mark.parametrize(
    ("gain", "residual"),
    [
        (GOOD, FITS),
        (replace(GOOD, share_of_excess_removed=0.6), FITS),
        # Within its error.
        (replace(GOOD, share_of_excess_removed=0.4, share_std=0.1), FITS),
        (replace(GOOD, share_of_excess_removed=np.nan, log_likelihood_per_sample=-0.1), FITS),
        # Nothing was measured.
        (Gain(), FITS),
        # Down to the noise before and after: nothing that an error could tell.
        (GOOD, Residual(0.0336, 0.0341, 0.0335, {}, {})),
    ],
)
def test_causes_stand_where_no_figure_speaks_against_them(gain, residual):
    assert not judge(gain, residual, CAUSES).withdrawn


@pytest.mark.parametrize(
    ("after", "significant", "withdrawn"),
    [(0.06, True, False), (0.09, True, True), (0.09, False, False), (0.036, True, False)],
)
def test_causes_beside_something_as_large_are_withdrawn(after, significant, withdrawn):
    """Half of the squared error beyond noise, 0.11² − 0.0335², is left at 0.0813 m/s²."""
    left = Unexplained(significant, "a line at 3 Hz")
    found = judge(GOOD, replace(FITS, rms_after=after), CAUSES, Policy(), left)
    assert found.withdrawn is withdrawn
    assert found.why == (
        "the causes found (tacho_scale) leave 64 % of the error beyond noise: a line at 3 Hz" if withdrawn else ""
    )


def test_a_gain_within_the_noise_is_no_figure():
    faint = Gain("blocks", 0.0342, 0.0342, log_likelihood_per_sample=-6e-4, log_likelihood_std=3e-3)
    assert not judge(faint, FITS, CAUSES).withdrawn
    assert np.isnan(measurable(faint).log_likelihood_per_sample)
    assert measurable(faint).held_out == "blocks"
    assert measurable(GOOD) is GOOD
    told = verdict_sentences("explained", CAUSES, FITS, measurable(faint), Unexplained(), ())
    assert any("the gain is within the noise" in sentence for sentence in told)


def test_nothing_is_withdrawn_where_nothing_was_found():
    assert not judge(replace(GOOD, share_of_excess_removed=0.1), FITS, ()).withdrawn


@pytest.mark.parametrize(
    ("effect", "key", "possible", "impossible"),
    [
        ("scale_factor", "a12", 0.2, -0.47),
        ("misalignment", "a1_x_rad", 0.2, 0.44),
        ("sensor_position", "a3_y_m", 0.05, 0.15),
        ("cross_axis", "a11_from_a12", 0.1, 0.5),
        ("mount_tilt", "x_rad", 0.1, -0.5),
        ("bias", "a22_m_s2", 2.0, 12.0),
    ],
)
def test_a_size_beyond_physics_says_what_does_not_fit(twin, effect, key, possible, impossible):
    small, large = (NamedCause(effect, {key: size}, {key: 0.01}, 0.997) for size in (possible, impossible))
    assert impossible_sizes([small], twin.families(), twin.array) == ""
    told = impossible_sizes([small, large], twin.families(), twin.array)
    assert told.startswith(f"the array file, axes or units do not fit these data: {effect} {key} = {impossible:.3g}, ")


def test_a_chip_may_be_moved_by_no_more_than_its_own_array(twin):
    small = AccelerometerArray.load("mimu4444")
    moved = NamedCause("sensor_position", {f"{small.chips[0].name}_x_m": 0.031}, {}, 0.997)
    assert "beyond ±0.0268" in impossible_sizes([moved], twin.families(), small)


def test_wiring_has_no_bound(twin):
    wiring = [
        NamedCause("axis_swap", {"channels": ["a11", "a12"]}, {}, 0.997),
        NamedCause("wrong_range", {"chip": "a1", "factor": 4.0}, {}, 0.997),
    ]
    assert impossible_sizes(wiring, twin.families(), twin.array) == ""


def test_every_bound_is_far_beyond_what_is_usual(twin):
    for family in EFFECTS.values():
        for size in family.sizes(twin.array):
            assert size.bound > 10 * size.prior_std


def test_the_thresholds_are_those_of_the_policy():
    half = replace(GOOD, share_of_excess_removed=0.6)
    assert not judge(half, FITS, CAUSES).withdrawn
    assert judge(half, FITS, CAUSES, replace(Policy(), least_share=0.7)).withdrawn
    rising = replace(FITS, rms_after=0.12)
    assert judge(GOOD, rising, CAUSES).withdrawn
    assert not judge(GOOD, rising, CAUSES, replace(Policy(), noise_accuracy=0.2)).withdrawn
