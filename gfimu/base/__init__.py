"""The ground: what every room uses and that knows no physics.

In: files, tables and settings as people write them.
Out: typed one-line errors, units, checked files, results that describe themselves, optional packages, entry points.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.base.declared import Table
    from gfimu.base.errors import nearest_name
    from gfimu.base.files.memory import MemoryLimit, MemoryLimitError, with_memory
    from gfimu.base.files.model_files import find_model, list_models
    from gfimu.base.files.rerun_stream import markdown
    from gfimu.base.lazy_names import homes_of
    from gfimu.base.results.colours import chip_colour, css
    from gfimu.base.units import STANDARD_GRAVITY
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
