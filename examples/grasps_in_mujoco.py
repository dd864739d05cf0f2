"""Close a simple hand on verified grasps in MuJoCo and lift: ``python examples/grasps_in_mujoco.py [TWINS]``.

Nothing of the package's own trial is used here: only the exported MJCF and the grasps as matrices.
"""

import sys
import tempfile
from pathlib import Path

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

import manitwin

FORCE_N, LIFT_M, TRIES = 50.0, 0.2, 10
HALF_PAD_M, TIP_DEPTH_M = (0.005, 0.009, 0.009), 0.1034  # the Panda hand's, whose grasps these are


def scene(object_file: Path, gripper_to_object: np.ndarray, opening_m: float) -> str:
    """Return MJCF: the object as it was exported, and two pads that slide along X of the grasp frame and rise together."""
    position = " ".join(map(str, gripper_to_object[:3, 3]))
    quaternion = " ".join(map(str, Rotation.from_matrix(gripper_to_object[:3, :3]).as_quat(scalar_first=True)))
    fingers = "".join(
        f"""<body name="{name}" pos="{side * (opening_m / 2 + HALF_PAD_M[0])} 0 {TIP_DEPTH_M}" gravcomp="1">
          <joint name="{name}" type="slide" axis="{-side} 0 0" damping="10"/>
          <geom type="box" size="{" ".join(map(str, HALF_PAD_M))}" mass="0.1" friction="1 0.005 0.0001" condim="4"/>
        </body>"""
        for name, side in (("plus", 1), ("minus", -1))
    )
    drives = "".join(
        f'<position joint="{name}" kp="10000" kv="100" forcerange="-{FORCE_N} {FORCE_N}"/>'
        for name in ("plus", "minus")
    )
    return f"""<mujoco>
      <option timestep="0.002" integrator="implicitfast" cone="elliptic" impratio="10" noslip_iterations="5"/>
      <asset><model name="twin" file="{object_file}"/></asset>
      <worldbody>
        <attach model="twin" body="{object_file.stem}" prefix="twin_"/>
        <body name="carriage" gravcomp="1">
          <joint name="lift" type="slide" axis="0 0 1"/>
          <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
          <body name="hand" pos="{position}" quat="{quaternion}" gravcomp="1">{fingers}</body>
        </body>
      </worldbody>
      <actuator>{drives}<position joint="lift" kp="50000" kv="2000"/></actuator>
    </mujoco>"""


def risen_m(model: mujoco.MjModel, opening_m: float) -> float:
    """Close without gravity, then lift with it; returns how far the object rose."""
    data = mujoco.MjData(model)
    body = next(i for i in range(model.nbody) if model.body(i).name.startswith("twin_"))
    gravity, model.opt.gravity[:] = model.opt.gravity.copy(), 0
    closed = opening_m / 2
    for step in range(1000):  # 2 s: close, then hold
        data.ctrl[:2] = closed * min(1.0, step / 400)
        mujoco.mj_step(model, data)
    model.opt.gravity[:] = gravity
    before = data.xipos[body, 2]
    for step in range(1000):
        data.ctrl[2] = LIFT_M * min(1.0, step / 500)
        mujoco.mj_step(model, data)
    return float(data.xipos[body, 2] - before)


def main(twins: Path) -> None:
    """Try the first grasps of the first twin; says how many hold."""
    twin = manitwin.Dataset(twins)[0]
    grasps = twin.grasps()
    opening_m = 0.08
    with tempfile.TemporaryDirectory() as folder:
        object_file = manitwin.export_twin(twin, "mjcf", folder)["mjcf"]
        held = 0
        for number, pose in enumerate(grasps.gripper_to_object[:TRIES]):
            file = object_file.parent / "scene.xml"
            file.write_text(scene(object_file, pose, opening_m))
            rose = risen_m(mujoco.MjModel.from_xml_path(str(file)), opening_m)
            held += rose > 0.9 * LIFT_M
            print(f"grasp {number}: rose by {rose * 1000:.0f} of {LIFT_M * 1000:.0f} mm")
    print(f"{held} of {min(TRIES, len(grasps))} verified grasps lift {twin.record.name!r} in MuJoCo")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "twins"))
