"""Rendering of recorded episodes: videos of the kept episodes of each batch."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from pydantic import Field, ValidationError

from manitwin.config import Resource
from manitwin.engine.drive import RunOptions, RunReport, drive
from manitwin.engine.folder_recipe import FolderRecipe, FolderRecord
from manitwin.engine.ledger.location import CONFIG
from manitwin.engine.recipe import Ending, Identity
from manitwin.engine.stage import Draft, Stage, report_progress
from manitwin.engine.stage_runner import StageCost
from manitwin.engine.task import Payload
from manitwin.episodes.batch import batch_name
from manitwin.episodes.cameras import NamedCamera, named_cameras
from manitwin.episodes.collect import LEROBOT, any_granules, batch_folders, stored_episodes
from manitwin.episodes.configuration import read_configuration
from manitwin.episodes.downsampling import rows_per_frame
from manitwin.episodes.episode_room import episode_room, granules_of
from manitwin.episodes.episodes_stage import EPISODES
from manitwin.episodes.hdf5_file import EpisodeFile
from manitwin.episodes.lerobot.videos import CameraVideos, Clip
from manitwin.episodes.lerobot.write import LeRobotSummary, write_lerobot
from manitwin.episodes.replay_pictures import EpisodeReplay, twin_drawable
from manitwin.episodes.settings import PicturesConfig
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.episodes.video import VideoWriter
from manitwin.errors import EpisodesError, Rejected
from manitwin.formats.json_file import read_json_object
from manitwin.formats.printable import printable_line
from manitwin.robots.load import load_robot
from manitwin.robots.robot import Robot
from manitwin.scenes.furniture_pictures import render_lighting
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.store import digests_below, sha256_of_json

PICTURES_RECORD = "pictures.json"
FILMS = "films/"

PICTURES = "pictures"


@dataclass(frozen=True)
class BatchRendering(Payload):
    """A batch whose kept episodes are to be rendered."""

    batch_id: str

    @property
    def title(self) -> str:
        """Display title."""
        return f"pictures of {self.batch_id}"

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> BatchRendering:
        """Return the batch stored in a ledger; earlier versions stored its id as text."""
        return cls(fields["text"] if "text" in fields else fields["batch_id"])


class PicturesRecord(FolderRecord):
    """``pictures.json``: the first frame of each episode in its cameras' videos, and the cameras' intrinsics and poses."""

    batch_id: str
    first_frames: dict[str, int]
    cameras: dict[str, dict[str, Any]] = Field(default_factory=dict)
    files: dict[str, str]


class EpisodeFilmsStage:
    """Stage that renders a batch's kept episodes: one video per camera; frame t of an episode shows state t."""

    name = "films"
    version = "8"
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = (FILMS, "first_frames", "cameras")
    needs: Resource = "cpu"
    backend = "sapien"
    model: str | None = None

    def __init__(self, settings: PicturesConfig, episodes: str, dataset: str, robot: str):
        """Take the settings, and the locations of the episodes and their twins."""
        self.settings, self._episodes, self._robot_name = settings, Path(episodes), robot
        self._source = TwinSource(dataset)
        self._drawn = self._to_draw = 0

    @cached_property
    def _robot(self) -> Robot:
        return load_robot(self._robot_name)

    def run(self, draft: Draft[BatchRendering], folder: Path) -> dict[str, Any]:
        """Write ``films/<camera>.mp4``; return the fields ``first_frames`` and ``cameras``."""
        cameras = named_cameras(self.settings.cameras, self._robot)
        first_frames: dict[str, int] = {}
        (folder / FILMS).mkdir()
        with ExitStack() as stack, EpisodeFile(self._episodes / batch_name(draft.payload.batch_id) / EPISODES) as file:
            films = [stack.enter_context(self._film(folder / FILMS, camera)) for camera in cameras if len(file)]
            self._drawn, self._to_draw = 0, sum(self._frames(episode) for episode in file)
            for episode in file:
                pictures = self.render_pictures(episode, cameras)
                spans = [film.add(shown) for film, shown in zip(films, pictures, strict=True)]
                first_frames[episode.attempt.episode_id] = spans[0].first_frame
        size = self.settings.size_px
        return {"first_frames": first_frames, "cameras": {each.name: each.to_json(size, size) for each in cameras}}

    def _film(self, folder: Path, camera: NamedCamera) -> VideoWriter:
        size = self.settings.size_px
        path, rate_hz = folder / f"{camera.name}.mp4", self.settings.rate_hz
        return VideoWriter(path, width_px=size, height_px=size, codec=self.settings.codec, rate_hz=rate_hz)

    def _frames(self, episode: StoredEpisode) -> int:
        return episode.recording.steps // rows_per_frame(self.settings.rate_hz)

    def render_pictures(self, episode: StoredEpisode, cameras: list[NamedCamera]) -> list[list[np.ndarray]]:
        """Return the pictures ``(H, W, 3) uint8`` of each camera, one per state at the settings' rate."""
        room, size = episode_room(episode), self.settings.size_px
        pictures: list[list[np.ndarray]] = [[] for _ in cameras]
        with EpisodeReplay(
            self._robot,
            [twin_drawable(self._source.folder(thing.twin_id), size) for thing in episode.objects],
            furniture=room.furniture,
            fixtures=room.fixture_boxes,
            granules=granules_of(episode),
            lighting=render_lighting(room.ambient, room.lights),
            seed=episode.attempt.seed % 2**31,
            picture_px=size,
        ) as replay:
            every = rows_per_frame(self.settings.rate_hz)
            states = replay.frames(episode.recording, cameras, width_px=size, height_px=size, every=every)
            for frames in islice(states, self._frames(episode)):
                for shown, frame in zip(pictures, frames, strict=True):
                    shown.append(frame.rgb)
                self._drawn += 1
                report_progress(self._drawn, self._to_draw, "frames")
        return pictures


@dataclass(frozen=True)
class PicturesRecipe(FolderRecipe[PicturesRecord]):
    """Videos of the batches of ``episodes``, with twins in ``dataset`` and a robot by name or file."""

    payload = BatchRendering
    record = PICTURES_RECORD
    record_type = PicturesRecord
    can_reject = False
    made_again = "they are drawn again"

    config: PicturesConfig
    episodes: str
    dataset: str
    robot: str

    @cached_property
    def sha256(self) -> str:
        """Digest of everything that determines a picture."""
        return sha256_of_json([self.config.model_dump(mode="json", exclude={"run"}), EpisodeFilmsStage.version])

    @property
    def seed(self) -> int:
        """Constant: only the appearance of furniture is random, and it is seeded by the episode."""
        return 0

    def folder_of(self, item_id: str) -> str:
        """Return the folder of a batch's pictures."""
        return batch_name(item_id)

    def identify(self, payload: BatchRendering) -> Identity:
        """Return the batch's identity."""
        return Identity(payload.batch_id, "films")

    def stages(self, kind: str) -> list[Stage]:
        """Return the single stage."""
        return [EpisodeFilmsStage(self.config, self.episodes, self.dataset, self.robot)]

    def write(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> PicturesRecord:
        """Write the folder of a batch's pictures."""
        shutil.copytree(draft.path(FILMS), fresh, dirs_exist_ok=True)
        fields = {name: draft.field(name) for name in ("first_frames", "cameras")}
        said = {"batch_id": draft.item_id, **fields, "files": digests_below(fresh)}
        return self.write_record(fresh, said)

    def ending(self, record: PicturesRecord) -> Ending:
        """Return the ending stated by a record of pictures."""
        return Ending("accepted", record.revision, None, f"{len(record.first_frames)} episodes drawn")


_DRAW = "run manitwin render again"


def read_pictures(folder: Path) -> PicturesRecord:
    """Read the record of a batch's pictures; raises EpisodesError if there is none."""
    path = folder / PICTURES_RECORD
    try:
        return PicturesRecord(**read_json_object(path, EpisodesError, inside=folder, name=str(path), remedy=_DRAW))
    except ValidationError as error:
        said = printable_line(str(error).split("\n")[0], max_characters=120)
        raise EpisodesError(f"{path}: not a record of pictures ({said}); {_DRAW}") from error


def render_batches(
    out: Path,
    config: PicturesConfig,
    *,
    twins: str | Path | None = None,
    **run: Unpack[RunOptions],
) -> RunReport:
    """Render the kept episodes of a finished run below ``out/pictures``; existing results are kept.

    ``twins`` is the current location of the twins; None: that recorded with the episodes. Raises EpisodesError if there are
    no episodes, UsageError for an unknown camera.
    """
    said = _run_sources(out)
    named_cameras(config.cameras, load_robot(said["robot"]))
    dataset = said["dataset"] if twins is None else DatasetRoot(twins).absolute()
    TwinSource(dataset)
    drawings = (BatchRendering(folder.name) for folder in batch_folders(out))
    recipe = PicturesRecipe(config, str(out.resolve()), dataset, said["robot"])
    return drive(
        recipe, drawings, DatasetRoot(out / PICTURES), config.run,
        configuration={"kind": PICTURES, **config.model_dump(mode="json")}, **run,
    )  # fmt: skip


def write_with_pictures(out: Path, cameras: tuple[str, ...], rate_hz: int) -> LeRobotSummary:
    """Write the LeRobot data set of a run again with the videos of these cameras, at their rate."""
    folders = batch_folders(out)
    clips: dict[str, dict[str, Clip]] = {camera: {} for camera in cameras}
    pinholes: dict[str, dict[str, Any]] = {}
    for folder in folders:
        place = out / PICTURES / batch_name(folder.name)
        record = read_pictures(place)
        pinholes |= record.cameras
        for episode_id, first in record.first_frames.items():
            for camera in cameras:
                clips[camera][episode_id] = Clip(place / f"{camera}.mp4", first)
    videos = [CameraVideos(camera, clips[camera], pinholes.get(camera, {})) for camera in cameras]
    granules = any_granules(folders)
    return write_lerobot(stored_episodes(folders), out / LEROBOT, videos=videos, granules=granules, rate_hz=rate_hz)


def _run_sources(out: Path) -> dict[str, str]:
    if not os.path.lexists(out / CONFIG):
        raise EpisodesError(f"{out}/{CONFIG}: no episodes found; create some with `manitwin trajectories`")
    return read_configuration(out)
