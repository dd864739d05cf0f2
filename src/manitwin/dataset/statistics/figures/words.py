"""Word clouds of the six attributes as SVG with real text."""

from __future__ import annotations

from xml.sax.saxutils import escape

from matplotlib import font_manager
from PIL import ImageFont
from wordcloud import WordCloud

from manitwin.dataset.statistics.query import Result
from manitwin.dataset.statistics.style import (
    BLUE,
    CYAN,
    FONT,
    GREEN,
    HALF_IN,
    PURPLE,
    RED,
    SURFACE,
    YELLOW,
    Figure,
    export_figure,
    shortened,
)

SEED = 0
_WIDTH_PT, _HEIGHT_PT = HALF_IN * 72, 2.2 * 72
_PIXELS_PER_PT, _LEAST_PIXELS, _MOST_PIXELS, _MOST_WORDS = 2, 15, 84, 100
_COLORS = (BLUE, GREEN, RED, PURPLE, CYAN, YELLOW)
_TOLD = 8
_NARROWER = 0.88
"""Width ratio of text in Helvetica and Arial, used by viewers, to DejaVu Sans, used for the layout."""


def word_cloud(result: Result, attribute: str) -> Figure | None:
    """Draw the terms of an attribute, sized by the number of twins; None if there are none.

    The ``wordcloud`` library computes the layout with seed ``SEED``; all words are horizontal.
    """
    counts: dict[str, int] = {}
    for row in result.rows[:_MOST_WORDS]:  # of terms with equal shortened text, the most frequent counts
        counts.setdefault(shortened(row["term"], 32), row["twins"])
    counts.pop("", None)
    if not counts:
        return None
    width, height = int(_WIDTH_PT * _PIXELS_PER_PT), int(_HEIGHT_PT * _PIXELS_PER_PT)
    words = _place_words(counts, width, height)
    name = f"words_{attribute}"
    told = ", ".join(f"{term} {count}" for term, count in list(counts.items())[:_TOLD])
    alt = f"Word cloud of {attribute}, {len(words)} terms. Most frequent: {told}."
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_WIDTH_PT}pt" height="{_HEIGHT_PT}pt" '
        f'viewBox="0 0 {width} {height}">\n<rect width="100%" height="100%" style="fill: {SURFACE}"/>\n'
        + "\n".join(words)
        + "\n</svg>\n"
    )
    return export_figure(svg, name, f"Words of {attribute}.", alt, result)


def _place_words(counts: dict[str, int], width: int, height: int) -> list[str]:
    """Return SVG text elements for the words, most frequent first, centred in ``width`` x ``height`` pixels."""
    font_file = font_manager.findfont("DejaVu Sans")
    cloud = WordCloud(
        font_path=font_file, width=width, height=height, margin=6, prefer_horizontal=1.0,
        random_state=SEED, min_font_size=_LEAST_PIXELS, max_font_size=_MOST_PIXELS, max_words=_MOST_WORDS,
        color_func=lambda *args, **kwargs: "",
    )  # fmt: skip
    cloud.generate_from_frequencies(counts)
    words = []
    for (word, _), size, (top, left), _, _ in cloud.layout_:
        font = ImageFont.truetype(font_file, size)
        ink = font.getbbox(word, anchor="ls")  # the library draws without font offsets: the ink begins at (left, top)
        words.append((word, size, left + (ink[2] - ink[0]) / 2, top - ink[1], font.getlength(word), ink))
    down = (height - min(b + ink[1] for *_, b, _, ink in words) - max(b + ink[3] for *_, b, _, ink in words)) / 2
    right = (width - min(x - n / 2 for *_, x, _, n, _ in words) - max(x + n / 2 for *_, x, _, n, _ in words)) / 2
    return [
        f'<text x="{middle + right:.1f}" y="{baseline + down:.1f}" text-anchor="middle" '
        f'textLength="{length * _NARROWER:.1f}" lengthAdjust="spacingAndGlyphs" '
        f'style="font: {size}px {FONT}; fill: {_COLORS[rank % len(_COLORS)]}">{escape(word)}</text>'
        for rank, (word, size, middle, baseline, length, _) in enumerate(words)
    ]
