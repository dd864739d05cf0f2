"""What a run makes of a layout's number: a folder with its scene. The engine drives it like the building of twins."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

from manitwin.engine.folder_recipe import FolderRecipe, FolderRecord
from manitwin.engine.recipe import Ending, Identity
from manitwin.engine.stage import Draft, Stage
from manitwin.engine.stage_runner import StageCost
from manitwin.errors import Rejected
from manitwin.scenes.app_config import LayoutsConfig
from manitwin.scenes.layouts.layout_stages import PICTURES, LayoutNumber, LayoutStage, PicturesStage
from manitwin.scenes.scene import SCENE
from manitwin.scenes.scene_file import parse_scene
from manitwin.scenes.scene_folders import scene_name
from manitwin.twin.store import sha256_of_json

LAYOUT_RECORD = "layout.json"
LAYOUT_SCHEMA_VERSION = 1


class LayoutRecord(FolderRecord):
    """``layout.json``: how the sampling of a layout ended; ``reason`` is that of a rejection."""

    schema_version: int
    scene_id: str
    reason: str | None
    detail: str


@dataclass(frozen=True)
class LayoutsRecipe(FolderRecipe[LayoutRecord]):
    """Layouts of the twins of ``dataset``, one for each number."""

    payload: ClassVar[type[LayoutNumber]] = LayoutNumber
    record: ClassVar[str] = LAYOUT_RECORD
    record_type: ClassVar[type[LayoutRecord]] = LayoutRecord

    config: LayoutsConfig
    dataset: str

    @cached_property
    def sha256(self) -> str:
        """The digest of what decides a layout, but for the twins: their revisions stand in the scene's record."""
        decides = self.config.model_dump(mode="json", exclude={"run"})
        return sha256_of_json([decides, LayoutStage.version, PicturesStage.version])

    @property
    def seed(self) -> int:
        """The seed of everything random."""
        return self.config.seed

    def folder_of(self, item_id: str) -> str:
        """Return the scene's folder."""
        return scene_name(item_id)

    def identify(self, payload: LayoutNumber) -> Identity:
        """Return the scene's id."""
        return Identity(f"layout_{self.seed}_{payload.number:06d}", "layout")

    def stages(self, kind: str) -> list[Stage]:
        """Return the sampling, and the drawing where pictures are wanted."""
        stages: list[Stage] = [LayoutStage(self.config.layout, self.dataset)]
        if self.config.pictures:
            stages.append(PicturesStage(self.config, self.dataset))
        return stages

    def write(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> LayoutRecord:
        """Write the layout's folder: its scene, and its pictures where there are any; nothing of one that was rejected."""
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
        return self.seal(fresh, said, decided_by=scene_bytes.decode())

    def ending(self, record: LayoutRecord) -> Ending:
        """Return how a layout's record says that it ended."""
        return Ending("rejected" if record.reason else "accepted", record.revision, record.reason, record.detail)
