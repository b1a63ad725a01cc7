"""Write the table of effects into docs/diagnosis.md from the library itself.

Run ``python docs/make_effects_table.py``.
"""

from __future__ import annotations

import re
from pathlib import Path

from gfimu import AccelerometerArray
from sim.effects import EFFECTS

PAGE = Path(__file__).parent / "diagnosis.md"
START, STOP = "<!-- effects: made by make_effects_table.py -->", "<!-- effects: end -->"
MOST_KEYS = 4


def effects_table() -> str:
    """Return the table: name, what is wrong, parameters, what separates it from its rivals."""
    array = AccelerometerArray.load("cube12")
    rows = [
        "| name | what is so in the world and missing in the simulation | parameters | what separates it from rivals |"
    ]
    rows.append("|---|---|---|---|")
    for name, effect in EFFECTS.items():
        keys = effect.parameter_keys(array)
        shown = ", ".join(f"`{key}`" for key in keys[:MOST_KEYS]) + (" …" if len(keys) > MOST_KEYS else "")
        rows.append(f"| `{name}` | {effect.summary} | {shown} | {effect.separated_by} |")
    return "\n".join(rows)


def with_table(page: str) -> str:
    """Return the text of the page with the present table between its marks."""
    pattern = re.compile(re.escape(START) + ".*?" + re.escape(STOP), flags=re.DOTALL)
    return pattern.sub(lambda _: f"{START}\n{effects_table()}\n{STOP}", page)


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
