"""A catalogue has each input once, says why what is not there is not, and is the same after the same was added again."""

from __future__ import annotations

import json
import os
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from hostile_schemas import ENDLESS
from json_documents import check_keys
from manitwin.dataset.collect.facts import BANDS, GROUP_OF_DOMAIN, GROUPS, size_band_of
from manitwin.dataset.collect.intake import DefaultValues, IntakeSummary, add_inputs
from manitwin.dataset.collect.status import catalogue_status
from manitwin.dataset.collect.store import Catalogue
from manitwin.errors import UsageError
from manitwin.models.annotators.priors import load_priors

MINE = DefaultValues(source="mine", licence="CC0-1.0")


@pytest.fixture
def photos(tmp_path: Path) -> Path:
    folder = tmp_path / "photos"
    folder.mkdir()
    for name in ("claw_hammer-02.png", "mug.jpg", "same_mug.jpg", "thing.png"):
        (folder / name).write_bytes(name.removeprefix("same_").encode())
    return folder


def rows(catalogue: Path, columns: str = "*") -> list[tuple[object, ...]]:
    with closing(sqlite3.connect(catalogue)) as connection:
        return connection.execute(f"SELECT {columns} FROM inputs ORDER BY number").fetchall()


def listed(folder: Path, *said: object, name: str = "list.jsonl") -> Path:
    path = folder / name
    path.write_text("".join(f"{each if isinstance(each, str) else json.dumps(each)}\n" for each in said))
    return path


def causes(done: IntakeSummary) -> dict[str, int]:
    return {each.cause.split(";")[0]: each.count for each in done.refused}


def test_a_folder_gives_a_row_a_file_with_what_its_name_says(photos: Path, tmp_path: Path) -> None:
    done = add_inputs(tmp_path / "c.db", photos, MINE)
    assert (done.new, done.entries, done.refused) == (4, 4, [])
    found = rows(tmp_path / "c.db", "place, category, grp, size_source, size_band, status, duplicate_of, licence")
    assert [(Path(str(place)).name, *rest) for place, *rest in found] == [
        ("claw_hammer-02.png", "hammer", "tools", "prior:hammer", "20 to 37 cm", "ready", None, "CC0-1.0"),
        ("mug.jpg", "mug", "kitchen", "prior:mug", "10 to 20 cm", "ready", None, "CC0-1.0"),
        ("same_mug.jpg", "unknown", "unknown", None, "unknown", "duplicate", 2, "CC0-1.0"),
        ("thing.png", "unknown", "unknown", None, "unknown", "ready", None, "CC0-1.0"),
    ]


def test_the_same_again_changes_nothing_and_a_changed_file_is_read_again(photos: Path, tmp_path: Path) -> None:
    catalogue = tmp_path / "c.db"
    add_inputs(catalogue, photos, MINE)
    before = rows(catalogue)
    assert (again := add_inputs(catalogue, photos, MINE)).unchanged == 4 and again.new == again.changed == 0
    assert rows(catalogue) == before
    (photos / "mug.jpg").write_bytes(b"another")
    os.utime(photos / "mug.jpg", (1, 1))
    assert add_inputs(catalogue, photos, MINE).changed == 1
    assert rows(catalogue, "status, duplicate_of") == [("ready", None)] * 4  # the second of two is one by itself now


def test_an_interrupted_intake_goes_on_and_ends_in_the_same_rows(
    photos: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("manitwin.dataset.collect.intake.BATCH", 2)
    put, calls = Catalogue.put, []

    def stopped(self: Catalogue, rows_: object) -> None:
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        put(self, rows_)  # type: ignore[arg-type]

    monkeypatch.setattr(Catalogue, "put", stopped)
    with pytest.raises(KeyboardInterrupt):
        add_inputs(tmp_path / "cut.db", photos, MINE)
    assert len(rows(tmp_path / "cut.db")) == 2
    add_inputs(tmp_path / "cut.db", photos, MINE)
    add_inputs(tmp_path / "whole.db", photos, MINE)
    assert rows(tmp_path / "cut.db") == rows(tmp_path / "whole.db")


def test_every_row_of_a_list_is_a_row_or_a_counted_cause(photos: Path, tmp_path: Path) -> None:
    (tmp_path / "secret.png").write_bytes(b"x")
    (photos / "out.png").symlink_to(tmp_path / "secret.png")
    os.mkfifo(photos / "pipe.png")
    (photos / "empty.png").touch()
    said = listed(
        photos,
        {"file": "mug.jpg", "category": "mug", "licence": "CC-BY-4.0", "size_m": 0.1, "source": "shop"},
        {"url": "https://example.org/a.png", "name": "mug"},
        {"url": "https://user:secret@example.org/a.png"},
        {"url": "file:///etc/passwd"},
        {"file": "mug.jpg"},
        {"file": "none.png"},
        {"file": "pipe.png"},
        {"file": "empty.png"},
        {"file": "out.png"},
        {"file": "../secret.png"},
        {"file": "notes.txt"},
        {"name": "mug"},
        {"file": "thing.png", "size_m": "9" * 10_000},
        '{"file": "thing.png", "size_m": ' + "9" * 10_000 + "}",
        {"file": "thing.png", "size_m": -1},
        {"file": "thing.png", "name": "a\x1b[31m"},
        "{broken",
        "[1]",
        '{"file": "caf\\udce9.png"}',
    )
    done = add_inputs(tmp_path / "c.db", said, DefaultValues(source="list"))
    assert (done.new, done.repeated, done.entries) == (7, 1, 19)
    assert sum(done.unreadable.values()) == 5
    assert {cause.split(",")[0].split(";")[0] for cause in done.unreadable} == {
        "cannot be opened (No such file or directory)",
        "is a named pipe",
        "is empty",
        "leads outside its folder",
    }
    assert sum(causes(done).values()) == 11
    status = catalogue_status(tmp_path / "c.db")
    assert status.rows == 7 and status.licence_known == 1 and status.refused == done.refused
    assert status.counts["status"] == {"ready": 1, "listed": 1, "duplicate": 0, "unreadable": 5}
    assert status.counts["source"] == {"list": 6, "shop": 1}
    assert status.counts["size_band"]["10 to 20 cm"] >= 1


def test_what_a_list_leaves_open_stays_as_it_was_said(photos: Path, tmp_path: Path) -> None:
    add_inputs(tmp_path / "c.db", listed(photos, {"file": "thing.png", "name": "mug", "size_m": 0.3}), MINE)
    add_inputs(tmp_path / "c.db", photos, DefaultValues(source="again"))
    found = rows(tmp_path / "c.db", "category, size_m, size_source, licence, source")
    assert found[0] == ("mug", 0.3, "given", "CC0-1.0", "again")


def test_licences_get_their_spdx_names_wherever_they_are_said(photos: Path, tmp_path: Path) -> None:
    said = listed(
        photos,
        {"file": "mug.jpg", "license": "CC BY 4.0"},
        {"file": "thing.png", "license": "by our agreement"},
        {"url": "https://example.org/a.png"},
    )
    add_inputs(tmp_path / "c.db", said, DefaultValues(source="mine", licence="CC0"))
    found = sorted(rows(tmp_path / "c.db", "licence"))
    assert found == [("CC-BY-4.0",), ("CC0-1.0",), ("by our agreement",)]


def test_a_broken_list_adds_nothing(photos: Path, tmp_path: Path) -> None:
    bad = photos / "list.csv"
    bad.write_text('file,name\nmug.jpg,mug\nthing.png,"no end\n')
    with pytest.raises(UsageError, match="not CSV"):
        add_inputs(tmp_path / "c.db", bad, MINE)
    assert not (tmp_path / "c.db").exists()


@pytest.mark.parametrize("own", ENDLESS)
def test_a_catalogue_with_a_schema_of_its_own_is_refused_before_it_is_asked(
    own: str, photos: Path, tmp_path: Path
) -> None:
    path = tmp_path / "c.db"
    add_inputs(path, photos, MINE)
    with closing(sqlite3.connect(path)) as changed:
        changed.executescript(own.replace("$NAME", "refused"))
    with pytest.raises(UsageError, match="do not match those of a catalogue"):
        catalogue_status(path)


@pytest.mark.parametrize("kind", ["text", "pipe", "foreign"])
def test_what_is_no_catalogue_is_refused_and_left_as_it_is(kind: str, photos: Path, tmp_path: Path) -> None:
    path = tmp_path / "c.db"
    if kind == "text":
        path.write_text("no catalogue at all, and long enough to be read as a header" * 20)
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        with closing(sqlite3.connect(path)) as connection:
            connection.execute("CREATE TABLE inputs (place)")
    before = path.read_bytes() if path.is_file() else None
    for use in (lambda: add_inputs(path, photos, MINE), lambda: catalogue_status(path)):
        with pytest.raises(UsageError):
            use()
    assert before is None or path.read_bytes() == before


def test_every_domain_of_the_priors_has_a_group_and_every_size_a_band() -> None:
    assert {prior.domain for prior in load_priors().values()} - set(GROUP_OF_DOMAIN) == {"general"}
    assert set(GROUP_OF_DOMAIN.values()) == set(GROUPS)
    sizes = (0.019, 0.02, 0.05, 0.051, 0.1, 0.2, 0.37, 0.371, None)
    assert [BANDS.index(size_band_of(size)) for size in sizes] == [0, 1, 1, 2, 2, 3, 4, 5, 6]


def test_status_is_the_document_that_the_page_describes(photos: Path, tmp_path: Path) -> None:
    add_inputs(tmp_path / "c.db", listed(photos, {"file": "mug.jpg", "name": "mug"}, {"file": "none.png"}, {}), MINE)
    document = catalogue_status(tmp_path / "c.db").document()
    check_keys(document, "collect status")
    assert (document["rows"], document["by_status"]["unreadable"], document["refused"][0]["count"]) == (2, 1, 1)
