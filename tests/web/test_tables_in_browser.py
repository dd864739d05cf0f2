"""Tables of the pages in a real Chromium: no word and no number of theirs is broken, and no report is wider than a telephone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from served_view import serving

from manitwin.dataset.report_page import Section, Table
from manitwin.dataset.report_page import page as report_page

pytestmark = [pytest.mark.slow, pytest.mark.browser]
Visitor = Callable[..., Any]
BROKEN = r"""() => {
  const broken = [];
  for (const cell of document.querySelectorAll("td, tbody th")) {
    const texts = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT);
    while (texts.nextNode()) {
      for (const word of texts.currentNode.textContent.matchAll(/(?<![\p{L}\p{N}.])[\p{L}\p{N}.]{2,12}(?![\p{L}\p{N}.])/gu)) {
        const range = document.createRange();
        range.setStart(texts.currentNode, word.index);
        range.setEnd(texts.currentNode, word.index + word[0].length);
        if (new Set([...range.getClientRects()].map((each) => Math.round(each.top))).size > 1) broken.push(word[0]);
      }
    }
  }
  return broken;
}"""
"""Words and numbers of at most twelve characters that stand on two lines; digests may."""


@pytest.mark.parametrize("width", [390, 1280])
def test_no_word_and_no_number_of_a_twin_is_broken(
    viewed: tuple[Path, list[str]], visitor: Visitor, width: int
) -> None:
    with serving(viewed[0]) as server:
        page = visitor(viewport={"width": width, "height": 844})
        page.goto(server.link)
        for twin_id in viewed[1][1:3]:
            page.goto(f"{server.address}/twin/{twin_id}")
            assert page.evaluate(BROKEN) == []
            if width == 1280:
                over = "[...document.querySelectorAll('.scroll')].filter((each) => each.scrollWidth > each.clientWidth)"
                assert page.evaluate(f"{over}.map((each) => each.innerText)") == [], "all columns are in sight"


def test_a_report_fits_a_telephone_and_its_texts_are_read_from_the_left(visitor: Visitor, tmp_path: Path) -> None:
    rows = [
        ("FIL001 unreadable", 5, "-1.5 %", "Ship the file beside the asset, as written."),
        ("x" * 40, 2372.4, "–", ""),
    ]
    path = "/a/very/long/path/of/an_asset_that_is_nowhere_broken_by_a_blank/0123456789.urdf"
    table = Table("Findings", ("rule", "assets", "share", "what to do"), rows)
    (tmp_path / "report.html").write_bytes(report_page("Report", ["What it is."], [Section(path, [table])]))
    page = visitor(viewport={"width": 390, "height": 844})
    page.goto((tmp_path / "report.html").as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert "2,372" in page.inner_text("table"), "no 2.37e+03"
    aligned = "[...document.querySelectorAll('thead th')].map((each) => getComputedStyle(each).textAlign)"
    assert page.evaluate(aligned) == ["left", "right", "right", "left"]
    cells = "[...document.querySelectorAll('tbody td')].map((each) => getComputedStyle(each).textAlign)"
    assert page.evaluate(cells) == ["right", "right", "left"] * 2
