"""Worlds by the number: with a hidden effect, measured without a twin, or with errors inside tolerances."""
