"""The command line: one thin file per command group; each command parses, calls one library function, prints."""

from __future__ import annotations

import os

# Small products on few cores collapse with several BLAS threads; a user's own setting wins.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

from gfimu.cli.app import main

__all__ = ["main"]
