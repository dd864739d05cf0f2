"""Rows of manifests and names of files that nobody means: refused in one line, or built under what can be shown of them."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from manitwin.engine.ledger.ledger import Ledger
from manitwin.errors import UsageError
from manitwin.pipeline.item import Item
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.pipeline.manifest_item import LONGEST

BOX = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def items(path: Path, **defaults: str | None) -> list[Item]:
    return list(iterate_items([path], defaults, Notes()))


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    path = tmp_path / "box.obj"
    path.write_text(BOX)
    return path


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("name", "x" * 201),
        ("name", "a\nb"),
        ("name", "a\x1b[31m"),
        ("name", "\u202ebox"),
        ("name", "a\x00b"),
        ("name", "\ud800x"),
        ("name", "a\x9bb"),
        ("license", "CC0\n---"),
        ("license", "x" * 10_000),
        ("attribution", "a\x1b]0;t\x07"),
        ("attribution", "x" * 10_000),
    ],
    ids=lambda value: ascii(value)[:20],
)
def test_words_that_are_none_are_refused_from_manifests_and_from_calls(
    column: str, value: str, mesh: Path, tmp_path: Path
) -> None:
    manifest = tmp_path / "list.jsonl"
    manifest.write_text(json.dumps({"file": str(mesh), column: value}) + "\n")
    for given, defaults in ((manifest, {}), (mesh, {column: value})):
        with pytest.raises(UsageError, match=rf"{column}: |JSON is broken") as found:
            items(given, **defaults)
        said = str(found.value)
        assert len(said.splitlines()) == 1 and len(said) < 500 and said.isprintable()


@pytest.mark.parametrize(
    "name", ["mug", "красная кружка", "マグカップ", "mug (2)", "x" * LONGEST["name"], "می\u200cخواهم", "[red]mug"]
)
def test_names_of_any_language_are_taken(name: str, mesh: Path) -> None:
    assert [item.name for item in items(mesh, name=name)] == [name]


@pytest.mark.parametrize(
    "file", ["a\0b.obj", "a" * 5000 + ".obj", "a/" * 3000 + "b.obj", "\ud800.obj", "/dev/zero", "~", "-", "n" * 300]
)
def test_files_that_are_none_are_refused_with_the_line(file: str, tmp_path: Path) -> None:
    manifest = tmp_path / "list.jsonl"
    manifest.write_text(json.dumps({"file": file}) + "\n")
    with pytest.raises(UsageError, match=r"list\.jsonl:1: ") as found:
        items(manifest)
    assert len(str(found.value)) < 700 and len(str(found.value).splitlines()) == 1


def test_files_whose_names_are_not_utf8_are_items_that_a_ledger_can_keep(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    for name in (b"caf\xe9.obj", b"\xff\xfe.obj", "a\x1b[31m\u202e\n.obj".encode()):
        Path(os.fsdecode(os.path.join(os.fsencode(folder), name))).write_text(BOX)
    found = items(folder)
    assert len(found) == 3
    for item in found:
        kept = json.dumps(item.to_json())
        kept.encode("ascii")
        assert Item.from_json(json.loads(kept)) == item
        assert item.file is not None and Path(item.file).read_text() == BOX


@pytest.mark.parametrize("kind", ["pipe", "device", "loop"])
def test_manifests_that_are_no_files_are_refused_without_waiting(kind: str, tmp_path: Path) -> None:
    manifest = tmp_path / "list.csv"
    if kind == "pipe":
        os.mkfifo(manifest)
    else:
        manifest.symlink_to({"device": "/dev/zero", "loop": "list.csv"}[kind])
    with pytest.raises(UsageError, match=r"list\.csv"):
        items(manifest)


def test_ledger_keeps_names_that_are_not_utf8(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "ledger.sqlite")
    item = Item(file=os.fsdecode(b"/caf\xe9.obj"))
    ledger.add_items([item])
    assert Item.from_json(ledger.payload(1)) == item
    ledger.close()
