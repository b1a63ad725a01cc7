"""A sender for boards of one's own: the firmware core over functions that a user fills in (docs/how_to/bench.md)."""
