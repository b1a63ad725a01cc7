"""Compiled loops, apart from the functions that call them: importing these must not wait for numba."""
