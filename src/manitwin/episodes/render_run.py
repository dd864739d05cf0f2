"""Draw all kept episodes of a run, and write them into its LeRobot data set."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from manitwin.engine.events import ItemEnded, OnStage
from manitwin.episodes.batch import batch_name
from manitwin.episodes.cameras import named_cameras
from manitwin.episodes.collect import LEROBOT, batch_folders, stored_episodes
from manitwin.episodes.lerobot.videos import CameraVideos, Clip
from manitwin.episodes.lerobot.write import Written, write_lerobot
from manitwin.episodes.pictures_recipe import BatchDrawing, PicturesRecipe, read_pictures
from manitwin.errors import EpisodesError
from manitwin.pipeline.dataset_run import CONFIG, ExecutorName, RunReport, drive
from manitwin.robots.load import load_robot
from manitwin.scenes.app_config import PicturesConfig
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import TwinSource

PICTURES = "pictures"


def draw_episodes(
    out: Path,
    config: PicturesConfig,
    *,
    twins: str | Path | None = None,
    executor: ExecutorName = "local",
    address: str | None = None,
    on_start: Callable[[int, int], None] = lambda items, opened: None,
    on_stage: OnStage = lambda event: None,
    on_ended: Callable[[ItemEnded], None] = lambda event: None,
) -> RunReport:
    """Draw the kept episodes of a finished run below ``out/pictures``; what is there already stays.

    ``twins`` names where their twins are now, None: where they were as the episodes were made.
    Raises EpisodesError where there are none, UsageError for an unknown camera.
    """
    said = _said(out)
    named_cameras(config.cameras, load_robot(said["robot"]))
    dataset = said["dataset"] if twins is None else DatasetRoot(twins).absolute()
    TwinSource(dataset)
    drawings = (BatchDrawing(folder.name) for folder in batch_folders(out))
    recipe = PicturesRecipe(config, str(out.resolve()), dataset, said["robot"])
    return drive(
        recipe,
        drawings,
        DatasetRoot(out / PICTURES),
        config.run,
        configuration={"kind": PICTURES, **config.model_dump(mode="json")},
        executor=executor,
        address=address,
        on_start=on_start,
        on_stage=on_stage,
        on_ended=on_ended,
    )


def write_with_pictures(out: Path, cameras: tuple[str, ...]) -> Written:
    """Write the LeRobot data set of a run again, with the films of these cameras."""
    folders = batch_folders(out)
    clips: dict[str, dict[str, Clip]] = {camera: {} for camera in cameras}
    for folder in folders:
        place = out / PICTURES / batch_name(folder.name)
        for episode_id, first in read_pictures(place).first_frames.items():
            for camera in cameras:
                clips[camera][episode_id] = Clip(place / f"{camera}.mp4", first)
    videos = [CameraVideos(camera, clips[camera]) for camera in cameras]
    return write_lerobot(stored_episodes(folders), out / LEROBOT, videos=videos)


def _said(out: Path) -> dict[str, str]:
    try:
        said: dict[str, str] = json.loads((out / CONFIG).read_bytes())
    except (OSError, ValueError) as error:
        raise EpisodesError(
            f"{out}/{CONFIG}: no episodes there ({error}); `manitwin trajectories` makes some"
        ) from error
    if "robot" not in said:
        raise EpisodesError(f"{out}/{CONFIG}: not of episodes; give the folder that `manitwin trajectories` wrote")
    return said
