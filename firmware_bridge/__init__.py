"""The wire: chips at register level, the LPC1768, frames, recording from a port.

In: bytes of a board, real or emulated.
Out: recordings; findings on firmware.
"""
