"""Integrity: faults that are seen in the samples themselves, before any Gaussian test.

Lost frames, a coarser step than assumed, clipping, frozen channels, exchanged or inverted channels, a chip in another
range. What they spoil is marked invalid; what they did is undone in the twin, so that the search sees clean data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.frozen import frozen_stretches, told_frozen
from gfimu.diagnosis.data.rails import Rail, find_rails, on_rails, rail_parameters, rail_sentence
from gfimu.diagnosis.data.rounding import common_step
from gfimu.diagnosis.data.run import Run, difference_noise
from gfimu.diagnosis.data.spikes import channel_spikes
from gfimu.world_model import Effect, WorldModel

__all__ = ["IntegrityReport", "check_integrity"]

_RANGE_FACTORS = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 2.0, 4.0, 8.0, 16.0)
_REMOVED = 0.7
_FITTING = 0.6  # of the power of the readings
_SIGNIFICANT_RMS = 12.0
_VARIED_RMS, _NOISE = 3.0, 1.5  # of a slow table, noise; power of white noise and some bias instability
_MANY = 3  # inverted channels that are more likely than exchanged ones
_PILE = 30
_CAUGHT = 0.8  # of the samples that should be beyond a limit
_SURELY_MISSING = 15.0  # samples above the largest value of several channels, of which none is there
_ONE_CHIP, _GARBAGE = 3, 5  # channels, and samples of each, that may read more than a limit
_OF_RANGE = 0.97  # of the configured range: clipping there is no fault
_DIFFERENT = 0.6  # share of values above which steps are finer than what is seen

_Option = tuple[float, str, dict[str, object], str, NDArray[np.float64]]
"""Misfit removed, effect, its parameters, a sentence, and the prediction with it."""


@dataclass(frozen=True)
class IntegrityReport:
    """Faults of a run and the run with what they spoiled marked invalid.

    Parameters
    ----------
    run : Run
        The run, invalid samples marked.
    effects : tuple of Effect
        Faults found, as effects of the library.
    why : mapping of str to str
        One sentence per effect name.
    spikes : int
        Isolated samples far off their neighbours.
    """

    run: Run
    effects: tuple[Effect, ...]
    why: dict[str, str]
    spikes: int


def check_integrity(model: WorldModel, run: Run, prediction: NDArray[np.float64]) -> IntegrityReport:
    """Look for faults in the samples of a run.

    Parameters
    ----------
    model : WorldModel
        The simulation; faults that it has already are not reported again.
    run : Run
        The run.
    prediction : ndarray, shape (n, c)
        What the simulation predicts for the run, m/s².
    """
    known = {effect.name for effect in model.effects}
    library = model.families()
    effects: list[Effect] = []
    why: dict[str, str] = {}

    def add(name: str, parameters: dict[str, object], sentence: str) -> None:
        if name in library:
            effects.append(library[name](parameters))
            why[name] = sentence

    expected = model.expected_noise(1.0 / run.sample_period)
    if run.lost and "dropped_frames" not in known:
        add(
            "dropped_frames",
            {"share": run.lost / len(run.t), "count": int(run.lost), "longest_s": run.longest_gap},
            f"{run.lost} of {len(run.t)} samples are missing; the longest gap is {run.longest_gap:.3f} s",
        )
    step = _resolution(run)
    if step is not None and step > 1.5 * expected.quantum and "coarse_resolution" not in known:
        add(
            "coarse_resolution",
            {"step_m_s2": step},
            f"all readings are multiples of {step:.4g} m/s², not of {expected.quantum:.4g} m/s²",
        )
    quantum = max(step or 0.0, expected.quantum)
    clipped_at = [float(effect.parameters["limit_m_s2"]) for effect in model.effects if effect.name == "saturation"]
    coarser = _range_factors(model.effects, model)
    limit = min(clipped_at) if clipped_at else _clipping(run, prediction, quantum * coarser, expected.white * coarser)
    rails = [] if clipped_at else _own_rails(run, prediction, limit, quantum * coarser, expected.white * coarser)
    at_limit = np.abs(run.readings) >= (np.inf if limit is None or rails else limit - 0.6 * quantum)
    at_limit |= on_rails(run, np.zeros_like(prediction), rails, quantum * coarser, np.zeros_like(coarser))
    # Clipped or dead readings look like those of a chip in a wider range.
    alive = run.valid & ~at_limit
    for channel, start, stop in frozen_stretches(run, prediction, quantum, limit, expected.analogue):
        alive[start:stop, channel] = False
    wiring = _wiring(model, replace(run, valid=alive), prediction, expected.white, known)
    for name, parameters, sentence in wiring:
        add(name, parameters, sentence)
    rewired = [effect for effect in effects if effect.name in {"axis_swap", "sign_flip", "wrong_range"}]
    if rewired:
        prediction = _rewire(prediction, rewired, model)
    coarser = _range_factors([*model.effects, *rewired], model)
    if not clipped_at:
        limit = _clipping(run, prediction, quantum * coarser, expected.white * coarser)
        rails = _own_rails(run, prediction, limit, quantum * coarser, expected.white * coarser)
    if rails:
        limit = None
        clipped = on_rails(run, prediction, rails, quantum * coarser, _noise_seen(run, expected.white))
        names = model.array.channels
        if "saturation" not in known and min(abs(rail.level) for rail in rails) < _OF_RANGE * expected.full_scale:
            left_out = int((clipped & run.valid).sum())
            parameters = rail_parameters(run, rails, names, quantum * coarser)
            add("saturation", parameters, rail_sentence(rails, names, left_out))
        run = replace(run, valid=run.valid & ~clipped)
    if limit is not None:
        if "saturation" not in known and limit < _OF_RANGE * expected.full_scale:
            add("saturation", {"limit_m_s2": limit}, f"readings pile up at ±{limit:.2f} m/s² and never exceed it")
        # Just below the limit only those samples are whole whose noise points down.
        near = np.abs(prediction) > limit - 4.0 * _noise_seen(run, expected.white)
        clipped = (np.abs(run.readings) >= limit - 0.6 * quantum) | near
        run = replace(run, valid=run.valid & ~clipped)
    valid = run.valid.copy()
    frozen = frozen_stretches(run, prediction, quantum, limit, expected.analogue)
    for channel, start, stop in frozen:
        valid[start:stop, channel] = False
    if frozen and "stuck_channel" not in known:
        add("stuck_channel", *told_frozen(run, frozen, model.array.channels))
    run = replace(run, valid=valid)
    spikes = channel_spikes(run, expected.white * coarser, quantum * coarser)
    run = replace(run, valid=run.valid & ~spikes)
    return IntegrityReport(run, tuple(effects), why, int(spikes.sum()))


def _resolution(run: Run) -> float | None:
    """Return the step that all readings of most channels are multiples of, m/s²."""
    steps = []
    for column, valid in zip(run.readings.T, run.valid.T, strict=True):
        step = common_step(column[valid])
        if step is not None and len(np.unique(column[valid])) < _DIFFERENT * valid.sum():
            steps.append(step)
    if len(steps) < max(2, run.readings.shape[1] // 2):
        return None
    return float(np.median(steps))


def _clipping(
    run: Run, prediction: NDArray[np.float64], steps: NDArray[np.float64], white: NDArray[np.float64]
) -> float | None:
    """Return the level at which readings pile up, m/s²; step and white noise per channel (c,)."""
    levels, piles = [], []
    lacking: list[tuple[float, float]] = []
    for channel, (quantum, sigma) in enumerate(zip(steps, white, strict=True)):
        mine = run.readings[run.valid[:, channel], channel]
        if len(mine) < 50 or np.ptp(mine) < 2 * quantum:
            continue  # a channel that holds one value is dead, not clipped
        noise = min(sigma, difference_noise(mine))
        for sign in (1.0, -1.0):
            top = float((sign * mine).max())
            if top <= 0.0:
                continue  # the other sign's extreme
            at_top = np.abs(sign * mine - top) < 0.3 * quantum
            below = np.abs(sign * mine - (top - quantum)) < 0.3 * quantum
            # Coarse rounding shows the top for anything within half a step of it.
            clear = max(1.5 * sigma, 0.5 * quantum + sigma)
            beyond = sign * prediction[run.valid[:, channel], channel] > top + clear
            # Nothing beyond it is read though it should be, even where a plateau is just below.
            caught = sigma > 0.5 * quantum and (beyond & at_top).sum() > max(_CAUGHT * beyond.sum(), _PILE)
            if sigma > 0.5 * quantum:
                lacking.append((top, _missing_above(int(at_top.sum()), int(below.sum()), noise / quantum)))
            if at_top.sum() < 8 or not (caught or at_top.sum() > 3 * below.sum() + 4):
                continue
            if caught or (beyond & at_top).sum() > 0.5 * at_top.sum():
                levels.append(top)
            elif at_top.sum() >= _PILE and sigma > 0.5 * quantum:
                piles.append(top)  # a steady signal at the limit: its noise would go beyond
    levels = levels or (piles if len(piles) > 1 else []) or _cut_off(lacking, float(steps.min()))
    if not levels:
        return None
    limit = float(np.median(levels))
    close = np.abs(np.array(levels) - limit) < 1.5 * float(steps.min())
    beyond_it = np.abs(np.where(run.valid, run.readings, 0.0)) > limit + np.maximum(0.6 * steps, 4.0 * white)
    # One chip in another range may read more, and single samples may be garbage.
    contradicted = np.sum(beyond_it.sum(axis=0) > _GARBAGE) > _ONE_CHIP
    return limit if close.sum() >= max(1, len(levels) // 2) and not contradicted else None


def _own_rails(
    run: Run,
    prediction: NDArray[np.float64],
    limit: float | None,
    steps: NDArray[np.float64],
    white: NDArray[np.float64],
) -> list[Rail]:
    """Return the rails of channels that clip otherwise than at one limit for all of them, above and below alike."""
    rails = find_rails(run, prediction, steps, white)
    if limit is None or not rails:
        return rails
    other = any(abs(abs(rail.level) - limit) > 1.5 * steps[rail.channel] for rail in rails)
    beyond = np.abs(np.where(run.valid, run.readings, 0.0)) > limit + np.maximum(0.6 * steps, 4.0 * white)
    return rails if other or (beyond.sum(axis=0) > _GARBAGE).any() else []


def _cut_off(lacking: Sequence[tuple[float, float]], step: float) -> list[float]:
    """Return the largest values of channels that end at one level, above which many samples are missing in all."""
    tops, missing = np.array(lacking).reshape(-1, 2).T
    for top in np.unique(tops):
        here = np.abs(tops - top) < 0.6 * step
        if here.sum() > 1 and missing[here].sum() > _SURELY_MISSING:
            return [float(one) for one in tops[here]]
    return []


def _missing_above(at_top: int, below: int, noise: float) -> float:
    """Return how many samples are missing above the largest value, at least.

    What is read is the signal plus Gaussian noise of σ steps, whatever the signal. The density of any such sum, over
    the Gaussian's own, is log-convex, so the counts of three neighbouring steps keep n₊ n₋ ≥ n₀² exp(−1/σ²).
    """
    if noise <= 0.0:
        return 0.0
    fewest, most = max(at_top - 2.0 * at_top**0.5, 0.0), below + 2.0 * below**0.5 + 1.0
    return float(fewest**2 / most * np.exp(-1.0 / noise**2))


def _noise_seen(run: Run, white: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the white noise of each channel (c,), at least what is expected."""
    seen = [difference_noise(mine[valid]) for mine, valid in zip(run.readings.T, run.valid.T, strict=True)]
    return np.maximum(white, seen)


def _range_factors(effects: Sequence[Effect], model: WorldModel) -> NDArray[np.float64]:
    """Return how many times coarser each channel is than the model's, shape (c,), as its chip is in a wider range."""
    factors = np.ones(model.array.n_channels)
    chips = [chip.name for chip in model.array.chips]
    for effect in effects:
        if effect.name == "wrong_range":
            mine = model.array.chip_of_channel == chips.index(str(effect.parameters["chip"]))
            factors[mine] = max(float(effect.parameters["factor"]), 1.0)
    return factors


def _wiring(
    model: WorldModel, run: Run, prediction: NDArray[np.float64], white: NDArray[np.float64], known: set[str]
) -> list[tuple[str, dict[str, object], str]]:
    """Find exchanged and inverted channels and chips in another range, the clearest first."""
    names = model.array.channels
    found: list[tuple[str, dict[str, object], str]] = []
    prediction = prediction.copy()
    chip_of = model.array.chip_of_channel
    power = np.diag(_misfits(run, np.zeros_like(prediction), white))
    many = [] if "sign_flip" in known else _many_inverted(run, prediction, white)
    if many:
        found += [("sign_flip", {"channel": names[channel]}, "") for channel in many]
        prediction[:, many] *= -1.0
    for _ in range(4):
        misfit, inverted = _misfits(run, prediction, white), _misfits(run, -prediction, white)
        own, flipped = np.diag(misfit), np.diag(inverted)
        options: list[_Option] = []
        for one, two in combinations(range(len(names)), 2):
            before = own[one] + own[two]
            after = misfit[one, two] + misfit[two, one]
            # Exchanged channels may be inverted as well: neither shows without the other, so both are tried at once
            # where inversion alone does not do; the inversion itself is found next.
            signed = _signed(misfit, inverted, (one, two), (two, one))
            if _clears(signed, _signed(misfit, inverted, (one, one), (two, two))):
                after = signed
            if before > 2 * _SIGNIFICANT_RMS**2 and after < (1 - _REMOVED) * before:
                order = np.arange(len(names))
                order[[one, two]] = order[[two, one]]
                options.append(
                    (
                        float(before - after),
                        "axis_swap",
                        {"channels": [names[one], names[two]]},
                        f"{names[one]} and {names[two]} read what the other should",
                        prediction[:, order],
                    )
                )
        options += _exchanged_chips(model, misfit, prediction, max((option[0] for option in options), default=0.0))
        for one in range(len(names)):
            if _clears(flipped[one], own[one]) or _reads_negative(run, prediction[:, one], white[one], one):
                sign = np.ones(len(names))
                sign[one] = -1
                options.append(
                    (
                        own[one] - flipped[one],
                        "sign_flip",
                        {"channel": names[one]},
                        f"{names[one]} reads the negative of what it should",
                        prediction * sign,
                    )
                )
        for factor in _RANGE_FACTORS:
            scaled = np.diag(_misfits(run, factor * prediction, white))
            for number, chip in enumerate(model.array.chips):
                mine = chip_of == number
                after, before = float(scaled[mine].sum()), float(own[mine].sum())
                # A prediction that is too large by far comes nearer by any factor.
                limit = min((1 - _REMOVED) * before, _FITTING * float(power[mine].sum()))
                if before > 2 * _SIGNIFICANT_RMS**2 and after < limit:
                    gain = np.where(mine, factor, 1.0)
                    options.append(
                        (
                            before - after,
                            "wrong_range",
                            {"chip": chip.name, "factor": factor},
                            f"chip {chip.name} reads {factor:g} times what it should",
                            prediction * gain,
                        )
                    )
        options = [option for option in options if option[1] not in known]
        if not options:
            break
        _, name, parameters, sentence, prediction = max(options, key=lambda option: option[0])
        found.append((name, parameters, sentence))
        known = known | {name} if name != "sign_flip" else known
    return _merged_flips(found)


def _exchanged_chips(
    model: WorldModel, misfit: NDArray[np.float64], prediction: NDArray[np.float64], by_two: float
) -> list[_Option]:
    """Return whole chips that may be exchanged, where that clears more than the exchange of two channels does."""
    options: list[_Option] = []
    chips, names = model.array.chips, model.array.channels
    channels = [np.flatnonzero(model.array.chip_of_channel == number) for number in range(len(chips))]
    for one, two in combinations(range(len(chips)), 2):
        if len(channels[one]) != len(channels[two]) or len(channels[one]) < 2:
            continue
        pairs = np.column_stack([channels[one], channels[two]])  # (axes, 2)
        before = float(misfit[pairs, pairs].sum())
        after = float((misfit[pairs[:, 0], pairs[:, 1]] + misfit[pairs[:, 1], pairs[:, 0]]).sum())
        if before - after > by_two + 2 * _SIGNIFICANT_RMS**2 and after < (1 - _REMOVED) * before:
            order = np.arange(len(names))
            order[pairs] = pairs[:, ::-1]
            told = f"chips {chips[one].name} and {chips[two].name} read what the other should"
            swapped = [names[channel] for channel in pairs.ravel()]
            options.append((before - after, "axis_swap", {"channels": swapped}, told, prediction[:, order]))
    return options


def _signed(misfit: NDArray[np.float64], inverted: NDArray[np.float64], *places: tuple[int, int]) -> float:
    """Return the summed misfit of channels to predictions, each inverted where that clears it."""
    return sum(float(inverted[at] if _clears(inverted[at], misfit[at]) else misfit[at]) for at in places)


def _clears(after: float, before: float) -> bool:
    """Tell whether a mean squared misfit is significant, and gone after."""
    return before > _SIGNIFICANT_RMS**2 and after < (1 - _REMOVED) * before


def _reads_negative(run: Run, prediction: NDArray[np.float64], white: float, channel: int) -> bool:
    """Tell whether what varies of a channel is the negative of its prediction (n,), down to the noise.

    Of little, as on a slow table: an offset may look like an inverted constant, but nothing else inverts a variation.
    """
    ok = run.valid[:, channel]
    if not ok.any():
        return False
    measured, expected = run.readings[ok, channel] / white, prediction[ok] / white
    inverted = measured + expected
    varied = float(np.var(measured - expected)) > _VARIED_RMS**2
    return varied and float(np.var(inverted)) < _NOISE and float(np.mean(inverted**2)) < 2 * _NOISE


def _misfits(run: Run, prediction: NDArray[np.float64], white: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the robust mean squared misfit of every channel (row) to every prediction (column), in noise units."""
    rows = slice(None, None, max(1, len(run.t) // 4000))
    out = np.empty((prediction.shape[1], prediction.shape[1]))
    for channel in range(prediction.shape[1]):
        ok = run.valid[rows, channel]
        error = (run.readings[rows, channel][ok, None] - prediction[rows][ok]) / white[channel]
        out[channel] = np.mean(error**2, axis=0) if ok.any() else 0.0
    return out


def _many_inverted(run: Run, prediction: NDArray[np.float64], white: NDArray[np.float64]) -> list[int]:
    """Return the channels that fit inverted, if they are several and that does it: in pairs they look exchanged."""
    own = np.diag(_misfits(run, prediction, white))
    flipped = np.diag(_misfits(run, -prediction, white))
    many = [channel for channel in range(len(own)) if _clears(flipped[channel], own[channel])]
    left = own.sum() - own[many].sum() + flipped[many].sum()
    return many if len(many) >= _MANY and left < (1 - _REMOVED) * own.sum() else []


def _merged_flips(
    found: list[tuple[str, dict[str, object], str]],
) -> list[tuple[str, dict[str, object], str]]:
    flips = [item for item in found if item[0] == "sign_flip"]
    if len(flips) < 2:
        return found
    names = [str(item[1]["channel"]) for item in flips]
    sentence = f"{', '.join(names)} read the negative of what they should"
    merged: tuple[str, dict[str, object], str] = ("sign_flip", {"channel": names}, sentence)
    return [item for item in found if item[0] != "sign_flip"] + [merged]


def _rewire(prediction: NDArray[np.float64], effects: Sequence[Effect], model: WorldModel) -> NDArray[np.float64]:
    """Apply exchanged, inverted and rescaled channels to a prediction."""
    prediction = prediction.copy()
    for effect in effects:
        if effect.name == "axis_swap":
            places = [model.array.index(name) for name in effect.parameters["channels"]]
            one, two = places[::2], places[1::2]
            prediction[:, [*one, *two]] = prediction[:, [*two, *one]]
        elif effect.name == "sign_flip":
            value = effect.parameters["channel"]
            for name in [value] if isinstance(value, str) else value:
                prediction[:, model.array.index(name)] *= -1
        else:
            chips = [chip.name for chip in model.array.chips]
            mine = model.array.chip_of_channel == chips.index(str(effect.parameters["chip"]))
            prediction[:, mine] *= float(effect.parameters["factor"])
    return prediction
