"""A sender for boards of one's own: the firmware's core on a few functions that a user fills in (docs/bench.md)."""
