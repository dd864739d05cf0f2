"""A small hand of boxes in a folder of its own: a thumb and two fingers of two links, to be spoilt by tests.

All stand upright 60 mm apart when open (joints at 0), and turn towards one another at positive positions.
"""

from __future__ import annotations

from pathlib import Path

ROOTS = {"thumb": (-0.036, 0.0, "0 1 0"), "index": (0.036, -0.012, "0 -1 0"), "middle": (0.036, 0.012, "0 -1 0")}
JOINTS = tuple(f"{finger}_{number}" for finger in ROOTS for number in (1, 2))
LIMIT = '<limit lower="0" upper="1.2" effort="1" velocity="2"/>'

TOML = """kind = "multi_finger"
name = "small_hand"
source = "made for a test"
tip_depth_m = 0.085
force_n = 8.0
finger_friction = 1.0
palm_front_m = 0.02
clearance_m = 0.008
joints = ["thumb_1", "thumb_2", "index_1", "index_2", "middle_1", "middle_2"]
fingers = [["thumb_1_link", "thumb_2_link"], ["index_1_link", "index_2_link"], ["middle_1_link", "middle_2_link"]]

[urdf]
file = "hand.urdf"

[root_to_gripper]
position_m = [0.0, 0.0, 0.0]
quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]

[drive]
stiffness_nm_rad = 20.0
damping_nm_s_rad = 0.5
torque_limit_nm = 0.9
press_nm = 0.6
speed_rad_s = 2.0
armature_kg_m2 = 0.0005

[[postures]]
name = "close"
grasp_types = ["pinch", "power", "parallel_jaw"]
depth_m = [0.06, 0.085]
closed_rad = [0.6, 0.3, 0.6, 0.3, 0.6, 0.3]
open_rad = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
"""
COUPLED = (
    TOML.replace(
        'joints = ["thumb_1", "thumb_2", "index_1", "index_2", "middle_1", "middle_2"]',
        'joints = ["thumb_1", "index_1", "middle_1"]',
    )
    .replace("[0.6, 0.3, 0.6, 0.3, 0.6, 0.3]", "[0.6, 0.6, 0.6]")
    .replace("[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]")
)
"""Of the hand whose second joints follow."""


def box(size: str, xyz: str) -> str:
    """Return a collision box as URDF."""
    return f'<collision><origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry></collision>'


def urdf(mimic: str = "") -> str:
    """Return the hand as URDF; ``mimic`` stands in the second joint of each finger, with ``{leader}`` its first."""
    parts = [f'<link name="palm">{box("0.09 0.05 0.02", "0 0 0.01")}</link>']
    for finger, (x_m, y_m, axis) in ROOTS.items():
        for number, parent, at in ((1, "palm", f"{x_m} {y_m} 0.02"), (2, f"{finger}_1_link", "0 0 0.04")):
            follows = mimic.format(leader=f"{finger}_1") if number == 2 else ""
            parts.append(
                f'<link name="{finger}_{number}_link">{box("0.012 0.014 0.036", "0 0 0.02")}</link>'
                f'<joint name="{finger}_{number}" type="revolute"><parent link="{parent}"/><child link="{finger}_{number}_link"/>'
                f'<origin xyz="{at}"/><axis xyz="{axis}"/>{LIMIT}{follows}</joint>'
            )
    return f'<robot name="small_hand">{"".join(parts)}</robot>'


def write_hand(folder: Path, toml: str = TOML, description: str | None = None) -> str:
    """Write the hand's two files, and return the path of its gripper file."""
    (folder / "hand.urdf").write_text(urdf() if description is None else description)
    (folder / "hand.toml").write_text(toml)
    return str(folder / "hand.toml")
