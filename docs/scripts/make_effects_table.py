"""Write the table of effects into docs/how_to/diagnosis.md from the library itself.

Run ``python docs/scripts/make_effects_table.py``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from gfimu import AccelerometerArray
from sim.effects import CARRIAGE_EFFECTS, EFFECTS, FURTHER_EFFECTS, Effect

PAGE = Path(__file__).resolve().parents[1] / "how_to" / "diagnosis.md"
START, STOP = "<!-- effects: made by make_effects_table.py -->", "<!-- effects: end -->"
CARRIAGE = ("<!-- linear axis: made by make_effects_table.py -->", "<!-- linear axis: end -->")
FURTHER = ("<!-- further effects: made by make_effects_table.py -->", "<!-- further effects: end -->")
MOST_KEYS = 4


def effects_table(effects: Mapping[str, type[Effect]] = EFFECTS) -> str:
    """Return the table: name, what is wrong, parameters, what separates it from its rivals."""
    rows = [
        "| name | what is so in the world and missing in the simulation | parameters | what separates it from rivals |"
    ]
    rows.append("|---|---|---|---|")
    for name, effect in effects.items():
        rows.append(f"| `{name}` | {effect.summary} | {_keys(effect)} | {effect.separated_by} |")
    return "\n".join(rows)


def _keys(effect: type[Effect]) -> str:
    keys = effect.parameter_keys(AccelerometerArray.load("cube12"))
    return ", ".join(f"`{key}`" for key in keys[:MOST_KEYS]) + (" …" if len(keys) > MOST_KEYS else "")


def with_table(page: str) -> str:
    """Return the text of the page with the present tables between their marks."""
    linear = {name: effect for name, effect in CARRIAGE_EFFECTS.items() if EFFECTS.get(name) is not effect}
    parts = (
        ((START, STOP), effects_table()),
        (CARRIAGE, effects_table(linear)),
        (FURTHER, effects_table(FURTHER_EFFECTS)),
    )
    for (start, stop), table in parts:
        pattern = re.compile(re.escape(start) + ".*?" + re.escape(stop), flags=re.DOTALL)
        page = pattern.sub(f"{start}\n{table}\n{stop}".replace("\\", "\\\\"), page)
    return page


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
