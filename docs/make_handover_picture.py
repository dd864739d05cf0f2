"""Make handover.png beside this file: moments of a handover from the side.

    manitwin build --quick --text "a hammer" -o HAMMER
    python docs/make_handover_picture.py HAMMER

The moments: lifted, at the meeting point, grasped by the second hand, released by the first, and put down.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

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
from manitwin.render.cameras import look_at
from manitwin.robots.load import load_robot
from manitwin.scenes.scene import Furniture
from manitwin.twin.loaded_twin import TwinSource

DOCS = Path(__file__).resolve().parent
SIZE_PX = 320
SIDE = NamedCamera("side", look_at(np.array([0.6, -1.7, 0.75]), np.array([0.6, 0.0, 0.38])), FOV_Y_RAD)
SEED, ATTEMPTS = 5, 3


def moments(recording: Recording) -> list[int]:
    """Return the shown states, the ends of phases in order."""

    def last(phase: Phase) -> int:
        return int(np.flatnonzero(recording.phase == phase)[-1])

    retreats = np.flatnonzero(recording.phase == Phase.RETREAT)
    withdrawn = int(retreats[np.flatnonzero(np.diff(retreats) > 1)[0]])  # the first of two retreats
    return [last(Phase.LIFT), last(Phase.ACT), last(Phase.CLOSE), withdrawn, last(Phase.LOWER)]


def row(episode: StoredEpisode, twins: Path) -> np.ndarray:
    """Draw the moments side by side."""
    recording, source = episode.recording, TwinSource(twins)
    visuals = [twin_drawable(source.folder(thing.twin_id)) for thing in episode.objects]
    furniture = Furniture(**episode.facts["furniture"])
    with EpisodeReplay(load_robot(episode.robot.name), visuals, furniture=furniture, seed=1) as replay:
        pictures = []
        for state in moments(recording):
            turns = rotation_from_quaternion_wxyz(recording.object_quaternions_wxyz[state])
            poses = [transform(*each) for each in zip(turns, recording.object_positions_m[state], strict=True)]
            joints_rad, hands_m = recording.joint_positions_rad[state], recording.hand[state]
            pictures += replay.picture(poses, joints_rad, hands_m, [SIDE], size_px=SIZE_PX)
    return np.hstack(pictures)


def main() -> None:
    """Make the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("twins", type=Path)
    twins = parser.parse_args().twins
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder) / "episodes"
        config = TrajectoriesConfig(seed=SEED, skill="handover", batch=ATTEMPTS)
        make_episodes(twins, work, ATTEMPTS, config, executor="inline")
        episode = next(stored_episodes(batch_folders(work)))
        save_picture(Image.fromarray(row(episode, twins)), DOCS / "handover.png", {"handover": of_episode(episode)})


if __name__ == "__main__":
    main()
