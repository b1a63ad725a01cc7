"""Modules of Python that are run in a process of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

__all__ = ["environment", "run_module"]


@contextmanager
def environment(**variables: str) -> Iterator[None]:
    """Give processes that start meanwhile variables that this one lacks, and no imports from the current folder.

    Python begins a process of `multiprocessing` with imports from there, before it learns where its parent imports
    from; the folder may hold files of strangers.
    """
    added = {name: value for name, value in variables.items() | {("PYTHONSAFEPATH", "1")} if name not in os.environ}
    os.environ.update(added)
    try:
        yield
    finally:
        for name in added:
            os.environ.pop(name, None)


def run_module(module: str, *arguments: str, **settings: Any) -> subprocess.CompletedProcess[Any]:
    """Run a module and wait for its end; it imports from where this process does.

    ``python -m`` alone would import from the current folder first, which may hold files of strangers.

    Parameters
    ----------
    module : str
        Name of the module.
    *arguments : str
        Its arguments.
    **settings
        Further arguments of `subprocess.run`.
    """
    variables = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-P", "-m", module, *arguments]
    return subprocess.run(command, capture_output=True, check=False, env=variables, **settings)
