"""The ADXL345 at register level (data sheet Rev. E).

In: specific force, accesses over SPI or I2C.
Out: register contents, interrupts, FIFO as a driver sees them.
"""
