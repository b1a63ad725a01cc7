"""Write the catalogue of effects: a page per effect in docs/effects, from the classes and from stored numbers.

    python docs/scripts/make_effect_catalogue.py              the pages, some seconds
    python docs/scripts/make_effect_catalogue.py --compute    first the numbers and figures, some minutes
    python docs/scripts/make_effect_catalogue.py --trials     first the verdicts that are not stored, an hour for all

The words of a page stand in the docstring of the effect's class (`sim.effects.description`), its figures in
``models/effects/catalogue.json``, which ``gfimu show EFFECT`` reads too. ``--effect NAME`` limits computing to one; so
a new effect is a class, its line in the registry, and one run of this script. ``--out FOLDER`` writes elsewhere: with
it the pages of effects that other packages add (`gfimu.effects`) are written, and none of gfimu's own.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from effect_index import index_page
from effect_numbers import rivalry
from effect_pages import page
from effect_signatures import draw, signature
from effect_trials import trial

from gfimu.model.effect_catalogue import EFFECT_CATALOGUE, effect_catalogue
from sim.effects import added_effects
from sim.effects.base import Effect
from sim.effects.catalogue import every_effect
from sim.effects.description import describe

ROOT = Path(__file__).resolve().parents[2]
PAGES = ROOT / "docs" / "effects"
NUMBERS = ROOT / "models" / EFFECT_CATALOGUE


def pages(numbers: Mapping[str, Any], effects: Mapping[str, type[Effect]]) -> dict[str, str]:
    """Return the text of each page by file name."""
    made = {f"{name}.md": page(effect, numbers[name]) for name, effect in effects.items()}
    return {"index.md": index_page(effects, numbers), **made}


def compute(effects: Mapping[str, type[Effect]], numbers: dict[str, Any], figures: Path) -> None:
    """Compute the numbers of effects into a mapping, and draw their figures."""
    figures.mkdir(parents=True, exist_ok=True)
    computed = rivalry(effects)
    for name, effect in effects.items():
        found = signature(name, describe(effect).example)
        draw(found, figures / f"{name}.png")
        kept = {key: value for key, value in numbers.get(name, {}).items() if key == "trial"}
        numbers[name] = {"signature": found.numbers(), **computed[name], **kept}


def write(numbers: Mapping[str, Any], effects: Mapping[str, type[Effect]], store: Path) -> None:
    """Store numbers in the order of the effects."""
    ordered = {name: numbers[name] for name in effects if name in numbers}
    store.parent.mkdir(parents=True, exist_ok=True)
    store.write_text(json.dumps(ordered, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")


def main(arguments: list[str] | None = None) -> None:
    """Write the pages."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--compute", action="store_true", help="compute numbers and draw figures first")
    parser.add_argument("--trials", action="store_true", help="diagnose the examples whose verdict is not stored")
    parser.add_argument("--effect", help="compute this one only")
    parser.add_argument("--out", type=Path, help="folder for the pages of effects that other packages add")
    given = parser.parse_args(arguments)
    own = given.out is None
    effects = every_effect() if own else added_effects()
    folder, store = (PAGES, NUMBERS) if own else (given.out, given.out / "catalogue.json")
    numbers = dict(effect_catalogue()) if own else json.loads(store.read_text("utf-8")) if store.exists() else {}
    chosen = {name: one for name, one in effects.items() if given.effect in (None, name)}
    if given.compute:
        compute(chosen, numbers, folder / "figures")
        write(numbers, effects, store)
    for name, effect in chosen.items() if given.trials else ():
        example = describe(effect).example
        if numbers[name].get("trial", {}).get("of") != example:
            numbers[name]["trial"] = trial(effect, example)
            write(numbers, effects, store)
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in pages(numbers, effects).items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
