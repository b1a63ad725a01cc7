"""Foreign files: readers of their formats, maps of their columns, and what an unknown file seems to hold.

A reader turns a file into tables of named columns. A map says which column is the time, a sensing axis or a reference,
and in which unit. `inspect_file` looks at a file of unknown layout and suggests a map to start from;
`gfimu.recording.mapped` makes a recording of a file and its map.
"""

from gfimu.recording.importing.column_map import ColumnMap, list_maps, load_map
from gfimu.recording.importing.inspection import Inspection, inspect_file

__all__ = ["ColumnMap", "Inspection", "inspect_file", "list_maps", "load_map"]
