"""Make episodes and read them without the package: ``python examples/plain_episodes.py [TWINS] [EPISODES]``.

It needs ``pip install 'manitwin[robots]'`` to make them; reading takes h5py and pyarrow alone.
"""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import h5py
import numpy as np
import pyarrow.parquet as pq

MANITWIN = Path(sys.executable).parent / "manitwin"


def main(twins: Path, episodes: Path) -> None:
    """Make four attempts at pick and place, then print what was recorded."""
    words = f"trajectories {twins} -n 4 --robot panda --seed 1 --jobs 1 -o {episodes}"
    subprocess.run([MANITWIN, *words.split()], check=True)

    attempts = pq.read_table(episodes / "attempts.parquet")  # a row for every attempt, kept or not
    print("outcomes:", dict(Counter(attempts["outcome"].to_pylist())))

    with h5py.File(episodes / "maniskill" / "trajectory.h5") as file:
        for name, trajectory in file.items():
            facts = json.loads(trajectory.attrs["episode"])
            actions = trajectory["actions"][:]  # (T, n + 1): target joint positions, rad; target opening, m
            target = trajectory["obs/extra/obj_pose"][:]  # (T + 1, 7): position, quaternion wxyz
            print(
                f"{name}: {len(actions)} steps of {actions.shape[1]} numbers;"
                f" the object goes {np.linalg.norm(target[-1, :2] - target[0, :2]):.3f} m,"
                f" up to {target[:, 2].max():.3f} m high: {facts['attempt']['instructions'][0]!r}"
            )

    frames = pq.read_table(sorted((episodes / "lerobot" / "data").rglob("*.parquet"))[0])
    print(f"LeRobot: {frames.num_rows} frames of", ", ".join(frames.column_names[:4]), "...")


if __name__ == "__main__":
    main(*(Path(sys.argv[i] if len(sys.argv) > i else name) for i, name in ((1, "twins"), (2, "episodes"))))
