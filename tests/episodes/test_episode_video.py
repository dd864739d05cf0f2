"""Videos of episodes, decoded frame by frame."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image, features

from manitwin.episodes.settings import PicturesConfig
from manitwin.episodes.video import VideoWriter, require_encoder, write_animation
from manitwin.episodes.video_encoders import CODECS
from manitwin.episodes.video_reading import VideoFacts, VideoReader, video_facts
from manitwin.errors import EpisodesError, UsageError

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
    with VideoReader(path) as film:
        return list(film)


def written(path: Path, codec: str) -> list[tuple[int, int]]:
    with VideoWriter(path, width_px=WIDTH, height_px=HEIGHT, codec=codec) as video:  # type: ignore[arg-type]
        spans = [video.add(pictures(0, 45)), video.add(iter(pictures(100, 30)))]
    return [(s.first_frame, s.frames) for s in spans]


@pytest.mark.parametrize("codec", CODECS)
def test_frames_come_back_in_their_places(tmp_path: Path, codec: str) -> None:
    path = tmp_path / "a.mp4"
    assert written(path, codec) == [(0, 45), (45, 30)]
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]
    frames = decoded(path)
    assert [number_of(frame) for frame in frames] == [*range(45), *range(100, 130)]
    for frame, original in zip(frames, [*pictures(0, 45), *pictures(100, 30)], strict=True):
        assert np.abs(frame[32:].astype(int) - original[32:]).mean() < 8


@pytest.mark.parametrize("codec", CODECS)
def test_seeking_by_frame_or_by_time_is_exact(tmp_path: Path, codec: str) -> None:
    path = tmp_path / "a.mp4"
    written(path, codec)
    numbers = [*range(45), *range(100, 130)]
    with VideoReader(path) as film:
        assert film.facts == VideoFacts(75, 20.0, HEIGHT, WIDTH, codec)
        for index in (74, 3, 45, 44, 0, 60):
            assert number_of(film.picture(index)) == numbers[index]
        with pytest.raises(EpisodesError, match=r"a\.mp4: frame 75 cannot be decoded"):
            film.picture(75)


@pytest.mark.parametrize("codec", ["vp9", "mpeg4"])
def test_seeking_by_opencv_alone_is_exact(tmp_path: Path, codec: str) -> None:
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


@pytest.mark.parametrize("codec", CODECS)
def test_same_pictures_give_the_same_bytes(tmp_path: Path, codec: str) -> None:
    for name in ("a.mp4", "b.mp4"):
        written(tmp_path / name, codec)
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()


def test_video_that_breaks_off_leaves_nothing(tmp_path: Path) -> None:
    with (
        pytest.raises(UsageError, match=r"a picture is \(10, 10, 3\) uint8"),
        VideoWriter(tmp_path / "a.mp4", width_px=WIDTH, height_px=HEIGHT) as video,
    ):
        video.add([*pictures(0, 2), np.zeros((10, 10, 3), np.uint8)])
    assert not list(tmp_path.iterdir())


def test_odd_sizes_and_unknown_codecs_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="even, not 95 x 64"):
        VideoWriter(tmp_path / "a.mp4", width_px=95, height_px=64)
    with pytest.raises(UsageError, match="video codec 'h264'"):
        VideoWriter(tmp_path / "a.mp4", width_px=96, height_px=64, codec="h264")  # type: ignore[arg-type]


def test_default_is_a_codec_that_browsers_play_with_a_licence_that_lets_everybody_carry_it(tmp_path: Path) -> None:
    """AV1 of the main profile (8 bits, 4:2:0), which Chromium and Firefox play; libaom, libavif and dav1d are BSD."""
    path = tmp_path / "a.mp4"
    with VideoWriter(path, width_px=WIDTH, height_px=HEIGHT, codec=PicturesConfig().codec) as video:
        video.add(pictures(0, 3))
    assert video_facts(path).codec == "av1"
    # AV1CodecConfigurationRecord: marker and version, profile and level, tier and depth and monochrome and subsampling
    marker, profile_level, sampling = path.read_bytes().partition(b"av1C")[2][:3]
    assert marker == 0x81 and profile_level >> 5 == 0
    assert sampling >> 4 & 0b111 == 0 and sampling >> 2 & 0b11 == 0b11  # not of 10 or 12 bits, not monochrome; 4:2:0


@pytest.mark.parametrize("frames", [1, 2, 12, 13, 24, 25])
def test_group_that_is_cut_short_has_all_its_pictures_and_no_more(tmp_path: Path, frames: int) -> None:
    path = tmp_path / "a.mp4"
    with VideoWriter(path, width_px=WIDTH, height_px=HEIGHT, codec="av1") as video:
        video.add(pictures(0, frames))
    assert video_facts(path).frames == frames
    assert [number_of(picture) for picture in decoded(path)] == list(range(frames))


def test_colors_come_back_as_they_were(tmp_path: Path) -> None:
    """Another matrix or range of the luma would be off by some ten steps in saturated colours."""
    path, shown = tmp_path / "a.mp4", np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    fields = [(255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255), (200, 120, 40), (10, 10, 10)]
    for i, color in enumerate(fields):
        shown[:, 16 * i : 16 * i + 16] = color
    with VideoWriter(path, width_px=WIDTH, height_px=HEIGHT, codec="av1") as video:
        video.add([shown] * 4)
    for picture in decoded(path):
        for i, color in enumerate(fields):
            assert np.abs(picture[8:-8, 16 * i + 4 : 16 * i + 12].mean((0, 1)) - color).max() < 6


def test_film_that_ends_too_soon_is_refused_where_it_ends(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    written(path, "av1")
    content = path.read_bytes()
    index = content.index(b"moov") - 4
    path.write_bytes(content[:200] + b"\0" * (index - 200) + content[index:])
    with VideoReader(path) as film, pytest.raises(EpisodesError, match=r"a\.mp4: frame 0 cannot be decoded"):
        film.picture(0)
    clock = content.index(b"mdhd") + 16
    path.write_bytes(content[:clock] + b"\0" * 4 + content[clock + 4 :])
    with pytest.raises(EpisodesError, match=r"a\.mp4: "), VideoReader(path) as film:
        film.picture(0)
    path.write_bytes(content[: index + 50])
    with pytest.raises(EpisodesError, match=r"a\.mp4: not a readable video"):
        VideoReader(path)


def test_build_without_the_encoder_says_which_has_it_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = cv2.VideoWriter

    class Lacking:
        """An OpenCV whose FFmpeg has no libvpx."""

        fourcc = staticmethod(real.fourcc)

        def __new__(cls, file: str, backend: int, fourcc: int, rate_hz: float, size: tuple[int, int]) -> object:
            return real() if fourcc == real.fourcc(*"vp09") else real(file, backend, fourcc, rate_hz, size)

    monkeypatch.setattr(cv2, "VideoWriter", Lacking)
    with pytest.raises(
        UsageError, match=r"no encoder for vp9 \(FFmpeg with libvpx\).*opencv-python.*--codec av1 or --codec mpeg4"
    ):
        require_encoder("vp9")
    with pytest.raises(UsageError, match="no encoder for vp9"):
        VideoWriter(tmp_path / "a.mp4", width_px=WIDTH, height_px=HEIGHT, codec="vp9")
    monkeypatch.setattr(features, "check", lambda name: name != "avif")
    with pytest.raises(
        UsageError, match=r"no encoder for av1 \(libavif with libaom\): reinstall pillow.*--codec vp9 or --codec mpeg4"
    ):
        require_encoder("av1")
    with pytest.raises(UsageError, match="no encoder for av1"):
        VideoWriter(tmp_path / "a.mp4", width_px=WIDTH, height_px=HEIGHT)
    assert not list(tmp_path.iterdir())
    require_encoder("mpeg4")


def test_folder_that_cannot_be_written_is_not_taken_for_a_missing_encoder(tmp_path: Path) -> None:
    (tmp_path / ".a.1.mp4").mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("os.getpid", lambda: 1)
        with pytest.raises(UsageError, match=r"a\.mp4: no video can be written there"):
            VideoWriter(tmp_path / "a.mp4", width_px=WIDTH, height_px=HEIGHT)


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
