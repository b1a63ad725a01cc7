"""Worlds by the number: with a hidden effect, of another generator, measured without a twin, or inside tolerances."""
