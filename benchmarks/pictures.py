"""Measure the cost of rendering a picture of an episode, with two checkouts of the code in alternation.

    python benchmarks/pictures.py TWINS [--other CHECKOUT] [--rounds 3] [--states 40] [--cameras front] [--save FOLDER]

A moving Panda and three twins of the data set TWINS are rendered in pictures of 128 and 256 pixels, with one thread as in
workers. Prints minimum and median CPU seconds per picture without the start-up cost (imports, shaders, the robot's meshes), which
is printed separately. Each round is one process, alternating between the two checkouts. ``--save`` writes the last picture of
each camera and size for inspection.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent
SIZES_PX = (128, 256)
DRAW = """
import inspect, json, sys, time
from pathlib import Path
import numpy as np
from PIL import Image
from manitwin.episodes.cameras import named_cameras
from manitwin.episodes.replay_pictures import EpisodeReplay, twin_drawable
from manitwin.geometry.poses import transform
from manitwin.robots.load import load_robot

twins, names, states, sizes, save = json.loads(sys.argv[1])
robot = load_robot("panda")
cameras = named_cameras(names, robot)
poses = [transform(translation=np.array([0.35 + 0.12 * i, 0.15 - 0.15 * i, 0.0])) for i in range(len(twins))]
home = np.array([0.0, -0.3, 0.0, -2.2, 0.0, 2.0, 0.785])
sized = "picture_px" in inspect.signature(EpisodeReplay).parameters
took = {}
for size in sizes:
    begun = time.process_time()
    told = {"picture_px": size} if sized else {}
    with EpisodeReplay(robot, [twin_drawable(Path(twin), **told) for twin in twins], **told) as replay:
        def draw(state):
            joints = home + 0.3 * np.sin(0.2 * state + np.arange(7))
            return replay.picture(poses, joints, np.array([0.04]), cameras, size_px=size)
        draw(0)
        took.setdefault("start", time.process_time() - begun)
        begun = time.process_time()
        for state in range(states):
            shown = draw(state)
        took[str(size)] = (time.process_time() - begun) / states / len(cameras)
    if save:
        for camera, picture in zip(cameras, shown):
            Image.fromarray(picture).save(f"{save}-{camera.name}-{size}.png")
print(json.dumps(took))
"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("twins", type=Path)
    parser.add_argument("--other", type=Path, help="a checkout to compare with")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--states", type=int, default=40)
    parser.add_argument("--cameras", default="front", help="names, with commas")
    parser.add_argument("--save", type=Path)
    arguments = parser.parse_args()
    twins = [str(each.parent) for each in sorted(arguments.twins.glob("twins/*/*/visual.glb"))[:3]]
    if len(twins) < 3:
        sys.exit(f"{arguments.twins}: has no three twins")
    states = {"this": HERE} | ({"other": arguments.other.resolve()} if arguments.other else {})
    took: dict[str, list[dict[str, float]]] = {name: [] for name in states}
    for _ in range(arguments.rounds):
        for name, checkout in states.items():
            save = str(arguments.save / name) if arguments.save else ""
            said = json.dumps([twins, arguments.cameras.split(","), arguments.states, SIZES_PX, save])
            environment = {
                **os.environ,
                "PYTHONPATH": str(checkout / "src"),
                "OMP_NUM_THREADS": "1",
                "LP_NUM_THREADS": "0",
            }
            done = subprocess.run(
                [sys.executable, "-W", "ignore", "-c", DRAW, said], env=environment, stdout=subprocess.PIPE, check=True
            )
            took[name].append(json.loads(done.stdout.splitlines()[-1]))
    for size in ("start", *map(str, SIZES_PX)):
        for name, rounds in took.items():
            seconds = [each[size] for each in rounds]
            print(f"{size:6s} {name:6s} CPU-s: {min(seconds):.4f} least {statistics.median(seconds):.4f} median")


if __name__ == "__main__":
    main()
