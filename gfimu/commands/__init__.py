"""The commands: a function under each, with its options, its result and its words on the shell.

In: paths or objects.
Out: the result object, files where an ``out`` is named. The one room of gfimu that knows the world and the wire.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.commands.shell.command_group import CommandGroup
    from gfimu.commands.shell.output import print_table
    from gfimu.commands.shell.printing import print_blocks
    from gfimu.commands.shell.program import main, program
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
