"""Work that is quicker for the cases of a batch at once than one by one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

from sim.trials.sweep.design import Case

__all__ = ["BatchWork", "prepared"]

_Work = Callable[[Case], Mapping[str, Any]]


@runtime_checkable
class BatchWork(Protocol):
    """What a case does, for the cases of a batch at once; the results must not depend on which cases are together."""

    def __call__(self, case: Case) -> Mapping[str, Any]:
        """Return the results of one case."""
        ...

    def prepared(self, cases: Sequence[Case]) -> _Work:
        """Run the cases and return what gives the results of each, or raises what made it fail."""
        ...


def prepared(work: _Work, cases: Sequence[Case]) -> _Work:
    """Return what gives the results of each of these cases: of a `BatchWork` they are run at once, now."""
    if not isinstance(work, BatchWork):
        return work
    try:
        return work.prepared(cases)
    except Exception as error:  # noqa: BLE001 - becomes the failure of each case, not of the campaign
        return _Failed(error)


class _Failed:
    """Gives each case the error that the batch had."""

    def __init__(self, error: Exception) -> None:
        self._error = error

    def __call__(self, case: Case) -> Mapping[str, Any]:
        raise self._error
