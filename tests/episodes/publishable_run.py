"""A finished run of six kept episodes with twins of four licences, drawn or not: what there is to publish."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

from lerobot_sets import HEIGHT_PX, WIDTH_PX, picture
from synthetic_episodes import attempt, episode

from manitwin.episodes.attempts import ATTEMPTS, merge_attempts, write_attempts
from manitwin.episodes.batch import BATCH_RECORD, BatchRecord
from manitwin.episodes.downsampling import downsample
from manitwin.episodes.episode_pictures import PICTURES_RECORD, PicturesRecord, batch_name
from manitwin.episodes.episodes_stage import EPISODES
from manitwin.episodes.hdf5_file import write_episodes
from manitwin.episodes.settings import TrajectoriesConfig
from manitwin.episodes.stored_episode import RecordedObject, StoredEpisode
from manitwin.episodes.video import VideoWriter
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.store import RECORD, write_twin_record
from twin_folders import twin_id, write_accepted

LICENCES = {0: "CC-BY-4.0", 1: "CC0-1.0", 2: "CC-BY-NC-4.0", 3: "unknown"}
MUG, BOWL, TOY, PLAIN = (twin_id(number) for number in LICENCES)
OBJECTS = ((MUG, BOWL), (MUG, TOY), (BOWL, MUG), (TOY, MUG), (BOWL, PLAIN), (BOWL,))
"""The twins in each kept episode, the one that is moved first; batches are of two."""
ALLOWED = (0, 2, 5)


def stored(number: int) -> StoredEpisode:
    """The synthetic episode of a number with these twins as its objects; its target is the first of them."""
    ids = OBJECTS[number]
    made = episode(number, things=len(ids))
    order = sorted(range(len(ids)), key=lambda place: place != made.recording.target)
    objects = {place: RecordedObject(f"object_{place:02d}", ids[rank]) for rank, place in enumerate(order)}
    category = "toy" if ids[0] == TOY else "cup"
    told = replace(made.attempt, twin_id=ids[0], category=category, instructions=(f"move the {category} {number}",))
    return replace(made, attempt=told, objects=tuple(objects[place] for place in range(len(ids))))


def write_twins(root: Path) -> None:
    for number, licence in LICENCES.items():
        folder = root / twin_name(write_accepted(root, number))
        record = json.loads((folder / RECORD).read_bytes())
        record["source"] |= {"license": licence, "attribution": "Ada & Bo" if number == 0 else None}
        del record["revision"], record["files"]
        write_twin_record(folder, record)


def write_run(root: Path, twins: Path, *, drawn: bool, rate_hz: int = 20) -> None:
    """What a finished run leaves: six kept episodes in three batches, drawn so many times a second, and three failed attempts."""
    config = TrajectoriesConfig(seed=7).model_dump(mode="json")
    root.mkdir(parents=True)
    said = {"kind": "trajectories", "dataset": str(twins), "scenes": None, **config}
    (root / "config.json").write_text(json.dumps(said))
    failed = [
        replace(attempt(6 + n, outcome="dropped"), twin_id=each, category="cup", instructions=(f"drop {n}",))
        for n, each in enumerate((MUG, TOY, PLAIN))
    ]
    files = []
    for number in range(3):
        folder = root / batch_name(f"{number}{number}batch")
        folder.mkdir(parents=True)
        both = [stored(2 * number), stored(2 * number + 1)]
        write_episodes(folder / EPISODES, both)
        write_attempts(folder / ATTEMPTS, [*(each.attempt for each in both), failed[number]])
        write_record(folder, TwinSource(twins), {each for ids in OBJECTS[2 * number : 2 * number + 2] for each in ids})
        files.append(folder / ATTEMPTS)
        if drawn:
            draw(root / "pictures" / batch_name(folder.name), both, rate_hz)
    merge_attempts(files, root / ATTEMPTS)
    if drawn:
        drawings = {"kind": "pictures", "cameras": ["front"], "rate_hz": rate_hz}
        (root / "pictures" / "config.json").write_text(json.dumps(drawings))


def write_record(folder: Path, source: TwinSource, twin_ids: set[str]) -> None:
    """The record of a batch, with the revisions that these twins have now."""
    revisions = {each: source.twin(each).record.revision for each in sorted(twin_ids)}
    counts = {"attempted": 3, "planned": 3, "succeeded": 2, "kept": 2}
    record = BatchRecord(
        schema_version=1, batch_id=folder.name, config_sha256="", revision="", twins=revisions, files={}, **counts
    )
    (folder / BATCH_RECORD).write_text(record.model_dump_json())


PINHOLE = {"camera.intrinsics_px": [[80.0, 0.0, 32.0], [0.0, 80.0, 24.0], [0.0, 0.0, 1.0]], "camera.frame": "world"}


def draw(folder: Path, both: list[StoredEpisode], rate_hz: int) -> None:
    first_frames = {}
    with VideoWriter(folder / "front.mp4", width_px=WIDTH_PX, height_px=HEIGHT_PX, rate_hz=rate_hz) as film:
        for each in both:
            number, steps = each.facts["number"], downsample(each.recording, rate_hz).steps
            span = film.add(picture(number, t, steps) for t in range(steps))
            first_frames[each.attempt.episode_id] = span.first_frame
    record = PicturesRecord(
        batch_id=folder.name,
        config_sha256="",
        revision="",
        first_frames=first_frames,
        files={},
        cameras={"front": PINHOLE},
    )
    (folder / PICTURES_RECORD).write_text(record.model_dump_json())
