"""Readers of foreign formats: each turns a file into tables of named columns."""

from gfimu.importing.readers.registry import READERS, read_foreign

__all__ = ["READERS", "read_foreign"]
