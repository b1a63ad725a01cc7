"""Boards of others that send no frames over a serial port.

In: Klipper's API server, phyphox over HTTP, UDP datagrams.
Out: samples as `source.Source` gives them.
"""
