"""Readers of foreign formats: each turns a file into tables of named columns."""

from gfimu.recording.importing.readers.registry import READERS, Reader, read_foreign, readers

__all__ = ["READERS", "Reader", "read_foreign", "readers"]
