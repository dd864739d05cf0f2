"""Twins against what they were made of: alike where the photo is theirs, not measured where no model was named."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from typer.testing import CliRunner

from embedding_server import embedding_server
from json_documents import check_keys
from manitwin.cli.main import app
from manitwin.config import ServicesConfig
from manitwin.dataset.evaluation import thirty_views
from manitwin.dataset.evaluation.generation import evaluate_generation
from manitwin.dataset.evaluation.input_likeness import METRICS, Models, draw_partners
from manitwin.dataset.evaluation.source_picture import Source, best_silhouette_iou, normalize_silhouette
from manitwin.dataset.index.rebuild import rebuild
from manitwin.errors import UsageError
from manitwin.models.embedders.clip import ClipFolder
from manitwin.models.embedders.clip_endpoint import ClipEndpoint
from manitwin.render.cameras import framing_camera
from manitwin.render.renderer import shared_renderer
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD, write_twin_record
from tiny_clip import write_tiny_clip
from twin_folders import box, twin_id, write_accepted, write_rejected

SHAPES = (box(0.03, 0.03, 0.2), trimesh.creation.torus(0.06, 0.015))


def given(root: Path, number: int, kind: str) -> None:
    """Say of a twin that it was made of a photo, which shows it from a side of no view, or of a text."""
    folder = root / twin_name(twin_id(number))
    record = json.loads((folder / RECORD).read_bytes())
    del record["revision"], record["files"]
    if kind == "text":
        record["source"] |= {"kind": "text", "prompt": f"a thing of kind {number}"}
    else:
        twin = Twin(folder)
        points = np.concatenate([part.vertices for part in twin.visual])
        camera = framing_camera(points, azimuth_deg=7, elevation_deg=30, fov_y_deg=30, width_px=128, height_px=128)
        frame = shared_renderer().render(twin.visual, [camera])[0]
        rgba = np.dstack([frame.rgb, np.rint(255 * frame.coverage).astype(np.uint8)])
        Image.fromarray(rgba).save(folder / "source.png")
        record["source"] |= {"kind": "image", "file": "source.png"}
    write_twin_record(folder, record)


@pytest.fixture(scope="module", autouse=True)
def few_views() -> object:
    """Four views instead of 30: what is tested here is not how many there are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(thirty_views, "RINGS", ((20.0, 4),))
        yield


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two twins of photos, two of texts, one of a mesh, and a rejected one."""
    root = tmp_path_factory.mktemp("made")
    for number, mesh in enumerate((*SHAPES, SHAPES[0], SHAPES[1], box())):
        write_accepted(root, number, mesh=mesh)
    for number, kind in enumerate(("image", "image", "text", "text")):
        given(root, number, kind)
    write_rejected(root, 9)
    rebuild(DatasetRoot(root), jobs=1)
    return root


def test_thirty_views_are_thirty() -> None:
    assert thirty_views.VIEWS == 30


def test_a_twin_is_more_like_its_own_photo_and_no_model_measures_nothing(place: Path) -> None:
    compared: list[str] = []
    report = evaluate_generation(str(place), Models(), on_twin=compared.append)
    assert sorted(compared) == sorted(twin_id(number) for number in (0, 1)), "texts are compared with nothing"
    rows = {(row["metric"], row["input"]): row for row in report.table("generation_quality")}
    for metric in ("EfficientNet-Lite0 cosine", "silhouette IoU"):
        row = rows[metric, "image"]
        assert (row["objects"], row["pairs"], row["matched_higher"]) == (2, 2, 1.0), row
        assert row["here"] > row["shuffled"] and row["high"] == 1.0 and row["paper"] is None
    for metric, kind in (("ULIP", "image"), ("CLIP(N-I/T)", "image"), ("CLIP(I-I/T)", "text")):
        row = rows[metric, kind]
        assert row["here"] is None and row["objects"] == 0 and row["why"].startswith("not measured")
        assert row["paper"] is not None and row["comparable"] == "no"
    assert report.models == {"clip": None, "ulip": None}
    assert {row["input"] for row in report.table("twins")} == {"image", "text"}
    assert any("CLIP(N-I/T)" in line and "not measured" in line for line in report.lines())


def test_named_models_judge_under_their_names(place: Path, tmp_path: Path) -> None:
    write_tiny_clip(tmp_path / "tiny", points=True)
    tiny = ClipFolder(tmp_path / "tiny", points=True)
    report = evaluate_generation(str(place), Models(tiny, tiny))
    rows = {(row["metric"], row["input"]): row for row in report.table("generation_quality")}
    twins = {row["twin_id"]: row for row in report.table("twins")}
    for metric in METRICS[:3]:
        for kind in ("image", "text"):
            values = [row[metric] for row in twins.values() if row["input"] == kind]
            assert rows[metric, kind]["here"] == pytest.approx(np.mean(values)) and rows[metric, kind]["pairs"] == 2
    twin = Twin(place / twin_name(twin_id(2)))
    expected = (
        tiny.pictures([view.normals for view in thirty_views.thirty_views(twin)]) @ tiny.texts(["a thing of kind 2"])[0]
    )
    assert twins[twin_id(2)]["CLIP(N-I/T)"] == pytest.approx(expected.mean())
    assert report.models["clip"] is not None and report.models["clip"]["name"] == "tiny"
    assert set(report.models["clip"]["sha256"]) >= {"vision_model.onnx", "text_model.onnx"}


def test_a_server_judges_as_its_model_says_and_has_no_digest(place: Path, tmp_path: Path) -> None:
    write_tiny_clip(tmp_path / "tiny")
    tiny = ClipFolder(tmp_path / "tiny")

    def answer(body: dict[str, Any]) -> dict[str, Any]:
        if body["modality"] == "text":
            vectors = tiny.texts(body["input"])
        else:
            read = [base64.b64decode(each.partition(",")[2]) for each in body["input"]]
            vectors = tiny.pictures([np.asarray(Image.open(io.BytesIO(each))) for each in read])
        return {"data": [{"index": i, "embedding": (3 * row).tolist()} for i, row in enumerate(vectors)]}

    here = evaluate_generation(str(place), Models(tiny))
    with embedding_server(answer, []) as spec:
        there = evaluate_generation(str(place), Models(ClipEndpoint(spec, ServicesConfig())))
    assert there.models["clip"] is not None and there.models["clip"]["sha256"] == {}
    assert there.models["clip"]["name"].startswith("tiny at http://127.0.0.1:")
    for ours, theirs in zip(here.table("twins"), there.table("twins"), strict=True):
        assert ours["CLIP(N-I/T)"] == pytest.approx(theirs["CLIP(N-I/T)"])
        assert ours["CLIP(I-I/T)"] == pytest.approx(theirs["CLIP(I-I/T)"])


def test_the_share_of_inputs_that_became_twins_leaves_meshes_out(place: Path) -> None:
    report = evaluate_generation(str(place), Models())
    beside = {row["metric"]: row for row in report.table("beside_the_paper")}
    assert beside["3D generation success rate"]["here"] == 1.0 and beside["3D generation success rate"]["objects"] == 4
    assert {row["kind"]: (row["accepted"], row["rejected"]) for row in report.table("sources")} == {
        "image": (2, 0), "text": (2, 0), "mesh": (1, 1),
    }  # fmt: skip


def test_an_outline_is_the_same_moved_scaled_and_turned() -> None:
    mask = np.zeros((200, 300), np.float32)
    mask[40:60, 30:150], mask[60:120, 30:50] = 1, 1
    same = normalize_silhouette(np.rot90(np.kron(mask, np.ones((2, 2)))).astype(np.float32), np.pi / 2)
    both = normalize_silhouette(mask)
    assert (same & both).sum() / (same | both).sum() > 0.9
    view = thirty_views.View(*[np.zeros((1, 1, 3), np.uint8)] * 3, np.rot90(mask))
    mirrored = thirty_views.View(*[np.zeros((1, 1, 3), np.uint8)] * 3, mask[::-1])
    assert best_silhouette_iou(mask, [mirrored, view])[1] == 1 and best_silhouette_iou(mask, [view])[0] > 0.9
    assert best_silhouette_iou(mask, [mirrored])[0] < 0.85


def test_inputs_are_shuffled_among_their_kind_and_never_with_the_same() -> None:
    sources = [Source("image", str(n % 3)) for n in range(6)] + [
        Source("text", "x", text="cup"),
        Source("text", "y", text="cup"),
    ]
    chosen = draw_partners(sources, np.random.default_rng(0))
    assert chosen[6:] == [None, None]
    for place, other in enumerate(chosen[:6]):
        assert other is not None and other < 6 and sources[other].sha256 != sources[place].sha256


def test_the_command_documents_the_tables(place: Path, tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["evaluate", "generation", str(place), "--out", str(tmp_path / "out"), "--json"])
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    check_keys(document, "evaluate generation")
    assert (tmp_path / "out" / "report.html").read_bytes().count(b"<img") == 2
    assert (tmp_path / "out" / "twins.parquet").exists() and (tmp_path / "out" / "generation_quality.csv").exists()


def test_a_data_set_without_an_index_is_refused(tmp_path: Path) -> None:
    write_accepted(tmp_path, 0)
    with pytest.raises(UsageError, match="manitwin index"):
        evaluate_generation(str(tmp_path), Models())
