"""Print a shipped file, a file of your own (checked), the array of a recording, or an effect.

A file of one's own is checked by its schema first; exit code 2 if it is wrong.

Examples
--------
gfimu show adxl355
# The array file that a recording carries
gfimu show run.parquet
# Check a twin of your own
gfimu show my_twin.toml
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from gfimu.base.declared import Declared, FileText, figure
from gfimu.base.errors import InputError, unknown_name
from gfimu.base.files.model_files import find_model, list_models, read_toml
from gfimu.commands import given
from gfimu.commands.list import catalogue
from gfimu.commands.shell import completion
from gfimu.commands.shell.declare import Option, command

if TYPE_CHECKING:
    from gfimu.base.files.memory import MemorySize

__all__ = ["show"]

_FILES = ("arrays", "parts", "maps", "twins", "scenarios", "frames")
_NAME = Option(
    "Name of an array, part, map, twin, scenario or effect; a file; or a recording.", "NAME", argument=True,
    offers=completion.shown,
)  # fmt: skip


@dataclass(frozen=True)
class Shown(Declared):
    """The text of a file."""

    name: Annotated[str, figure("Name or path that was asked for.")]
    text: Annotated[str, figure("The file (TOML), or one line on an effect.")]

    def shown(self) -> Iterator[FileText]:
        """Yield the text."""
        yield FileText(self.text)


@command(report=lambda text, values: Shown(values["name"], text), results=lambda: (Shown,))
def show(name: Annotated[str, _NAME], *, max_memory: given.Memory = None) -> str:
    """Return the text of a shipped file, of a file of your own, of the array in a recording, or of an effect.

    A file of one's own is checked; of a recording the array file is returned.

    Raises
    ------
    InputError
        If nothing has that name, the file is wrong, or the recording carries no array.

    Examples
    --------
    >>> import gfimu
    >>> print(gfimu.show("rest").splitlines()[0])
    # The unit at rest: noise, biases, drift. Turned on its side with: --set 'mounting_rotvec_rad=[1.5708, 0, 0]'.
    """
    if Path(name).suffix in {".toml", ".csv", ".parquet"}:
        return _shown_file(name, max_memory)
    for kind in _FILES:
        if name in list_models(kind):
            return find_model(kind, name).read_text(encoding="utf-8")
    if name in catalogue("effects"):
        from sim.effects import added_effects
        from sim.effects.catalogue import essence, every_effect

        return essence((every_effect() | added_effects())[name])  # formula, parameters, rivals, experiment
    files = (known for kind in _FILES for known in list_models(kind))
    raise unknown_name("name", name, [*files, *catalogue("effects")])


def _shown_file(name: str, max_memory: "MemorySize | None") -> str:
    """Return the text of a file after a check by its schema, or the array file that a recording carries."""
    from gfimu.base.files.memory import with_memory
    from gfimu.commands.file_kinds import check_file
    from gfimu.recording import Recording

    if not Path(name).is_file():
        raise InputError(f"{name}: no such file; give its path, or a name of gfimu list arrays")
    if not name.endswith(".toml"):
        return Recording.read(with_memory(name, max_memory)).own_array().to_toml()
    check_file(read_toml(Path(name)), name)
    return Path(name).read_text(encoding="utf-8")
