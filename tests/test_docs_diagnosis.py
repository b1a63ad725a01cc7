"""The page on diagnosis: its table of effects is the library's, every verdict is explained."""

import importlib.util
import re

from sim.effects import EFFECTS


def test_the_table_of_effects_is_the_librarys(project_root):
    specification = importlib.util.spec_from_file_location(
        "effects_page", project_root / "docs/scripts/make_effects_table.py"
    )
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    page = (project_root / "docs" / "how_to" / "diagnosis.md").read_text(encoding="utf-8")
    assert page == module.with_table(page), "run: python docs/scripts/make_effects_table.py"
    assert re.findall(r"^\| `(\w+)` \|", module.effects_table(), re.MULTILINE) == list(EFFECTS)


def test_every_verdict_is_explained_on_the_page(project_root):
    page = (project_root / "docs" / "how_to" / "diagnosis.md").read_text(encoding="utf-8")
    for verdict in ("nothing_found", "explained", "ambiguous", "unknown"):
        assert f"| `{verdict}` |" in page
