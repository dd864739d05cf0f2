"""Ways of slid objects, against all their pairs of parts and against small steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manitwin.geometry.hull_distance import distance
from manitwin.geometry.hull_sweep import TOLERANCE_M, first_contacts
from manitwin.scenes.perception.scene_truth import SceneTruth, read_scene_truth
from manitwin.scenes.scene_files import scene_files
from manitwin.scenes.vqa.posed_objects import PosedObject, TwinShape, posed_objects_of
from manitwin.scenes.vqa.sweeps import LONGEST_M, MARGIN_M, Slide, obstacles_of, sweep
from manitwin.twin.loaded_twin import TwinSource

STEP_M = 0.01


@pytest.fixture(scope="module", params=[0, 1])
def scene(scenes: Path, request: pytest.FixtureRequest) -> tuple[SceneTruth, list[PosedObject]]:
    truth = read_scene_truth(scene_files(scenes)[request.param])
    source = TwinSource(scenes.parent / "set")
    return truth, posed_objects_of(truth, lambda twin_id: TwinShape.of_twin(source.folder(twin_id)))


def slides_of(things: list[PosedObject]) -> list[Slide]:
    angles = np.linspace(0, 2 * np.pi, 5, endpoint=False) + 0.1
    return [
        Slide(thing, start, (float(np.cos(angle)), float(np.sin(angle))))
        for thing in things for start in ((0.0, 0.0), (-0.03, 0.02)) for angle in angles
    ]  # fmt: skip


def test_ways_of_many_slides_are_those_of_each_and_of_all_pairs(scene: tuple[SceneTruth, list[PosedObject]]) -> None:
    truth, things = scene
    slides = slides_of(things)
    ways = sweep(slides, things, truth.record)
    met = 0
    for slide, way in zip(slides, ways, strict=True):
        assert sweep([slide], things, truth.record) == [way]
        parts = slide.thing.placed_hulls.parts + slide.start_offset_m
        for name, obstacle in obstacles_of(slide.thing, things, truth.record).items():
            rows, columns = (axis.ravel() for axis in np.indices((len(parts), len(obstacle.parts))))
            units = np.broadcast_to(slide.unit, (len(rows), 3))
            near_m = first_contacts(parts[rows], obstacle.parts[columns], units, LONGEST_M, MARGIN_M).min()
            found = way.meetings[name].near_m if name in way.meetings else np.inf
            assert found == near_m or abs(found - near_m) < 2 * TOLERANCE_M
            met += np.isfinite(near_m)
    assert 0 < met < len(slides) * 2


def test_what_is_met_is_within_the_margin_there_and_not_before(scene: tuple[SceneTruth, list[PosedObject]]) -> None:
    truth, things = scene
    slides = [slide for slide in slides_of(things) if slide.start_m == (0.0, 0.0)]
    for slide, way in zip(slides, sweep(slides, things, truth.record), strict=True):
        for name, obstacle in obstacles_of(slide.thing, things, truth.record).items():
            near_m = way.meetings[name].near_m if name in way.meetings else np.inf
            for place_m in np.arange(0, LONGEST_M, STEP_M):
                pose = slide.thing.pose.copy()
                pose[:3, 3] += place_m * slide.unit
                gap_m = distance(slide.thing.shape.hulls.at(pose), obstacle)
                if place_m < near_m - 2e-4:
                    assert gap_m > MARGIN_M - 2e-4
                elif place_m < near_m + STEP_M:
                    assert gap_m < MARGIN_M + STEP_M
