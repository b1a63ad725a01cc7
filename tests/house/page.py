"""docs/development/rooms.md, made of the docstrings of the rooms and of their imports."""

from __future__ import annotations

from .house import MODULES, ROOMS, ROOT, arrows

PAGE = ROOT / "docs" / "development" / "rooms.md"

HEAD = """# Rooms of the code
`python -m tests.house write` makes this page from the docstrings of the rooms.

A world, a wire and a mind: `sim` is the world (rigs, chips and everything that can go wrong in them),
`firmware_bridge` is the wire (chips, processor, frames, ports), `gfimu` is the mind (geometry, estimation,
calibration, diagnosis), and `models` is what the world is made of, as data. A
[recording](../reference/recording-format.md#recording) is the one thing that passes between them.

Rooms are listed from the ground up. A room imports rooms above it in this list only, there are no circles between
files, and below the commands nothing of `gfimu` imports `sim`, `firmware_bridge`, MuJoCo or serial ports.
`tests/house` checks this. The rooms for noise, pictures and the design of arrays are not called `noise`, `show` and
`design`, because a package of that name would hide the public function `gfimu.noise`, `gfimu.show` or `gfimu.design`
once it is imported. What `gfimu` itself exports is the public interface.
"""


def page() -> str:
    """Return the page."""
    below = arrows()
    parts = [HEAD]
    for room in ROOMS[:-1]:
        used = [f"`{other.removeprefix('gfimu.')}`" for other in ROOMS if (room, other) in below]
        parts.append(f"## `{room}`\n{MODULES[room].docstring}\n\nImports {', '.join(used) or 'no other room'}.\n")
        inner = sorted(name for name, module in MODULES.items() if is_inner_room(name, room))
        if inner:
            summaries = (MODULES[name].docstring.partition("\n\n")[0].replace("\n", " ") for name in inner)
            rows = [f"| `{name}` | {summary} |" for name, summary in zip(inner, summaries, strict=True)]
            parts.append("\n".join(["| inside | |", "|---|---|", *rows]) + "\n")
    return "\n".join(parts)


def is_inner_room(name: str, room: str) -> bool:
    """Whether a module is a package directly inside a room."""
    return name.rpartition(".")[0] == room and MODULES[name].file.name == "__init__.py"
