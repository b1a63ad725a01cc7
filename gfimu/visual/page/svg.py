"""Figures of matplotlib as SVG inside a page: small, with the page's colours, and no name taken twice."""

from __future__ import annotations

import base64
import io
import re
import warnings
import zlib

from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from gfimu.base.results.colours import INK, NOISE_ON_PAPER, PAGE, chip_colour, css

__all__ = ["GRID", "ON_PAGE", "svg_text", "themed"]

GRID = "#ededed"
"""Of the lines behind a plot."""
_DPI = 110
ON_PAGE = {
    "font.family": "sans-serif",
    "font.size": 10,
    "svg.fonttype": "none",
    "svg.hashsalt": "gfimu",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": css(NOISE_ON_PAPER),
    "axes.labelcolor": css(INK),
    "text.color": css(INK),
    "xtick.color": css(INK),
    "ytick.color": css(INK),
    "legend.frameon": False,
    "grid.color": GRID,
    "axes.grid": False,  # whatever style the caller has set
}
"""Settings of matplotlib (rcParams) under which a figure for a page is drawn."""


def svg_text(figure: Figure, dpi: int | None = None) -> str:
    """Return a figure as the text of an SVG element that takes the width of what it stands in.

    Parameters
    ----------
    figure : Figure
        Drawn under `ON_PAGE`.
    dpi : int, optional
        Dots per inch of pictures inside it, which dense lines are.
    """
    for text in figure.findobj(Text):
        if isinstance(text, Text) and text.get_text():  # written by now: no tick label, which may be a formula
            text.set_parse_math(False)  # a name may hold a dollar sign
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")  # letters are text, for which the browser has a font
        return _drawn(figure, dpi or _DPI)


def _drawn(figure: Figure, dpi: int) -> str:
    buffer = io.StringIO()
    if layout := figure.get_layout_engine():  # laid out here, as a figure that is saved with a layout is drawn twice
        FigureCanvasSVG(figure)
        figure.set_dpi(72)  # points per inch, in which SVG is laid out
        layout.execute(figure)
        figure.set_layout_engine(None)
    figure.savefig(buffer, format="svg", dpi=dpi, metadata={"Date": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, count=1, flags=re.DOTALL)
    text = re.sub(r'(<image\b[^>]*?) id="[^"]*"', r"\1", text)  # equal pictures would share one name
    text = re.sub(r"(?<=base64,)[^\"]+", lambda match: _few_colours(match.group()), text)
    text = _shortened(text)
    # Several figures share one page: their definitions must not share names; the size follows the page.
    tag = f"f{zlib.crc32(text.encode()):08x}"
    text = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{tag}_", text)
    return re.sub(r"<svg [^>]*>", lambda match: re.sub(r' (width|height)="[^"]*"', "", match.group(0)), text, count=1)


def _shortened(svg: str) -> str:
    """Return a figure without comments, without names that nothing refers to, and with two decimals of a point."""
    svg = re.sub(r"<!--.*?-->", "", svg, flags=re.DOTALL)
    used = set(re.findall(r'(?:url\(|href=")#([^)"]+)', svg))
    svg = re.sub(r' id="([^"]+)"', lambda match: match[0] if match[1] in used else "", svg)
    svg = re.sub(r"<defs>\s*<style[^>]*>.*?</style>\s*</defs>", "", svg, flags=re.DOTALL)
    svg = re.sub(r"(?<=[ \"(,-])\d+\.\d{3,}", lambda match: f"{float(match[0]):.2f}".rstrip("0").rstrip("."), svg)
    return re.sub(r"\s*\n\s*", " ", svg)


def _few_colours(picture: str) -> str:
    """Return a PNG picture in base64 with at most 64 colours, which is a third as long."""
    image = Image.open(io.BytesIO(base64.b64decode(picture))).convert("RGBA")
    buffer = io.BytesIO()
    image.quantize(64, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(buffer, "png", optimize=True)
    return base64.b64encode(buffer.getvalue()).decode("ascii")


def themed(svg: str, chips: int) -> str:
    """Return a figure whose colours are those of the page, by day and by night, in place of fixed ones."""
    names = {
        css(PAGE["light"][name]): name for name in ("card", "ink", "noise", "band", "before", "after", "spin-axis")
    }
    names[GRID] = "line"
    names |= {css(chip_colour(index, on_paper=True)): f"chip-{index}" for index in range(chips)}
    return re.sub(r"#[0-9a-f]{6}\b", lambda match: f"var(--{names[match[0]]})" if match[0] in names else match[0], svg)
