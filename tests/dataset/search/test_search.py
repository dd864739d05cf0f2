"""Search of a small data set: by words, by a served model, by pictures, and what is kept for the next time."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from manitwin.cli.main import app
from manitwin.config import ServicesConfig
from manitwin.dataset.index.query import Index
from manitwin.dataset.index.rebuild import rebuild
from manitwin.dataset.search import appearance_vectors as drawing
from manitwin.dataset.search.appearance_vectors import SPACE, load_appearance_vectors
from manitwin.dataset.search.question import words
from manitwin.dataset.search.search import search_picture, search_words, text_vectors
from manitwin.dataset.search.vector_store import FOLDER, StoredVectors, VectorStore
from manitwin.dataset.search.words import rank_by_words, text_fields, unknown_words
from manitwin.errors import UsageError
from manitwin.models.embedders.texts import text_embedder
from manitwin.render.cameras import framing_camera
from manitwin.render.renderer import shared_renderer
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD, write_twin_record
from scene_twins import can, slab, write_thing
from tiny_clip import write_tiny_clip


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> DatasetRoot:
    folder = tmp_path_factory.mktemp("set")
    for number, thing in enumerate((can(), slab("knife", 0.22, 0.02, 0.01, 0.08), slab("box", 0.12, 0.08, 0.06))):
        write_thing(folder, number, thing)
    _say(folder, 2, color="dark blue (80 %), white (20 %)", caption="A dark blue box.")
    rebuild(DatasetRoot(folder), jobs=1)
    return DatasetRoot(folder)


def _say(folder: Path, number: int, **words: str) -> None:
    from twin_folders import twin_id

    twin = folder / twin_name(twin_id(number))
    record = json.loads((twin / RECORD).read_bytes())
    record["language"] |= words
    del record["revision"], record["files"]
    write_twin_record(twin, record)


def revisions(root: DatasetRoot) -> dict[str, str]:
    assert root.local is not None
    return {each: Twin(root.local / root.twin_name(each)).record.revision for each in root.twin_ids()}


def test_words_find_what_the_thing_is_before_its_color(root: DatasetRoot) -> None:
    found = search_words(root, "some BLUE boxes", limit=5)
    assert found[0].category == "box" and found[0].matched == {
        "blue": ["caption", "color"],
        "box": ["aliases", "caption", "category"],
    }
    assert search_words(root, "tin", limit=5)[0].category == "can", "an alias of the priors"
    assert search_words(root, "xylophone", limit=5) == []
    assert len(search_words(root, "can knife box", limit=2)) == 2
    with pytest.raises(UsageError, match="no word"):
        search_words(root, "of the ...", limit=5)


def test_scores_are_those_of_bm25_by_hand() -> None:
    texts = [text_fields({"category": word}) | {"aliases": ""} for word in ("xa", "xb", "xb")]
    hits = rank_by_words("xa xb", texts)
    assert [hit.place for hit in hits] == [0, 1, 2]
    # one field of its mean length: weight 6, k1 1.2; rarities log(1 + 2.5/1.5) and log(1 + 1.5/2.5)
    assert hits[0].score == pytest.approx(np.log(1 + 2.5 / 1.5) * 6 * 2.2 / 7.2)
    assert hits[1].score == hits[2].score == pytest.approx(np.log(1 + 1.5 / 2.5) * 6 * 2.2 / 7.2)


SHELF = [
    {"category": "mug", "color": "red", "material": "ceramic", "function": "holding hot drinks"},
    {"category": "mug", "color": "blue", "material": "ceramic", "function": "holding hot drinks"},
    {"category": "mug", "color": "red", "material": "plastic", "function": "holding hot drinks"},
    {"category": "apple", "color": "green", "function": "eating raw or cooking"},
    {"category": "wine glass", "color": "white", "material": "glass", "function": "drinking wine"},
    {"category": "hourglass", "color": "black", "material": "plastic and glass", "function": "measuring time"},
    {"category": "magnifying glass", "color": "black", "material": "glass", "function": "looking at small things"},
    {"category": "hammer", "color": "yellow", "material": "wood and steel", "function": "driving nails"},
]
LONGEST_M = [0.09, 0.10, 0.15, 0.08, 0.21, 0.13, 0.17, 0.30]


def on_the_shelf(question: str) -> list[int]:
    """The places of what is found, the best first."""
    return [hit.place for hit in rank_by_words(question, [text_fields(each) for each in SHELF], LONGEST_M)]


@pytest.mark.parametrize(
    ("question", "found"),
    [
        ("something red", [0, 2]),  # a red apple is a name of apples, and this one is green
        ("crimson things", [0, 2]),
        ("metal", [7]),
        ("hour glass", [5]),
        ("tools", [6, 7]),
        ("something to drink from", [0, 1, 2, 4]),
        ("a mug that is not red", [1]),
        ("mugs, but not plastic", [0, 1]),
    ],
)
def test_what_is_found_is_what_is_asked_for(question: str, found: list[int]) -> None:
    assert sorted(on_the_shelf(question)) == found


def test_a_compound_is_found_however_it_is_written() -> None:
    assert on_the_shelf("wineglass")[0] == 4 and on_the_shelf("wine glass")[0] == 4


def test_words_that_no_twin_has_are_told_with_those_spelt_nearly_so() -> None:
    texts = [text_fields(each) for each in SHELF]
    assert unknown_words("a red hamer, xylophones and a múg", texts) == {"hamer": ["hammer"], "xylophone": []}
    assert unknown_words("something to drink from", texts) == {}
    assert on_the_shelf("a múg") == on_the_shelf("a mug")


def test_small_and_large_order_the_things_of_a_category() -> None:
    assert on_the_shelf("small red mug") == [0, 2, 1] and on_the_shelf("a LARGE red mug")[0] == 2
    assert on_the_shelf("the largest mug") == [2, 1, 0] and on_the_shelf("tiny mug, the smallest")[0] == 0


def test_a_question_of_nothing_but_what_is_unwanted_is_refused() -> None:
    with pytest.raises(UsageError, match="only excluded words"):
        on_the_shelf("not red")


def test_words_are_in_the_singular_and_in_one_spelling() -> None:
    assert words("The gray knives for Glasses, berries and brushes") == ["grey", "knife", "glass", "berry", "brush"]
    assert "unknown" not in text_fields({"category": "mug", "color": "unknown color (untextured)"})["color"]


class Embedder:
    """Stands for a served model: vectors by the first letter, and a count of the texts that were asked."""

    identity = "here 1"

    def __init__(self) -> None:
        self.asked: list[str] = []

    def embed(self, texts: list[str]) -> np.ndarray:
        self.asked += texts
        return np.array([np.eye(26, dtype=np.float32)[ord(text[0].lower()) - 97] for text in texts]).reshape(-1, 26)


def test_a_model_of_embeddings_is_asked_once_for_each_text(root: DatasetRoot) -> None:
    model = Embedder()
    found = search_words(root, "knight", limit=3, embedder=model)  # type: ignore[arg-type]
    assert found[0].category == "knife" and found[0].matched is None
    assert len(model.asked) == 1 + 3
    again = search_words(root, "knight", limit=3, embedder=model)  # type: ignore[arg-type]
    assert again == found and len(model.asked) == 2 + 3
    rows = [
        {"twin_id": each, "revision": "r", "category": "can", "caption": "new"} for each in list(root.twin_ids())[:1]
    ]
    text_vectors(root, rows, model)  # type: ignore[arg-type]
    assert model.asked[-1] == "can: new"


def test_a_clips_folder_ranks_without_any_server(root: DatasetRoot, tmp_path: Path) -> None:
    write_tiny_clip(tmp_path / "clip")
    done = CliRunner().invoke(
        app, ["search", root.url, "mug", "--embedder", f"clip:{tmp_path / 'clip'}", "--json"], catch_exceptions=False
    )
    hits = json.loads(done.stdout)["hits"]
    assert len(hits) == 3 and {hit["matched"] is None for hit in hits} == {True}, (
        "no twin has the word, all have vectors"
    )
    model = text_embedder(f"clip:{tmp_path / 'clip'}", ServicesConfig())
    asked = model.embed(["mug"])[0]
    texts = {hit["twin_id"]: f"{hit['category']}: {hit['caption']}" for hit in hits}
    likeness = [float(model.embed([texts[hit["twin_id"]]])[0] @ asked) for hit in hits]
    assert likeness == sorted(likeness, reverse=True)


def test_a_picture_finds_its_twin_and_looks_are_made_once(root: DatasetRoot, monkeypatch: pytest.MonkeyPatch) -> None:
    assert root.local is not None
    drawn: list[str] = []
    monkeypatch.setattr(drawing, "AROUND", 3)
    for twin_id in root.twin_ids():
        twin = Twin(root.local / root.twin_name(twin_id))
        points = np.concatenate([part.vertices for part in twin.visual])
        camera = framing_camera(points, azimuth_deg=77, elevation_deg=28, fov_y_deg=40, width_px=120, height_px=96)
        (frame,) = shared_renderer().render(twin.visual, [camera], background=(70, 90, 60))
        hits, found = search_picture(root, frame.rgb, limit=2, on_twin=drawn.append)
        assert (hits[0].twin_id, found) == (twin_id, "border") and len(hits) == 2
    assert sorted(drawn) == sorted(root.twin_ids()), "each was drawn for the first question alone"


def test_looks_are_made_again_for_another_surface_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "AROUND", 1)
    root, drawn = DatasetRoot(tmp_path), list[str]()
    twin_id = write_thing(tmp_path, 0, can())
    before = dict(load_appearance_vectors(root, revisions(root), drawn.append))[twin_id]
    file = tmp_path / VectorStore(root, SPACE).file(twin_id)
    content = file.read_bytes()
    file.unlink()
    assert (dict(load_appearance_vectors(root, revisions(root), drawn.append))[twin_id] == before).all()
    assert file.read_bytes() == content and len(drawn) == 2
    _say(tmp_path, 0, caption="Another sentence.")
    dict(load_appearance_vectors(root, revisions(root), drawn.append))
    assert len(drawn) == 2, "a sentence changes no look"
    file.write_bytes(content[:-9])
    dict(load_appearance_vectors(root, revisions(root), drawn.append))
    assert len(drawn) == 3, "a file that was cut off is made again"
    write_thing(tmp_path, 0, slab("can", 0.1, 0.1, 0.02))
    after = dict(load_appearance_vectors(root, revisions(root), drawn.append))[twin_id]
    assert len(drawn) == 4 and (after != before).any()


def test_a_store_gives_back_what_it_was_given_and_refuses_other_lengths(tmp_path: Path) -> None:
    root = DatasetRoot(tmp_path)
    kept = VectorStore(root, "space").write(
        "ab12", StoredVectors("r", "c", np.array([[0.25, 0.5], [1.0, -2.0]], np.float32))
    )
    again = VectorStore(root, "space", 2).read("ab12")
    assert again is not None and (again.revision, again.content) == ("r", "c")
    assert (again.vectors == kept.vectors).all()
    assert VectorStore(root, "space", 3).read("ab12") is None
    assert VectorStore(root, "other").read("ab12") is None
    assert [path.name for path in (tmp_path / FOLDER).rglob("*.parquet")] == ["ab12.parquet"]


def test_pictures_want_a_local_data_set() -> None:
    with pytest.raises(UsageError, match="copy the data set"):
        dict(load_appearance_vectors(DatasetRoot("memory://nowhere"), {"ab12": "r"}))


def test_a_part_is_found_and_left_out_by_what_points_are_called() -> None:
    rows = [{"category": "mug", "parts": "rim handle"}, {"category": "mug", "parts": "rim"}]
    texts = [text_fields(row) for row in rows]
    assert [hit.place for hit in rank_by_words("a mug without a handle", texts)] == [1]
    assert [hit.place for hit in rank_by_words("a mug with a handle", texts)] == [0, 1]


def test_labels_of_functional_points_are_searched(tmp_path: Path) -> None:
    write_thing(tmp_path, 0, can())
    rebuild(DatasetRoot(tmp_path), jobs=1)
    labels = Index(DatasetRoot(tmp_path)).select("points", columns=["role", "label"]).to_pylist()
    told = next(each["label"] for each in labels if each["role"] == "functional")
    (hit,) = search_words(DatasetRoot(tmp_path), told, limit=3)
    assert hit.matched is not None and "parts" in next(iter(hit.matched.values()))
