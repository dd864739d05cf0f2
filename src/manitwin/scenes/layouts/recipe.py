"""What a run makes of a layout's number: a folder with its scene. The engine drives it like the building of twins."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from manitwin.engine.recipe import Ending, Identity
from manitwin.engine.stage import Draft, Item, Stage
from manitwin.engine.stage_runner import StageCost
from manitwin.errors import Rejected
from manitwin.scenes.app_config import LayoutsConfig
from manitwin.scenes.layouts.layout_stages import PICTURES, LayoutStage, PicturesStage
from manitwin.scenes.scene import SCENE
from manitwin.scenes.scene_file import parse_scene
from manitwin.scenes.scene_folders import scene_name
from manitwin.twin.store import canonical_json, sha256_of_json, write_bytes_atomically

LAYOUT_RECORD = "layout.json"
LAYOUT_SCHEMA_VERSION = 1


class LayoutRecord(BaseModel):
    """``layout.json``: how the sampling of a layout ended; ``reason`` is that of a rejection."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    schema_version: int
    scene_id: str
    config_sha256: str
    revision: str
    reason: str | None
    detail: str


@dataclass(frozen=True)
class LayoutsRecipe:
    """Layouts of the twins of ``dataset``, one for each number."""

    config: LayoutsConfig
    dataset: str

    @cached_property
    def sha256(self) -> str:
        """The digest of what decides a layout, but for the twins: their revisions stand in the scene's record."""
        decides = self.config.model_dump(mode="json", exclude={"run"})
        return sha256_of_json([decides, LayoutStage.version, PicturesStage.version])

    @property
    def tables(self) -> None:
        """There are none."""

    @property
    def seed(self) -> int:
        """The seed of everything random."""
        return self.config.seed

    @property
    def record(self) -> str:
        """The record of a layout, accepted or rejected."""
        return LAYOUT_RECORD

    def items(self, count: int) -> Iterator[Item]:
        """Yield the first so many layouts as items of a run."""
        return (Item(file=None, text=f"layout {number}") for number in range(count))

    def folder_of(self, twin_id: str) -> str:
        """Return the scene's folder."""
        return scene_name(twin_id)

    def identify(self, item: Item) -> Identity:
        """Return the scene's id."""
        return Identity(f"layout_{self.seed}_{_number(item):06d}", "layout")

    def stages(self, kind: str) -> list[Stage]:
        """Return the sampling, and the drawing where pictures are wanted."""
        stages: list[Stage] = [LayoutStage(self.config.layout, self.dataset)]
        if self.config.pictures:
            stages.append(PicturesStage(self.config, self.dataset))
        return stages

    def finish(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> Ending:
        """Write the layout's folder."""
        shutil.rmtree(fresh, ignore_errors=True)
        fresh.mkdir(parents=True)
        detail = "" if rejected is None else rejected.detail
        if rejected is None:
            shutil.copyfile(draft.path(SCENE), fresh / SCENE)
            scene = parse_scene((fresh / SCENE).read_bytes())
            detail = f"{len(scene.objects)} objects on a {scene.furniture.kind}, {scene.repairs} repairs"
            if PICTURES in draft.paths:
                shutil.copytree(draft.path(PICTURES), fresh / PICTURES)
        said: dict[str, Any] = {
            "schema_version": LAYOUT_SCHEMA_VERSION,
            "scene_id": draft.twin_id,
            "config_sha256": self.sha256,
            "reason": None if rejected is None else rejected.reason,
            "detail": detail,
        }
        scene_bytes = draft.path(SCENE).read_bytes() if rejected is None else b""
        record = LayoutRecord(**said, revision=sha256_of_json([said, scene_bytes.decode()]))
        write_bytes_atomically(fresh / LAYOUT_RECORD, canonical_json(record.model_dump(mode="json")).encode())
        return _ending(record)

    def ending_of(self, record: bytes) -> Ending | None:
        """Return how a layout ended; None where this recipe would make another one."""
        try:
            layout = LayoutRecord(**json.loads(record))
        except (ValueError, ValidationError):
            return None
        return _ending(layout) if layout.config_sha256 == self.sha256 else None


def _ending(record: LayoutRecord) -> Ending:
    return Ending("rejected" if record.reason else "accepted", record.revision, record.reason, record.detail)


def _number(item: Item) -> int:
    return int((item.text or "").split()[-1])
