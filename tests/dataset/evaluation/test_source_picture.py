"""What a twin was made of, cut out as its build did: within the box and by the mask that were stated."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from PIL import Image

from manitwin.dataset.evaluation.source_picture import load_source
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.record import Source

WIDTH, HEIGHT = 480, 240


def _left() -> np.ndarray:
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    return np.hypot(columns - 120, rows - 120) < 70


def _twin(folder: Path, **said: object) -> Twin:
    picture = np.full((HEIGHT, WIDTH, 3), 200, np.uint8)
    picture[_left()] = 170, 30, 20
    picture[_left()[:, ::-1]] = 20, 40, 160
    Image.fromarray(picture).save(folder / "source.png")
    Image.fromarray((255 * _left()).astype(np.uint8)).save(folder / "source_mask.png")
    source = Source.model_validate(
        {"kind": "image", "file": "source.png", "sha256": "0" * 64, "license": "CC0-1.0", **said}
    )
    return cast(Twin, SimpleNamespace(folder=folder, record=SimpleNamespace(source=source, naming=None, name="ball")))


@pytest.mark.parametrize("said", [{"box_px": [50.0, 50.0, 190.0, 190.0]}, {"mask": "source_mask.png"}])
def test_the_source_is_the_thing_that_was_meant(tmp_path: Path, said: dict[str, object]) -> None:
    found = load_source(_twin(tmp_path, **said))
    assert found is not None and not found.left_out and found.rgb is not None and found.mask is not None
    inside = found.rgb[found.mask > 0.9].mean(0)
    assert inside[0] > 2 * inside[2]
    assert (found.mask > 0.5).sum() == pytest.approx(_left().sum(), rel=0.02)


def test_without_either_there_are_two(tmp_path: Path) -> None:
    found = load_source(_twin(tmp_path))
    assert found is not None and "2 separate objects" in found.left_out
