"""What `gfimu start` returns: what was read and written, and the commands to go on with."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, Line, figure
from gfimu.base.results import TableResult, text_column

__all__ = ["Started"]


@dataclass(frozen=True)
class Started(Declared, TableResult):
    """A recording of one's own with its array and twin, and what to do next."""

    folder: Annotated[str, figure("Folder that was written.")]
    rig: Annotated[str, figure("What moved.")]
    written: Annotated[tuple[str, ...], figure("Files in it.")]
    reasons: Annotated[tuple[str, ...], figure("What the files were taken for, and why.")]
    next_commands: Annotated[tuple[str, ...], figure("Commands to go on with.", key="next")]

    def to_columns(self) -> dict[str, NDArray[np.object_]]:
        """Return the commands to go on with, one row each."""
        return {"next_command": text_column(self.next_commands)}

    def _notes(self) -> tuple[str, ...]:
        return self.reasons

    def shown(self) -> Iterator[Line]:
        """Yield what was read, what was written, and what to do next."""
        yield from (Line(f"- {line}") for line in self.reasons)
        yield Line(f"wrote {', '.join(self.written)} in {self.folder}")
        yield Line("Next:", style="bold")
        yield from (Line(f"  {line}") for line in self.next_commands)
