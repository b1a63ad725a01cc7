"""Generators of worlds that share no code with the project: own table, own effects, own sensors.

Nothing here imports `gfimu` or the rest of `sim`; a test checks that. The physics is written as plain formulas on
arrays, without type annotations; `sim.trials.benchmark.drawing` is the typed way in.
"""
