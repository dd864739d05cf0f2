"""Style of figures: one palette, one font size, and byte-reproducible SVG."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal
from xml.sax.saxutils import escape

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from manitwin.dataset.statistics.query import Result
from manitwin.formats.markdown import one_line

VARIABLES = {
    "#1f2328": "ink",
    "#59626c": "muted",
    "#d9dde2": "grid",
    "#ffffff": "surface",
    "#4477aa": "blue",
    "#dd5566": "red",
    "#228833": "green",
    "#b89b1f": "yellow",
    "#aa3377": "purple",
    "#3399bb": "cyan",
    "#8d959e": "grey",
}
"""Style sheet variables by colour; in the page, colours follow the light or dark theme.

After Paul Tol's bright scheme (Colour Schemes, SRON/EPS/TN/09-002), which is colour-blind safe; yellow, cyan and grey are darker,
so that text in them is readable on white.
"""
INK, MUTED, GRID, SURFACE, BLUE, RED, GREEN, YELLOW, PURPLE, CYAN, GREY = VARIABLES

FONT = "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif"
FULL_IN, HALF_IN = 7.6, 3.7
"""Figure widths in inches: of the page column, and of half of it."""

_RC: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
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
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
    "svg.fonttype": "none",  # text stays text: it can be searched, read aloud, and shown in any script
    "svg.hashsalt": "manitwin",
    "text.parse_math": False,  # a dollar sign in a category is literal
}


@dataclass(frozen=True)
class Figure:
    """A figure: ``svg`` is self-contained, ``alt`` describes it in words, ``queries`` name the sources of its numbers."""

    name: str
    caption: str
    alt: str
    queries: tuple[str, ...]
    svg: str


@contextmanager
def report_style() -> Iterator[None]:
    """Apply the report's style, independent of the user's matplotlib settings."""
    with matplotlib.rc_context(), warnings.catch_warnings():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_RC)
        # Text stays text: for glyphs missing in this font, only the widths are estimated.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        yield


def canvas(width_in: float, height_in: float, columns: int = 1) -> tuple[Canvas, list[Axes]]:
    """Return an empty figure with one row of axes."""
    figure = Canvas(figsize=(width_in, height_in))
    FigureCanvasSVG(figure)
    return figure, list(figure.subplots(1, columns, squeeze=False)[0])


def row_canvas(labels: Sequence[str], row_in: float = 0.22, frame_in: float = 0.75) -> tuple[Canvas, Axes]:
    """Return an empty figure with one row per label, the first on top."""
    figure, (axis,) = canvas(FULL_IN, frame_in + row_in * max(len(labels), 2))
    axis.set_yticks(range(len(labels)), labels)
    axis.set_ylim(len(labels) - 0.4, -0.6)
    axis.tick_params(axis="y", length=0)
    return figure, axis


def export_figure(figure: Canvas | str, name: str, caption: str, alt: str, *results: Result) -> Figure:
    """Return a figure of results from a drawn canvas or SVG, without XML prologue and dates.

    Ids are made unique, the report's font is set, and a text description is added.
    """
    svg = figure if isinstance(figure, str) else _svg(figure)
    body = re.sub(r"<metadata>.*?</metadata>\s*", "", svg[svg.index("<svg") :], flags=re.DOTALL)

    def own(tag: str) -> str:
        tag = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{name}-", tag)
        return tag.replace("'DejaVu Sans'", FONT)

    body = _map_tags(body, own)
    opening = body.index(">") + 1
    svg = (
        f'<svg role="img" aria-labelledby="{name}-title {name}-description" {body[len("<svg ") : opening]}\n'
        f'<title id="{name}-title">{escape(name.replace("_", " "))}</title>'
        f'<desc id="{name}-description">{escape(one_line(alt))}</desc>{body[opening:]}'
    )
    return Figure(name, caption, alt, tuple(result.query.name for result in results), svg)


def _svg(figure: Canvas) -> str:
    stream = io.StringIO()
    figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    return stream.getvalue()


def themed_svg(svg: str) -> str:
    """Return SVG with its colours replaced by the page's CSS variables."""

    def variables(tag: str) -> str:
        for color, name in VARIABLES.items():
            tag = tag.replace(f": {color}", f": var(--{name})")
        return tag

    return _map_tags(svg, variables)


def _map_tags(svg: str, change: Callable[[str], str]) -> str:
    """Apply ``change`` to the tags only; the text between them is data."""
    return re.sub(r"<[a-z][^<>]*>", lambda tag: change(tag[0]), svg)


def shortened(words: str, most: int = 36) -> str:
    """Return a text on one line, shortened to fit beside an axis."""
    line = one_line(words)
    return line if len(line) <= most else line[: most - 1].rstrip() + "…"


def plain_number(value: float) -> str:
    """Return a number as an axis label: 0.05, 2, 1,500."""
    return f"{value:,.0f}" if value >= 10 else f"{value:.4g}"


def label_bar(axis: Axes, end: float, row: float, words: str) -> None:
    """Write a text beside the end of a horizontal bar."""
    axis.annotate(words, (end, row), (3, 0), textcoords="offset points", va="center")


def legend_above(axis: Axes, columns: int, **more: Any) -> None:
    """Place the legend above an axis, left-aligned."""
    axis.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=columns, borderaxespad=0.2, **more)


def count_axis(axis: Axes, which: Literal["x", "y"], label: str) -> None:
    """Format an axis for counts: integers from 0, with a grid."""
    chosen = axis.xaxis if which == "x" else axis.yaxis
    chosen.set_major_locator(MaxNLocator(integer=True, nbins=6))
    chosen.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    chosen.set_label_text(label)
    axis.grid(axis=which)
    (axis.set_xlim if which == "x" else axis.set_ylim)(0, None)


def logarithmic_axis(axis: Axes, which: str, label: str) -> None:
    """Make an axis logarithmic, with plain tick labels as dense as its range allows."""
    (axis.set_xscale if which == "x" else axis.set_yscale)("log")
    chosen = axis.xaxis if which == "x" else axis.yaxis
    low, high = axis.get_xlim() if which == "x" else axis.get_ylim()
    subs = (1.0, 2.0, 3.0, 5.0, 7.0) if high / low < 12 else (1.0, 2.0, 5.0) if high / low < 300 else (1.0,)
    chosen.set_major_locator(LogLocator(subs=subs, numticks=20))
    chosen.set_major_formatter(FuncFormatter(lambda value, _: plain_number(value)))
    chosen.set_minor_formatter(NullFormatter())
    chosen.set_label_text(label)
