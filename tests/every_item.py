"""Tests of a rule that every item of a list has to keep: one test, which lists the items that break it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable


def every(names: str, items: Iterable) -> Callable:
    """Check a rule on every item within one test, in place of a test for each.

    Parameters
    ----------
    names : str
        Argument of the rule that takes an item; several, separated by commas, take the members of a tuple. The other
        arguments are fixtures, which all items share.
    items : iterable
        Items that have to keep the rule.
    """
    keys = [name.strip() for name in names.split(",")]
    listed = list(items)

    def decorate(rule: Callable) -> Callable:
        signature = inspect.signature(rule)

        def test(**fixtures):
            assert listed, "no item to check"
            broken = []
            for item in listed:
                values = item if len(keys) > 1 else (item,)
                try:
                    rule(**dict(zip(keys, values, strict=True)), **fixtures)
                except Exception as error:  # noqa: BLE001 - what one item breaks must not hide the others
                    text = str(error).splitlines() or [""]
                    broken.append(f"{item}: {type(error).__name__}: {text[0]}")
            assert not broken, f"{len(broken)} of {len(listed)} break the rule:\n" + "\n".join(broken)

        others = [parameter for name, parameter in signature.parameters.items() if name not in keys]
        test.__signature__ = signature.replace(parameters=others)
        for attribute in ("__name__", "__qualname__", "__module__", "__doc__"):
            setattr(test, attribute, getattr(rule, attribute))
        test.pytestmark = getattr(rule, "pytestmark", [])
        return test

    return decorate
