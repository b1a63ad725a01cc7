"""A sender for boards of one's own: the firmware core over functions that a user fills in.

In: a target.
Out: a folder with sources to complete and build (docs/how_to/bench.md).
"""
