"""The world: a turntable with a cube, its sensors, and everything that can go wrong in it.

A `scenarios.Scenario` is a `world` that moves (`motions`, `rigs`) and is measured (`chips`); `simulation` makes its
recording. A `twin` is what a diagnosis believes of it, `forward` the analytic prediction of both.
"""
