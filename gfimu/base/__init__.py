"""The ground: what every room uses and that knows no physics.

In: files, tables and settings as people write them.
Out: typed one-line errors, units, checked files, results that describe themselves, optional packages, entry points.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.base.declared import Table as Table
    from gfimu.base.errors import nearest_name as nearest_name
    from gfimu.base.files.column_file import write_columns as write_columns
    from gfimu.base.files.memory import MemoryLimit as MemoryLimit
    from gfimu.base.files.memory import MemoryLimitError as MemoryLimitError
    from gfimu.base.files.memory import with_memory as with_memory
    from gfimu.base.files.model_files import find_model as find_model
    from gfimu.base.files.model_files import list_models as list_models
    from gfimu.base.files.model_files import read_toml as read_toml
    from gfimu.base.files.outputs import OutputFile as OutputFile
    from gfimu.base.files.outputs import OutputFolder as OutputFolder
    from gfimu.base.files.rerun_stream import markdown as markdown
    from gfimu.base.results.colours import PAGE as PAGE
    from gfimu.base.results.colours import chip_colour as chip_colour
    from gfimu.base.units import STANDARD_GRAVITY as STANDARD_GRAVITY
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
