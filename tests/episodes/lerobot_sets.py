"""LeRobot data sets written of made-up episodes, with and without pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from synthetic_episodes import episode

from manitwin.episodes.downsampling import downsample
from manitwin.episodes.lerobot.videos import CameraVideos, Clip
from manitwin.episodes.lerobot.write import LeRobotSummary, write_lerobot
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.episodes.video import VideoWriter
from manitwin.episodes.video_encoders import Codec

HEIGHT_PX, WIDTH_PX = 48, 64


def episodes(count: int = 5) -> list[StoredEpisode]:
    return [episode(i) for i in range(count)]


def written(place: Path, count: int = 5, *, size_mb: int = 100, videos: Sequence[CameraVideos] = ()) -> LeRobotSummary:
    return write_lerobot(episodes(count), place, data_files_size_in_mb=size_mb, videos=videos)


def color_rgb(number: int) -> np.ndarray:
    """The colour that all pictures of an episode have, but for a bar."""
    return np.array([40 * number, 200 - 30 * number, 90])


def picture(number: int, frame: int, steps: int) -> np.ndarray:
    """RGB uint8: the episode's colour; as many columns are white as frames are past."""
    image = np.empty((HEIGHT_PX, WIDTH_PX, 3), np.uint8)
    image[:] = color_rgb(number)
    image[:, : round(WIDTH_PX * frame / steps)] = 255
    return image


def camera(
    folder: Path, given: Sequence[StoredEpisode], name: str = "front", codec: Codec = "av1", rate_hz: int = 20
) -> CameraVideos:
    """Pictures of all episodes, two an mp4, with an extra picture of the last state behind each."""
    folder.mkdir(parents=True, exist_ok=True)
    clips: dict[str, Clip] = {}
    for number in range(0, len(given), 2):
        path = folder / f"{name}_{number}.mp4"
        with VideoWriter(path, width_px=WIDTH_PX, height_px=HEIGHT_PX, codec=codec, rate_hz=rate_hz) as video:
            for offset, one in enumerate(given[number : number + 2]):
                steps = downsample(one.recording, rate_hz).steps
                span = video.add(picture(number + offset, t, steps) for t in range(steps + 1))
                clips[one.attempt.episode_id] = Clip(path, span.first_frame)
    return CameraVideos(name, clips)
