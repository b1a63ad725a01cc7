"""The world model: by what interface a diagnosis uses a simulation.

In: drive and parameters of effects.
Out: predicted readings and their derivatives; the protocols that `sim.twin.Twin` implements, and a simulation of one's
own (`own_rig`).
"""
