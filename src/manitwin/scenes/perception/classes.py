"""Classes of a data set of scenes: object categories, part names, and stuff."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manitwin.scenes.perception.scene_truth import PictureTruth, SceneTruth

BACKGROUND, FURNITURE = "background", "furniture"
STUFF = (BACKGROUND, FURNITURE)
"""Stuff classes: floor and backdrop, and the boxes that objects stand on."""


@dataclass(frozen=True)
class Classes:
    """The categories and the parts (``category/name``) of all scenes, sorted and numbered from 1.

    In class pictures, ``STUFF`` follows the categories.
    """

    categories: tuple[str, ...]
    parts: tuple[str, ...]

    @cached_property
    def category_ids(self) -> dict[str, int]:
        """The number of each category and stuff class."""
        return {name: number for number, name in enumerate((*self.categories, *STUFF), 1)}

    @cached_property
    def part_ids(self) -> dict[str, int]:
        """The number of each kind of part."""
        return {name: number for number, name in enumerate(self.parts, 1)}

    @classmethod
    def from_scenes(cls, scenes: Iterable[SceneTruth]) -> Classes:
        """Return the classes of scenes."""
        categories, parts = set[str](), set[str]()
        for scene in scenes:
            categories |= {thing.category for thing in scene.record.objects}
            parts |= {f"{part.category}/{part.name}" for part in scene.parts.values()}
        return cls(tuple(sorted(categories)), tuple(sorted(parts)))

    def class_picture(self, scene: SceneTruth, picture: PictureTruth) -> np.ndarray:
        """Return the class ``(H, W) uint16`` at each pixel's centre."""
        table = np.full(
            int(max(picture.ids.max(), *scene.ids.values(), 0)) + 1, self.category_ids[FURNITURE], np.uint16
        )
        table[0] = self.category_ids[BACKGROUND]
        for thing in scene.record.objects:
            table[scene.ids[thing.name]] = self.category_ids[thing.category]
        return table[picture.ids]

    def part_picture(self, scene: SceneTruth, picture: PictureTruth) -> np.ndarray:
        """Return the kind of part ``(H, W) uint16`` at each pixel's centre, 0 for none."""
        table = np.zeros(int(max(picture.parts.max(), *scene.parts, 0)) + 1, np.uint16)
        for number, part in scene.parts.items():
            table[number] = self.part_ids[f"{part.category}/{part.name}"]
        return table[picture.parts]
