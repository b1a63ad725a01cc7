"""Answers of a method: one JSON object per world, in the words of ``verdict.json``; reading, checking, schema."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from gfimu.base.errors import InputError
from sim.json_lines import read_lines, six_digits, write_lines
from sim.trials.benchmark.release import cases, find_case

__all__ = ["Answer", "CauseAnswer", "ParameterAnswer", "answer_of", "answer_schema", "read_answers", "write_answers"]


class ParameterAnswer(msgspec.Struct, frozen=True, omit_defaults=True):
    """One parameter of a cause; the key ends in its unit."""

    value: Annotated[float | str | list[str], msgspec.Meta(description="Number in the unit of the key, or names.")]
    std: Annotated[float | None, msgspec.Meta(description="Standard deviation of a number, in the same unit.")] = None


class CauseAnswer(msgspec.Struct, frozen=True, omit_defaults=True):
    """One cause: an effect of the library, or a description of one that has no name."""

    effect: Annotated[str, msgspec.Meta(description="Contract name, or unlisted for a description.")]
    parameters: Annotated[
        dict[str, ParameterAnswer], msgspec.Meta(description="Sizes and shapes by contract key, such as x_rad.")
    ] = {}
    not_distinguishable_from: Annotated[
        list[str], msgspec.Meta(description="Names of which the data can't tell this one: it is one of these.")
    ] = []
    name: Annotated[str, msgspec.Meta(description="Of an unlisted effect: the name in the wider library, if any.")] = ""
    place: Annotated[str, msgspec.Meta(description="Of an unlisted effect: where in the chain it acts.")] = ""
    dependence: Annotated[str, msgspec.Meta(description="Of an unlisted effect: what it goes with, if known.")] = ""


class Answer(msgspec.Struct, frozen=True, omit_defaults=True):
    """What a method says of one world."""

    world: Annotated[str, msgspec.Meta(description="Name of the world, such as own/test/007.")]
    verdict: Annotated[
        Literal["nothing_found", "explained", "ambiguous", "unknown", "error"],
        msgspec.Meta(
            description="nothing_found: the simulation fits. explained: by the causes. ambiguous: sets of causes that "
            "the data can't tell apart. unknown: something is there that no name fits. error: the method failed."
        ),
    ]
    causes: Annotated[list[CauseAnswer], msgspec.Meta(description="Causes; none where nothing is named.")] = []
    expected_rms_m_s2: Annotated[
        float | None,
        msgspec.Meta(description="Rms error of the channels that the method expects on a new recording, m/s²."),
    ] = None
    method: Annotated[str, msgspec.Meta(description="Name of the method.")] = ""
    processor_s: Annotated[float | None, msgspec.Meta(description="Processor time that it took, s.")] = None
    error: Annotated[str, msgspec.Meta(description="First line of an error.")] = ""


def answer_schema() -> dict[str, Any]:
    """Return the JSON schema of a line of an answers file."""
    return msgspec.json.schema(Answer)


def answer_of(found: Mapping[str, Any], where: str) -> Answer:
    """Return an answer from its JSON form, which may have further keys.

    Raises
    ------
    InputError
        If a key is missing or of another type; the message names the place.
    """
    try:
        return msgspec.convert(dict(found), Answer)
    except msgspec.ValidationError as error:
        raise InputError(f"{where}: {error}; gfimu benchmark worlds writes answer.schema.json") from None


def read_answers(path: str | Path, *, complete: bool = False) -> list[Answer]:
    """Read answers from lines of JSON, packed (``.xz``) or not.

    Parameters
    ----------
    path : str or Path
        The file.
    complete : bool
        Whether to add an error for each world of its sets and splits that the file lacks.

    Raises
    ------
    InputError
        If the file is not there, holds none, a line is no answer, or a world has two by one method.
    """
    file = Path(path)
    lines = read_lines(file, "give answers as lines of JSON (.jsonl or .jsonl.xz)")
    found = []
    for number, line in enumerate(lines, start=1):
        if line.strip():
            where = f"{file}: line {number}"
            try:
                value = msgspec.json.decode(line)
            except msgspec.DecodeError as error:
                raise InputError(f"{where}: {error}; give one JSON object per line") from None
            if not isinstance(value, dict):
                raise InputError(f"{where}: is {value!r:.40}; give one JSON object per line")
            found.append(answer_of(value, where))
    if not found:
        raise InputError(f"{file}: holds no answers; give one JSON object per line")
    (method, world), count = Counter((answer.method, answer.world) for answer in found).most_common(1)[0]
    if count > 1:
        raise InputError(f"{file}: two answers for {world} by method {method!r}; give one")
    return found + (_missing(found) if complete else [])


def _missing(answers: Sequence[Answer]) -> list[Answer]:
    """Return an error for each world without an answer, of the sets and splits that a method has answered."""
    given = {(answer.method, answer.world) for answer in answers}
    groups = {(answer.method, case.set_name, case.split) for answer in answers for case in [find_case(answer.world)]}
    return [
        Answer(case.world, "error", method=method, error="no answer")
        for method, name, split in sorted(groups)
        for case in cases(name, split)
        if (method, case.world) not in given
    ]


def write_answers(answers: Iterable[Answer], path: str | Path) -> None:
    """Write answers as lines of JSON, numbers to six digits, packed where the name ends in ``.xz``."""
    write_lines(path, (msgspec.json.encode(six_digits(msgspec.to_builtins(answer))).decode() for answer in answers))
