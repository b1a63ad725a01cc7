"""The catalogue of effects: every registered effect has a page with formula, picture and rivals, as the code has it."""

import importlib
import json
import re
import sys

import matplotlib.image
import numpy as np
import pytest
from every_item import every
from test_docs_words import VAGUE

from gfimu import InputError
from gfimu.diagnosis import Policy
from gfimu.diagnosis.design.proposal import SEPARATED
from gfimu.model.effect_catalogue import effect_catalogue
from sim.effects import (
    BODY_EFFECTS,
    CARRIAGE_EFFECTS,
    INCLINED_EFFECTS,
    SIMULATED_EFFECTS,
    TABLE_EFFECTS,
    Effect,
    Size,
    catalogue,
    describe,
)
from sim.effects.catalogue import essence, every_effect
from sim.scenarios import Scenario

MOST_BYTES, MOST_OF_ALL = 60_000, 3_000_000
EFFECTS = every_effect()


@pytest.fixture(scope="module")
def script(project_root):
    """Return a function that imports a script of the documentation."""
    folder = str(project_root / "docs" / "scripts")
    sys.path.insert(0, folder)
    yield importlib.import_module
    sys.path.remove(folder)


@pytest.fixture(scope="module")
def folder(project_root):
    return project_root / "docs" / "effects"


def test_every_registered_effect_is_in_the_catalogue():
    known = TABLE_EFFECTS | BODY_EFFECTS | CARRIAGE_EFFECTS | INCLINED_EFFECTS | SIMULATED_EFFECTS
    assert set(EFFECTS) == {*known, "unknown"}
    assert set(effect_catalogue()) == set(EFFECTS), "run: python docs/scripts/make_effect_catalogue.py --compute"


def test_the_pages_are_those_of_the_code(script, folder):
    pages = script("effect_pages")
    assert {pages.place_of(effect) for effect in EFFECTS.values()} == set(pages.PLACES)
    made = script("make_effect_catalogue").pages(effect_catalogue(), EFFECTS)
    stored = {file.name: file.read_text(encoding="utf-8") for file in folder.glob("*.md")}
    assert set(stored) == set(made)
    assert [name for name in made if stored[name] != made[name]] == [], (
        "run: python docs/scripts/make_effect_catalogue.py"
    )


@every("name", EFFECTS)
def test_a_page_has_its_parts(folder, name):
    page = (folder / f"{name}.md").read_text(encoding="utf-8")
    formula = page.partition("## Mathematics")[2].partition("##")[0]
    assert re.search(r"\$\$\n.+=.+\n\$\$", formula, re.DOTALL)
    assert f"](figures/{name}.png)" in page
    assert len(describe(EFFECTS[name]).experiment) > 30
    assert f"[{name}]({name}.md)" in (folder / "index.md").read_text(encoding="utf-8")
    for link in re.findall(r"\]\((\S+?\.md)\)", page):
        assert (folder / link).is_file(), link
    assert not VAGUE.search(re.sub(r"`[^`]*`", "", page))


@every("name", EFFECTS)
def test_an_effect_without_computed_rivals_says_how_it_is_found(folder, name):
    own = describe(EFFECTS[name]).rivals
    assert bool(own) == (not effect_catalogue()[name]["motions"])
    page = (folder / f"{name}.md").read_text(encoding="utf-8")
    rivals = page.partition("## Rivals")[2].partition("##")[0]
    assert own.replace("``", "`") in rivals
    if EFFECTS[name].place != "data":  # only a fault of the samples is found before a fit
        assert "before any fit" not in rivals


def test_the_pictures_are_small_and_have_ink(folder):
    pictures = sorted((folder / "figures").glob("*.png"))
    assert [one.stem for one in pictures] == sorted(EFFECTS)
    assert sum(one.stat().st_size for one in pictures) < MOST_OF_ALL
    for one in pictures:
        assert one.stat().st_size < MOST_BYTES
        picture = matplotlib.image.imread(one)
        ink = picture[..., 3] > 0.9
        assert 0.005 < ink.mean() < 0.4, one.name  # the rest is transparent: it is shown on white and on black
        brightness = picture[..., :3][ink] @ [0.2126, 0.7152, 0.0722]
        assert np.quantile(brightness, 0.9) < 0.75
        assert np.quantile(brightness, 0.1) > 0.25


@every("name", EFFECTS)
def test_the_command_of_a_page_hides_the_effect(script, name):
    trials = script("effect_trials")
    changes = trials.changes_of(EFFECTS[name], describe(EFFECTS[name]).example)
    scenario = Scenario.load(trials.run_of(name), changes=changes)
    (hidden,) = scenario.effects
    assert (hidden.name, hidden.parameters) == (name, describe(EFFECTS[name]).example)


@pytest.mark.parametrize("name", EFFECTS)
def test_the_signature_is_the_one_that_is_stored(script, name):
    found = script("effect_signatures").signature(name, describe(EFFECTS[name]).example).numbers()
    stored = effect_catalogue()[name]["signature"]
    assert {key: found[key] for key in ("scenario", "drawn", "unit", "against")} == {
        key: stored[key] for key in ("scenario", "drawn", "unit", "against")
    }
    assert found["rms"] == pytest.approx(stored["rms"], rel=0.02, abs=1e-6)
    assert found["share"] == pytest.approx(stored["share"], abs=0.02)
    assert (found["line_hz"] is None) == (stored["line_hz"] is None)


def test_the_rivals_in_a_constant_spin_are_those_that_are_stored(script):
    rivals = script("effect_rivals")
    table = rivals.table_of(rivals.TABLE.twin, rivals.TABLE.motions["constant spin"])
    assert len(table.names) > 28
    for name in table.names:
        found, stored = table.of(name), effect_catalogue()[name]["motions"]["constant spin"]
        assert found["detectability"] == pytest.approx(stored["detectability"], rel=0.01, abs=0.01)
        for rival, share, _ in stored["rivals"]:
            assert found["rivals"][rival][0] == pytest.approx(share, abs=0.003), (name, rival)


@pytest.mark.study
def test_the_rivals_are_those_that_are_stored(script):
    found = script("effect_numbers").rivalry(EFFECTS)
    for name, stored in effect_catalogue().items():
        assert set(found[name]["motions"]) == set(stored["motions"]), name
        for motion, one in stored["motions"].items():
            again = found[name]["motions"][motion]
            assert again["detectability"] == pytest.approx(one["detectability"], rel=0.05, abs=0.1), (name, motion)
            near = {rival for rival, _, nats in one["rivals"] if nats < 0.5 * SEPARATED}
            assert near <= {rival for rival, _, nats in again["rivals"] if nats < SEPARATED} | set(
                again.get("more", [])
            )
        for rig, one in stored["experiments"].items():
            assert found[name]["experiments"][rig]["separates"] == one["separates"], (name, rig)


def test_the_thresholds_are_those_of_the_diagnosis():
    assert catalogue._SEPARATED == SEPARATED
    assert pytest.approx(Policy().seen, abs=0.05) == catalogue._SEEN


def test_the_essence_of_an_effect_names_formula_rivals_and_experiment():
    text = essence(EFFECTS["centrifugal_flex"])
    for part in ("y = f + s·a·", "stretch_s2_rad2", "speed sweep: not separable from", "on its side", "sensing axis"):
        assert part in text


class BeltSlip(Effect):
    """The belt that drives the table slips.

    The tachometer on the motor reads more than the table turns.

    Notes
    -----
    :formula: Ω′ = (1 + s)·Ω
    :symbols: s = ratio
    :size: 1 %, by choice.
    :example: ratio = 0.02
    :experiment: Put a mark on the belt and count turns of motor and table.
    """

    name = "belt_slip"
    summary = "the belt slips, so that the motor turns faster than the table"
    place = "reference"

    @classmethod
    def sizes(cls, array):
        return (Size("ratio", "1", 0.01),)

    def apply(self, world):
        factor = 1.0 + self.value("ratio")
        return world.changed(reference_steps=(*world.reference_steps, lambda read, spin, t: read * factor))


def test_an_effect_of_another_package_has_a_page_too(script, tmp_path, monkeypatch):
    made = script("make_effect_catalogue")
    for module in ("gfimu.base.plugins", "sim.effects.registry"):
        monkeypatch.setattr(sys.modules[module], "plugins", lambda group, kind, own=(): {"belt_slip": BeltSlip})
    monkeypatch.setattr(made, "added_effects", lambda: {"belt_slip": BeltSlip})
    computed = {"belt_slip": {"motions": {}, "experiments": {}}}
    monkeypatch.setattr(made, "rivalry", lambda effects: computed)
    made.main(["--compute", "--out", str(tmp_path)])
    page = (tmp_path / "belt_slip.md").read_text(encoding="utf-8")
    assert "count turns of motor and table" in page
    assert json.loads((tmp_path / "catalogue.json").read_text())["belt_slip"]["signature"]["drawn"] == ["reference"]
    assert (tmp_path / "figures" / "belt_slip.png").stat().st_size > 2000


def test_a_docstring_without_a_field_is_refused():
    class Bare(BeltSlip):
        """Bare.

        It says nothing.

        Notes
        -----
        :formula: y = f
        """

    with pytest.raises(InputError, match="docstring of Bare: lacks the field :symbols:"):
        describe(Bare)
    assert essence(Bare) == "belt_slip: the belt slips, so that the motor turns faster than the table\n"
