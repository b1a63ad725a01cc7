"""Firmware in the loop: the emulated board in a process of its own.

In: an image, a motion.
Out: a virtual port, a recorded run, the outcome of a campaign of faults.
"""
