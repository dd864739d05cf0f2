"""The base of all recipes: a folder is written afresh, its record last, and read again as what the recipe would make."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from manitwin.engine.folder_recipe import FolderRecipe, FolderRecord
from manitwin.engine.recipe import Ending
from manitwin.engine.stage import Draft
from manitwin.engine.task import Payload
from manitwin.errors import ManiTwinError, NewerVersion, Rejected


@dataclass(frozen=True)
class Word(Payload):
    word: str

    @property
    def title(self) -> str:
        return self.word


class WordRecord(FolderRecord):
    letters: int


@dataclass(frozen=True)
class Words(FolderRecipe[WordRecord]):
    payload = Word
    record = "word.json"
    record_type = WordRecord
    can_reject = False

    sha256: str = "one"

    def folder_of(self, item_id: str) -> str:
        return f"words/{item_id}"

    def write(self, draft: Draft[Word], *given: Any) -> WordRecord:
        fresh = given[-1]
        (fresh / "word.txt").write_text(draft.payload.word)
        return self.write_record(fresh, {"letters": len(draft.payload.word)}, decided_by=draft.payload.word)

    def ending(self, record: WordRecord) -> Ending:
        return Ending("accepted", record.revision, None, f"{record.letters} letters")


def made(fresh: Path, word: str, recipe: Words | None = None) -> Ending:
    return (recipe or Words()).finish(Draft("id", Word(word), 0), "word", {}, None, "spell", fresh)


def test_a_folder_is_written_afresh_and_says_how_it_ended(tmp_path: Path) -> None:
    fresh = tmp_path / "new" / "folder"
    fresh.mkdir(parents=True)
    (fresh / "left.txt").write_text("of an attempt that was cut off")
    ending = made(fresh, "mug")
    assert sorted(path.name for path in fresh.iterdir()) == ["word.json", "word.txt"]
    assert ending.detail == "3 letters"
    assert Words().ending_of((fresh / "word.json").read_bytes()) == ending


def test_a_revision_is_of_all_that_decides_the_folder(tmp_path: Path) -> None:
    first = made(tmp_path / "a", "mug")
    assert made(tmp_path / "b", "mug") == first
    assert made(tmp_path / "c", "cup").revision != first.revision, "as many letters, another word"
    assert made(tmp_path / "d", "mug", Words("two")).revision != first.revision


@pytest.mark.parametrize("record", [b"{", b"{}", b'{"config_sha256": "one", "revision": "r", "letters": 3, "more": 1}'])
def test_a_record_that_cannot_be_read_is_of_no_use(record: bytes) -> None:
    assert Words().ending_of(record) is None


def test_a_folder_of_another_recipe_is_made_again(tmp_path: Path) -> None:
    made(tmp_path / "a", "mug")
    assert Words("two").ending_of((tmp_path / "a" / "word.json").read_bytes()) is None


def test_a_rejection_is_an_error_where_a_recipe_knows_none(tmp_path: Path) -> None:
    with pytest.raises(ManiTwinError, match=r"word id: .*cannot be rejected"):
        Words().finish(Draft("id", Word("mug"), 0), "word", {}, Rejected("poor_quality", "so"), "spell", tmp_path / "a")
    assert not (tmp_path / "a").exists()


def test_a_record_of_a_newer_version_is_not_taken_for_one_to_be_made_again() -> None:
    with pytest.raises(NewerVersion, match=r"word.json: of schema 2, this version reads up to 1"):
        Words().ending_of(b'{"schema_version": 2, "letters": 3, "sounds": 2}')
    for damaged in (b'{"schema_version": 1, "sounds": 2}', b"[1]", b"{", b"[" * 100_000):
        assert Words().ending_of(damaged) is None
