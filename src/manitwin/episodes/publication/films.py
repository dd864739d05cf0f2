"""Films of the episodes that go out: whole files where all of a file go, others without the pictures of those that stay."""

from __future__ import annotations

import json
from collections.abc import Iterator, Set
from itertools import pairwise
from pathlib import Path
from typing import cast

import cv2
import numpy as np

from manitwin.episodes.lerobot.videos import CameraVideos, Clip, video_facts
from manitwin.episodes.pictures_recipe import batch_name, read_pictures
from manitwin.episodes.render_run import PICTURES
from manitwin.episodes.video import Codec, EpisodesVideo
from manitwin.errors import EpisodesError
from manitwin.pipeline.dataset_run import CONFIG


def cameras_of(episodes: Path) -> tuple[str, ...]:
    """Return the cameras that a run was drawn from; none where it was not drawn."""
    path = episodes / PICTURES / CONFIG
    return tuple(json.loads(path.read_bytes())["cameras"]) if path.is_file() else ()


def films_of(episodes: Path, batches: list[Path], allowed: Set[str], scratch: Path) -> list[CameraVideos]:
    """Return each camera's films with the pictures of ``allowed`` episodes alone.

    A film that shows others too is cut: what may go out of it is encoded again, with the same codec, below ``scratch``. Raises
    EpisodesError for a batch that was not drawn.
    """
    cameras = cameras_of(episodes)
    clips: dict[str, dict[str, Clip]] = {camera: {} for camera in cameras}
    for batch in batches if cameras else ():
        place = episodes / PICTURES / batch_name(batch.name)
        first_frames = read_pictures(place).first_frames
        kept = {name: first for name, first in first_frames.items() if name in allowed}
        for camera in cameras if kept else ():
            film = place / f"{camera}.mp4"
            if len(kept) == len(first_frames):
                clips[camera] |= {name: Clip(film, first) for name, first in kept.items()}
            else:
                clips[camera] |= cut_film(film, first_frames, allowed, scratch / f"{batch.name}-{camera}.mp4")
    return [CameraVideos(camera, clips[camera]) for camera in cameras]


def cut_film(film: Path, first_frames: dict[str, int], allowed: Set[str], place: Path) -> dict[str, Clip]:
    """Write the ``allowed`` episodes of a film, which follow each other without gaps, to another; returns where they are."""
    facts = video_facts(film)
    order = sorted(first_frames, key=first_frames.__getitem__)
    ends = [*(later for _, later in pairwise(first_frames[name] for name in order)), facts.frames]
    clips: dict[str, Clip] = {}
    pictures = _decoded(film)
    with EpisodesVideo(
        place, width_px=facts.width_px, height_px=facts.height_px, codec=cast(Codec, facts.codec)
    ) as cut:
        for name, end in zip(order, ends, strict=True):
            shown = [picture for _, picture in zip(range(first_frames[name], end), pictures, strict=False)]
            if len(shown) != end - first_frames[name]:
                raise EpisodesError(f"{film}: ends within episode {name}; run manitwin render again")
            if name in allowed:
                clips[name] = Clip(place, cut.add(shown).first_frame)
    return clips


def _decoded(film: Path) -> Iterator[np.ndarray]:
    capture = cv2.VideoCapture(str(film))
    try:
        while True:
            read, picture = capture.read()
            if not read:
                return
            yield cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)
    finally:
        capture.release()
