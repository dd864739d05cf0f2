"""Sample layouts of twins, export one as MJCF, let it rest in MuJoCo: ``python examples/layout_to_mjcf.py [TWINS] [SCENES]``."""

import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np

import manitwin

MANITWIN = Path(sys.executable).parent / "manitwin"


def main(twins: Path, scenes: Path) -> None:
    """Sample two layouts of three objects, write the first as MJCF, and say how far its objects move in a second."""
    words = f"layout {twins} -n 2 --objects 3..3 --surface table --clutter sparse --seed 1 --jobs 1 -o {scenes}"
    subprocess.run([MANITWIN, *words.split()], check=True)
    folder = min(scenes.glob("scenes/*/*/scene.json")).parent
    for placed in manitwin.load_scene(folder).record.objects:
        print(f"{placed.name} is {placed.twin_id} at", np.round(placed.position_m, 3))

    exports = scenes / "exports"
    subprocess.run([MANITWIN, "export", folder, "--to", "mjcf", "-o", exports], check=True)
    file = next(path for path in sorted(exports.glob("*/mjcf/*.xml")))
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    before = data.xpos.copy()
    while data.time < 1.0:
        mujoco.mj_step(model, data)
    moved_m = np.linalg.norm(data.xpos - before, axis=1).max()
    print(f"{file}: {model.nbody - 1} bodies; in one second none moves by more than {moved_m * 1000:.2f} mm")


if __name__ == "__main__":
    main(*(Path(sys.argv[i] if len(sys.argv) > i else name) for i, name in ((1, "twins"), (2, "scenes"))))
