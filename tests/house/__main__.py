"""``python -m tests.house [write]``: print the figures beside their limits, or lower the limits and write the page."""

from __future__ import annotations

import sys

from .figures import figures
from .limits import LIMITS, write_limits
from .page import PAGE, page


def main() -> int:
    """Print the figures, or store them; exit code 1 if one is above its limit."""
    found = figures()
    for name, value in found.items():
        limit = LIMITS.get(name, value)
        print(f"{value:7d}  {name}" + (f"  {value - limit:+d}" if value != limit else ""))
    if sys.argv[1:] == ["write"]:
        write_limits(found)
        PAGE.write_text(page(), encoding="utf-8")
    return int(any(value > LIMITS.get(name, value) for name, value in found.items()))


if __name__ == "__main__":
    sys.exit(main())
