"""The world: a turntable with a cube, its sensors, and everything that can go wrong in it.

In: a scenario, ``models/``.
Out: recordings with their truth (`simulation`); a `twin`, what a diagnosis believes of the world, predicted by
`forward` in closed form.
"""
