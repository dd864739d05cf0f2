"""What a run makes of a finished batch: films of its kept episodes, by showing their states again."""

from __future__ import annotations

import json
import shutil
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from manitwin.config import Resource
from manitwin.engine.recipe import Ending, Identity
from manitwin.engine.stage import Draft, Item, Stage
from manitwin.engine.stage_parts import tell_part
from manitwin.engine.stage_runner import StageCost
from manitwin.episodes.batch import BATCHES
from manitwin.episodes.cameras import NamedCamera, named_cameras
from manitwin.episodes.episodes_stage import EPISODES
from manitwin.episodes.hdf5_file import EpisodeFile
from manitwin.episodes.replay_pictures import Replay, twin_drawable
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.episodes.video import EpisodesVideo
from manitwin.errors import EpisodesError, ManiTwinError, Rejected
from manitwin.robots.load import load_robot
from manitwin.robots.robot import Robot
from manitwin.scenes.app_config import PicturesConfig
from manitwin.scenes.furniture_pictures import lighting_of
from manitwin.scenes.scene import Furniture, Light
from manitwin.twin.store import canonical_json, sha256_of_file, sha256_of_json, write_bytes_atomically
from manitwin.twin.twin_source import TwinSource

PICTURES_RECORD = "pictures.json"
FILMS = "films/"


class PicturesRecord(BaseModel):
    """``pictures.json``: at which frame of its camera's film each episode begins."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    batch_id: str
    config_sha256: str
    revision: str
    first_frames: dict[str, int]
    files: dict[str, str]


class PicturesStage:
    """Draw the kept episodes of a batch: one film a camera, all episodes in it, frame t of an episode showing state t."""

    name = "films"
    version = "1"
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = (FILMS, "first_frames")
    needs: Resource = "cpu"
    backend = "sapien"
    model: str | None = None

    def __init__(self, settings: PicturesConfig, episodes: str, dataset: str, robot: str):
        """Take the settings, and where the episodes and their twins are."""
        self.settings, self._episodes, self._robot_name = settings, Path(episodes), robot
        self._source = TwinSource(dataset)
        self._drawn = self._to_draw = 0

    @cached_property
    def _robot(self) -> Robot:
        return load_robot(self._robot_name)

    def run(self, draft: Draft, folder: Path) -> dict[str, Any]:
        """Write ``films/<camera>.mp4``, return the field ``first_frames``."""
        cameras = named_cameras(self.settings.cameras, self._robot)
        first_frames: dict[str, int] = {}
        (folder / FILMS).mkdir()
        with ExitStack() as stack, EpisodeFile(self._episodes / batch_name(draft.twin_id) / EPISODES) as file:
            films = [stack.enter_context(self._film(folder / FILMS, camera)) for camera in cameras if len(file)]
            self._drawn, self._to_draw = 0, sum(episode.recording.steps for episode in file)
            for episode in file:
                pictures = self._frames(episode, cameras)
                spans = [film.add(shown) for film, shown in zip(films, pictures, strict=True)]
                first_frames[episode.attempt.episode_id] = spans[0].first_frame
        return {"first_frames": first_frames}

    def _film(self, folder: Path, camera: NamedCamera) -> EpisodesVideo:
        size = self.settings.size_px
        return EpisodesVideo(folder / f"{camera.name}.mp4", width_px=size, height_px=size, codec=self.settings.codec)

    def _frames(self, episode: StoredEpisode, cameras: list[NamedCamera]) -> list[list[np.ndarray]]:
        facts, size = episode.facts, self.settings.size_px
        lights = tuple(Light(**light) for light in facts["lights"])
        pictures: list[list[np.ndarray]] = [[] for _ in cameras]
        with Replay(
            self._robot,
            [twin_drawable(self._source.folder(thing.twin_id)) for thing in episode.objects],
            furniture=Furniture(**facts["furniture"]),
            lighting=lighting_of(tuple(facts["ambient"]), lights),
            seed=episode.attempt.seed % 2**31,
        ) as replay:
            states = replay.frames(episode.recording, cameras, width_px=size, height_px=size)
            for frames in islice(states, episode.recording.steps):
                for shown, frame in zip(pictures, frames, strict=True):
                    shown.append(frame.rgb)
                self._drawn += 1
                tell_part(self._drawn, self._to_draw, "frames")
        return pictures


@dataclass(frozen=True)
class PicturesRecipe:
    """Films of the batches of ``episodes``, of twins in ``dataset``, with a robot by name or file."""

    config: PicturesConfig
    episodes: str
    dataset: str
    robot: str

    @cached_property
    def sha256(self) -> str:
        """The digest of what decides a picture."""
        return sha256_of_json([self.config.model_dump(mode="json", exclude={"run"}), PicturesStage.version])

    @property
    def tables(self) -> None:
        """There are none."""

    @property
    def seed(self) -> int:
        """Nothing is random but the furniture's looks, which are the episode's own."""
        return 0

    @property
    def record(self) -> str:
        """The record of a batch's pictures."""
        return PICTURES_RECORD

    def folder_of(self, twin_id: str) -> str:
        """Return the folder of a batch's pictures."""
        return batch_name(twin_id)

    def identify(self, item: Item) -> Identity:
        """Return the batch's id."""
        return Identity(item.text or "", "films")

    def stages(self, kind: str) -> list[Stage]:
        """Return the one stage."""
        return [PicturesStage(self.config, self.episodes, self.dataset, self.robot)]

    def finish(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> Ending:
        """Write the folder of a batch's pictures."""
        if rejected is not None:
            raise ManiTwinError(f"batch {draft.twin_id}: {rejected}; pictures are never rejected")
        shutil.rmtree(fresh, ignore_errors=True)
        shutil.copytree(draft.path(FILMS), fresh)
        said: dict[str, Any] = {
            "batch_id": draft.twin_id,
            "config_sha256": self.sha256,
            "first_frames": draft.field("first_frames"),
            "files": {path.name: sha256_of_file(path) for path in sorted(fresh.iterdir())},
        }
        record = PicturesRecord(**said, revision=sha256_of_json(said))
        write_bytes_atomically(fresh / PICTURES_RECORD, canonical_json(record.model_dump(mode="json")).encode())
        return _ending(record)

    def ending_of(self, record: bytes) -> Ending | None:
        """Return how a batch ended; None where this recipe would make other pictures."""
        try:
            pictures = PicturesRecord(**json.loads(record))
        except (ValueError, ValidationError):
            return None
        return _ending(pictures) if pictures.config_sha256 == self.sha256 else None


def batch_name(batch_id: str) -> str:
    """Return a batch's folder below the root of the episodes, and that of its pictures below theirs."""
    return f"{BATCHES}/{batch_id[:2]}/{batch_id}"


def read_pictures(folder: Path) -> PicturesRecord:
    """Read the record of a batch's pictures; raises EpisodesError where there is none."""
    path = folder / PICTURES_RECORD
    try:
        return PicturesRecord(**json.loads(path.read_bytes()))
    except (OSError, ValueError) as error:
        raise EpisodesError(f"{path}: no record of pictures ({error}); run manitwin render again") from error


def _ending(record: PicturesRecord) -> Ending:
    return Ending("accepted", record.revision, None, f"{len(record.first_frames)} episodes drawn")
