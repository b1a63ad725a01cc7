"""Wiring: exchanged and inverted channels, exchanged chips, and chips in another range."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.run import Run
from gfimu.model.world_model import Effect, WorldModel

__all__ = ["SIGNIFICANT_RMS", "Fault", "find_wiring", "range_factors", "rewired"]

_RANGE_FACTORS = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 2.0, 4.0, 8.0, 16.0)
_REMOVED = 0.7
_FITTING = 0.6  # of the power of the readings
SIGNIFICANT_RMS = 12.0
"""Of a misfit, in units of noise."""
_VARIED_RMS, _NOISE = 3.0, 1.5  # of a slow table, noise; power of white noise and some bias instability
_MANY = 3  # inverted channels that are more likely than exchanged ones

Fault = tuple[str, dict[str, object], str]
"""Effect, its parameters, and a sentence."""

_Option = tuple[float, str, dict[str, object], str, NDArray[np.float64]]
"""Misfit removed, effect, its parameters, a sentence, and the prediction with it."""


def find_wiring(
    model: WorldModel, run: Run, prediction: NDArray[np.float64], white: NDArray[np.float64], known: set[str]
) -> list[Fault]:
    """Find exchanged and inverted channels and chips in another range, the clearest first."""
    names = model.array.channels
    found: list[Fault] = []
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
        for index, chip in enumerate(model.array.chips):
            mine = model.array.chip_of_channel == index
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
    channels = [np.flatnonzero(model.array.chip_of_channel == index) for index in range(len(chips))]
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


def range_factors(effects: Sequence[Effect], model: WorldModel) -> NDArray[np.float64]:
    """Return how many times coarser each channel is than the model's, shape (c,), as its chip is in a wider range."""
    factors = np.ones(model.array.n_channels)
    chips = [chip.name for chip in model.array.chips]
    for effect in effects:
        if effect.name == "wrong_range":
            mine = model.array.chip_of_channel == chips.index(str(effect.parameters["chip"]))
            factors[mine] = max(float(effect.parameters["factor"]), 1.0)
    return factors


def rewired(prediction: NDArray[np.float64], effects: Sequence[Effect], model: WorldModel) -> NDArray[np.float64]:
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
