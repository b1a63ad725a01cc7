"""Dependences: what an unknown function is of (motion, angle, time, temperature, a reading), with a prior."""
