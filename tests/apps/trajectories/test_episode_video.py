"""Videos of episodes, decoded frame by frame."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from manitwin.apps.trajectories.video import EpisodesVideo, write_animation
from manitwin.errors import UsageError

WIDTH, HEIGHT = 96, 64


def pictures(first: int, count: int) -> list[np.ndarray]:
    """Pictures that carry their number as 8 black or white fields, on a smooth ground of colour."""
    made = []
    for number in range(first, first + count):
        picture = np.empty((HEIGHT, WIDTH, 3), np.uint8)
        picture[..., 0] = np.linspace(40, 200, WIDTH)[None]
        picture[..., 1] = np.linspace(60, 160, HEIGHT)[:, None]
        picture[..., 2] = 120
        for bit in range(8):
            picture[8:24, 8 + 10 * bit : 16 + 10 * bit] = 255 if number >> bit & 1 else 0
        made.append(picture)
    return made


def number_of(picture: np.ndarray) -> int:
    return sum(int(picture[16, 12 + 10 * bit].mean() > 127) << bit for bit in range(8))


def decoded(path: Path) -> list[np.ndarray]:
    capture, frames = cv2.VideoCapture(str(path)), []
    while True:
        read, frame = capture.read()
        if not read:
            return frames
        frames.append(cv2.cvtColor(frame, cv2.COLOR_BGR2RGB))


def written(path: Path, codec: str) -> list[tuple[int, int, float, float]]:
    with EpisodesVideo(path, width_px=WIDTH, height_px=HEIGHT, codec=codec) as video:  # type: ignore[arg-type]
        spans = [video.add(pictures(0, 45)), video.add(iter(pictures(100, 30)))]
    return [(s.first_frame, s.frames, s.from_timestamp_s, s.to_timestamp_s) for s in spans]


@pytest.mark.parametrize("codec", ["vp9", "mpeg4"])
def test_frames_come_back_in_their_places(tmp_path: Path, codec: str) -> None:
    path = tmp_path / "a.mp4"
    assert written(path, codec) == [(0, 45, 0.0, 2.25), (45, 30, 2.25, 3.75)]
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]
    frames = decoded(path)
    assert [number_of(frame) for frame in frames] == [*range(45), *range(100, 130)]
    for frame, original in zip(frames, [*pictures(0, 45), *pictures(100, 30)], strict=True):
        assert np.abs(frame[32:].astype(int) - original[32:]).mean() < 8


@pytest.mark.parametrize("codec", ["vp9", "mpeg4"])
def test_seeking_by_frame_or_by_time_is_exact(tmp_path: Path, codec: str) -> None:
    path = tmp_path / "a.mp4"
    written(path, codec)
    capture = cv2.VideoCapture(str(path))
    assert capture.get(cv2.CAP_PROP_FPS) == 20
    numbers = [*range(45), *range(100, 130)]
    for index in (74, 3, 45, 44, 0, 60):
        capture.set(cv2.CAP_PROP_POS_FRAMES, index)
        assert number_of(capture.read()[1]) == numbers[index]
        capture.set(cv2.CAP_PROP_POS_MSEC, 1000 * index / 20)
        assert number_of(capture.read()[1]) == numbers[index]


@pytest.mark.parametrize("codec", ["vp9", "mpeg4"])
def test_same_pictures_give_the_same_bytes(tmp_path: Path, codec: str) -> None:
    for name in ("a.mp4", "b.mp4"):
        written(tmp_path / name, codec)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()


def test_video_that_breaks_off_leaves_nothing(tmp_path: Path) -> None:
    with (
        pytest.raises(UsageError, match=r"a picture is \(10, 10, 3\) uint8"),
        EpisodesVideo(tmp_path / "a.mp4", width_px=WIDTH, height_px=HEIGHT) as video,
    ):
        video.add([*pictures(0, 2), np.zeros((10, 10, 3), np.uint8)])
    assert not list(tmp_path.iterdir())


def test_odd_sizes_and_unknown_codecs_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="even, not 95 x 64"):
        EpisodesVideo(tmp_path / "a.mp4", width_px=95, height_px=64)
    with pytest.raises(UsageError, match="video codec 'h264'"):
        EpisodesVideo(tmp_path / "a.mp4", width_px=96, height_px=64, codec="h264")  # type: ignore[arg-type]


@pytest.mark.parametrize("suffix", [".webp", ".gif"])
def test_animation_shows_every_picture_for_its_time(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    write_animation(pictures(0, 7), path, rate_hz=10)
    with Image.open(path) as image:
        assert image.n_frames == 7 and image.info["loop"] == 0
        for index in range(7):
            image.seek(index)
            assert number_of(np.asarray(image.convert("RGB"))) == index
            assert image.info["duration"] == 100  # known when the picture is decoded


def test_animation_of_nothing_or_of_another_kind_is_refused(tmp_path: Path) -> None:
    for shown, name in (([], "a.gif"), (pictures(0, 1), "a.mp4")):
        with pytest.raises(UsageError, match=r"\.webp or \.gif of at least one picture"):
            write_animation(shown, tmp_path / name)
