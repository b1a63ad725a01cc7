"""``python -m tests.golden check|write|list [NAME …]``: compare the calls with what is stored, or store them anew."""

from __future__ import annotations

import argparse
import fnmatch
import sys
import tempfile
import time
from pathlib import Path

from .calls import CALLS, EXPECTED
from .golden import check, write


def main() -> int:
    """Check, write or list calls; exit code 1 if a checked one differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.golden", description=__doc__)
    parser.add_argument("action", choices=["check", "write", "list"])
    parser.add_argument("names", nargs="*", default=["*"], help="calls, with * and ?; all by default")
    given = parser.parse_args()
    names = [name for name in CALLS if any(fnmatch.fnmatch(name, one) for one in given.names)]
    if strange := [one for one in given.names if not fnmatch.filter(CALLS, one)]:
        parser.error(f"no call is named {', '.join(strange)}; see list")
    if given.action == "list":
        print("\n".join(f"{name} ({CALLS[name].tolerance}): {'; '.join(CALLS[name].lines)}" for name in names))
        return 0
    moved = 0
    for name in names:
        start = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            found = (write if given.action == "write" else check)(CALLS[name], Path(folder))
        moved += bool(found)
        print(f"{name}: {len(found)} differences, {time.perf_counter() - start:.1f} s", *found, sep="\n  ", flush=True)
    if given.action == "write" and given.names == ["*"]:
        for file in set(EXPECTED.iterdir()) - {call.expected for call in CALLS.values()}:
            file.unlink()
    print(f"{len(names)} calls, {moved} {'written' if given.action == 'write' else 'differ'}")
    return int(bool(moved) and given.action == "check")


if __name__ == "__main__":
    sys.exit(main())
