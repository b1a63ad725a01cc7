"""Firmware in the loop: the emulated board in a process of its own, its physics, its port, its runs."""
