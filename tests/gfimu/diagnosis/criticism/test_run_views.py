"""Views of runs: the given twin before, the causes that were found after, over the samples of the recording."""

from __future__ import annotations

import numpy as np
from made_fits import cause, fitted, recorded, twin

from gfimu.diagnosis import prepare, run_views
from sim.effects import make_effect


def test_a_view_has_the_given_twin_before_and_the_causes_after():
    run = recorded(2, effects=[make_effect("table_tilt", {"x_rad": 0.004, "y_rad": -0.002})])
    stretches, fit = fitted(run, causes=[cause("table_tilt")])
    (view,) = run_views(prepare([run], twin(), ["tilted"]), stretches, fit)
    white = twin().expected_noise(run.sample_rate).white
    before, after = (np.where(view.valid, view.measured - one, 0.0) / white for one in (view.before, view.after))
    assert view.name == "tilted"
    np.testing.assert_allclose(view.t, run.t_s, atol=1e-9)
    # Gravity of 9.8 m/s² tilted by 4.5 mrad: an amplitude of 0.044 m/s² in the channels across the axis.
    removed = np.mean(before**2 - after**2, axis=0) * white**2
    across = np.abs(twin().array.axes[:, 2]) < 0.5
    np.testing.assert_allclose(removed[across], 0.5 * 0.0439**2, rtol=0.3)
    assert np.mean(after[:, across] ** 2) < 1.5
    np.testing.assert_allclose(view.rate, run.reference["tacho_rad_s"], atol=0.15)
