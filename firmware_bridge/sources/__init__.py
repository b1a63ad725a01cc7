"""Boards of others that send no frames over a serial port: Klipper's API server, phyphox over HTTP, UDP datagrams."""
