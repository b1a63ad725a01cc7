"""The world: a turntable with a cube, its sensors, and everything that can go wrong in it."""
