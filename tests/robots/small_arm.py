"""A small robot of boxes in a folder of its own: three joints and a generated hand, to be spoilt by tests."""

from __future__ import annotations

from pathlib import Path

URDF = """<robot name="small">
  <link name="world"/>
  <joint name="stand" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 1"/></joint>
  <link name="base">{base_collision}</link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="2" effort="10"/></joint>
  <link name="upper">{upper_collision}</link>
  <joint name="lift" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="2" effort="10"/></joint>
  <link name="fore">{fore_collision}</link>
  <joint name="roll" type="revolute"><parent link="fore"/><child link="flange"/>
    <origin xyz="0.4 0 0" rpy="0 1.5707963267948966 0"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="3" effort="10"/></joint>
  <link name="flange"/>
</robot>"""

TOML = """name = "small"
source = "made for a test"
base_link = "base"
arm_joints = ["turn", "lift", "roll"]
home_rad = [0.0, 0.5, 0.0]
velocity_fraction = 0.5
acceleration_rad_s2 = 3.0

[urdf]
file = "small.urdf"

[hand]
kind = "generated"
gripper = "panda"
mount_link = "flange"
mass_kg = 0.7

[hand.gripper_to_mount]
position_m = [0.0, 0.0, 0.0]
quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]

[workspace]
min_radius_m = 0.3
max_radius_m = 0.6
half_angle_rad = 1.0
"""


def box(size: str, xyz: str = "0 0 0") -> str:
    """Return a collision box as URDF."""
    return f'<collision><origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry></collision>'


def mesh(name: str) -> str:
    """Return a collision mesh as URDF."""
    return f'<collision><geometry><mesh filename="{name}"/></geometry></collision>'


def small_arm(
    folder: Path,
    *,
    base: str = box("0.1 0.1 0.3", "0 0 0.15"),
    upper: str = box("0.3 0.05 0.05", "0.2 0 0"),
    fore: str = box("0.3 0.05 0.05", "0.2 0 0"),
    urdf: tuple[str, str] = ("", ""),
    toml: tuple[str, str] = ("", ""),
) -> str:
    """Write the robot, with ``urdf`` and ``toml`` replaced (what, by what); returns the path of its TOML file."""
    text = URDF.format(base_collision=base, upper_collision=upper, fore_collision=fore)
    for written, change in ((text, urdf), (TOML, toml)):
        assert change[0] in written, f"nothing to replace: {change[0]}"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "small.urdf").write_text(text.replace(*urdf) if urdf[0] else text)
    path = folder / "small.toml"
    path.write_text(TOML.replace(*toml) if toml[0] else TOML)
    return str(path)
