"""Images of a gripper's definition in the grasp frame: open and closed from the side, and an oblique view."""

from __future__ import annotations

import numpy as np
import trimesh
from PIL import Image, ImageDraw, ImageFont

from manitwin.geometry.poses import rotation_between, transform
from manitwin.render.cameras import Camera, framing_camera
from manitwin.render.raycast import merge_parts
from manitwin.render.renderer import shared_renderer
from manitwin.render.surfaces import plain_part
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.suction import SuctionGripper

TILE_PX, LABEL_PX = 420, 34
PALM, THUMB, FINGER = (120, 128, 144), (196, 92, 60), (84, 134, 200)
AXES = ((214, 48, 49), (39, 150, 70), (32, 98, 210))
INK, WHITE = (24, 28, 36), (255, 255, 255)
VIEWS = ((-90.0, 0.0), (-90.0, 0.0), (-35.0, 25.0))
"""Azimuth and elevation (degrees) of the columns: along +Y, with X to the right and Z up; and oblique."""
LIP_HEIGHT_M = 0.01


def gripper_picture(gripper: Gripper) -> Image.Image:
    """Draw a gripper: one row per posture of a hand, one row for others; open, closed, and half open obliquely (a cup: two
    views).

    The thumb, or the -X finger, is red, other fingers are blue. Arrows at the grasp frame's origin: X red, Y green, Z blue; the
    black ball is ``tip_depth_m`` in front of it.
    """
    rows = [_states(gripper)] if not isinstance(gripper, MultiFingerGripper) else _posture_states(gripper)
    corners = np.concatenate([part.vertices for row in rows for _, parts in row for part in parts])
    marks = _marks(gripper, float(np.ptp(corners, axis=0).max()))
    corners = np.concatenate([corners, *(mark.vertices for mark in marks)])
    views = VIEWS if len(rows[0]) == len(VIEWS) else VIEWS[1:]
    picture = Image.new("RGB", (TILE_PX * len(views), (TILE_PX + LABEL_PX) * len(rows)), WHITE)
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(15)
    for line, row in enumerate(rows):
        for column, ((azimuth, elevation), (label, parts)) in enumerate(zip(views, row, strict=True)):
            camera = framing_camera(
                corners,
                azimuth_deg=azimuth,
                elevation_deg=elevation,
                fov_y_deg=12.0,
                width_px=TILE_PX,
                height_px=TILE_PX,
            )
            left, top = TILE_PX * column, (TILE_PX + LABEL_PX) * line
            picture.paste(_render_with_marks(parts, marks, camera), (left, top + LABEL_PX))
            draw.text((left + 12, top + 10), label, fill=INK, font=font)
    return picture


def _render_with_marks(parts: list[trimesh.Trimesh], marks: list[trimesh.Trimesh], camera: Camera) -> Image.Image:
    """Draw parts, with the marks in front of everything."""
    under = shared_renderer().render(parts, [camera], background=WHITE)[0].rgb.astype(float)
    front = shared_renderer().render(marks, [camera], background=WHITE)[0]
    cover = front.coverage[..., None]
    mixed = under * (1 - cover) + (front.rgb - 255.0 * (1 - cover))
    return Image.fromarray(np.rint(mixed).clip(0, 255).astype(np.uint8))


def _states(gripper: Gripper) -> list[tuple[str, list[trimesh.Trimesh]]]:
    """Return labels and parts of open, closed and half-open jaws, or of a cup for two views."""
    if isinstance(gripper, SuctionGripper):
        lip = trimesh.creation.cylinder(gripper.lip_radius_m, LIP_HEIGHT_M, sections=64)
        lip.apply_translation([0, 0, gripper.tip_depth_m - LIP_HEIGHT_M / 2])
        parts = [plain_part(lip, FINGER), *(plain_part(_box(*box), PALM) for box in gripper.boxes(0.0))]
        label = f"{gripper.name}: lip of {2000 * gripper.lip_radius_m:.0f} mm, {gripper.force_n:.0f} N"
        return [(label, parts), ("oblique", parts)]
    opening_m = gripper.opening_m
    palm = len(gripper.palm_boxes) if isinstance(gripper, ParallelGripper) else 0
    states = []
    for label, at_m in (
        (f"{gripper.name}: open, {1000 * opening_m:.0f} mm", opening_m),
        ("closed", 0.0),
        ("half open", opening_m / 2),
    ):
        boxes = [_box(*box) for box in gripper.boxes(at_m)]
        half = (len(boxes) - palm) // 2
        colors = [PALM] * palm + [FINGER] * half + [THUMB] * half
        states.append((label, [plain_part(box, color) for box, color in zip(boxes, colors, strict=True)]))
    return states


def _posture_states(hand: MultiFingerGripper) -> list[list[tuple[str, list[trimesh.Trimesh]]]]:
    rows = []
    for posture in hand.postures:
        joints = np.array(posture.joints_rad)
        half = joints[len(joints) // 2] if len(joints) > 2 else joints.mean(0)
        width = f", {1000 * posture.openings_m[-1]:.0f} mm" if posture.openings_m else ""
        rows.append(
            [
                (f"{hand.name}, {posture.name}: open{width}", _hand_parts(hand, joints[-1])),
                ("closed", _hand_parts(hand, joints[0])),
                ("half open", _hand_parts(hand, half)),
            ]
        )
    return rows


def _hand_parts(hand: MultiFingerGripper, joints_rad: np.ndarray) -> list[trimesh.Trimesh]:
    parts = []
    for link, pose, finger in zip(hand.links, hand.link_poses(joints_rad), hand.finger_of_link, strict=True):
        color = PALM if finger < 0 else THUMB if finger == 0 else FINGER
        parts += [plain_part(shape.to_mesh().apply_transform(pose), color) for shape in link.shapes]
    return parts


def _box(pose: np.ndarray, half_extents_m: np.ndarray) -> trimesh.Trimesh:
    return trimesh.creation.box(2 * half_extents_m, transform=pose)


def _marks(gripper: Gripper, size_m: float) -> list[trimesh.Trimesh]:
    """Return the grasp frame's axes and the ball at the tip depth, scaled to the gripper."""
    length_m, marks = 0.3 * size_m, []
    for axis, color in enumerate(AXES):
        shaft = trimesh.creation.cylinder(0.008 * size_m, 0.84 * length_m, sections=16)
        shaft.apply_translation([0, 0, 0.42 * length_m])
        head = trimesh.creation.cone(0.02 * size_m, 0.2 * length_m, sections=24)
        head.apply_translation([0, 0, 0.8 * length_m])
        arrow = merge_parts([shaft, head])
        arrow.apply_transform(transform(rotation_between(np.eye(3)[2], np.eye(3)[axis])))
        marks.append(plain_part(arrow, color))
    ball = trimesh.creation.icosphere(2, 0.014 * size_m)
    ball.apply_translation([0, 0, gripper.tip_depth_m])
    return [*marks, plain_part(ball, INK)]
