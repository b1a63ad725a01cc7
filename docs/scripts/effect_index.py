"""The first page of the catalogue of effects: the table of all, what the pages' figures mean, how to add one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from effect_formulas import to_latex, vectors_of
from effect_pages import PLACES, link, place_of

from gfimu.diagnosis.design.proposal import SEPARATED
from gfimu.diagnosis.policy import Policy
from sim.effects.base import Effect
from sim.effects.description import Description, describe

__all__ = ["index_page"]

_LONGEST = 28  # characters of a formula in the table
_ANY = Policy().seen


def index_page(effects: Mapping[str, type[Effect]], numbers: Mapping[str, Any]) -> str:
    """Return the table of all effects, by place in the chain."""
    parts = [
        "# Catalogue of effects",
        _INTRODUCTION,
    ]
    for place, words in PLACES.items():
        mine = [effect for effect in effects.values() if place_of(effect) == place]
        if not mine:
            continue
        rows = ["| effect | what the rig has and the simulation lacks | formula | not separable in a sweep from |"]
        rows.append("|---|---|---|---|")
        for effect in mine:
            sweep = numbers[effect.name]["motions"].get("speed sweep", {"rivals": []})
            rivals = [rival for rival, _, nats in sweep["rivals"] if nats < SEPARATED]
            formula = _inline(describe(effect))
            summary = effect.summary.replace("|", "\\|")
            rows.append(f"| {link(effect.name)} | {summary} | {formula} | {', '.join(map(link, rivals))} |")
        parts += [f"## {place.capitalize()}: {words}", "\n".join(rows)]
    names = "\n".join(effects)
    parts += ["## Your own effects", _OWN, f"```{{toctree}}\n:hidden:\n:maxdepth: 1\n\n{names}\n```"]
    return "\n\n".join(parts) + "\n"


_INTRODUCTION = f"""\
One page per effect that a simulated rig can have and a diagnosis can name: what it is, its formula, what it changes
in a run, which effects it is confounded with in which motion, and the experiment that separates them.
`gfimu list effects` lists them; `gfimu show table_tilt` prints the summary of a page.

The effects follow the chain of a measurement: geometry and gravity → motion → sensing → sampling → data. An ideal
sensor with the axis $\\boldsymbol{{a}}$, at the place $\\boldsymbol{{r}}$ from the table's axis $\\boldsymbol{{z}}$,
reads the specific force there along its axis:

$$
f = \\boldsymbol{{a}} \\cdot \\boldsymbol{{F}}, \\qquad
\\boldsymbol{{F}} = g\\,\\boldsymbol{{u}} + \\alpha\\,\\boldsymbol{{z}} \\times \\boldsymbol{{r}}
+ \\omega^2\\,\\boldsymbol{{z}} \\times (\\boldsymbol{{z}} \\times \\boldsymbol{{r}})
$$

| symbol | meaning | unit |
|---|---|---|
| $f$, $y$ | reading of a channel before and after the effect; an index is a channel | m/s² |
| $\\theta$, $\\omega$, $\\alpha$ | angle, rate and angular acceleration of the table | rad, rad/s, rad/s² |
| $\\Omega$, $\\Omega'$ | reading of the reference before and after the effect; of a free body the gyro's | rad/s |
| $\\boldsymbol{{u}}$, $g$ | up, in the table's frame; local gravity | 1, m/s² |
| $R_z(\\theta)$ | rotation by the angle $\\theta$ about $\\boldsymbol{{z}}$ | |
| $\\boldsymbol{{\\rho}}$ | place of a chip from the cube's centre | m |
| $t$, $T$ | time since the run began, temperature of the board | s, °C |

All vectors are in the table's frame, which turns with the array. Each formula is evaluated by a test and compared
with the forward model.

**Figures on the pages.** *d′* is an effect of its usual size, in standard deviations of the data of a motion. All
other unknowns (the drive, that is the motion of the table, and slow noise) are free. Below {_ANY:.2g} an effect may be
missed. *Share* is the part of an effect's energy, in units of the noise, that a rival effect can explain at most: the
squared correlation of the two changes of the data, after the other unknowns are fitted. *Nats* is
the expected difference of the log likelihoods of the effect and the rival; below {SEPARATED:g} the two are not
separable. The figures are computed as `gfimu check` and `gfimu design` do, for `cube12` with ADXL345 chips at 100 Hz.

Motions: *constant spin*, 30 s at 4 rad/s; *speed sweep*, the scenario `speed_sweep`; *tilted rest*, 60 s at rest,
tilted by 30°; *calibration poses*, 18 rests of 6 s with faces and edges up; *tumble* and *in the hand*, the scenarios
`tumble` and `hand` as a free body with a gyro; *strokes*, the scenario `linear_axis`."""

_OWN = """\
The pages are made from the code: the text from the docstring of the effect's class (fields under *Notes*, see
`sim/effects/description.py`), the figures from computations of the package. A new effect is a class, its line in
`sim/effects/registry.py`, and
```
python docs/scripts/make_effect_catalogue.py --compute --effect my_effect
```
A test fails as long as a registered effect has no page, picture or formula. For effects that an installed package adds
(entry point `gfimu.effects`), `--out FOLDER` writes their pages into a folder of that package; `gfimu show` prints the
docstring. Their rivals are computed among gfimu's own effects too. The
verdict `unknown` has the page of that name."""


def _inline(text: Description) -> str:
    """Return the last equation, or for a long one the first, for a cell of the table."""
    short = min(text.formula, key=len) if len(text.formula[-1]) > _LONGEST else text.formula[-1]
    if len(short) > _LONGEST or (short != text.formula[-1] and short.partition(" = ")[0] not in ("y", "n")):
        return ""
    return f"${to_latex(short, vectors_of(text.formula, text.symbols))}$".replace("left|", "left\\vert ").replace(
        "right|", "right\\vert "
    )
