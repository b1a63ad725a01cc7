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

from gfimu.diagnosis.data.rails import GARBAGE, PILE, Rail, find_rails, on_rails, rail_parameters, rail_sentence
from gfimu.diagnosis.data.rounding import common_step
from gfimu.diagnosis.data.run import Run, difference_noise
from gfimu.diagnosis.data.samples import channel_spikes, frozen_stretches, told_frozen
from gfimu.world_model import Effect, ExpectedNoise, WorldModel

__all__ = ["SIGNIFICANT_RMS", "IntegrityReport", "check_integrity"]

_RANGE_FACTORS = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 2.0, 4.0, 8.0, 16.0)
_REMOVED = 0.7
_FITTING = 0.6  # of the power of the readings
SIGNIFICANT_RMS = 12.0
"""Of a misfit, in units of noise."""
_VARIED_RMS, _NOISE = 3.0, 1.5  # of a slow table, noise; power of white noise and some bias instability
_MANY = 3  # inverted channels that are more likely than exchanged ones
_CAUGHT = 0.8  # of the samples that should be beyond a limit
_SURELY_MISSING = 15.0  # samples above the largest value of several channels, of which none is there
_ONE_CHIP = 3  # channels that may read more than a limit
_OF_RANGE = 0.97  # of the configured range: clipping there is no fault
_DIFFERENT = 0.6  # share of values above which steps are finer than what is seen

_Fault = tuple[str, dict[str, object], str]
"""Effect, its parameters, and a sentence."""

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
    known, library = {effect.name for effect in model.effects}, model.families()
    step, expected = _resolution(run), model.expected_noise(run.output_data_rate)
    counts = _Counts(max(step or 0.0, expected.quantum), _range_factors(model.effects, model), expected)
    wiring = _wiring(model, _alive(model, run, prediction, counts), prediction, expected.white, known)
    rewired = [library[name](parameters) for name, parameters, _ in wiring if name in library]
    prediction = _rewire(prediction, rewired, model)
    counts = replace(counts, coarser=_range_factors([*model.effects, *rewired], model))
    ends = _ends(model, run, prediction, counts)
    clipped = _clipped(run, prediction, ends, counts)
    faults = [*_lost(run), *_coarse(step, expected.quantum), *wiring]
    faults += _saturation(run, clipped, ends, counts, model.array.channels)
    run = replace(run, valid=run.valid & ~clipped)
    limit = None if ends.rails else ends.limit
    frozen = frozen_stretches(run, prediction, counts.quantum, limit, expected.analogue)
    run = replace(run, valid=_without(run.valid, frozen))
    if frozen:
        faults.append(("stuck_channel", *told_frozen(run, frozen, model.array.channels)))
    spikes = channel_spikes(run, counts.white, counts.steps)
    run = replace(run, valid=run.valid & ~spikes)
    found = [fault for fault in faults if fault[0] in library and fault[0] not in known]
    effects = tuple(library[name](parameters) for name, parameters, _ in found)
    return IntegrityReport(run, effects, {name: sentence for name, _, sentence in found}, int(spikes.sum()))


@dataclass(frozen=True)
class _Counts:
    """Steps and noise of the channels, some of which may be ``coarser`` (c,) than expected by a factor."""

    quantum: float
    coarser: NDArray[np.float64]
    expected: ExpectedNoise

    @property
    def steps(self) -> NDArray[np.float64]:
        """One count of each channel, m/s²."""
        return self.quantum * self.coarser

    @property
    def white(self) -> NDArray[np.float64]:
        """White noise of each channel, m/s²."""
        return np.asarray(self.expected.white * self.coarser)


@dataclass(frozen=True)
class _Ends:
    """Where readings end: at one limit for all channels, m/s², or at rails of single ones."""

    limit: float | None
    rails: Sequence[Rail]


def _lost(run: Run) -> list[_Fault]:
    """Return the lost samples as a fault."""
    if not run.lost:
        return []
    parameters: dict[str, object] = {
        "share": run.lost / len(run.t),
        "count": int(run.lost),
        "longest_s": run.longest_gap,
    }
    text = f"{run.lost} of {len(run.t)} samples are missing; the longest gap is {run.longest_gap:.3f} s"
    return [("dropped_frames", parameters, text)]


def _coarse(step: float | None, quantum: float) -> list[_Fault]:
    """Return a step that is coarser than expected as a fault."""
    if step is None or step <= 1.5 * quantum:
        return []
    text = f"all readings are multiples of {step:.4g} m/s², not of {quantum:.4g} m/s²"
    return [("coarse_resolution", {"step_m_s2": step}, text)]


def _ends(model: WorldModel, run: Run, prediction: NDArray[np.float64], counts: _Counts) -> _Ends:
    """Return where readings end: where the model says so, else where the run shows it."""
    clipped_at = [float(effect.parameters["limit_m_s2"]) for effect in model.effects if effect.name == "saturation"]
    if clipped_at:
        return _Ends(min(clipped_at), ())
    limit = _clipping(run, prediction, counts.steps, counts.white)
    return _Ends(limit, _own_rails(run, prediction, limit, counts.steps, counts.white))


def _alive(model: WorldModel, run: Run, prediction: NDArray[np.float64], counts: _Counts) -> Run:
    """Return the run without clipped and dead readings, which look like those of a chip in a wider range."""
    ends = _ends(model, run, prediction, counts)
    limit = np.inf if ends.limit is None or ends.rails else ends.limit - 0.6 * counts.quantum
    at_limit = np.abs(run.readings) >= limit
    at_limit |= on_rails(run, np.zeros_like(prediction), ends.rails, counts.steps, np.zeros_like(counts.coarser))
    frozen = frozen_stretches(run, prediction, counts.quantum, ends.limit, counts.expected.analogue)
    return replace(run, valid=_without(run.valid & ~at_limit, frozen))


def _without(valid: NDArray[np.bool_], frozen: Sequence[tuple[int, int, int]]) -> NDArray[np.bool_]:
    """Return which readings count without (channel, start, stop)."""
    valid = valid.copy()
    for channel, start, stop in frozen:
        valid[start:stop, channel] = False
    return valid


def _clipped(run: Run, prediction: NDArray[np.float64], ends: _Ends, counts: _Counts) -> NDArray[np.bool_]:
    """Mark readings (n, c) at which a channel ends, or so near that noise is cut."""
    noise = _noise_seen(run, counts.expected.white)
    if ends.rails:
        return on_rails(run, prediction, ends.rails, counts.steps, noise)
    if ends.limit is None:
        return np.zeros_like(run.valid)
    # Just below the limit only those samples are whole whose noise points down.
    near = np.abs(prediction) > ends.limit - 4.0 * noise
    return np.asarray((np.abs(run.readings) >= ends.limit - 0.6 * counts.quantum) | near)


def _saturation(
    run: Run, clipped: NDArray[np.bool_], ends: _Ends, counts: _Counts, names: Sequence[str]
) -> list[_Fault]:
    """Return clipping below the configured range as a fault."""
    levels = [abs(rail.level) for rail in ends.rails] or ([] if ends.limit is None else [ends.limit])
    if not levels or min(levels) >= _OF_RANGE * counts.expected.full_scale:
        return []
    if ends.rails:
        parameters = rail_parameters(run, ends.rails, names, counts.steps)
        return [("saturation", parameters, rail_sentence(ends.rails, names, int((clipped & run.valid).sum())))]
    text = f"readings pile up at ±{ends.limit:.2f} m/s² and never exceed it"
    return [("saturation", {"limit_m_s2": ends.limit}, text)]


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
            caught = sigma > 0.5 * quantum and (beyond & at_top).sum() > max(_CAUGHT * beyond.sum(), PILE)
            if sigma > 0.5 * quantum:
                lacking.append((top, _missing_above(int(at_top.sum()), int(below.sum()), noise / quantum)))
            if at_top.sum() < 8 or not (caught or at_top.sum() > 3 * below.sum() + 4):
                continue
            if caught or (beyond & at_top).sum() > 0.5 * at_top.sum():
                levels.append(top)
            elif at_top.sum() >= PILE and sigma > 0.5 * quantum:
                piles.append(top)  # a steady signal at the limit: its noise would go beyond
    levels = levels or (piles if len(piles) > 1 else []) or _cut_off(lacking, float(steps.min()))
    if not levels:
        return None
    limit = float(np.median(levels))
    close = np.abs(np.array(levels) - limit) < 1.5 * float(steps.min())
    beyond_it = np.abs(np.where(run.valid, run.readings, 0.0)) > limit + np.maximum(0.6 * steps, 4.0 * white)
    # One chip in another range may read more, and single samples may be garbage.
    contradicted = np.sum(beyond_it.sum(axis=0) > GARBAGE) > _ONE_CHIP
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
    return rails if other or (beyond.sum(axis=0) > GARBAGE).any() else []


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
) -> list[_Fault]:
    """Find exchanged and inverted channels and chips in another range, the clearest first."""
    names = model.array.channels
    found: list[_Fault] = []
    prediction = prediction.copy()
    many = [] if "sign_flip" in known else _many_inverted(run, prediction, white)
    if many:
        found += [("sign_flip", {"channel": names[channel]}, "") for channel in many]
        prediction[:, many] *= -1.0
    for _ in range(4):
        misfit, inverted = _misfits(run, prediction, white), _misfits(run, -prediction, white)
        options = _exchanged_channels(names, misfit, inverted, prediction)
        options += _exchanged_chips(model, misfit, prediction, max((option[0] for option in options), default=0.0))
        options += _inverted_channels(names, run, misfit, inverted, prediction, white)
        options += _other_ranges(model, run, np.diag(misfit), prediction, white)
        options = [option for option in options if option[1] not in known]
        if not options:
            break
        _, name, parameters, sentence, prediction = max(options, key=lambda option: option[0])
        found.append((name, parameters, sentence))
        known = known | {name} if name != "sign_flip" else known
    return _merged_flips(found)


def _exchanged_channels(
    names: Sequence[str],
    misfit: NDArray[np.float64],
    inverted: NDArray[np.float64],
    prediction: NDArray[np.float64],
) -> list[_Option]:
    """Return the pairs of channels each of which reads what the other should; misfits (c, c) of each to each."""
    own = np.diag(misfit)
    options: list[_Option] = []
    for one, two in combinations(range(len(names)), 2):
        before = own[one] + own[two]
        after = misfit[one, two] + misfit[two, one]
        # Exchanged channels may be inverted as well: neither shows without the other, so both are tried at once where
        # inversion alone does not do; the inversion itself is found next.
        signed = _signed(misfit, inverted, (one, two), (two, one))
        if _clears(signed, _signed(misfit, inverted, (one, one), (two, two))):
            after = signed
        if before > 2 * SIGNIFICANT_RMS**2 and after < (1 - _REMOVED) * before:
            order = np.arange(len(names))
            order[[one, two]] = order[[two, one]]
            words = f"{names[one]} and {names[two]} read what the other should"
            swapped: dict[str, object] = {"channels": [names[one], names[two]]}
            options.append((float(before - after), "axis_swap", swapped, words, prediction[:, order]))
    return options


def _inverted_channels(
    names: Sequence[str],
    run: Run,
    misfit: NDArray[np.float64],
    inverted: NDArray[np.float64],
    prediction: NDArray[np.float64],
    white: NDArray[np.float64],
) -> list[_Option]:
    """Return the channels that read the negative of what they should."""
    own, flipped = np.diag(misfit), np.diag(inverted)
    options: list[_Option] = []
    for one, name in enumerate(names):
        if _clears(flipped[one], own[one]) or _reads_negative(run, prediction[:, one], white[one], one):
            sign = np.ones(len(names))
            sign[one] = -1
            words = f"{name} reads the negative of what it should"
            options.append((own[one] - flipped[one], "sign_flip", {"channel": name}, words, prediction * sign))
    return options


def _other_ranges(
    model: WorldModel,
    run: Run,
    own: NDArray[np.float64],
    prediction: NDArray[np.float64],
    white: NDArray[np.float64],
) -> list[_Option]:
    """Return the chips whose readings are those of another range; ``own`` is the misfit of each channel (c,)."""
    power = np.diag(_misfits(run, np.zeros_like(prediction), white))
    options: list[_Option] = []
    for factor in _RANGE_FACTORS:
        scaled = np.diag(_misfits(run, factor * prediction, white))
        for number, chip in enumerate(model.array.chips):
            mine = model.array.chip_of_channel == number
            after, before = float(scaled[mine].sum()), float(own[mine].sum())
            # A prediction that is too large by far comes nearer by any factor.
            limit = min((1 - _REMOVED) * before, _FITTING * float(power[mine].sum()))
            if before > 2 * SIGNIFICANT_RMS**2 and after < limit:
                found: dict[str, object] = {"chip": chip.name, "factor": factor}
                words = f"chip {chip.name} reads {factor:g} times what it should"
                options.append((before - after, "wrong_range", found, words, prediction * np.where(mine, factor, 1.0)))
    return options


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
        if before - after > by_two + 2 * SIGNIFICANT_RMS**2 and after < (1 - _REMOVED) * before:
            order = np.arange(len(names))
            order[pairs] = pairs[:, ::-1]
            words = f"chips {chips[one].name} and {chips[two].name} read what the other should"
            swapped = [names[channel] for channel in pairs.ravel()]
            options.append((before - after, "axis_swap", {"channels": swapped}, words, prediction[:, order]))
    return options


def _signed(misfit: NDArray[np.float64], inverted: NDArray[np.float64], *places: tuple[int, int]) -> float:
    """Return the summed misfit of channels to predictions, each inverted where that clears it."""
    return sum(float(inverted[at] if _clears(inverted[at], misfit[at]) else misfit[at]) for at in places)


def _clears(after: float, before: float) -> bool:
    """Whether a mean squared misfit is significant, and gone after."""
    return before > SIGNIFICANT_RMS**2 and after < (1 - _REMOVED) * before


def _reads_negative(run: Run, prediction: NDArray[np.float64], white: float, channel: int) -> bool:
    """Whether what varies of a channel is the negative of its prediction (n,), down to the noise.

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
