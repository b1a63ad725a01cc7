"""Accelerometer chips.

In: specific force at the sensing axes.
Out: counts or m/s² as a chip of a data sheet reports them, and when it converts.
"""
