"""Accelerometer chips: the sensing chain from specific force to counts, data sheets, conversion times."""
