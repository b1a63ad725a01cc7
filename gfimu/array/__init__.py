"""Arrays: where the chips sit and what their readings say of the motion.

In: array and part files, positions and sensing axes.
Out: `AccelerometerArray`, the regression matrix J and its condition, the closed-form solutions, quadrature, gravity, a
known axis of rotation.
"""
