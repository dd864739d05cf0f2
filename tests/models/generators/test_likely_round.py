"""What nobody has named and most likely names call round is as thick as it is wide."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh

from manitwin.formats.glb import read_glb
from manitwin.models.generators.lift.likely_round import is_likely_round
from manitwin.models.generators.lift.photo_generation import LiftResult, generate_from_photo

ROUND = (("screwdriver", 0.5), ("glass bottle", 0.2), ("spatula", 0.1))
FLAT = (("spatula", 0.5), ("glass bottle", 0.2))
OUTLINE = {"solidity": 0.94, "mirror_iou": 0.9, "holes": 0.0}


@pytest.mark.parametrize(
    ("likely", "outline", "expected"),
    [
        (ROUND, OUTLINE, True),
        (FLAT, OUTLINE, False),
        ((), OUTLINE, False),
        ((("glass bottle", 0.05),), OUTLINE, False),  # hardly said
        (ROUND, OUTLINE | {"solidity": 0.6}, False),  # a hammer
        (ROUND, OUTLINE | {"mirror_iou": 0.7}, False),
        (ROUND, OUTLINE | {"holes": 1.0}, False),
        ((("pump bottle", 0.5),), OUTLINE, False),  # its spout sticks out
        ((("coin", 0.5),), OUTLINE, False),  # round, and flat
    ],
)
def test_names_and_outline_say_what_is_round(
    likely: tuple[tuple[str, float], ...], outline: dict[str, float], expected: bool
) -> None:
    assert is_likely_round(likely, outline) is expected


def _lying_bottle() -> np.ndarray:
    """An RGBA picture of a bottle that lies across it, of which the cut-out lacks a strip along one side."""
    points = [(60, 250), (200, 250), (280, 200), (560, 200), (560, 370), (420, 345), (280, 370), (200, 330), (60, 330)]
    rgba = np.zeros((560, 640, 4), np.uint8)
    cv2.fillPoly(rgba, [np.array(points, np.int32)], (90, 60, 40, 255))
    turn = cv2.getRotationMatrix2D((320, 280), 20.0, 1.0)
    return np.asarray(cv2.warpAffine(rgba, turn, (640, 560), flags=cv2.INTER_NEAREST))


def _thickness(job: LiftResult, folder: Path) -> float:
    """Return the least of a job's sides over the second."""
    path = folder / "made.glb"
    path.write_bytes(job.glb)
    solid = trimesh.util.concatenate(read_glb(path))
    thin, thick, _ = np.sort(trimesh.bounds.oriented_bounds(solid)[1])
    return float(thin / thick)


@pytest.mark.slow
def test_a_bottle_that_is_cut_out_unevenly_is_round_by_its_likely_names(tmp_path: Path) -> None:
    photo = _lying_bottle()
    flat, thick = generate_from_photo(photo, None, likely=FLAT), generate_from_photo(photo, None, likely=ROUND)
    assert flat.notes["primitive"] == thick.notes["primitive"] == "inflation"
    assert thick.notes["depth_source"] == "round" and flat.notes["depth_source"] == "outline"
    assert _thickness(flat, tmp_path) < 0.75 < 0.85 < _thickness(thick, tmp_path)
