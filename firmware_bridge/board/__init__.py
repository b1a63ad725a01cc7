"""The emulated LPC1768 board; needs the extra ``firmware``.

In: an image, the readings of its chips.
Out: bytes on its line, pins, faults, a trace.
"""
