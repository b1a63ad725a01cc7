"""Pages from templates: one head for all, every text escaped."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader

from gfimu.base.errors import printable
from gfimu.visual.page.style import STILL_POLICY

__all__ = ["page_text"]


def page_text(
    template: Path, content: Mapping[str, Any], filters: Mapping[str, Callable[..., Any]] | None = None
) -> str:
    """Return an HTML page without references to anything outside it.

    Parameters
    ----------
    template : Path
        Template of the page, which extends ``page.html.j2``.
    content : mapping
        What it is filled with; ``style`` is the style sheet. A page with scripts has a ``policy`` of its own.
    filters : mapping, optional
        Functions that the template applies to texts, by name.
    """
    folders = [template.parent, Path(__file__).parent / "templates"]
    environment = Environment(loader=FileSystemLoader(folders), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= filters or {}
    return printable(environment.get_template(template.name).render({"policy": STILL_POLICY, **content}))
