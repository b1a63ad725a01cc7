"""Rotation about one known axis from few accelerometers: rate, angle, and the bounds of both.

`estimation` has the estimate, `accuracy` its bounds; the package itself imports neither, as a bound needs no compiler.
"""
