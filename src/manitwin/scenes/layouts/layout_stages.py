"""The stages that make a layout: the sampling, and its pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from manitwin.config import Resource
from manitwin.engine.stage import Draft
from manitwin.engine.task import Payload
from manitwin.scenes.app_config import LayoutsConfig, LayoutSettings
from manitwin.scenes.layouts.pool import pool_of
from manitwin.scenes.layouts.sample import sample_layout
from manitwin.scenes.scene import SCENE
from manitwin.scenes.scene_file import read_scene, write_scene
from manitwin.twin.loaded_twin import TwinSource

PICTURES = "pictures/"


@dataclass(frozen=True)
class LayoutNumber(Payload):
    """The number of a layout to sample, from 0."""

    number: int

    @property
    def title(self) -> str:
        """The layout's number in words."""
        return f"layout {self.number}"

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> LayoutNumber:
        """Return the number that a ledger keeps; those of earlier versions kept it as the text ``layout 17``."""
        return cls(int(fields["text"].split()[-1]) if "text" in fields else fields["number"])


class LayoutStage:
    """Sample the layout of a number."""

    name = "layout"
    version = "1"
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = (SCENE,)
    needs: Resource = "cpu"
    backend = "sapien"
    model: str | None = None

    def __init__(self, settings: LayoutSettings, dataset: str):
        self.settings: BaseModel = settings
        self._layout, self._dataset = settings, dataset

    def run(self, draft: Draft[LayoutNumber], folder: Path) -> dict[str, Any]:
        """Write the scene; raises Rejected where none could be made."""
        number = draft.payload.number
        write_scene(sample_layout(pool_of(self._dataset), self._layout, draft.seed, number), folder)
        return {}


class PicturesStage:
    """Draw a scene from its cameras: colours, depth, normals and instance ids."""

    name = "pictures"
    version = "2"
    reads: tuple[str, ...] = (SCENE,)
    writes: tuple[str, ...] = (PICTURES,)
    needs: Resource = "cpu"
    backend = "sapien"
    model: str | None = None

    def __init__(self, settings: LayoutsConfig, dataset: str):
        self.settings: BaseModel = settings
        self._px, self._source = settings.picture_px, TwinSource(dataset)

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write the pictures of every camera."""
        from manitwin.scenes.layouts.preview import write_previews  # needs a renderer

        scene = read_scene(draft.path(SCENE))
        write_previews(scene, self._source.folder, folder / PICTURES, size_px=self._px)
        return {}
