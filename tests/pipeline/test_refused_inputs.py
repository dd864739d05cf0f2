"""Everything that is wrong with a list is said at once, and nothing of it is begun."""

from pathlib import Path

import pytest

from input_items import collect_items
from manitwin.errors import UsageError
from manitwin.pipeline.item import Item
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.pipeline.refused_inputs import MOST, ROWS_NAMED, TOLD, RefusedInputs


def no_unicorns(item: Item) -> str | None:
    return "no unicorns; draw a horse" if "unicorn" in (item.text or "") else None


def test_every_row_that_cannot_be_used_is_named_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cup.glb").write_bytes(b"x")
    manifest = Path("list.csv")
    rows = [
        "file,text,units",
        "cup.glb,,m",
        ",a unicorn,",
        "gone.glb,,",
        "cup.glb,,furlong",
        ",a mug,",
        ",,",
        ",two unicorns,",
    ]
    manifest.write_text("\n".join(rows) + "\n")
    with pytest.raises(UsageError) as raised:
        list(iterate_items([manifest], {}, Notes(), refusal=no_unicorns))
    first, others = str(raised.value).split(". 4 more cannot be used: ")
    assert first == f"{manifest}:3: no unicorns; draw a horse"
    told = others.split("; ")
    assert [line.removeprefix(f"{manifest}:")[0] for line in told] == ["4", "5", "7", "8"]
    assert "gone.glb is not found" in told[0] and "furlong" in told[1] and told[3].endswith("no unicorns")


def test_one_that_is_wrong_is_told_as_ever(tmp_path: Path) -> None:
    manifest = tmp_path / "list.csv"
    manifest.write_text("text\na unicorn\na mug\n")
    with pytest.raises(UsageError) as raised:
        list(iterate_items([manifest], {}, Notes(), refusal=no_unicorns))
    assert str(raised.value) == f"{manifest}:2: no unicorns; draw a horse"


def test_texts_behind_each_other_are_told_together() -> None:
    texts = ["a unicorn", "a mug", "a pink unicorn"]
    with pytest.raises(UsageError, match=r"1 more cannot be used: --text: no unicorns$"):
        list(iterate_items([], {}, Notes(), texts, refusal=no_unicorns))


def test_a_manifest_behind_a_wrong_one_is_read_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.csv", "b.csv"):
        Path(name).write_text("file\nnone.obj\n")
    with pytest.raises(UsageError, match=r"a.csv:2: .*1 more cannot be used: .*b.csv:2: "):
        collect_items([Path("a.csv"), Path("b.csv")])


def test_a_group_that_contradicts_itself_is_told_with_the_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("front.jpg", "side.jpg"):
        Path(name).write_bytes(b"x")
    rows = ["file,name,group", "gone.glb,,", "front.jpg,mug,1", "side.jpg,spoon,1"]
    Path("list.csv").write_text("\n".join(rows) + "\n")
    with pytest.raises(
        UsageError, match=r"^list.csv:2: .*gone.glb is not found.* 1 more cannot be used: list.csv: group '1'"
    ):
        list(iterate_items([Path("list.csv")], {}, Notes()))


def test_of_very_many_the_rest_are_told_by_their_rows() -> None:
    refused = RefusedInputs()
    for row in range(2, 2 + 1 + TOLD + ROWS_NAMED + 5):
        with refused.noted():
            raise UsageError(f"list.csv:{row}: no such thing; give another")
    with pytest.raises(UsageError) as raised:
        refused.tell()
    said = str(raised.value)
    assert f"{TOLD + ROWS_NAMED + 5} more cannot be used" in said and "give another. " in said
    assert said.count("no such thing") == 1 + TOLD and f"and {ROWS_NAMED + 5} more in rows 11, 12, " in said
    assert said.endswith(", 210, ...") and len(said) < 3000


def test_a_list_of_nothing_else_is_not_read_to_its_end(tmp_path: Path) -> None:
    read = []

    def refusal(item: Item) -> str | None:
        read.append(item)
        return "none of these"

    texts = [f"thing {number}" for number in range(3 * MOST)]
    with pytest.raises(UsageError, match=rf"{MOST - 1} more cannot be used: .*; the inputs after them were not read$"):
        list(iterate_items([], {}, Notes(), texts, refusal=refusal))
    assert len(read) == MOST
    manifest = tmp_path / "list.csv"
    manifest.write_text("text\n" + "".join(f"{text}\n" for text in texts))
    with pytest.raises(UsageError) as raised:
        list(iterate_items([manifest], {}, Notes(), refusal=refusal))
    assert str(raised.value).count("cannot be used") == 1 and len(read) == 2 * MOST


def test_other_errors_are_not_kept() -> None:
    refused = RefusedInputs()
    with pytest.raises(ValueError, match="a defect"), refused.noted():
        raise ValueError("a defect")
    refused.tell()
