"""Runs and views made by hand: what is in them is known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gfimu.diagnosis import Run, RunView

PERIOD = 0.01  # s
SIGMA = 0.05  # m/s², white noise


def made_view(rate, residual, *, sigma: float = SIGMA, after=None) -> RunView:
    """Return a view whose residual before is (n, c) on top of noise; after it is ``after``, nothing by default."""
    n, c = residual.shape
    t = PERIOD * np.arange(n)
    rng = np.random.default_rng(4)
    noise = sigma * rng.standard_normal((n, c))
    believed = 0.3 * np.sin(0.7 * t)[:, None] * np.ones(c)
    truth = believed + residual
    return RunView(
        name="made",
        t=t,
        measured=truth + noise,
        valid=np.ones((n, c), dtype=bool),
        before=believed,
        after=truth if after is None else truth - after,
        reference=rate,
        reference_before=rate,
        reference_after=rate,
        angle=np.cumsum(rate) * PERIOD,
        rate=rate,
        acceleration=np.gradient(rate, PERIOD),
        temperature=None,
        white=np.full(c, sigma),
    )


def made_run(readings, *, reference=None) -> Run:
    """Return a run with these readings (n, c), all valid."""
    n = len(readings)
    return Run(
        t=PERIOD * np.arange(n),
        readings=readings,
        valid=np.ones(readings.shape, dtype=bool),
        reference=np.zeros(n) if reference is None else reference,
        reference_valid=np.ones(n, dtype=bool),
        temperature=None,
        mounting=np.zeros(3),
        lost=0,
        longest_gap=0.0,
    )


def without(run: Run, rows, channel: int) -> Run:
    """Return the run with some readings of a channel invalid."""
    valid = run.valid.copy()
    valid[rows, channel] = False
    return replace(run, valid=valid)
