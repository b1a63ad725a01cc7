"""The decorator that checks a rule on every item within one test."""

import pytest
from every_item import every


def test_it_names_the_items_that_break_the_rule_and_goes_on_after_the_first():
    @every("number", [2, 3, 4, 5])
    def even(number):
        assert number % 2 == 0

    with pytest.raises(AssertionError, match=r"(?s)2 of 4 break the rule.*3: Assert.*5: Assert"):
        even()


def test_an_exception_is_a_broken_rule_and_an_empty_list_no_success():
    @every("left, right", [(1, 0), (0, 1)])
    def divided(left, right):
        assert left / right == 0

    with pytest.raises(AssertionError, match=r"1 of 2 break the rule:\n\(1, 0\): ZeroDivisionError"):
        divided()

    @every("name", ())
    def never(name):
        del name

    with pytest.raises(AssertionError, match="no item"):
        never()


@every("name", ["a", "b"])
def test_fixtures_are_given_to_the_rule(name, tmp_path):
    (tmp_path / name).write_text(name)
    assert (tmp_path / name).exists()
