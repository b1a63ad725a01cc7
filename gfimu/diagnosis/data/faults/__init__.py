"""Faults that are seen in the samples of a table's run: rails and clipping, exchanged channels, other ranges."""
