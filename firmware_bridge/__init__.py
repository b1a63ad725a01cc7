"""The wire: chips at register level, the LPC1768, serial frames, recording from a port."""
