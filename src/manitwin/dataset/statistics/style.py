"""The look of figures: one palette, one type size, and SVG that is the same bytes every time."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import escape

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

INK, MUTED, GRID, SURFACE = "#1f2328", "#59626c", "#d9dde2", "#ffffff"
BLUE, RED, GREEN, YELLOW, PURPLE, CYAN, GREY = (
    "#4477aa",
    "#dd5566",
    "#228833",
    "#b89b1f",
    "#aa3377",
    "#3399bb",
    "#8d959e",
)
"""After Paul Tol's bright scheme (Colour Schemes, SRON/EPS/TN/09-002), told apart by the colour-blind; yellow, cyan and grey
darker, so that words in them can be read on white."""

VARIABLES = {
    INK: "ink",
    MUTED: "muted",
    GRID: "grid",
    SURFACE: "surface",
    BLUE: "blue",
    RED: "red",
    GREEN: "green",
    YELLOW: "yellow",
    PURPLE: "purple",
    CYAN: "cyan",
    GREY: "grey",
}
"""The style sheet's variables: in the page, colours follow light and dark."""

FONT = "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif"
FULL_IN, HALF_IN = 7.6, 3.7
"""Widths of figures, inch: of the page's column, and of half of it."""
_PER_INCH = 72

_RC: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.fontsize": 9,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.facecolor": SURFACE,
    "figure.facecolor": SURFACE,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.linewidth": 0.8,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
    "svg.fonttype": "none",  # words stay words: they can be searched, read aloud, and shown in any script the reader has
    "svg.hashsalt": "manitwin",
    "text.parse_math": False,  # a dollar sign in a category is a dollar sign
}


@dataclass(frozen=True)
class Figure:
    """A figure: ``svg`` stands alone; ``alt`` says in words what it shows; ``queries`` name where its numbers are."""

    name: str
    caption: str
    alt: str
    queries: tuple[str, ...]
    svg: str
    half: bool = False


@contextmanager
def drawing() -> Iterator[None]:
    """Draw in the report's style, whatever the reader's matplotlib settings are."""
    with matplotlib.rc_context(), warnings.catch_warnings():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_RC)
        # words stay words: only their widths are guessed where this font lacks a letter
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        yield


def canvas(width_in: float, height_in: float, columns: int = 1) -> tuple[Canvas, list[Axes]]:
    """Return an empty figure with one row of axes."""
    figure = Canvas(figsize=(width_in, height_in))
    FigureCanvasSVG(figure)
    return figure, list(figure.subplots(1, columns, squeeze=False)[0])


def to_svg(figure: Canvas, name: str, alt: str) -> str:
    """Return a drawn figure as SVG with its alternative text, ids that no other figure has, and no dates."""
    stream = io.StringIO()
    figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    return finished(stream.getvalue(), name, alt)


def finished(svg: str, name: str, alt: str) -> str:
    """Return SVG without its prologue, with own ids, the report's font and a description for who cannot see it."""
    body = re.sub(r"<metadata>.*?</metadata>\s*", "", svg[svg.index("<svg") :], flags=re.DOTALL)

    def own(tag: str) -> str:
        tag = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{name}-", tag)
        return tag.replace("'DejaVu Sans'", FONT)

    body = _in_tags(body, own)
    opening = body.index(">") + 1
    return (
        f'<svg role="img" aria-labelledby="{name}-title {name}-description" {body[len("<svg ") : opening]}\n'
        f'<title id="{name}-title">{escape(name.replace("_", " "))}</title>'
        f'<desc id="{name}-description">{escape(printable(alt))}</desc>{body[opening:]}'
    )


def for_page(svg: str) -> str:
    """Return SVG whose colours are the page's variables."""

    def variables(tag: str) -> str:
        for color, name in VARIABLES.items():
            tag = tag.replace(f": {color}", f": var(--{name})")
        return tag

    return _in_tags(svg, variables)


def _in_tags(svg: str, change: Callable[[str], str]) -> str:
    """Change tags alone: words between them are other people's."""
    return re.sub(r"<[a-z][^<>]*>", lambda tag: change(tag[0]), svg)


def printable(words: str) -> str:
    """Return words on one line without control characters, which SVG cannot hold."""
    return " ".join("".join(c if c.isprintable() else " " for c in words).split())


def shortened(words: str, most: int = 36) -> str:
    """Return words that fit beside an axis, on one line."""
    line = printable(words)
    return line if len(line) <= most else line[: most - 1].rstrip() + "…"


def plain_number(value: float) -> str:
    """Return a number as on an axis: 0.05, 2, 1,500."""
    return f"{value:,.0f}" if value >= 10 else f"{value:.4g}"


def count_axis(axis: Axes, which: str, label: str) -> None:
    """Make an axis one of whole numbers from 0, with a grid."""
    chosen = axis.xaxis if which == "x" else axis.yaxis
    chosen.set_major_locator(MaxNLocator(integer=True, nbins=6))
    chosen.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    chosen.set_label_text(label)
    axis.grid(axis="x" if which == "x" else "y")
    (axis.set_xlim if which == "x" else axis.set_ylim)(0, None)


def logarithmic_axis(axis: Axes, which: str, label: str) -> None:
    """Make an axis logarithmic, its ticks as close as its length allows and written plainly."""
    (axis.set_xscale if which == "x" else axis.set_yscale)("log")
    chosen = axis.xaxis if which == "x" else axis.yaxis
    low, high = axis.get_xlim() if which == "x" else axis.get_ylim()
    subs = (1.0, 2.0, 3.0, 5.0, 7.0) if high / low < 12 else (1.0, 2.0, 5.0) if high / low < 300 else (1.0,)
    chosen.set_major_locator(LogLocator(subs=subs, numticks=20))
    chosen.set_major_formatter(FuncFormatter(lambda value, _: plain_number(value)))
    chosen.set_minor_formatter(NullFormatter())
    chosen.set_label_text(label)


def size_pt(width_in: float, height_in: float) -> tuple[float, float]:
    """Return a size in points, the unit of SVG's user space in all figures."""
    return width_in * _PER_INCH, height_in * _PER_INCH
