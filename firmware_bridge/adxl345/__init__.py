"""The ADXL345 at register level: what a driver sees through SPI or I2C (data sheet Rev. E)."""
