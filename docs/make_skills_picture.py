"""Make skills.png beside this file: close-up moments of an episode of each tool skill.

    manitwin build --quick --text "a sponge" --text "a chef's knife" --text "a spray bottle" -o TOOLS
    python docs/make_skills_picture.py TOOLS

One row each for wiping, a cutting motion and aiming: the lifted tool, and four moments of the action.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from picture_file import of_episode, save_picture
from PIL import Image

from manitwin.episodes.cameras import FOV_Y_RAD, NamedCamera
from manitwin.episodes.collect import batch_folders, stored_episodes
from manitwin.episodes.episodes_run import make_episodes
from manitwin.episodes.planning.problem import Phase
from manitwin.episodes.recording import Recording
from manitwin.episodes.replay_pictures import EpisodeReplay, twin_drawable
from manitwin.episodes.settings import TrajectoriesConfig
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.geometry.rigid_body import StaticBox
from manitwin.render.cameras import look_at
from manitwin.robots.load import load_robot
from manitwin.scenes.scene import Furniture
from manitwin.twin.loaded_twin import TwinSource

DOCS = Path(__file__).resolve().parent
SKILLS = ("wipe", "cut_motion", "aim")
SIZE_PX, MOMENTS = 280, 4
EYES_M = {
    "wipe": (0.65, -0.35, 0.35),
    "cut_motion": (0.65, -0.35, 0.35),
    "aim": (-0.1, 0.7, 0.35),
}  # relative to the subject
UP_M = 0.06
SEED, ATTEMPTS = 5, 3  # each twin once


def an_episode(twins: Path, work: Path, skill: str) -> StoredEpisode:
    """Record a few episodes of a skill and return the first that was kept."""
    make_episodes(twins, work, ATTEMPTS, TrajectoriesConfig(seed=SEED, skill=skill, batch=ATTEMPTS), executor="inline")
    return next(stored_episodes(batch_folders(work)))


def moments(episode: StoredEpisode, twins: Path, skill: str) -> np.ndarray:
    """Draw a row: the object in the hand, and moments of the action from beside it."""
    recording, source = episode.recording, TwinSource(twins)
    acting = np.flatnonzero(np.isin(recording.phase, [Phase.ACT, Phase.HOLD])) + 1
    shown = [
        int(np.flatnonzero(recording.phase == Phase.LIFT)[-1]),
        *np.linspace(acting[0], acting[-1], MOMENTS).astype(int),
    ]
    taken = shown.pop(0)
    acts = recording.object_positions_m[acting[-1]]
    cameras = [
        _camera(recording.object_positions_m[taken, recording.target], EYES_M[skill]),
        _camera(acts[:2].mean(0) if skill == "aim" else acts[0], EYES_M[skill]),
    ]
    visuals = [twin_drawable(source.folder(thing.twin_id)) for thing in episode.objects]
    boxes = [_box(each) for fixture in episode.facts.get("fixtures", ()) for each in fixture["boxes"]]
    with EpisodeReplay(
        load_robot(episode.robot.name),
        visuals,
        furniture=Furniture(**episode.facts["furniture"]),
        fixtures=boxes,
        seed=1,
    ) as replay:
        return np.hstack(
            [
                _picture(replay, recording, taken, cameras[0]),
                *(_picture(replay, recording, n, cameras[1]) for n in shown),
            ]
        )


def _camera(middle_m: np.ndarray, eye_m: tuple[float, float, float]) -> NamedCamera:
    middle_m = middle_m + np.array([0.0, 0, UP_M])
    return NamedCamera("near", look_at(middle_m + np.array(eye_m), middle_m), FOV_Y_RAD)


def _picture(replay: EpisodeReplay, recording: Recording, state: int, camera: NamedCamera) -> np.ndarray:
    turns = rotation_from_quaternion_wxyz(recording.object_quaternions_wxyz[state])
    poses = [transform(*each) for each in zip(turns, recording.object_positions_m[state], strict=True)]
    arm_rad, opening_m = recording.joint_positions_rad[state], float(recording.gripper_opening_m[state])
    return replay.picture(poses, arm_rad, opening_m, [camera], size_px=SIZE_PX)[0]


def _box(said: dict[str, Any]) -> StaticBox:
    rotation = rotation_from_quaternion_wxyz(np.array(said["quaternion_wxyz"]))
    return StaticBox(said["name"], np.array(said["half_extents_m"]), transform(rotation, np.array(said["position_m"])))


def main() -> None:
    """Make the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("twins", type=Path)
    twins, rows, shown = parser.parse_args().twins, [], {}
    for skill in SKILLS:
        with tempfile.TemporaryDirectory() as folder:
            episode = an_episode(twins, Path(folder) / "episodes", skill)
            rows.append(moments(episode, twins, skill))
            shown[skill] = of_episode(episode)
    save_picture(Image.fromarray(np.vstack(rows)), DOCS / "skills.png", shown)


if __name__ == "__main__":
    main()
