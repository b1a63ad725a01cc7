"""Crash and head-impact tests: channel frequency classes, time zero, polarity, and the figures they ask for."""
