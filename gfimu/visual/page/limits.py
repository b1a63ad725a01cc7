"""How much of a run a page's plots store and show."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["PlotLimits"]


@dataclass(frozen=True)
class PlotLimits:
    """Sizes of plots that keep a page below 3 MB and readable.

    Parameters
    ----------
    most_samples : int
        Samples of all channels together that are stored one by one: twelve minutes of twelve channels at 100 Hz,
        1.8 MB.
    most_groups : int
        Groups of a longer run, of all channels together, each stored as lowest, highest and mean value: 1.2 MB.
    fineness : float
        Steps that values are rounded to, per standard deviation of the noise: rounding adds 0.1 % to the noise.
    smooth_s : float
        Length of the moving mean that is drawn over the samples, s.
    shown_first : int
        Channels that are drawn when the page opens.
    compared, compared_s : int and float
        Channels that are drawn as measured and as predicted, and for how long about the largest error, s.
    coloured : int
        Channels that have a colour of their own; the others are grey.
    """

    most_samples: int = 900_000
    most_groups: int = 140_000
    fineness: float = 8.0
    smooth_s: float = 0.15
    shown_first: int = 3
    compared: int = 2
    compared_s: float = 4.0
    coloured: int = 4

    def group(self, samples: int) -> int:
        """Return how many samples one stored group holds, 1 if each is stored; ``samples`` of all channels together."""
        return 1 if samples <= self.most_samples else -(-samples // self.most_groups)
