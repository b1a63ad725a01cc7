"""What an HTML page with plots that zoom has to hold besides its own text: scripts, style, data."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gfimu.visual.page.packed import Packed
from gfimu.visual.page.style import STILL_POLICY

__all__ = ["page_plots"]

_HERE = Path(__file__).parent
_SCRIPTS = ("uplot/uPlot.iife.min.js", "plots.js")
_STYLES = ("uplot/uPlot.min.css", "plots.css")


def page_plots(plots: Mapping[str, Any], data: Packed) -> Mapping[str, Any]:
    """Return what the template of a page puts into it.

    Parameters
    ----------
    plots : mapping
        What to draw, for JSON: see ``plots.js``. Columns are named by their numbers in ``data``.
    data : Packed
        The columns.

    Returns
    -------
    mapping
        ``scripts``, ``style`` and ``licence`` (of uPlot), texts; ``plots``, JSON safe inside a page; ``data``, base64;
        ``policy``, the Content-Security-Policy under which these scripts run, no other does, and nothing is loaded.
    """
    scripts = [(_HERE / name).read_text(encoding="utf-8") for name in _SCRIPTS]
    text = json.dumps({**plots, "columns": data.columns}, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    hashes = " ".join(f"'sha256-{_sha256(script)}'" for script in scripts)
    return {
        "scripts": scripts,
        "style": "\n".join((_HERE / name).read_text(encoding="utf-8") for name in _STYLES),
        "licence": (_HERE / "uplot" / "LICENSE").read_text(encoding="utf-8"),
        "plots": text.replace("<", "\\u003c"),
        "data": data.text(),
        "policy": f"{STILL_POLICY}; script-src {hashes}",
    }


def _sha256(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
