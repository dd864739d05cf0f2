"""Print the cost of the video codecs, one row each: CPU and bytes per picture, similarity to the original, and reading cost.

    manitwin trajectories TWINS -n 10 -o EPISODES
    python benchmarks/films.py EPISODES --size 256

The pictures are those of one batch of kept episodes, rendered again and held in memory. The first line is the cost of rendering a
picture.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from manitwin.episodes.cameras import named_cameras
from manitwin.episodes.collect import batch_folders
from manitwin.episodes.configuration import read_configuration
from manitwin.episodes.episode_pictures import EpisodeFilmsStage
from manitwin.episodes.episodes_stage import EPISODES
from manitwin.episodes.hdf5_file import EpisodeFile
from manitwin.episodes.settings import PicturesConfig
from manitwin.episodes.video import VideoWriter
from manitwin.episodes.video_encoders import CODECS
from manitwin.episodes.video_reading import VideoReader
from manitwin.robots.load import load_robot

AT_RANDOM = 30
"""Number of pictures that are read at random, each from a newly opened video."""


def row(camera: str, codec: str, pictures: np.ndarray, place: Path) -> str:
    """Write and read a video of pictures ``(N, H, W, 3) uint8``, and return its figures as a row."""
    count, height, width = pictures.shape[:3]
    begun = time.process_time()
    with VideoWriter(place, width_px=width, height_px=height, codec=codec) as video:  # type: ignore[arg-type]
        video.add(pictures)
    written = time.process_time()
    with VideoReader(place) as film:
        squared = [np.mean((read.astype(float) - drawn) ** 2) for read, drawn in zip(film, pictures, strict=True)]
    compared = time.process_time()
    with VideoReader(place) as film:
        assert sum(1 for _ in film) == count
    read = time.process_time()
    for frame in np.random.default_rng(0).integers(0, count, AT_RANDOM):
        with VideoReader(place) as film:
            film.picture(int(frame))
    sought = time.process_time()
    decibels = np.mean(10 * np.log10(255**2 / np.array(squared)))
    write_ms, read_ms, seek_ms = (
        1000 * (b - a) / n for a, b, n in ((begun, written, count), (compared, read, count), (read, sought, AT_RANDOM))
    )
    return (
        f"{camera:6} {codec:6} {write_ms:6.2f} ms  {place.stat().st_size / count / 1000:5.2f} kB  {decibels:.1f} dB"
        f"  read {read_ms:.2f} ms, at random {seek_ms:.1f} ms"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("episodes", type=Path)
    parser.add_argument("--size", type=int, default=256)
    given = parser.parse_args()
    configuration = read_configuration(given.episodes)
    settings = PicturesConfig(size_px=given.size)
    robot = configuration["robot"]
    cameras = named_cameras(settings.cameras, load_robot(robot))
    stage = EpisodeFilmsStage(settings, str(given.episodes), configuration["dataset"], robot)
    drawn: list[list[np.ndarray]] = [[] for _ in cameras]
    begun = time.process_time()
    with EpisodeFile(next(iter(batch_folders(given.episodes))) / EPISODES) as file:
        for episode in file:
            for shown, pictures in zip(drawn, stage.render_pictures(episode, cameras), strict=True):
                shown += pictures
    spent = time.process_time() - begun
    print(
        f"{sum(map(len, drawn))} pictures of {given.size} px: {1000 * spent / sum(map(len, drawn)):.1f} ms to draw one"
    )
    with tempfile.TemporaryDirectory() as scratch:
        for camera, pictures in zip(cameras, drawn, strict=True):
            for codec in CODECS:
                print(row(camera.name, codec, np.stack(pictures), Path(scratch) / f"{camera.name}-{codec}.mp4"))
