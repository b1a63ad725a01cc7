"""The form of an error: bins of as many samples, the quantity that orders it, and nothing where nothing does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from made_runs import PERIOD, made_view

from gfimu.diagnosis.criticism.views.error_form import ErrorForm, error_form
from gfimu.diagnosis.criticism.views.run_view import RunView

T = PERIOD * np.arange(3000)
RATE = 5.0 + 2.0 * np.sin(0.6 * T)
CHANNELS = ("a11", "a12")


def seen(error) -> RunView:
    """A run with an error in its second channel, which the extended simulation has."""
    return made_view(RATE, np.column_stack([0.0 * T, error]))


def test_bins_hold_as_many_samples_each_and_their_means():
    values = np.random.default_rng(1).permutation(np.arange(600.0))
    form = ErrorForm.of(("a11", "the rate", "ω", "rad/s"), values, 0.01 * values, 0.02 * values)
    np.testing.assert_allclose(form.at, 9.5 + 20.0 * np.arange(30))
    np.testing.assert_allclose(form.mean, 0.01 * form.at)
    np.testing.assert_allclose(form.form, 0.02 * form.at)
    np.testing.assert_allclose(form.std, 0.01 * np.std(np.arange(20.0)) / np.sqrt(20.0))
    assert form.share > 0.99


def test_an_error_has_its_channel_its_quantity_and_its_form():
    form = error_form(seen(3e-3 * RATE**2), CHANNELS)
    assert (form.channel, form.quantity) == ("a12", "the rate")
    np.testing.assert_allclose(form.form, 3e-3 * form.at**2, atol=2e-3)


def test_an_error_that_goes_with_nothing_has_no_form():
    scattered = 0.1 * np.random.default_rng(2).standard_normal(len(T))
    assert error_form(seen(scattered), CHANNELS) is None


def test_nothing_that_was_taken_away_has_no_form():
    run = seen(0.0 * T)
    assert error_form(replace(run, after=run.before), CHANNELS) is None
