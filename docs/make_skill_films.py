r"""Make films/SKILL.webp beside this file: a close-up animation of an episode of each skill.

    manitwin build --quick --text "a mug" --text "a mixing bowl" --text "a wooden spoon" --text "a hammer" \
        --text "a remote control" --text "a sponge" --text "a chef's knife" --text "a spray bottle" --text "a screwdriver" \
        --text "a plastic bottle" --text "a tea box" --text "a small tea box" --text "a cup" --text "a plate" -o THINGS
    python docs/make_skill_films.py THINGS [--skills pour,hang]
    manitwin build --quick --text "a bowl" --text "a marker" -o TO_STIR
    python docs/make_skill_films.py TO_STIR --skills stir

Each shows the first kept episode of a few attempts at three times its speed. films/films.json records the objects and the motion
of the arm.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from picture_file import of_episode

from manitwin.episodes.cameras import FOV_Y_RAD, NamedCamera
from manitwin.episodes.collect import batch_folders, stored_episodes
from manitwin.episodes.episodes_run import make_episodes
from manitwin.episodes.recording import RATE_HZ, Recording
from manitwin.episodes.replay_pictures import EpisodeReplay, twin_drawable
from manitwin.episodes.settings import TrajectoriesConfig
from manitwin.episodes.skills.registry import skill_names
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.episodes.video import write_animation
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.geometry.rigid_body import StaticBox
from manitwin.render.cameras import look_at
from manitwin.robots.load import load_robot
from manitwin.scenes.layouts.pool import cached_pool
from manitwin.scenes.scene import Furniture
from manitwin.twin.loaded_twin import TwinSource

FILMS = Path(__file__).resolve().parent / "films"
RECORD = FILMS / "films.json"
SIZE_PX, EVERY, SPEED, QUALITY = 224, 5, 3.0, 45
STILL, STILL_FRAMES = 0.1, 2  # mean difference of equal-looking pictures, and half a second
SEED, ATTEMPTS, TRIES = 7, 4, 4
TARGETS = {
    "pick_place": "mug",
    "left_of": "bottle",
    "right_of": "cup",
    "behind": "mug",
    "in_front_of": "box",
    "near": "mug",
    "away_from": "mug",
    "upright": "bottle",
    "handover": "hammer",
    "lift": "mug",
}  # best targets of skills that accept any; each twin is tried once per seed
EYE = np.array([0.45, -0.85, 0.55])  # from the scene, unobstructed by an arm at the origin
LEAST_WAY_M, WAY_SHARE = 0.45, 1.5  # minimum distance of the camera, and its ratio to the extent of the scene


def an_episode(twins: Path, skill: str) -> StoredEpisode:
    """Record episodes of a skill with successive seeds until one is kept; raises LookupError if none is."""
    wanted = TARGETS.get(skill)
    count = ATTEMPTS if wanted is None else len(cached_pool(str(twins)).twins)
    for number in range(TRIES):
        with tempfile.TemporaryDirectory() as folder:
            config = TrajectoriesConfig(seed=SEED + number, skill=skill, batch=count)
            make_episodes(twins, Path(folder) / "e", count, config, executor="inline")
            for found in stored_episodes(batch_folders(Path(folder) / "e")):
                if wanted in (None, found.attempt.category):
                    return found
    raise LookupError(f"no episode of {skill} was kept")


def camera_for(recording: Recording) -> NamedCamera:
    """Return a camera that sees all objects and the paths of the hands."""
    arms, things = recording.tip_position_m.shape[1] // 3, recording.object_positions_m.shape[1]
    objects = [recording.object_positions_m[:, number] for number in range(things)]
    places = [*objects, *np.split(recording.tip_position_m, arms, axis=1)]
    seen = np.concatenate(places)
    low, high = np.percentile(seen, 2, axis=0), np.percentile(seen, 98, axis=0)
    middle, reach_m = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    way = EYE / np.linalg.norm(EYE)
    if arms > 1:
        way = np.array([0.0, -0.94, 0.34])
    return NamedCamera("film", look_at(middle + max(LEAST_WAY_M, WAY_SHARE * reach_m + 0.35) * way, middle), FOV_Y_RAD)


def film(episode: StoredEpisode, twins: Path) -> list[np.ndarray]:
    """Draw every fifth state of an episode."""
    recording, source = episode.recording, TwinSource(twins)
    granules = recording.granule_positions_m
    radius_m = episode.facts.get("granule_radius_m")
    with EpisodeReplay(
        load_robot(episode.robot.name),
        [twin_drawable(source.folder(thing.twin_id)) for thing in episode.objects],
        furniture=Furniture(**episode.facts["furniture"]),
        fixtures=[_box(each) for fixture in episode.facts.get("fixtures", ()) for each in fixture["boxes"]],
        granules=None if granules is None or radius_m is None else (granules.shape[1], float(radius_m)),
        seed=1,
    ) as replay:
        camera = [camera_for(recording)]
        frames = replay.frames(recording, camera, width_px=SIZE_PX, height_px=SIZE_PX, every=EVERY)
        return [views[0].rgb for views in frames]


def until_still(pictures: list[np.ndarray]) -> list[np.ndarray]:
    """Cut the motionless end to half a second; an object kept in the hand is observed for two seconds."""
    moves = [k for k, each in enumerate(pictures) if np.abs(each.astype(float) - pictures[-1]).mean() > STILL]
    return pictures[: max(moves, default=-1) + 1 + STILL_FRAMES]


def _box(said: dict[str, Any]) -> StaticBox:
    rotation = rotation_from_quaternion_wxyz(np.array(said["quaternion_wxyz"]))
    return StaticBox(said["name"], np.array(said["half_extents_m"]), transform(rotation, np.array(said["position_m"])))


def main() -> None:
    """Make the films."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("twins", type=Path)
    parser.add_argument("--skills", default=",".join(skill_names()))
    asked = parser.parse_args()
    for skill in asked.skills.split(","):
        episode = an_episode(asked.twins, skill)
        pictures = until_still(film(episode, asked.twins))
        write_animation(pictures, FILMS / f"{skill}.webp", rate_hz=SPEED * RATE_HZ / EVERY, quality=QUALITY)
        shown = json.loads(RECORD.read_text()) if RECORD.exists() else {}
        names = [TwinSource(asked.twins).twin(each.twin_id).record.language for each in episode.objects]
        shown[skill] = {
            "episode": of_episode(episode),
            "goal": episode.attempt.goal,
            "objects": [None if each is None else each.category for each in names],
            "seconds": round((len(pictures) - 1) * EVERY / RATE_HZ, 1),
        }
        print(skill, shown[skill], (FILMS / f"{skill}.webp").stat().st_size, flush=True)
        RECORD.write_text(json.dumps(dict(sorted(shown.items())), indent=1) + "\n")


if __name__ == "__main__":
    main()
