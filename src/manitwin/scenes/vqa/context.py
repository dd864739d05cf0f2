"""Input of the question families: one picture with its objects, directions, gaps and slides."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from manitwin.geometry.hull_distance import distance
from manitwin.scenes.perception.scene_truth import SceneTruth
from manitwin.scenes.vqa.directions import Direction, picture_directions, robot_directions
from manitwin.scenes.vqa.posed_objects import ObjectInPicture, PosedObject, View
from manitwin.scenes.vqa.question import Point
from manitwin.scenes.vqa.references import one_of
from manitwin.scenes.vqa.sweeps import Slide, SweptPath, can_be_slid, sweep

LEAST_INNER_PX = 3.0
"""Least distance of a point in question from the border of its mask (px of a picture 512 wide)."""


SlideKey = tuple[str, float, float, float, float]
"""An object's name, the start of its slide, and its direction."""


@dataclass(frozen=True)
class SceneMeasurements:
    """Measurements of a scene, shared by its pictures: gaps (m) between pairs of objects, and swept ways."""

    gaps_m: dict[tuple[str, str], float] = field(default_factory=dict)
    ways: dict[SlideKey, SweptPath] = field(default_factory=dict)


@dataclass(frozen=True)
class Context:
    """One picture of a scene; ``words`` are references by object name, ``categories`` are those of all scenes."""

    scene: SceneTruth
    things: Sequence[PosedObject]
    view: View
    words: dict[str, str]
    categories: Sequence[str]
    rng: random.Random
    measured: SceneMeasurements

    @cached_property
    def named_objects(self) -> list[ObjectInPicture]:
        """The clear objects that have a reference."""
        return [each for each in self.view.clear_objects if each.thing.name in self.words]

    @cached_property
    def pointable_objects(self) -> list[tuple[ObjectInPicture, Point]]:
        """The clear objects that a point can identify, with that point."""
        found = []
        for each in self.view.clear_objects:
            point, deep_px = each.inner
            if deep_px >= LEAST_INNER_PX * self.view.camera.width_px / 512:
                found.append((each, point))
        return found

    @cached_property
    def directions(self) -> list[Direction]:
        """The directions of the picture, and those of the robot if the picture determines them."""
        camera = self.view.camera
        return [*picture_directions(camera), *robot_directions(camera, self.things[0].center_m)]

    @property
    def looks_down_rad(self) -> float:
        """The angle between the camera's viewing axis and the horizontal plane, positive downward."""
        # the viewing axis is -z (OpenGL)
        return float(np.arcsin(np.clip(self.view.camera.camera_to_object[2, 2], -1, 1)))

    @property
    def surface(self) -> str:
        """The name of the surface below the objects: its rendered material and ``surface``."""
        return f"{self.scene.record.furniture.boxes[0].material} surface"

    @cached_property
    def slidable(self) -> list[ObjectInPicture]:
        """The named objects that can be slid alone; none if an object of the scene is not clear."""
        if not self.view.shows_all:
            return []
        return [each for each in self.named_objects if can_be_slid(each.thing, self.scene.record)]

    def words_of(self, seen: ObjectInPicture) -> str:
        """Return the reference of an object."""
        return self.words[seen.thing.name]

    def reference_or_category(self, seen: ObjectInPicture) -> str:
        """Return the reference of an object, or its category if it has none, for objects that a point identifies."""
        return self.words.get(seen.thing.name, f"the {one_of(seen.thing.category)}")

    def swept_path(self, seen: ObjectInPicture, direction: Direction) -> SweptPath:
        """Return the obstacles of an object in one direction."""
        slide = Slide(seen.thing, (0.0, 0.0), direction.vector)
        if _key(slide) not in self.measured.ways:
            self.swept_paths(
                [Slide(each.thing, (0.0, 0.0), d.vector) for each in self.slidable for d in self.directions]
            )
        return self.measured.ways[_key(slide)]

    def swept_paths(self, slides: Sequence[Slide]) -> list[SweptPath]:
        """Return the obstacles of each slide; cached for all pictures of a scene, and fastest for many slides at once."""
        known = self.measured.ways
        new = {_key(each): each for each in slides if _key(each) not in known}
        known.update(zip(new, sweep(list(new.values()), self.things, self.scene.record), strict=True))
        return [known[_key(each)] for each in slides]

    def gap_m(self, a: PosedObject, b: PosedObject) -> float:
        """Return the distance between two objects; cached for all pictures of a scene."""
        key = (min(a.name, b.name), max(a.name, b.name))
        gaps_m = self.measured.gaps_m
        if key not in gaps_m:
            gaps_m[key] = distance(a.placed_hulls, b.placed_hulls)
        return gaps_m[key]

    def in_view(self, seen: ObjectInPicture, end_m: np.ndarray) -> bool:
        """Return whether an object's centre, moved by ``end_m (2,)``, stays in the picture."""
        column, row, depth_m = self.view.pixel(seen.thing.center_m + np.array([*end_m, 0.0]))
        camera = self.view.camera
        return depth_m > 0 and 0 <= column < camera.width_px and 0 <= row < camera.height_px

    def names(self, *seen: ObjectInPicture) -> dict[str, str]:
        """Return the categories by object name, which are part of every answer's evidence."""
        return {each.thing.name: each.thing.category for each in seen}


def _key(slide: Slide) -> SlideKey:
    return slide.thing.name, *slide.start_m, *slide.direction


def sentence(text: str) -> str:
    """Return a text with a capital letter and a full stop."""
    return f"{text[:1].upper()}{text[1:]}{'' if text.endswith(('.', '!', '?')) else '.'}"


def join_words(words: Sequence[str]) -> str:
    """Return words joined by commas and ``and``."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
