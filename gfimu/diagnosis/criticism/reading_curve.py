"""Whether a cubic of a channel's reading explains more than the named effects on that channel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gfimu.diagnosis.criticism.generic import basis_units
from gfimu.diagnosis.criticism.series_tests import LackOfFit
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import Fit, fit
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.cause import Cause
from gfimu.model.generic_basis import OF_READING

__all__ = ["reading_curve"]


def reading_curve(stretches: Sequence[Stretch], found: Fit, policy: Policy = Policy()) -> LackOfFit:
    """Compare a cubic of one channel's reading with the effects of a fit that distort this channel.

    A cubic is close to a polynomial of the reading, as an offset, a gain and a square are together. Where the cubic
    alone is more probable, these are a compromise.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    found : Fit
        Causes and drives.
    policy : Policy
        Thresholds of fits, and ``extra_cause``.
    """
    array, best = stretches[0].model.array, LackOfFit(-np.inf, "", {})
    for index, channel in enumerate(array.channels):
        mine = [cause for cause in found.causes if _distorts(cause, array.n_channels, index)]
        if all(cause.place != f"channel {channel}" for cause in mine):
            continue
        family = stretches[0].model.unnamed(OF_READING, basis_units(stretches, found.point))
        cubic = Cause(family, OF_READING, np.eye(array.n_channels)[:, [index]], {}, np.zeros(1))
        others = tuple(cause for cause in found.causes if all(cause is not one for one in mine))
        instead = fit(stretches, replace(found.point, causes=(*others, cubic)), policy)
        priors = [cause.log_prior for cause in mine]
        odds = instead.log_evidence + max(priors) - found.log_evidence - sum(priors)
        odds -= policy.extra_cause * (len(mine) - 1)
        if odds > best.log_odds:
            text = f"channel {channel} follows a curve of its reading that the library has not (cubic)"
            size = float(instead.causes[-1].sizes(array, 0)[index])
            best = LackOfFit(odds, text, {f"{channel}: {OF_READING}": size}, instead=True, hints=(OF_READING,))
    return best


def _distorts(cause: Cause, channels: int, number: int) -> bool:
    """Whether a cause changes a channel by a law of its sensing: one size per channel and no shape."""
    per_channel = cause.family.place == "sensing" and len(cause.mixing) == channels and not cause.shape
    of_temperature = getattr(cause.family, "needs_temperature", False)
    return per_channel and not of_temperature and bool(np.abs(cause.mixing[number]).any())
