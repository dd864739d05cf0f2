"""The built-in network: its layers against the same arithmetic in SciPy, its two looks, and a made scene."""

from __future__ import annotations

from importlib.resources import files

import cv2
import numpy as np
import pytest
from scipy import ndimage, signal

from manitwin.models.classifiers.efficientnet_lite import DEVIATION, MEAN, load_weights, trunk
from manitwin.models.matting import object_network
from manitwin.models.matting.object_network import (
    BLOCKS,
    MIXES,
    SIDE_PX,
    WAYS,
    WEIGHTS_FILES,
    decoder_weights,
    evaluate_coarse_to_fine,
    network_bytes,
    object_share,
)


def _scene(center: tuple[int, int], axes: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    truth = np.zeros((300, 400), np.uint8)
    cv2.ellipse(truth, center, axes, 20, 0, 360, 1, -1)
    scene = np.full((300, 400, 3), (205.0, 200.0, 190.0)) + np.random.default_rng(0).normal(0, 1.5, (300, 400, 3))
    scene[truth > 0] = (30, 90, 160)
    return np.clip(cv2.GaussianBlur(scene, (0, 0), 0.8), 0, 255).astype(np.uint8), truth > 0


@pytest.mark.parametrize(("center", "axes"), [((200, 150), (90, 60)), ((90, 80), (34, 22))], ids=["large", "small"])
def test_thing_on_a_plain_ground_is_told_from_it(center: tuple[int, int], axes: tuple[int, int]) -> None:
    photo, truth = _scene(center, axes)
    share = object_share(photo)
    assert share.shape == truth.shape and share.dtype == np.float32 and 0 <= share.min() <= share.max() <= 1
    found = share > 0.5
    assert (found & truth).sum() / (found | truth).sum() > 0.9
    assert np.array_equal(share, object_share(photo))


def test_a_picture_is_looked_at_in_each_way_and_a_mirrored_look_is_turned_back(monkeypatch: pytest.MonkeyPatch) -> None:
    photo, _ = _scene((150, 140), (150, 100))
    one_way = {}
    for way in WAYS:
        monkeypatch.setattr(object_network, "WAYS", (way,))
        one_way[way] = object_share(photo)
    (side, _), mirrored = WAYS[-1], np.ascontiguousarray(photo[:, ::-1])
    monkeypatch.setattr(object_network, "WAYS", ((side, False),))
    assert np.allclose(object_share(mirrored)[:, ::-1], one_way[side, True], atol=1e-4)
    assert not np.allclose(one_way[side, True], one_way[side, False], atol=1e-4)
    monkeypatch.setattr(object_network, "WAYS", WAYS)
    assert np.allclose(object_share(photo), sum(one_way.values()) / len(WAYS), atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("file", WEIGHTS_FILES)
def test_the_layers_are_those_of_a_feature_pyramid(file: str) -> None:
    """Encoder values as OpenCV has them; the decoder after them in SciPy, layer by layer."""
    picture = np.random.default_rng(1).integers(0, 256, (SIDE_PX, SIDE_PX, 3)).astype(np.float32)
    blob = ((picture - MEAN) / DEVIATION).transpose(2, 0, 1)[None].copy()
    weights = {name: value.astype(np.float32) for name, value in decoder_weights(file).items()}

    def run(content: bytes) -> np.ndarray:
        network = cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
        network.setInput(blob)
        return np.array(network.forward()[0])

    seen = []
    for level, (block, channels) in enumerate(zip(BLOCKS, (16, 24, 40, 112, 320), strict=True)):
        graph, values = trunk(load_weights(), SIDE_PX)
        side = SIDE_PX // 2 ** (level + 1)
        seen.append(run(graph.to_bytes(values[f"_blocks.{block}"], (1, channels, side, side))))

    def convolved(name: str, x: np.ndarray, active: bool = True) -> np.ndarray:
        kernel, bias = weights[f"{name}.weight"], weights[f"{name}.bias"]
        y = np.stack(
            [
                sum(
                    (signal.correlate(plane, part, mode="same") for plane, part in zip(x, row, strict=True)),
                    start=np.zeros_like(x[0]),
                )
                for row in kernel
            ]
        )
        y += bias[:, None, None]
        return np.maximum(y, 0) if active else y

    def doubled(x: np.ndarray) -> np.ndarray:
        at = (np.arange(2 * x.shape[1]) + 0.5) / 2 - 0.5
        rows, columns = np.meshgrid(at, at, indexing="ij")
        return np.stack([ndimage.map_coordinates(plane, [rows, columns], order=1, mode="nearest") for plane in x])

    y = convolved("top", convolved("lateral4", seen[4]))
    for level in reversed(range(len(BLOCKS) - 1)):
        y = doubled(convolved(f"narrow{level}", y, active=False)) + convolved(f"lateral{level}", seen[level])
        for mix in range(MIXES):
            y = convolved(f"mix{level}.{mix}", y)
    quarters = convolved("answer", y, active=False)
    logits = quarters.reshape(2, 2, SIDE_PX // 2, SIDE_PX // 2).transpose(2, 0, 3, 1).reshape(SIDE_PX, SIDE_PX)
    share = run(network_bytes(load_weights(), [decoder_weights(file)]))[0]
    assert np.abs(1 / (1 + np.exp(-logits)) - share).max() < 1e-3


def test_the_share_is_the_mean_of_the_decoders() -> None:
    photo, _ = _scene((200, 150), (90, 60))
    blob = (
        ((cv2.resize(photo, (SIDE_PX, SIDE_PX)).astype(np.float32) - MEAN) / DEVIATION).transpose(2, 0, 1)[None].copy()
    )

    def run(files: tuple[str, ...]) -> np.ndarray:
        content = network_bytes(load_weights(), [decoder_weights(name) for name in files])
        network = cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
        network.setInput(blob)
        return np.array(network.forward()[0])

    each = [run((name,)) for name in WEIGHTS_FILES]
    assert np.abs(each[0] - each[1]).max() > 0.01
    assert np.allclose(run(WEIGHTS_FILES), np.mean(each, axis=0), atol=1e-5)


def test_what_is_small_is_looked_at_again_closer() -> None:
    sizes = []

    def look(rgb: np.ndarray) -> np.ndarray:
        sizes.append(rgb.shape[:2])
        return (rgb[..., 0] > 100).astype(np.float32)

    photo = np.zeros((200, 300, 3), np.uint8)
    photo[40:60, 100:130] = 200
    share = evaluate_coarse_to_fine(photo, look)
    assert len(sizes) == 2 and sizes[0] == (200, 300) and max(sizes[1]) < 70
    assert np.array_equal(share > 0.5, photo[..., 0] > 100)
    sizes.clear()
    photo[10:190, 10:290] = 200
    evaluate_coarse_to_fine(photo, look)
    assert sizes == [(200, 300)]


def test_nothing_is_not_looked_at_again() -> None:
    empty = np.zeros((60, 80), np.float32)
    assert evaluate_coarse_to_fine(np.zeros((60, 80, 3), np.uint8), lambda rgb: empty) is empty


def test_its_weights_are_small_enough_to_come_along() -> None:
    for name in WEIGHTS_FILES:
        assert len((files("manitwin.models.matting") / name).read_bytes()) < 1_000_000
    assert object_network.built_in_model().startswith("object-network sha256:")


def test_the_content_of_the_network_is_made_once_for_all_photos(monkeypatch: pytest.MonkeyPatch) -> None:
    object_network._content.cache_clear()
    read: list[str] = []

    def weights() -> dict[str, np.ndarray]:
        read.append("weights")
        return load_weights()

    monkeypatch.setattr(object_network, "load_weights", weights)
    photo, _ = _scene((200, 150), (90, 60))
    assert np.array_equal(object_share(photo), object_share(photo))
    assert read == ["weights"]
