"""Two files of outcomes, list by list: which cases differ, the rates with their intervals, what leaves its interval."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from gfimu.base.errors import InputError
from sim.trials.study.outcome_file import generator_name, read_outcomes
from sim.trials.study.tally import LEAST_APART, Outcome, Tally, rate_with_interval, score, visible

__all__ = ["POLICY", "Comparison", "Policy", "Promise", "compare", "load_outcomes"]

_NEEDED = ("key", "study", "source", "effects", "size", "without", "verdict", "causes")
_DEFINED = (
    *("effects", "size", "duration", "sample_rate", "bias_instability_mg", "tacho_noise", "array", "residue"),
    *("without", "encoder_counts"),
)
_KEPT_DIGITS = 1e-5  # of a number that is kept (`sim.trials.study.outcome_file.keep_outcomes`)
_MOST_NAMED = 10  # cases of a list that only one file has


@dataclass(frozen=True)
class Measure:
    """One property of an outcome; ``wanted`` tells whether more of it is better."""

    name: str
    holds: Callable[[Outcome], bool]
    wanted: bool = True


def _scored(what: str) -> Callable[[Outcome], bool]:
    return lambda outcome: score(outcome)[what]


ALONE = Measure("named alone", _scored("exact"))
SET = Measure("alone or inseparable set", _scored("fair"))
ANY_SET = Measure("in any set", _scored("within"))
WRONG = Measure("wrong", _scored("wrong"), wanted=False)
NOTHING = Measure("nothing found", _scored("nothing"))
FALSE_ALARM = Measure("false alarm", _scored("named"), wanted=False)
UNKNOWN = Measure("unknown", _scored("unknown"))
CRASHED = Measure("crashed", _scored("error"), wanted=False)

_INSIDE = (ALONE, SET, ANY_SET, WRONG, CRASHED)
_NULL = (NOTHING, FALSE_ALARM, CRASHED)
_OUTSIDE = (UNKNOWN, WRONG, CRASHED)


@dataclass(frozen=True)
class Promise:
    """A rate that is promised of a measure: at least where it is wanted, at most otherwise."""

    measure: Measure
    rate: float

    def bound(self, cases: int, level: float) -> int:
        """Return the count that fewer than a share ``level`` of fair draws at the promised rate go beyond."""
        return int(binom.ppf(level if self.measure.wanted else 1.0 - level, cases, self.rate))

    def kept(self, hits: int, cases: int, level: float) -> bool:
        """Whether a count is within its bound."""
        bound = self.bound(cases, level)
        return hits >= bound if self.measure.wanted else hits <= bound


_SINGLES = (Promise(ALONE, 0.93), Promise(SET, 0.95), Promise(ANY_SET, 0.98), Promise(WRONG, 0.05))
_PAIRS = (Promise(ALONE, 0.88), Promise(WRONG, 0.05))
_NULLS = (Promise(FALSE_ALARM, 0.01),)
_UNKNOWNS = (Promise(UNKNOWN, 0.90),)


@dataclass(frozen=True)
class Policy:
    """When a list leaves its interval.

    Parameters
    ----------
    level : float
        Probability of a list that is as good as before, or as promised, to leave its interval by chance. The paired
        test is one-sided and exact: of the cases that changed (McNemar 1947), those that got worse are binomial with
        ½. The bound of a promised rate is the quantile of the binomial count, as in the tests of hidden effects.
    promises : mapping
        Rates by study and number of hidden effects. Named alone, 0.93: the rate of ``singles`` in
        docs/accuracy/diagnosis-study.md; the others are what its tests ask (same page: asked are 95 %
        alone or in an inseparable set, 98 % in any set, of pairs 88 % alone, at most 5 % wrong; unknown 90 % outside
        the library).
        Faint lists, three effects and single effects under programmed motion have no promise of their own.
    within_three : float
        Share of the parameters of rightly named causes within three standard deviations; normal errors have 0.997.
    """

    level: float = 0.01
    promises: Mapping[tuple[str, str], tuple[Promise, ...]] = field(
        default_factory=lambda: {
            **{(study, "1"): _SINGLES for study in ("singles", "fresh_singles", "other_settings", "residue")},
            **{(study, "1"): _SINGLES for study in ("short_runs", "slow_samples", "fast_samples", "noisy_tacho")},
            **{(study, "1"): _SINGLES for study in ("corners8", "three_plus_one", "encoders", "coarse_encoders")},
            **{(study, "2"): _PAIRS for study in ("pairs", "other_pairs")},
            **{(study, "0"): _NULLS for study in ("nulls", "other_nulls", "threshold_nulls", "long_nulls", "residue")},
            ("exotics", "outside"): _UNKNOWNS,
            ("left_out", "outside, unlike any two others"): _UNKNOWNS,
        }
    )
    within_three: float = 0.98

    def worse_by_chance(self, better: int, worse: int) -> float:
        """Return the probability of at least so many worse ones among those that changed."""
        return float(binom.sf(worse - 1, better + worse, 0.5)) if worse else 1.0


POLICY = Policy()


@dataclass(frozen=True)
class Comparison:
    """The text of a comparison, and the lists that left their interval with the reason."""

    text: str
    left: tuple[str, ...]
    compared: int
    different: int


def load_outcomes(path: str | Path) -> dict[tuple[str, str], Outcome]:
    """Read outcomes of the diagnosis by key and generator; a later one replaces an earlier.

    Raises
    ------
    InputError
        If there is no outcome in the file, or a line is something else.
    """
    found: dict[tuple[str, str], Outcome] = {}
    for number, outcome in enumerate(read_outcomes(path), start=1):
        missing = [key for key in _NEEDED if not isinstance(outcome, dict) or key not in outcome]
        if missing:
            raise InputError(
                f"{path}: outcome {number} has no {missing[0]!r}; give a run of `python -m sim.trials.study run`"
            )
        if not outcome.get("method"):
            found[outcome["key"], generator_name(outcome["source"])] = outcome
    if not found:
        raise InputError(f"{path}: no outcomes; give a folder that `python -m sim.trials.study run` wrote")
    return found


def compare(
    old: Mapping[tuple[str, str], Outcome], new: Mapping[tuple[str, str], Outcome], policy: Policy = POLICY
) -> Comparison:
    """Compare the cases that both have; those in which what is hidden can't be seen are left out.

    Raises
    ------
    InputError
        If there are none, or one of a name is another case in the other.
    """
    both = [name for name in new if name in old]
    if not both:
        raise InputError("no case is in both files; run the same list, such as `python -m sim.trials.study run gate`")
    for name in both:
        _same_case(old[name], new[name])
    lists: dict[tuple[str, str, str], list[tuple[Outcome, Outcome]]] = defaultdict(list)
    hidden_from_view = 0
    for name in both:
        if visible(new[name]):
            lists[_list_of(new[name])].append((old[name], new[name]))
        else:
            hidden_from_view += 1
    parts, left, different = [], [], 0
    for place, pairs in sorted(lists.items()):
        text, reasons, count = _compare_list(place, pairs, policy)
        parts.append(text)
        left += reasons
        different += count
    everything = list(itertools.chain.from_iterable(lists.values()))
    text, reasons = _together(everything, policy)
    parts.append(text)
    left += reasons
    parts += [_only("only in the old file", old, new), _only("only in the new file", new, old)]
    if hidden_from_view:
        parts.append(f"left out, below what can be seen: {hidden_from_view}\n")
    parts.append(f"{len(everything)} cases compared in {len(lists)} lists, {different} differ\n")
    parts += [f"LEFT ITS INTERVAL  {reason}\n" for reason in left] or ["every list stays within its interval\n"]
    return Comparison("".join(parts), tuple(left), len(everything), different)


def _same_case(old: Outcome, new: Outcome) -> None:
    """Refuse to compare two cases that only share a name."""
    for key in _DEFINED:
        one, other = old.get(key), new.get(key)
        if one is None or other is None:
            continue
        same = abs(one - other) <= _KEPT_DIGITS * abs(one) if isinstance(one, float) else one == other
        if not same:
            raise InputError(f"{new['key']}: {key} is {one} in the old file and {other} in the new; run it again")


def _list_of(outcome: Outcome) -> tuple[str, str, str]:
    """Return study, generator and kind of the list that an outcome belongs to."""
    kind = str(len(outcome["effects"]))
    if outcome["study"] == "exotics":
        kind = "outside"
    elif outcome["without"]:
        apart = (outcome.get("left_by_two") or 0.0) > 2 * LEAST_APART
        kind = "outside, unlike any two others" if apart else "outside, like others"
    return outcome["study"], generator_name(outcome["source"]).partition(":")[0], kind


def _measures(kind: str) -> tuple[Measure, ...]:
    return _OUTSIDE if kind.startswith("outside") else _NULL if kind == "0" else _INSIDE


def _said(outcome: Outcome) -> str:
    names = sorted({cause["effect"] for cause in outcome["causes"]})
    flags = [what for what in ("exact", "fair", "within", "wrong") if score(outcome)[what]]
    blame = [f"blame: {outcome['blame']}"] if outcome.get("blame") else []
    return f"{outcome['verdict']} {' + '.join(names)}".strip() + f" ({', '.join([*flags, *blame]) or 'missed'})"


def _differs(old: Outcome, new: Outcome) -> bool:
    def answer(outcome: Outcome) -> tuple[object, ...]:
        return outcome["verdict"], {cause["effect"] for cause in outcome["causes"]}, tuple(score(outcome).values())

    return answer(old) != answer(new)


def _compare_list(
    place: tuple[str, str, str], pairs: Sequence[tuple[Outcome, Outcome]], policy: Policy
) -> tuple[str, list[str], int]:
    """Return the text of a list, why it leaves its interval, and how many cases differ."""
    study, source, kind = place
    title = f"{study}, worlds from {source}, {kind if kind.startswith('outside') else kind + ' hidden'}"
    changed = [(old, new) for old, new in pairs if _differs(old, new)]
    lines = [f"{title}: {len(pairs)} cases, {len(changed)} differ"]
    for old, new in sorted(changed, key=lambda pair: str(pair[1]["key"])):
        hidden = " + ".join(new["effects"]) or "nothing"
        lines.append(f"  {new['key']}  {hidden} d' {new['size']:.0f}: {_said(old)} -> {_said(new)}")
    promised = {promise.measure.name: promise for promise in policy.promises.get((study, kind), ())}
    promised["crashed"] = Promise(CRASHED, 0.0)
    reasons = []
    for measure in _measures(kind):
        line, reason = _compare_measure(measure, promised.get(measure.name), pairs, policy)
        lines.append(f"  {line}")
        reasons += [f"{title}: {reason}"] if reason else []
    z, before = Tally([new for _, new in pairs]).z(), Tally([old for old, _ in pairs]).z()
    if len(z):
        lines.append(f"  parameters within 1, 2, 3 std: {_spread(before)} -> {_spread(z)}")
        hits, bound = int(np.sum(z < 3)), int(binom.ppf(policy.level, len(z), policy.within_three))
        if hits < bound:
            reasons.append(f"{title}: {hits} of {len(z)} parameters within 3 std, {policy.within_three} asks {bound}")
    return "\n".join(lines) + "\n\n", reasons, len(changed)


def _compare_measure(
    measure: Measure, promise: Promise | None, pairs: Sequence[tuple[Outcome, Outcome]], policy: Policy
) -> tuple[str, str]:
    """Return the line of one measure and why the list leaves its interval by it, if it does."""
    before, after = (np.array([measure.holds(pair[place]) for pair in pairs]) for place in (0, 1))
    gained, lost = int(np.sum(after & ~before)), int(np.sum(before & ~after))
    better, worse = (gained, lost) if measure.wanted else (lost, gained)
    chance = policy.worse_by_chance(better, worse)
    hits, cases = int(after.sum()), len(pairs)
    line = f"{measure.name:25s} {_rate(int(before.sum()), cases)} -> {_rate(hits, cases)}"
    reason = ""
    if better or worse:
        line += f"  {better} better, {worse} worse, p {chance:.3g}"
    if chance < policy.level:
        reason = f"{measure.name}: {worse} worse, {better} better, p {chance:.2g} < {policy.level}"
    if promise is not None:
        side = "at least" if measure.wanted else "at most"
        asked = f"{hits} of {cases}, {side} {promise.bound(cases, policy.level)} at a promised {promise.rate:g}"
        line += f"  [{side} {promise.bound(cases, policy.level)}]"
        if not promise.kept(hits, cases, policy.level):
            reason = f"{measure.name}: {asked}"
    return line, reason


def _together(pairs: Sequence[tuple[Outcome, Outcome]], policy: Policy) -> tuple[str, list[str]]:
    """Compare all lists as one by what is right and by what is wrong, which no single small list may show."""

    def right(outcome: Outcome) -> bool:
        outside = outcome["without"] or outcome["study"] == "exotics"
        return score(outcome)["unknown" if outside else "fair"]

    def wrong(outcome: Outcome) -> bool:
        judged = score(outcome)
        return judged["wrong"] or (judged["named"] and not outcome["effects"])

    lines, reasons = ["all lists together"], []
    for measure in (Measure("right", right), Measure("wrong or false alarm", wrong, wanted=False)):
        line, reason = _compare_measure(measure, None, pairs, policy)
        lines.append(f"  {line}")
        reasons += [f"all lists together: {reason}"] if reason else []
    return "\n".join(lines) + "\n\n", reasons


def _rate(hits: int, cases: int) -> str:
    rate, low, high = rate_with_interval(hits, cases)
    return f"{rate:.3f} ({low:.2f}-{high:.2f})"


def _spread(z: NDArray[np.float64]) -> str:
    if not len(z):
        return "none"
    return " ".join(f"{float(np.mean(z < width)):.3f}" for width in (1, 2, 3)) + f" of {len(z)}"


def _only(title: str, some: Mapping[tuple[str, str], Outcome], others: Mapping[tuple[str, str], Outcome]) -> str:
    """Count and name the cases that one file has alone, by study and generator; of many the first."""
    alone: dict[tuple[str, str], list[str]] = defaultdict(list)
    for (key, source), outcome in some.items():
        if (key, source) not in others:
            alone[outcome["study"], source.partition(":")[0]].append(key.rpartition("/")[2])
    lines = [f"{title}: {sum(map(len, alone.values()))}\n"]
    for (study, source), seeds in sorted(alone.items()):
        more = f" and {len(seeds) - _MOST_NAMED} more" if len(seeds) > _MOST_NAMED else ""
        lines.append(f"  {study}, {source}, {len(seeds)}: {', '.join(seeds[:_MOST_NAMED])}{more}\n")
    return "".join(lines)
