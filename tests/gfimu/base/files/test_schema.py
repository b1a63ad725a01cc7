"""A table is read by its schema: every mistake is one line with file, table, key, value and remedy."""

from typing import Annotated, Literal

import msgspec
import pytest

from gfimu import InputError
from gfimu.base.files.schema import NotNegative, Positive, Table, Triple, about, read


class Round(Table, frozen=True, tag_field="kind", tag="round"):
    """A disc."""

    radius_m: Annotated[Positive, about("Radius.", "m", example=0.1)]


class Square(Table, frozen=True, tag_field="kind", tag="square"):
    """A plate."""

    side_m: Annotated[Positive, about("Side.", "m")] = 1.0


class Hole(Table, frozen=True):
    """A hole."""

    at_m: Annotated[Triple, about("Centre.", "m", example=[0, 0, 1])]
    count: Annotated[Annotated[int, msgspec.Meta(ge=1)] | None, about("How many.")] = None


class Plate(Table, frozen=True):
    """A plate with holes."""

    hole: Annotated[Annotated[tuple[Hole, ...], msgspec.Meta(min_length=1)], about("Holes.")]
    name: Annotated[str, about("Name.")] = ""
    shape: Annotated[Round | Square, about("Shape.")] = Square()
    part: Annotated[tuple[Round | Square, ...], about("Parts.")] = ()
    heavy: Annotated[bool, about("Whether it is heavy.")] = False
    finish: Annotated[Literal["raw", "polished"], about("Surface.")] = "raw"
    mass_kg: Annotated[NotNegative | None, about("Mass.", "kg", default="unknown")] = None
    direction: Annotated[str | Triple, about("Direction.")] = "x"
    notes: Annotated[list[str], about("Notes.")] = msgspec.field(default_factory=list)


class Loose(Table, frozen=True, forbid_unknown_fields=False):
    """A table with notes of its author."""

    length_of_arm_m: Annotated[Positive, about("Length.", "m")] = 1.0


HOLE = {"at_m": [0, 0, 1]}


def test_numbers_become_floats_and_missing_keys_their_defaults():
    plate = read({"hole": [HOLE], "mass_kg": 2, "shape": {"side_m": 3}}, Plate, "p.toml")
    assert plate.hole[0].at_m == (0.0, 0.0, 1.0)
    assert isinstance(plate.mass_kg, float)
    assert plate.shape == Square(3.0)  # the kind of the default where the table does not say it
    assert read({"hole": [HOLE], "shape": {"kind": "round", "radius_m": 1}}, Plate, "p.toml").shape == Round(1.0)


MISTAKES = {
    "no table": ([1], "must be a table of keys and values, not [1]"),
    "missing list of tables": ({}, "no [[hole]] table; add at least one"),
    "empty list of tables": ({"hole": []}, "no [[hole]] table; add at least one"),
    "table for a list of tables": ({"hole": HOLE}, "hole = {'at_m': [0, 0, 1]} must be an array of tables: [[hole]]"),
    "number in a list of tables": (
        {"hole": [HOLE, 3]},
        "hole = [{'at_m': [0, 0, 1]}, 3] must be an array of tables: [[hole]]",
    ),
    "missing key": ({"hole": [HOLE, {}]}, "[[hole]] 2: key 'at_m' is missing; add it, such as at_m = [0, 0, 1]"),
    "unknown key": (
        {"mas_kg": 1},
        (
            "unknown key 'mas_kg'; valid: direction, finish, heavy, hole, mass_kg, name, notes, part, shape; "
            "did you mean 'mass_kg'?"
        ),
    ),
    "unknown key like none": ({"hole": [HOLE | {"xyz": 1}]}, "[[hole]] 1: unknown key 'xyz'; valid: at_m, count"),
    "list too short": ({"hole": [{"at_m": [1, 2]}]}, "[[hole]] 1: at_m = [1, 2] must be a list of 3 finite numbers"),
    "text in a list": (
        {"hole": [{"at_m": [1, 2, "z"]}]},
        "[[hole]] 1: at_m = [1, 2, 'z'] must be a list of 3 finite numbers",
    ),
    "NaN in a list": (
        {"hole": [{"at_m": [1, 2, float("nan")]}]},
        "[[hole]] 1: at_m = [1, 2, nan] must be a list of 3 finite numbers",
    ),
    "infinite": ({"mass_kg": float("inf")}, "mass_kg = inf must be a finite number"),
    "below the bound": ({"mass_kg": -1}, "mass_kg = -1 must be at least 0"),
    "text for a number": ({"mass_kg": "1"}, "mass_kg = '1' must be a finite number"),
    "true for a number": ({"mass_kg": True}, "mass_kg = True must be a finite number"),
    "not whole": ({"hole": [HOLE | {"count": 1.5}]}, "[[hole]] 1: count = 1.5 must be a whole number of at least 1"),
    "whole below the bound": (
        {"hole": [HOLE | {"count": 0}]},
        "[[hole]] 1: count = 0 must be a whole number of at least 1",
    ),
    "not true or false": ({"heavy": 1}, "heavy = 1 must be true or false"),
    "number for a text": ({"name": 3}, "name = 3 must be a string"),
    "no such word": ({"finish": "polish"}, "finish = 'polish' must be one of polished, raw; did you mean 'polished'?"),
    "either of two": ({"direction": 3}, "direction = 3 must be a string or a list of 3 finite numbers"),
    "no such kind": ({"shape": {"kind": "oval"}}, "[shape]: kind = 'oval' must be one of round, square"),
    "missing key of a kind": (
        {"shape": {"kind": "round"}},
        "[shape]: key 'radius_m' is missing; add it, such as radius_m = 0.1",
    ),
    "key of another kind": ({"shape": {"radius_m": 1}}, "[shape]: unknown key 'radius_m'; valid: kind, side_m"),
    "number for a table": ({"shape": 3}, "shape = 3 must be a table: [shape]"),
    "missing kind": ({"part": [{}]}, "[[part]] 1: key 'kind' is missing; add it, one of round, square"),
    "number in texts": ({"notes": ["a", 1]}, "notes = ['a', 1] must be a list of strings"),
    "long value": ({"heavy": "x" * 200}, f"heavy = '{'x' * 57} … must be true or false"),
}


@pytest.mark.parametrize(("change", "message"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_named_with_its_place_and_remedy(change, message):
    data = {"hole": [HOLE]} | change if isinstance(change, dict) and change else change
    with pytest.raises(InputError) as error:
        read(data, Plate, "p.toml")
    assert str(error.value) == f"p.toml: {message}"


def test_a_table_with_notes_takes_any_key_but_a_misspelt_one():
    assert read({"length_of_arm_m": 2, "drawn_by": "me", "colour": 3}, Loose, "a.toml") == Loose(2.0)
    with pytest.raises(InputError, match=r"a\.toml: unknown key 'lenght_of_arm_m'; did you mean 'length_of_arm_m'\?"):
        read({"lenght_of_arm_m": 2}, Loose, "a.toml")
