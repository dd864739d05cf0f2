"""Publication of episodes: select by licence, write the LeRobot layout and videos, validate, and put the result in place."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Set
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path
from typing import Any, cast

import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.dataset.publish.licences import LICENSES_MD, licenses_page, without_attribution
from manitwin.dataset.publish.privacy import check_text, local_paths
from manitwin.dataset.publish.publication import EPISODES, Publication
from manitwin.engine.ledger.location import CONFIG
from manitwin.episodes.attempts import (
    ATTEMPTS,
    AttemptCounts,
    count_attempts,
    merge_attempts,
    read_attempts,
    write_attempts,
)
from manitwin.episodes.collect import any_granules, batch_folders, stored_episodes
from manitwin.episodes.configuration import read_configuration
from manitwin.episodes.downsampling import RATES_HZ
from manitwin.episodes.episode_pictures import PICTURES, batch_name, read_pictures
from manitwin.episodes.lerobot.read import LeRobotSet, read_lerobot
from manitwin.episodes.lerobot.videos import CameraVideos, Clip
from manitwin.episodes.lerobot.write import write_lerobot
from manitwin.episodes.publication.card import OF_EPISODES, TWINS_FILE, EpisodesCard, episodes_card
from manitwin.episodes.publication.episode_selection import EpisodeSelection, choose_episodes
from manitwin.episodes.recording import RATE_HZ
from manitwin.episodes.video import VideoWriter
from manitwin.episodes.video_encoders import Codec
from manitwin.episodes.video_reading import VideoReader
from manitwin.errors import EpisodesError, UsageError
from manitwin.formats.installation import installed_version
from manitwin.formats.json_file import read_json_object
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import TwinSource

README = "README.md"
TWINS_SCHEMA = pa.schema(
    [
        *((name, pa.string()) for name in ("twin_id", "category", "license", "attribution", "source_sha256")),
        ("revisions", pa.list_(pa.string())),
        ("episodes", pa.list_(pa.int64())),
    ]
)


_DRAW = "run manitwin render again"
_CAMERA = re.compile(r"[0-9A-Za-z_-]+")


def rendered_cameras(episodes: Path) -> tuple[tuple[str, ...], int]:
    """Return the cameras of a run's rendered pictures, and their rate in Hz; no cameras if it was not rendered."""
    path = episodes / PICTURES / CONFIG
    if not os.path.lexists(path):
        return (), RATE_HZ
    said = read_json_object(path, EpisodesError, inside=episodes, name=str(path), remedy=_DRAW)
    cameras, rate_hz = said.get("cameras"), said.get("rate_hz", RATE_HZ)
    if not isinstance(cameras, list) or not all(isinstance(each, str) and _CAMERA.fullmatch(each) for each in cameras):
        raise EpisodesError(f"{path}: cameras are not names; {_DRAW}")
    if rate_hz not in RATES_HZ:
        raise EpisodesError(f"{path}: rate_hz is not one of {', '.join(map(str, RATES_HZ))}; {_DRAW}")
    return tuple(cameras), int(rate_hz)


def camera_videos(
    episodes: Path, cameras: tuple[str, ...], batches: list[Path], allowed: Set[str], scratch: Path
) -> list[CameraVideos]:
    """Return the videos of ``cameras`` that contain only ``allowed`` episodes.

    A video that also shows other episodes is cut: the allowed parts are encoded again with the same codec, below ``scratch``.
    Raises EpisodesError for a batch that was not rendered.
    """
    clips: dict[str, dict[str, Clip]] = {camera: {} for camera in cameras}
    pinholes: dict[str, dict[str, Any]] = {}
    for batch in batches if cameras else ():
        place = episodes / PICTURES / batch_name(batch.name)
        record = read_pictures(place)
        first_frames = record.first_frames
        pinholes |= record.cameras
        kept = {name: first for name, first in first_frames.items() if name in allowed}
        for camera in cameras if kept else ():
            film = place / f"{camera}.mp4"
            if len(kept) == len(first_frames):
                clips[camera] |= {name: Clip(film, first) for name, first in kept.items()}
            else:
                clips[camera] |= cut_video(film, first_frames, allowed, scratch / f"{batch.name}-{camera}.mp4")
    return [CameraVideos(camera, clips[camera], pinholes.get(camera, {})) for camera in cameras]


def cut_video(film: Path, first_frames: dict[str, int], allowed: Set[str], place: Path) -> dict[str, Clip]:
    """Write the ``allowed`` episodes of a video, whose episodes are contiguous, to another one; return their clips."""
    with VideoReader(film) as shown:
        return _cut(film, shown, first_frames, allowed, place)


def _cut(
    film: Path, shown: VideoReader, first_frames: dict[str, int], allowed: Set[str], place: Path
) -> dict[str, Clip]:
    facts = shown.facts
    order = sorted(first_frames, key=first_frames.__getitem__)
    if order and not 0 <= first_frames[order[0]] <= first_frames[order[-1]] < facts.frames:
        raise EpisodesError(
            f"{film}: has {facts.frames} frames, but another number was recorded; run manitwin render again"
        )
    ends = [*(later for _, later in pairwise(first_frames[name] for name in order)), facts.frames]
    clips: dict[str, Clip] = {}
    pictures = iter(shown)
    codec, rate_hz = cast(Codec, facts.codec), round(facts.rate_hz)
    with VideoWriter(place, width_px=facts.width_px, height_px=facts.height_px, codec=codec, rate_hz=rate_hz) as cut:
        for name, end in zip(order, ends, strict=True):
            episode = list(islice(pictures, end - first_frames[name]))
            if len(episode) != end - first_frames[name]:
                raise EpisodesError(f"{film}: ends within episode {name}; run manitwin render again")
            if name in allowed:
                clips[name] = Clip(place, cut.add(episode).first_frame)
    return clips


@dataclass(frozen=True)
class PublishedEpisodes:
    """Counts of a publication; ``left_out`` counts kept episodes by the licences that exclude them.

    ``rehearsals`` counts episodes excluded because a rehearsal server contributed to one of their twins.
    """

    episodes: int
    frames: int
    twins: int
    left_out: dict[str, int]
    without_attribution: int
    files: int
    bytes: int
    rehearsals: int = 0


def publish_episodes(
    episodes: str | Path,
    out: str | Path,
    *,
    license_allow: Iterable[str] | None = None,
    with_rehearsals: bool = False,
    twins: str | Path | None = None,
    name: str | None = None,
) -> PublishedEpisodes:
    """Write a LeRobotDataset v3.0 with a card, licences, attempts and checksums to ``out``, a folder or URL.

    An episode is published if the licences of all its objects allow it: those in ``license_allow``, or all known ones.
    Episodes with a twin that a rehearsal server (``manitwin fake``) contributed to need ``with_rehearsals``. No row, picture
    or statistic of other episodes is written. ``twins`` is the current location of the twins; None: that recorded with the
    episodes. The output is deterministic to the byte. Raises UsageError for invalid arguments and missing twins,
    EpisodesError for episodes that cannot be read or that contain a local path.
    """
    episodes = Path(episodes)
    said = _configuration(episodes)
    source = TwinSource(said["dataset"] if twins is None else twins)
    batches, title = batch_folders(episodes), name or Path(str(out).rstrip("/")).name
    chosen = choose_episodes(
        batches, read_attempts(episodes / ATTEMPTS), source, license_allow, with_rehearsals=with_rehearsals
    )
    publication = Publication(DatasetRoot(out), EPISODES)
    publication.require_own_root()
    try:
        with publication.scratch() as scratch:
            made = scratch / "made"
            cameras, rate_hz = rendered_cameras(episodes)
            films = camera_videos(episodes, cameras, batches, chosen.episodes.published.keys(), scratch / "films")
            kept = (each for each in stored_episodes(batches) if each.attempt.episode_id in chosen.episodes.published)
            write_lerobot(kept, made, videos=films, granules=any_granules(batches), rate_hz=rate_hz)
            checked = read_lerobot(made)
            rows = _write_tables(episodes, chosen, made)
            success = count_attempts(each for each in read_attempts(episodes / ATTEMPTS) if chosen.counts_attempt(each))
            pages = _pages(title, checked, chosen, success, rows, said)
            places = local_paths([DatasetRoot(episodes), source.root, publication.root])
            for page, words in {**pages, "meta/tasks.parquet": "\n".join(checked.tasks)}.items():
                check_text(page, words, places, EpisodesError)
            publication.begin()
            for path in sorted(path for path in made.rglob("*") if path.is_file()):
                publication.put(path, path.relative_to(made).as_posix())
        for page, words in pages.items():
            publication.write(page, words.encode())
        publication.finish()
    except OSError as error:
        raise UsageError(f"{out}: not finished ({error}); fix this and publish again") from error
    return PublishedEpisodes(
        episodes=checked.info["total_episodes"],
        frames=checked.info["total_frames"],
        twins=len(chosen.twins),
        left_out=chosen.episodes.left_out,
        without_attribution=len(without_attribution(chosen.rows)),
        files=len(publication.sizes) + 1,
        bytes=sum(publication.sizes.values()),
        rehearsals=chosen.episodes.rehearsals,
    )


def _configuration(episodes: Path) -> dict[str, Any]:
    if not (episodes / ATTEMPTS).is_file():
        raise UsageError(
            f"{episodes}: no {ATTEMPTS}, so this is not a folder of finished episodes; run manitwin trajectories"
        )
    return read_configuration(episodes)


def _write_tables(episodes: Path, chosen: EpisodeSelection, made: Path) -> int:
    """Write the published attempts, numbered like the episodes, and the twins; return the number of attempts."""
    unnumbered = made / f".{ATTEMPTS}"
    write_attempts(unnumbered, (each for each in read_attempts(episodes / ATTEMPTS) if chosen.includes_attempt(each)))
    rows, _ = merge_attempts([unnumbered], made / ATTEMPTS)
    unnumbered.unlink()
    twins = pa.Table.from_pylist(chosen.rows, schema=TWINS_SCHEMA)
    pq.write_table(twins, made / TWINS_FILE, compression="zstd", version="2.6")
    return rows


def _pages(
    title: str, checked: LeRobotSet, chosen: EpisodeSelection, success: AttemptCounts, rows: int, said: dict[str, Any]
) -> dict[str, str]:
    made_of = {"objects": f"data set {Path(said['dataset']).name}"}
    if said["scenes"]:
        made_of["scenes"] = f"layouts {Path(said['scenes']).name}"
    made_of |= {
        "other objects": "those of the scenes" if said["scenes"] else str(said["others"]),
        "skill": said["skill"],
        "seed": str(said["seed"]),
        "kept where the object ended within": f"{1000 * said['episode']['max_placed_m']:g} mm and "
        f"{said['episode']['max_tilt_deg']:g} degrees of its goal",
        "twins": f"in the revisions that {TWINS_FILE} names",
        "published with": f"manitwin {installed_version()}",
    }
    facts = EpisodesCard(title, checked.info, chosen.rows, success, chosen.episodes.left_out, rows, made_of)
    licences = licenses_page(title, chosen.rows, introduction=OF_EPISODES)
    return {LICENSES_MD: licences, README: episodes_card(facts)}
