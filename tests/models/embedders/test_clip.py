"""CLIP from ONNX files: a tiny one of its architecture, against numpy; its tokens against what CLIP's own rules give."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manitwin.errors import UsageError
from manitwin.models.embedders.clip import ClipFolder
from manitwin.models.embedders.clip_tokens import BEGIN, END, LENGTH, ClipTokens, words
from tiny_clip import DEVIATION, MEAN, SIDE, Weights, point_weight, text_vector, vision_vector, write_tiny_clip

NETWORKS = ("vision_model.onnx", "text_model.onnx", "point_model.onnx")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Weights]:
    folder = tmp_path_factory.mktemp("models") / "tiny-clip"
    return folder, write_tiny_clip(folder, points=True)


def unit(vector: np.ndarray) -> np.ndarray:
    return np.asarray(vector / np.linalg.norm(vector))


def test_a_picture_has_the_vector_that_numpy_computes(made: tuple[Path, Weights]) -> None:
    picture = np.random.default_rng(0).integers(0, 256, (SIDE, SIDE, 3), dtype=np.uint8)
    pixels = ((picture / 255 - MEAN) / DEVIATION).transpose(2, 0, 1).astype(np.float32)
    found = ClipFolder(made[0]).pictures([picture])[0]
    np.testing.assert_allclose(found, unit(vision_vector(made[1], pixels)), atol=1e-4)


def test_a_text_has_the_vector_that_numpy_computes(made: tuple[Path, Weights]) -> None:
    clip, tokens = ClipFolder(made[0]), ClipTokens.of_folder(made[0])
    for text in ("a red mug", "mug"):
        found = clip.texts([text])[0]
        np.testing.assert_allclose(found, unit(text_vector(made[1], tokens.encode(text))), atol=1e-4)


def test_points_are_taken_with_y_up_in_the_unit_ball(made: tuple[Path, Weights]) -> None:
    clip = ClipFolder(made[0], points=True)
    assert clip.point_count == 64
    points = np.random.default_rng(1).normal(0, 0.05, (64, 3)) + 0.3
    turned = points[:, [0, 2, 1]] * [1, 1, -1]
    ball = turned - turned.mean(0)
    ball /= np.linalg.norm(ball, axis=1).max()
    expected = (1 / (1 + np.exp(-ball @ point_weight()))).mean(0) @ made[1]["v.projection"]
    np.testing.assert_allclose(clip.points(points), unit(expected), atol=1e-4)


def test_texts_are_cut_as_clip_cuts_them() -> None:
    assert list(words("  A mug's  lid, 12 &amp; (red) ")) == [
        "a",
        "mug",
        "'s",
        "lid",
        ",",
        "1",
        "2",
        "&",
        "(",
        "red",
        ")",
    ]


def test_merges_are_done_in_their_order_and_texts_end(made: tuple[Path, Weights]) -> None:
    tokens = ClipTokens.of_folder(made[0])
    ids = tokens.encode("Mug red")
    names = {place: name for name, place in tokens.vocabulary.items()}
    assert [names[each] for each in ids[:5]] == [BEGIN, "mug</w>", "re", "d</w>", END]
    assert len(ids) == LENGTH and set(ids[5:]) == {tokens.vocabulary[END]}
    long = tokens.encode("x " * 200)
    assert len(long) == LENGTH and long[-1] == tokens.vocabulary[END] and long[-2] != tokens.vocabulary[END]


def test_its_files_are_told_apart_by_their_sha256(made: tuple[Path, Weights], tmp_path: Path) -> None:
    write_tiny_clip(tmp_path / "other", seed=1)
    one, other = ClipFolder(made[0]).sha256, ClipFolder(tmp_path / "other").sha256
    assert set(one) == {*NETWORKS, "preprocessor_config.json", "vocab.json", "merges.txt"}
    assert one["vision_model.onnx"] != other["vision_model.onnx"] and one["vocab.json"] == other["vocab.json"]


@pytest.mark.parametrize("gone", ["onnx/text_model.onnx", "merges.txt", "preprocessor_config.json"])
def test_a_folder_without_one_of_its_files_is_refused(tmp_path: Path, gone: str) -> None:
    write_tiny_clip(tmp_path / "m")
    (tmp_path / "m" / gone).unlink()
    with pytest.raises(UsageError, match=f"{Path(gone).name}: not found"):
        ClipFolder(tmp_path / "m")


def test_what_is_no_network_of_one_input_is_refused(tmp_path: Path, made: tuple[Path, Weights]) -> None:
    write_tiny_clip(tmp_path / "m")
    (tmp_path / "m" / "onnx" / "vision_model.onnx").write_bytes(b"no network")
    with pytest.raises(UsageError, match="no ONNX network"):
        ClipFolder(tmp_path / "m").pictures([np.zeros((4, 4, 3), np.uint8)])
    with pytest.raises(UsageError, match="point_model"):
        ClipFolder(tmp_path / "m", points=True)
