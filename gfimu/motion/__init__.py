"""Motion of the body: what a recording says of rate, attitude, velocity and position.

In: a recording, with a calibration if there is one.
Out: `Estimate` with its covariances, attitude, navigation, an impact and its criteria (`impact`).
"""
