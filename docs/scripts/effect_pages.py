"""The pages of the catalogue of effects: text in MyST Markdown from an effect's class and its stored numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from effect_formulas import BY_CHANCE, TOLERANCE, to_latex, vectors_of
from effect_trials import simulate_command, twin_of

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.design.proposal import SEPARATED
from gfimu.diagnosis.policy import Policy
from gfimu.model.parameter_units import NAME, NUMBER, RATIO
from sim.effects import BODY_EFFECTS, CARRIAGE_EFFECTS, TABLE_EFFECTS
from sim.effects.base import Effect
from sim.effects.catalogue import every_effect
from sim.effects.description import Description, describe

__all__ = ["EXPERIMENTS", "PLACES", "link", "page", "place_of"]

PLACES = {
    "geometry": "where chips, axes and the table are",
    "motion": "how the table and the array move",
    "gravity": "what gravity adds along each axis",
    "sensing": "from the specific force to the analogue reading, in each chip",
    "sampling": "when chips and the reference are read, and what the reference reads",
    "data": "noise, and the samples in the file",
}
"""Places in the chain, in its order, and what is there."""

EXPERIMENTS = {
    "sweep": "speed sweep",
    "sweep + side": "sweep upright and on its side",
    "sweep + poses": "sweep and 18 poses at rest",
    "sweep + heated rest": "sweep and a rest warmed by 10 K",
    "all": "all of these",
    "tumble": "tumble",
    "hand": "in the hand",
    "tumble + hand": "tumble and in the hand",
    "strokes": "strokes",
    "strokes + side": "strokes upright and on its side",
}
"""Words for the experiments of `effect_rivals`."""

_OF_GRAVITY = frozenset({"gravity", "table_tilt"})
_PLACE = {"timing": "sampling", "reference": "sampling", "noise": "data"}
_MOVING = frozenset({"bearing_shake", "bench_sway", "centrifugal_flex"})
_UNITS = {RATIO: "1", NUMBER: "number", NAME: "name"}
SLOWEST_LINE = 0.3  # Hz: what is slower is the course of the run
LEAST, MOST = 0.1, 1000  # nats: what is less, or more, is printed so
_ANY = Policy().seen


def place_of(effect: type[Effect]) -> str:
    """Return where an effect acts: a key of `PLACES`."""
    if effect.name in _OF_GRAVITY:
        return "gravity"
    moves = effect.name in _MOVING
    return "motion" if moves else _PLACE.get(effect.place, effect.place)


def page(effect: type[Effect], numbers: Mapping[str, Any]) -> str:
    """Return the page of an effect."""
    text = describe(effect)
    parts = [
        f"# {effect.name}",
        f"**{_sentence(_plain(text.title))}** {_plain(text.what)}",
        _where(effect),
        "## Parameters",
        _parameters(effect, text),
        "## Mathematics",
        _mathematics(effect, text),
        "## Signature",
        _signature(effect, text, numbers["signature"]),
        "## Rivals",
        _rivals(effect, text, numbers),
        "## How to separate it",
        _separation(text, numbers),
        "## In real data",
        text.recordings or "No recording with it is at hand.",
        "## Hide it, and find it",
        _trial(effect, text, numbers.get("trial")),
    ]
    rail = CARRIAGE_EFFECTS.get(effect.name)
    if rail is not None and rail is not effect:
        parts += ["## On a linear axis", _on_rail(rail)]
    return "\n\n".join(parts) + "\n"


def _where(effect: type[Effect]) -> str:
    place = place_of(effect)
    kinds = [
        words
        for words, library in (
            ("a table that turns", TABLE_EFFECTS),
            ("a free body", BODY_EFFECTS),
            ("a linear axis", CARRIAGE_EFFECTS),
        )
        if library.get(effect.name) is not None
    ]
    looked = f"A diagnosis looks for it on {_and(kinds)}" if kinds else "A diagnosis does not look for it"
    if effect.name == "angle_zero":
        looked = "A diagnosis looks for it on an inclined table with an encoder"
    if effect.name == "unknown":
        looked = "A diagnosis does not look for it: what has no name it describes by its place"
    per_run = " Each mounting has its own." if effect.per_run else ""
    return f"Place in the chain: **{place}** ({PLACES[place]}). {looked}.{per_run}"


def _parameters(effect: type[Effect], text: Description) -> str:
    array = AccelerometerArray.load("one_adxl345" if effect.name == "mount_turn" else "cube12")
    rows = ["| parameter | symbol | unit | usual size (1 σ of the prior) | limit |", "|---|---|---|---|---|"]
    sizes = {size.key: size for size in effect.sizes(array)}
    vectors = vectors_of(text.formula, text.symbols)
    seen: dict[tuple[str, ...], list[str]] = {}
    for key, unit in effect.parameter_units(array).items():
        size = sizes.get(key)
        usual = "" if size is None else f"{size.prior_std:.3g}" + (", positive" if size.positive else "")
        limit = "" if size is None or size.bound == float("inf") else f"{size.bound:.3g}"
        low_high = effect.shape_limits.get(key)
        limit = f"{low_high[0]:g} to {low_high[1]:g}" if low_high else limit
        seen.setdefault((_UNITS.get(unit, unit), usual, limit), []).append(key)
    for (unit, usual, limit), keys in seen.items():
        many = f" … ({len(keys)})" if len(keys) > 3 else ""
        shown = ", ".join(f"`{key}`" for key in keys[:3]) + many
        symbols = ", ".join(f"${_symbol(one, vectors)}$" for one, key in text.symbols.items() if _names(key, keys))
        rows.append(f"| {shown} | {symbols} | {unit} | {usual} | {limit} |")
    parts = "amplitude" in " ".join(effect.parameter_units(array)) and bool(sizes)
    usual = ", ".join(f"`{key}` {size.prior_std:.3g} {size.unit}" for key, size in sizes.items()) if parts else ""
    fitted = f"\n\nFitted as its parts with the priors {usual}." if usual else ""
    return "\n".join(rows) + fitted + f"\n\n**Where the figure comes from.** {text.size}"


def _names(pattern: str, keys: list[str]) -> bool:
    """Whether a pattern of keys, such as ``{channel}_m_s2``, stands for one of some keys."""
    plain = pattern.removeprefix("2π·")
    if "{" not in plain:
        return any(key in plain.split(", ") or key == plain for key in keys) or (plain == "channels" and plain in keys)
    if "{neighbour}" in plain:
        return "_from_" in keys[0]
    first, _, last = plain.partition("{")
    return any(key.startswith(first) and key.endswith(last.rpartition("}")[2]) for key in keys)


def _symbol(symbols: str, vectors: frozenset[str]) -> str:
    """Return one or several symbols, parted by commas, as LaTeX."""
    return ", ".join(to_latex(f"{one} = 0", vectors).partition(" = ")[0] for one in symbols.split(", "))


def _mathematics(effect: type[Effect], text: Description) -> str:
    vectors = vectors_of(text.formula, text.symbols)
    lines = [to_latex(one, vectors).replace(" = ", " &= ", 1) for one in text.formula]
    body = " \\\\\n".join(lines)
    symbols = "; ".join(f"${_symbol(one, vectors)}$ = {_keyed(key)}" for one, key in text.symbols.items())
    return f"$$\n\\begin{{aligned}}\n{body}\n\\end{{aligned}}\n$$\n\nwith {symbols}. {_tested(effect.name)}"


def _keyed(key: str) -> str:
    return f"2π `{key[3:]}`" if key.startswith("2π·") else f"`{key}`"


def _tested(name: str) -> str:
    if name in BY_CHANCE:
        return f"A test finds it in simulated recordings to {100 * BY_CHANCE[name]:g} %."
    tolerance = TOLERANCE.get(name, 1e-6)
    why = ", to first order in a small angle" if tolerance == 1e-2 else ""
    return (
        "A test evaluates it and compares with the forward model: within "
        f"{100 * tolerance:g} % of the largest change{why}."
    )


def _signature(effect: type[Effect], text: Description, found: Mapping[str, Any]) -> str:
    example = ", ".join(f"`{key}` = {value}" for key, value in text.example.items())
    largest = sorted(found["rms"].items(), key=lambda item: -item[1])[:3]
    in_words = ", ".join(f"{name} {value:g}" for name, value in largest)
    sentences = [
        f"Change by {example} in the scenario `{found['scenario']}`, without noise:",
        "over time, against the quantity that it goes with best, and its amplitude spectrum (Hann window).",
        f"Largest rms: {in_words} {found['unit']}.",
    ]
    if found["share"] >= 0.5:
        sentences.append(
            f"A function of the {found['against'].rpartition(',')[0]} explains "
            f"{100 * found['share']:.0f} % of its variance."
        )
    if found["line_hz"] is not None and found["line_hz"] > SLOWEST_LINE:
        sentences.append(
            f"Strongest line of {found['drawn'][0]}: {found['line']:g} {found['unit']} at {found['line_hz']:g} Hz."
        )
    if found["drawn"] == ["reference"]:
        sentences.append("No channel changes, only the reference does.")
    if found["drawn"][0].startswith("gyro"):
        sentences.append("No accelerometer changes, only the gyro does.")
    alt = f"Change by {effect.name} over time, against {found['against']}, and its spectrum"
    return f"![{alt}](figures/{effect.name}.png)\n\n" + " ".join(sentences)


def _rivals(effect: type[Effect], text: Description, numbers: Mapping[str, Any]) -> str:
    motions = numbers["motions"]
    if not motions:
        none = "No rivals are computed, as it has no column in the normal equations of the standard motions."
        return f"{none} {_plain(text.rivals)}".rstrip()
    rows = ["| motion | d′ | rivals: share that each explains, and nats that remain |", "|---|---|---|"]
    for motion, one in motions.items():
        if one["detectability"] < _ANY:
            rows.append(f"| {motion} | {one['detectability']:.1f} | does not show |")
            continue
        rivals = [_rival(*rival) for rival in one["rivals"]]
        more = one.get("more") or []
        cell = ", ".join(rivals) + (f", and {len(more)} more" if more else "")
        rows.append(f"| {motion} | {one['detectability']:.3g} | {cell or 'none'} |")
    notes = f"Bold: not separable in this motion (below {SEPARATED:g} nats). The others explain nine tenths or more."
    if numbers.get("of_samples"):
        notes = (
            f"Computed for the example below, linear in the sizes of the rivals; those that would need a size beyond "
            f"their limit are left out. A diagnosis looks for a fault of the samples before any fit. {notes}"
        )
    if effect.contained_in:
        wider = _and([link(one) for one in sorted(effect.contained_in)])
        notes += f" Whatever it does, {wider} can do too: no motion separates the two, and the narrower one is named."
    return "\n".join(rows) + f"\n\n{notes}"


def _rival(name: str, share: float, nats: float) -> str:
    text = f"{link(name)} {100 * share:.4g} %, {_nats(nats)}"
    return f"**{text}**" if nats < SEPARATED else text


def _nats(value: float) -> str:
    """Return nats with as many digits as matter."""
    if value < LEAST:
        return f"< {LEAST:g}"
    return f"{value:.2g}" if value < SEPARATED else f"{value:.0f}" if value < MOST else f"> {MOST}"


def _separation(text: Description, numbers: Mapping[str, Any]) -> str:
    parts = [text.experiment]
    for rig, one in numbers["experiments"].items():
        where = {"table": "On a table", "body": "On a free body", "carriage": "On a linear axis"}[rig]
        trials = list(one["nats"])
        rows = [f"| {where}: nats against | {' | '.join(EXPERIMENTS[trial] for trial in trials)} |"]
        rows.append("|---|" + "---|" * len(trials))
        for place, rival in enumerate(one["rivals"]):
            cells = [one["nats"][trial][place] for trial in trials]
            shown = [f"**{_nats(cell)}**" if cell < SEPARATED else _nats(cell) for cell in cells]
            rows.append(f"| {link(rival)} | {' | '.join(shown)} |")
        if one["separates"]:
            sentence = (
                f"Computed: *{EXPERIMENTS[one['separates']]}* separates it from every effect with which some motion "
                "above confounds it."
            )
        else:
            remaining = _and([link(rival) for rival in one["remaining"]])
            none = all(max(values) < SEPARATED for values in one["nats"].values())
            best = f"*{EXPERIMENTS[one['best']]}* separates it best, but not from {remaining}."
            sentence = f"Computed: {f'none of these separates it from {remaining}.' if none else best}"
        parts += ["\n".join(rows), sentence]
    return "\n\n".join(parts)


def _trial(effect: type[Effect], text: Description, found: Mapping[str, Any] | None) -> str:
    lines = [f"```\n{simulate_command(effect, text.example)}"]
    twin = "free.toml" if effect.name.startswith("gyro_") else twin_of(effect.name)
    lines[0] += f"\ngfimu diagnose hidden.parquet --twin {twin} --out diagnosis\n```"
    if effect.name.startswith("gyro_"):
        lines.append('`free.toml` is a copy of the twin `cube12_turntable` with `source = "gyro"` in `[drive]`.')
    lines.append(f'In a twin file it is a table `[[effect]]` with `name = "{effect.name}"` and the same parameters.')
    if effect.name not in ("unknown", "proof_mass"):
        lines.append(f'`verdict.json` names it `"effect": "{effect.name}"`.')
    if found is not None and found["of"] == text.example:
        lines.append(f"What the diagnosis of this recording says: {_verdict(found)}.")
    return "\n\n".join(lines)


def _verdict(found: Mapping[str, Any]) -> str:
    if found["verdict"] == "refused":
        return f"the recording is refused ({found['message']})"
    causes = []
    for one in found["causes"]:
        name = one.get("name", one["effect"])
        rivals = one["not_distinguishable_from"]
        beside = f", not distinguishable from {_and([f'`{rival}`' for rival in rivals])}" if rivals else ""
        causes.append(f"`{name}` (probability {one['probability']:.2f}{beside})")
    by = f" by {_and(causes)}" if causes else ""
    share = (
        f"; {100 * found['share']:.0f} % of the excess on held-out data is removed"
        if found.get("share") is not None
        else ""
    )
    return f"*{found['verdict'].replace('_', ' ')}*{by}{share}"


def _on_rail(effect: type[Effect]) -> str:
    text = describe(effect)
    vectors = vectors_of(text.formula, text.symbols)
    lines = "\n".join(to_latex(one, vectors) for one in text.formula)
    return f"{text.what}\n\n$$\n{lines}\n$$\n\n{text.experiment}"


def link(name: str) -> str:
    """Return an effect's name as a link to its page."""
    return f"[{name}]({name}.md)" if name in every_effect() else f"`{name}`"


def _and(items: list[str]) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"


def _plain(text: str) -> str:
    """Return text with the marks of code as Markdown has them."""
    return text.replace("``", "`")


def _sentence(text: str) -> str:
    return text if text.endswith(".") else f"{text}."
