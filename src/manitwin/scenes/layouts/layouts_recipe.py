"""Recipe of layouts: stages that sample and render a scene by its number, and the writing of its folder."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from manitwin.config import Resource
from manitwin.engine.folder_recipe import FolderRecipe, FolderRecord
from manitwin.engine.recipe import Ending, Identity
from manitwin.engine.stage import Draft, Stage
from manitwin.engine.stage_runner import StageCost
from manitwin.engine.task import Payload
from manitwin.errors import Rejected
from manitwin.scenes.layouts.pool import cached_pool
from manitwin.scenes.layouts.sample import sample_layout
from manitwin.scenes.scene import SCENE
from manitwin.scenes.scene_files import parse_scene, read_scene, read_scene_content, scene_name, write_scene
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.store import sha256_of_json

PICTURES = "pictures/"

LAYOUT_RECORD = "layout.json"
LAYOUT_SCHEMA_VERSION = 1


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
        """Return the number stored in a ledger; earlier versions stored the text ``layout 17``."""
        return cls(int(fields["text"].split()[-1]) if "text" in fields else fields["number"])


class LayoutStage:
    """Sample the layout of a number, or reuse an existing scene, which is never replaced.

    Twins or this stage may have changed since, but tasks and episodes refer to the scene by its id.
    """

    name = "layout"
    version = "3"
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = (SCENE,)
    needs: Resource = "cpu"
    backend = "sapien"
    model: str | None = None

    def __init__(self, settings: LayoutSettings, dataset: str, out: str | None = None):
        self.settings: BaseModel = settings
        self._layout, self._dataset = settings, dataset
        self._out = None if out is None else DatasetRoot(out)

    def run(self, draft: Draft[LayoutNumber], folder: Path) -> dict[str, Any]:
        """Write the scene; raises Rejected if sampling failed, UsageError if a newer version wrote the existing one."""
        there = None if self._out is None else read_scene_content(self._out, draft.item_id)
        if there is not None:
            (folder / SCENE).write_bytes(there)
            return {}
        number = draft.payload.number
        write_scene(sample_layout(cached_pool(self._dataset), self._layout, draft.seed, number), folder)
        return {}


class ScenePicturesStage:
    """Render a scene from its cameras: colour, depth, normals and instance ids."""

    name = "pictures"
    version = "6"
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
        from manitwin.scenes.layouts.previews import write_previews  # needs a renderer

        scene = read_scene(draft.path(SCENE))
        write_previews(scene, self._source.folder, folder / PICTURES, size_px=self._px)
        return {}


class LayoutRecord(FolderRecord):
    """``layout.json``: the outcome of sampling a layout; ``reason`` is that of a rejection."""

    schema_version: int
    scene_id: str
    reason: str | None
    detail: str


@dataclass(frozen=True)
class LayoutsRecipe(FolderRecipe[LayoutRecord]):
    """Layouts of twins from ``dataset``, one for each number; existing scenes below ``out`` are reused."""

    payload = LayoutNumber
    record = LAYOUT_RECORD
    record_type = LayoutRecord
    made_again = "their scenes stay as they are, pictures that they have are drawn again"

    config: LayoutsConfig
    dataset: str
    out: str | None = None

    @cached_property
    def sha256(self) -> str:
        """Digest of what determines a layout, except the twins, whose revisions are in the scene's record."""
        decides = self.config.model_dump(mode="json", exclude={"run"})
        return sha256_of_json([decides, LayoutStage.version, ScenePicturesStage.version])

    @property
    def seed(self) -> int:
        """The random seed."""
        return self.config.seed

    def folder_of(self, item_id: str) -> str:
        """Return the scene's folder."""
        return scene_name(item_id)

    def identify(self, payload: LayoutNumber) -> Identity:
        """Return the scene's id."""
        return Identity(f"layout_{self.seed}_{payload.number:06d}", "layout")

    def stages(self, kind: str) -> list[Stage]:
        """Return the sampling stage, and the rendering stage if pictures are requested."""
        stages: list[Stage] = [LayoutStage(self.config.layout, self.dataset, self.out)]
        if self.config.pictures:
            stages.append(ScenePicturesStage(self.config, self.dataset))
        return stages

    def write(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> LayoutRecord:
        """Write the layout's folder: its scene, and its pictures if there are any; nothing for a rejected one."""
        detail, scene_bytes = "" if rejected is None else rejected.detail, b""
        if rejected is None:
            scene_bytes = draft.path(SCENE).read_bytes()
            (fresh / SCENE).write_bytes(scene_bytes)
            scene = parse_scene(scene_bytes)
            detail = f"{len(scene.objects)} objects on a {scene.furniture.kind}, {scene.repairs} repairs"
            if PICTURES in draft.paths:
                shutil.copytree(draft.path(PICTURES), fresh / PICTURES)
        said = {
            "schema_version": LAYOUT_SCHEMA_VERSION,
            "scene_id": draft.item_id,
            "reason": None if rejected is None else rejected.reason,
            "detail": detail,
        }
        return self.write_record(fresh, said, decided_by=scene_bytes.decode())

    def ending(self, record: LayoutRecord) -> Ending:
        """Return the outcome stated in a layout's record."""
        return Ending("rejected" if record.reason else "accepted", record.revision, record.reason, record.detail)
