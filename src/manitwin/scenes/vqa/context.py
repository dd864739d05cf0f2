"""What the families of questions are given of one picture."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manitwin.geometry.hull_distance import distance
from manitwin.scenes.perception.scene_truth import SceneTruth
from manitwin.scenes.vqa.directions import Direction, picture_directions, robot_directions
from manitwin.scenes.vqa.question import Point
from manitwin.scenes.vqa.references import one_of
from manitwin.scenes.vqa.sweeps import Way, can_be_slid, obstacles_of, sweep
from manitwin.scenes.vqa.things import Seen, Thing, View

LEAST_INNER_PX = 3.0
"""A point that is asked for or about lies so deep inside of what it is on (px of a picture of 512 x 512)."""


@dataclass(frozen=True)
class Context:
    """One picture of a scene; ``words`` are the references by object's name, ``categories`` those of all scenes."""

    scene: SceneTruth
    things: Sequence[Thing]
    view: View
    words: dict[str, str]
    categories: Sequence[str]
    rng: random.Random
    gaps: dict[tuple[str, str], float]

    @cached_property
    def named(self) -> list[Seen]:
        """The clear objects that have words of their own."""
        return [each for each in self.view.clear if each.thing.name in self.words]

    @cached_property
    def pointed(self) -> list[tuple[Seen, Point]]:
        """The clear objects that a point can mean, with it."""
        found = []
        for each in self.view.clear:
            point, deep_px = each.inner
            if deep_px >= LEAST_INNER_PX * self.view.camera.width_px / 512:
                found.append((each, point))
        return found

    @cached_property
    def directions(self) -> list[Direction]:
        """The picture's directions, and the robot's where the picture lets one know them."""
        camera = self.view.camera
        return [*picture_directions(camera), *robot_directions(camera, self.things[0].center_m)]

    @property
    def looks_down_rad(self) -> float:
        """The angle between the camera's viewing axis and the level."""
        return float(np.arcsin(np.clip(self.view.camera.camera_to_object[2, 2], -1, 1)))  # its axis is -z (OpenGL)

    @property
    def surface(self) -> str:
        """The words for what the objects stand on: its material as it is drawn, and ``surface``."""
        return f"{self.scene.record.furniture.boxes[0].material} surface"

    @cached_property
    def slidable(self) -> list[Seen]:
        """The named objects that can be slid alone; none where something that could be met is not seen."""
        if not self.view.shows_all:
            return []
        return [each for each in self.named if can_be_slid(each.thing, self.scene.record)]

    def words_of(self, seen: Seen) -> str:
        """Return the words that mean an object."""
        return self.words[seen.thing.name]

    def called(self, seen: Seen) -> str:
        """Return the words that mean an object, or its category's where it has none: what a point means already."""
        return self.words.get(seen.thing.name, f"the {one_of(seen.thing.category)}")

    def ways(self, seen: Seen, directions: Sequence[Direction], start_m: np.ndarray | None = None) -> list[Way]:
        """Return what an object meets in each direction; ``start_m (2,)`` is how far it was moved before."""
        record = self.scene.record
        obstacles = obstacles_of(seen.thing, self.things, record)
        start = np.zeros(2) if start_m is None else start_m
        return sweep(seen.thing, record, obstacles, start, [each.vector for each in directions])

    def gap_m(self, a: Thing, b: Thing) -> float:
        """Return the distance of two objects; found once for all pictures of a scene."""
        key = (min(a.name, b.name), max(a.name, b.name))
        if key not in self.gaps:
            self.gaps[key] = distance(a.placed, b.placed)
        return self.gaps[key]

    def in_view(self, seen: Seen, end_m: np.ndarray) -> bool:
        """Whether an object's middle, moved by ``end_m (2,)``, is still in the picture."""
        column, row, depth_m = self.view.pixel(seen.thing.center_m + np.array([*end_m, 0.0]))
        camera = self.view.camera
        return depth_m > 0 and 0 <= column < camera.width_px and 0 <= row < camera.height_px

    def names(self, *seen: Seen) -> dict[str, str]:
        """Return categories by object's name: part of every answer's evidence."""
        return {each.thing.name: each.thing.category for each in seen}


def sentence(text: str) -> str:
    """Return a text with a capital and a full stop."""
    return f"{text[:1].upper()}{text[1:]}{'' if text.endswith(('.', '!', '?')) else '.'}"


def listed(words: Sequence[str]) -> str:
    """Return words joined by commas and ``and``."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
