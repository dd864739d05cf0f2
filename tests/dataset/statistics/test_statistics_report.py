"""The report as a page: its numbers again, its bytes again, and nothing in it that could break it."""

from __future__ import annotations

import html
import json
import math
import re
import time
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.dom import minidom

import duckdb
import pyarrow as pa
import pytest
from synthetic_index import synthetic_tables

from manitwin.dataset.index.near_duplicates import NearDuplicates, NearPair
from manitwin.dataset.statistics.page import FIGURES, NUMBERS, REPORT
from manitwin.dataset.statistics.query import ReportTables
from manitwin.dataset.statistics.report import NO_TWIN, write_report

NAMES = (
    *("$x^2$", "<script>alert(1)</script>", "& \"quoted\" 'single'", "茶杯", 'id="x" #4477aa', "line\nbreak\x07bell"),
    *("very " * 40 + "long", "back\\slash_{sub}", "--></svg>", "   ", "${mass} {0} %s", "'DejaVu Sans'"),
)


def written(out: Path, tables: dict[str, pa.Table], **more: Any) -> str:
    write_report(ReportTables(tables), out, title="Statistics of a set", **more)
    return (out / REPORT).read_text()


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report")
    written(out, synthetic_tables(120, 40))
    return out


def same(one: Any, other: Any) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-12)
    return bool(one == other)


def test_every_number_is_found_again_by_its_sql_alone(report: Path) -> None:
    numbers = json.loads((report / NUMBERS).read_text())
    plain = duckdb.connect()  # as a reader has it: many threads, another order of rows
    for name, table in synthetic_tables(120, 40).items():
        plain.register(name, table)
    plain.execute(numbers["prelude"])
    assert len(numbers["queries"]) > 40
    for name, query in numbers["queries"].items():
        rows = plain.sql(query["sql"]).to_arrow_table().to_pylist()
        assert len(rows) == len(query["rows"]), name
        for row, kept in zip(rows, query["rows"], strict=True):
            assert set(row) == set(kept) and all(same(row[key], kept[key]) for key in row), (name, row, kept)


def test_every_table_and_figure_shows_the_sql_of_its_numbers(report: Path) -> None:
    page = (report / REPORT).read_text()
    numbers = json.loads((report / NUMBERS).read_text())
    shown = {html.unescape(sql) for sql in re.findall(r"</summary><pre><code>(.*?)</code></pre>", page, re.DOTALL)}
    assert {query["sql"] for query in numbers["queries"].values() if query["rows"]} <= shown
    assert html.escape(numbers["prelude"]) in page


def test_cells_are_the_numbers_of_the_queries(report: Path) -> None:
    numbers = json.loads((report / NUMBERS).read_text())["queries"]
    table = re.search(r'<table id="table-success_by_stage">.*?</table>', (report / REPORT).read_text(), re.DOTALL)
    assert table
    rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in re.findall(r"<tr>(.*?)</tr>", table[0])][1:]
    for cells, row in zip(rows, numbers["success_by_stage"]["rows"], strict=True):
        share, low, high = (f"{100 * row[key]:.1f}" for key in ("passed_share", "low", "high"))
        interval = f'{share} % <span class="interval">[{low}, {high}]</span>'
        assert cells == [row["stage"], str(row["entered"]), str(row["passed"]), str(row["rejected"]), interval]


def test_same_rows_give_the_same_bytes(report: Path, tmp_path: Path) -> None:
    tables = synthetic_tables(120, 40)
    reversed_rows = {name: table.take(pa.array(range(len(table))[::-1])) for name, table in tables.items()}
    written(tmp_path, reversed_rows)
    files = sorted(path.relative_to(report) for path in report.rglob("*") if path.is_file())
    assert files == sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file())
    assert len(files) == 21
    assert [name for name in files if (report / name).read_bytes() != (tmp_path / name).read_bytes()] == []


def test_page_asks_for_nothing_from_outside_and_needs_no_script(report: Path) -> None:
    page = (report / REPORT).read_text()
    assert not re.search(r"<(script|link|img|iframe|object|embed|base|form)\b", page)
    assert not re.search(r"@import|url\((?!#)|\bsrc=|\bon\w+=", page)
    assert set(re.findall(r'href="([^"]*)"', page)) == set(re.findall(r'href="(#[^"]*)"', page))


def test_links_and_references_lead_to_one_element_each(report: Path) -> None:
    page = (report / REPORT).read_text()
    ids = re.findall(r'<[^<>]*\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids)) > 100
    named = {name for names in re.findall(r'aria-labelledby="([^"]+)"', page) for name in names.split()}
    assert set(re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', page)) and named <= set(ids)
    assert {one or other for one, other in re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', page)} <= set(ids)


def test_who_cannot_see_gets_every_figure_in_words_and_tables_with_headings(report: Path) -> None:
    page = (report / REPORT).read_text()
    figures = re.findall(r"<figure .*?</figure>", page, re.DOTALL)
    assert len(figures) == len(list((report / FIGURES).glob("*.svg"))) == 19
    for figure in figures:
        said = re.search(r"<desc [^>]*>(.+?)</desc>", figure)
        assert said and len(said[1]) > 30 and 'role="img"' in figure and "<figcaption>" in figure
    for table in re.findall(r"<table.*?</table>", page, re.DOTALL):
        assert "<caption>" in table and '<th scope="col"' in table and '<th scope="row"' in table


def test_figures_stand_alone_and_follow_light_and_dark_in_the_page(report: Path) -> None:
    for path in (report / FIGURES).glob("*.svg"):
        svg = path.read_text()
        assert "var(" not in svg and minidom.parseString(svg).documentElement.tagName == "svg"
        assert not re.search(r"<dc:|<metadata|20\d\d-\d\d-\d\d", svg)
    drawn = " ".join(re.findall(r"<svg .*?</svg>", (report / REPORT).read_text(), re.DOTALL))
    assert "fill: var(--blue)" in drawn and not re.search(r"(fill|stroke): #", drawn), (
        "all are the style sheet's colours"
    )


def test_words_of_a_cloud_do_not_lie_on_each_other(report: Path) -> None:
    pattern = r'<text x="([\d.]+)" y="([\d.]+)" [^>]*textLength="([\d.]+)"[^>]*font: (\d+)px'
    for path in (report / FIGURES).glob("words_*.svg"):
        boxes = [
            (x - length / 2, y - 0.5 * size, x + length / 2, y)  # x-height, which all words have
            for x, y, length, size in (map(float, found) for found in re.findall(pattern, path.read_text()))
        ]
        assert len(boxes) >= 4
        width, height = map(float, re.findall(r'viewBox="0 0 (\d+) (\d+)"', path.read_text())[0])
        assert all(left >= 0 and top >= 0 and right <= width and bottom <= height for left, top, right, bottom in boxes)
        for number, one in enumerate(boxes):
            for other in boxes[:number]:
                apart = one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]
                assert apart, path.name


class Words(HTMLParser):
    """Collect what a reader sees of a page, and its tags."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.seen: list[str] = []
        self.tags: set[str] = set()

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.tags.add(tag)

    def handle_data(self, data: str) -> None:
        self.seen.append(data)


def test_names_from_outside_are_shown_as_they_are_and_change_nothing(tmp_path: Path) -> None:
    page = written(tmp_path, synthetic_tables(200, 5, category_names=NAMES))
    reader = Words()
    reader.feed(page)
    assert "script" not in reader.tags
    for name in ("$x^2$", "<script>alert(1)</script>", "& \"quoted\" 'single'", "茶杯", 'id="x" #4477aa', "--></svg>"):
        assert name in reader.seen, "in the table of categories"
        assert name in [node.firstChild.data for node in text_nodes(tmp_path / FIGURES / "categories.svg")]
    assert "line break bell" in reader.seen
    for path in (tmp_path / FIGURES).glob("*.svg"):
        minidom.parseString(path.read_text())


def text_nodes(path: Path) -> list[Any]:
    return [node for node in minidom.parseString(path.read_text()).getElementsByTagName("text") if node.firstChild]


@pytest.mark.parametrize("accepted, rejected, figures", [(0, 0, 0), (0, 7, 2), (1, 0, 18), (1, 1, 19)])
def test_small_sets_give_a_sensible_report(tmp_path: Path, accepted: int, rejected: int, figures: int) -> None:
    page = written(tmp_path, synthetic_tables(accepted, rejected))
    assert len(list((tmp_path / FIGURES).glob("*.svg"))) == page.count("<figure ") == figures
    assert (NO_TWIN in page) == (accepted == 0)
    cells = re.findall(r"<td[^>]*>(.*?)</td>", page)
    assert not {"nan", "inf", "None", ""} & set(cells)
    items = (
        f"{accepted + rejected} items: {accepted} accepted, {rejected} rejected."
        if accepted + rejected
        else "No item has ended"
    )
    assert items in page


def test_figures_of_an_earlier_report_do_not_stay(tmp_path: Path) -> None:
    written(tmp_path, synthetic_tables(3, 0))
    (tmp_path / FIGURES / "my_own.svg").write_text("<svg/>")
    written(tmp_path, synthetic_tables(0, 3))
    assert {path.stem for path in (tmp_path / FIGURES).iterdir()} == {"success_by_stage", "rejections", "my_own"}


def test_near_duplicates_are_listed_the_nearest_first_with_the_call_that_finds_them(tmp_path: Path) -> None:
    pairs = [NearPair("aaaa", f"b{number:03d}", 0.001 * number, 1.01) for number in range(1, 60)]
    page = written(tmp_path, synthetic_tables(3, 0), duplicates=NearDuplicates({}, pairs))
    assert "59 pairs of 60 twins" in page and "The 40 nearest." in page and "near_duplicates(Index(DATASET))" in page
    kept = json.loads((tmp_path / NUMBERS).read_text())["near_duplicates"]
    assert (kept["pairs"], kept["twins"]) == (59, 60)
    assert kept["nearest"][0] == {"first": "aaaa", "second": "b001", "shape_distance": 0.001, "size_ratio": 1.01}


@pytest.mark.slow
def test_users_settings_of_matplotlib_change_nothing(report: Path, tmp_path: Path) -> None:
    import matplotlib

    with matplotlib.rc_context({"font.size": 30, "svg.fonttype": "path", "axes.facecolor": "pink", "axes.grid": True}):
        written(tmp_path, synthetic_tables(120, 40))
    assert (tmp_path / REPORT).read_bytes() == (report / REPORT).read_bytes()


@pytest.mark.slow
def test_hundred_thousand_twins_take_less_than_a_minute(tmp_path: Path) -> None:
    names = tuple(f"category {number}" for number in range(502)) + NAMES
    tables = ReportTables(synthetic_tables(100_000, 40_000, category_names=names))
    start = time.process_time()
    write_report(tables, tmp_path, title="Statistics of a large set")
    assert time.process_time() - start < 60
    assert (tmp_path / REPORT).stat().st_size < 2e6
