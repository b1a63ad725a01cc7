"""The style that all HTML pages share: colours by day and by night, letters, cards, tables, paper."""

from __future__ import annotations

from pathlib import Path

from gfimu.base.results.colours import PAGE, TONES, chip_colour, css

__all__ = ["STILL_POLICY", "page_basics", "page_style"]

STILL_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""Content-Security-Policy of a page without scripts: nothing runs and nothing is loaded."""


def page_style(chips: int = 0) -> str:
    """Return the style sheet of a page: the colours as variables, then the rules of ``page.css``.

    Parameters
    ----------
    chips : int
        Chips that have a colour of their own, ``--chip-0`` and so on.
    """
    tones = " ".join(f".{tone} {{ --tone: var(--{tone}); }}" for tone in TONES)
    return f"{page_basics(chips)}\n{tones}\n{_rules('page.css')}"


def page_basics(chips: int = 0) -> str:
    """Return what a page with rules of its own shares with the others: colours as variables, and tables that scroll.

    The colours are those of the day and of the night; paper is light. Parameters as of `page_style`.
    """
    light, dark = (_variables(theme, chips) for theme in ("light", "dark"))
    return f"{light}\n@media screen and (prefers-color-scheme: dark) {{ {dark} }}\n{_rules('basics.css')}"


def _rules(name: str) -> str:
    return (Path(__file__).parent / name).read_text(encoding="utf-8")


def _variables(theme: str, chips: int) -> str:
    colours = {name: css(colour) for name, colour in PAGE[theme].items()}
    colours |= {f"chip-{index}": css(chip_colour(index, on_paper=theme == "light")) for index in range(chips)}
    return f":root {{ {' '.join(f'--{name}: {colour};' for name, colour in colours.items())} }}"
