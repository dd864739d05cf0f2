"""Make the pictures of the documentation beside this file: frames.png, cards.png, grippers.png and questions.png.

frames.png shows every frame of a twin on a mug: object frame, grasp frame, placement plane, and the axes of a GLB file. cards.png
shows the cards of the two samples, grippers.png every shipped gripper on the mug, questions.png the pictures from which a
vision-language model chooses grasp points.
"""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import numpy as np
import trimesh
from picture_file import of_twin, save_picture
from PIL import Image, ImageDraw, ImageFont, ImageOps

import manitwin
from manitwin.cli.annotator_questions import list_annotator_questions
from manitwin.config import BuildConfig
from manitwin.formats.glb import read_glb
from manitwin.geometry.boxes import smallest_enclosing_circle
from manitwin.geometry.poses import OBJECT_TO_GLTF, rotation_between, transform, transform_points
from manitwin.models.vlm.protocol import Picture as ChatPicture
from manitwin.render.cameras import Camera, framing_camera, project
from manitwin.render.card_panels import gripper_body
from manitwin.render.raycast import merge_parts
from manitwin.render.renderer import shared_renderer
from manitwin.render.surfaces import plain_part
from manitwin.robots.grippers.gripper import Gripper, load_gripper, shipped_grippers
from manitwin.robots.grippers.hand_clearance import HandCollision
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.suction import SuctionGripper

DOCS = Path(__file__).resolve().parent
MUG = DOCS.parent / "samples" / "mug.glb"
AXIS_COLORS = ((214, 48, 49), (39, 150, 70), (32, 98, 210))
AXIS_M = 0.07
WIDTH, HEIGHT = 1500, 940
TILE, LABEL = 440, 40
QUESTION_PX = 520
FINGER_COLORS = ((120, 128, 144), (196, 92, 60), (84, 134, 200), (76, 160, 116), (196, 158, 66))
INK, GREY = (24, 28, 36), (96, 104, 116)

GRASP_TEXT = """Grasp frame
gripper_to_object (wxyz)
origin at the gripper's base
+Z approaches the object
X closes the fingers"""
FINGERTIPS_TEXT = """Fingertips
depth_m along +Z,
width_m apart along X
of the grasp frame"""
OBJECT_TEXT = """Object frame
right-handed, metres, +Z up
origin at the bottom centre:
the object stands on z = 0"""
PLACEMENT_TEXT = """Placement
object_to_plane: the plane is
z = 0, its origin the centre of
the smallest circle around
the object (collision_radius_m)"""


def mug() -> list[trimesh.Trimesh]:
    """Return the sample mug or, if the samples have not been made yet, a revolved profile with a ring."""
    if MUG.is_file():
        return read_glb(MUG)
    profile = [[0, 0], [0.036, 0], [0.040, 0.004], [0.040, 0.095], [0.0365, 0.095], [0.0365, 0.008], [0, 0.006]]
    body = trimesh.creation.revolve(np.array(profile), sections=96)
    handle = trimesh.creation.torus(0.024, 0.0052, major_sections=48, minor_sections=24)
    handle.apply_transform(transform(np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), np.array([0.041, 0, 0.05])))
    keep = handle.triangles_center[:, 0] > 0.0385
    handle = trimesh.Trimesh(handle.vertices, handle.faces[keep], process=False)
    return [plain_part(merge_parts([body, handle]), (238, 236, 230), roughness=0.4)]


def axes(frame_to_object: np.ndarray, length: float) -> list[trimesh.Trimesh]:
    """Return three arrows: red X, green Y, blue Z."""
    result = []
    for axis, color in enumerate(AXIS_COLORS):
        shaft = trimesh.creation.cylinder(0.0013, length * 0.84, sections=24)
        shaft.apply_translation([0, 0, length * 0.42])
        head = trimesh.creation.cone(0.0036, length * 0.18, sections=32)
        head.apply_translation([0, 0, length * 0.82])
        arrow = merge_parts([shaft, head])
        arrow.apply_transform(frame_to_object @ transform(rotation_between(np.eye(3)[2], np.eye(3)[axis])))
        result.append(plain_part(arrow, color, roughness=0.8))
    return result


def rim_grasp(gripper: Gripper, extents: np.ndarray, part: trimesh.Trimesh) -> tuple[np.ndarray, float]:
    """Return a grasp of the rim from above: ``gripper_to_object`` and the width of the held wall."""
    rim = float(extents[2])
    across = trimesh.intersections.mesh_plane(part, [0, 0, 1], [0, 0, rim - 0.012]).reshape(-1, 3)
    near = across[(np.abs(across[:, 0]) < 0.004) & (across[:, 1] < 0)]
    inner, outer = float(near[:, 1].max()), float(near[:, 1].min())
    rotation = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]) @ np.diag([1.0, -1, -1])
    tip = np.array([0, (inner + outer) / 2, rim - 0.012])
    return transform(rotation, tip - rotation[:, 2] * gripper.tip_depth_m), inner - outer


def _font(size_px: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size_px)


def _at(point: np.ndarray, camera: Camera) -> tuple[float, float]:
    x, y = project(np.asarray(point, dtype=float)[None], camera)[0][0]
    return float(x), float(y)


def _letters(draw: ImageDraw.ImageDraw, camera: Camera, frame_to_object: np.ndarray, length: float, names: str) -> None:
    for axis, color in enumerate(AXIS_COLORS):
        tip = transform_points(frame_to_object, length * 1.13 * np.eye(3)[axis : axis + 1])[0]
        draw.text(
            _at(tip, camera), names[axis], fill=color, font=_font(30), anchor="mm", stroke_width=4, stroke_fill="white"
        )


def _note(draw: ImageDraw.ImageDraw, at: tuple[float, float], corner: tuple[int, int], text: str) -> None:
    """Write a title and lines at a corner, with a leader line to the described point."""
    title, *lines = text.splitlines()
    x, y = corner
    width = max(_font(26).getlength(title), *(_font(18).getlength(line) for line in lines))
    anchor_x = x + width + 12 if at[0] > x + width else x - 12
    draw.line((anchor_x, y + 14, *at), fill=GREY, width=2)
    draw.ellipse((at[0] - 5, at[1] - 5, at[0] + 5, at[1] + 5), outline=GREY, width=2)
    draw.text((x, y), title, fill=INK, font=_font(26))
    for index, line in enumerate(lines):
        draw.text((x, y + 40 + 26 * index), line, fill=GREY, font=_font(18))


def frames_picture() -> Image.Image:
    """Draw all frames on the mug."""
    parts, gripper = mug(), load_gripper("panda")
    whole = merge_parts(parts)
    gripper_to_object, width_m = rim_grasp(gripper, whole.extents, whole)
    hand = gripper_body(gripper.boxes(width_m + 0.012)).apply_transform(gripper_to_object)
    center, radius = smallest_enclosing_circle(np.asarray(whole.vertices)[:, :2])
    ring = trimesh.creation.annulus(radius - 0.0008, radius + 0.0008, 0.0006, sections=128)
    scene = [*parts, plain_part(ring.apply_translation([*center, 0]), (150, 84, 190))]
    everything = np.concatenate([whole.vertices, hand.vertices, ring.vertices])
    camera = framing_camera(
        everything, azimuth_deg=-32.0, elevation_deg=20.0, fov_y_deg=22.0, width_px=WIDTH, height_px=HEIGHT
    )
    renderer, white = shared_renderer(), (255, 255, 255)
    bare = renderer.render(scene, [camera], background=white)[0].rgb.astype(float)
    held = renderer.render([*scene, plain_part(hand, (150, 158, 172))], [camera], background=white)[0].rgb
    arrows = axes(np.eye(4), AXIS_M) + axes(gripper_to_object, AXIS_M)
    front = renderer.render(arrows, [camera], background=white)[0]
    cover = front.coverage[..., None]
    # The hand is translucent, and the axes are drawn on top.
    under = 0.45 * bare + 0.55 * held
    picture = Image.fromarray(
        np.rint(under * (1 - cover) + (front.rgb - 255.0 * (1 - cover))).clip(0, 255).astype(np.uint8)
    )
    draw = ImageDraw.Draw(picture)
    _letters(draw, camera, np.eye(4), AXIS_M, "XYZ")
    _letters(draw, camera, gripper_to_object, AXIS_M, "XYZ")
    tip = gripper_to_object[:3, 3] + gripper.tip_depth_m * gripper_to_object[:3, 2]
    edge = np.append(center, 0) + radius * camera.camera_to_object[:3, 0]
    for place, corner, text in (
        (gripper_to_object[:3, 3], (60, 90), GRASP_TEXT),
        (tip, (60, 440), FINGERTIPS_TEXT),
        (np.zeros(3), (60, 690), OBJECT_TEXT),
        (edge, (1180, 640), PLACEMENT_TEXT),
    ):
        _note(draw, _at(place, camera), corner, text)
    _gltf_inset(draw, camera)
    return picture


def _gltf_inset(draw: ImageDraw.ImageDraw, camera: Camera) -> None:
    """Draw the axes of GLB files from the same viewpoint, with the conversion from object axes."""
    x, y, length = 1270.0, 180.0, 62.0
    for axis, color in enumerate(AXIS_COLORS):
        direction = OBJECT_TO_GLTF[:3, :3].T[:, axis] @ camera.camera_to_object[:3, :3]
        tip = (x + length * direction[0], y - length * direction[1])
        draw.line((x, y, *tip), fill=color, width=5)
        letter = (x + 1.3 * length * direction[0], y - 1.3 * length * direction[1])
        draw.text(letter, "XYZ"[axis], fill=color, font=_font(26), anchor="mm")
    draw.text((1180, 232), "GLB files are Y-up", fill=INK, font=_font(26))
    draw.text((1180, 272), "object (x, y, z)", fill=GREY, font=_font(18))
    draw.text((1180, 298), "is glTF (x, z, -y)", fill=GREY, font=_font(18))


def grippers_picture() -> Image.Image:
    """Draw every shipped gripper holding the mug, at one scale."""
    parts = mug()
    whole = merge_parts(parts)
    drawn = [(name, _held(load_gripper(name), whole)) for name in shipped_grippers()]
    corners = [hand.vertices for _, hands in drawn for hand in hands]
    camera = framing_camera(
        np.concatenate([whole.vertices, *corners]),
        azimuth_deg=-50.0,
        elevation_deg=22.0,
        fov_y_deg=22.0,
        width_px=TILE,
        height_px=TILE,
    )
    picture = Image.new("RGB", (TILE * len(drawn), TILE + LABEL), "white")
    draw = ImageDraw.Draw(picture)
    for index, (name, hands) in enumerate(drawn):
        scene = [*parts, *(plain_part(h, c) for h, c in zip(hands, FINGER_COLORS, strict=False))]
        picture.paste(
            Image.fromarray(shared_renderer().render(scene, [camera], background=(255, 255, 255))[0].rgb),
            (TILE * index, LABEL),
        )
        draw.text((TILE * (index + 0.5), 30), name, fill=INK, font=_font(22), anchor="ms")
    return picture


def _held(gripper: Gripper, whole: trimesh.Trimesh) -> list[trimesh.Trimesh]:
    """Return a gripper's parts in its grasp of the mug: jaws at the rim, suction cup and hand at the side without handle."""
    radius, height = float(whole.extents[1]) / 2, float(whole.extents[2])
    if isinstance(gripper, SuctionGripper):
        lip = trimesh.creation.cone(gripper.lip_radius_m, 0.02, sections=64)
        lip.apply_transform(transform(np.diag([1.0, -1, -1]), np.array([0, 0, gripper.tip_depth_m])))
        pose = _from_the_side(-radius - gripper.tip_depth_m, height / 2)
        return [gripper_body(gripper.boxes(0.0)).apply_transform(pose), lip.apply_transform(pose)]
    if isinstance(gripper, MultiFingerGripper):
        return _held_in_hand(gripper, whole, radius, height)
    pose, width_m = rim_grasp(gripper, whole.extents, whole)
    return [gripper_body(gripper.boxes(width_m)).apply_transform(pose)]


def _from_the_side(x: float, z: float) -> np.ndarray:
    """Return a grasp pose with its origin at (x, 0, z) that approaches along +X and closes along Y."""
    return transform(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]), np.array([x, 0, z]))


def _held_in_hand(
    hand: MultiFingerGripper, whole: trimesh.Trimesh, radius: float, height: float
) -> list[trimesh.Trimesh]:
    """Close the first posture around the mug's body until contact."""
    body = HandCollision((np.array(trimesh.creation.cylinder(radius, height, sections=48).vertices),))
    posture = hand.postures[0]
    pose = _from_the_side(-radius - hand.palm_front_m - 0.006, 0.0)
    opening_m = posture.openings_m[-1]
    while not body.boxes_overlap(hand.boxes_at(posture.joints_at(np.array(opening_m))), pose[None], 0.0)[0]:
        opening_m -= 0.001
    links = hand.link_poses(posture.joints_at(np.array(opening_m)))
    fingers: list[list[trimesh.Trimesh]] = [[] for _ in range(len(hand.fingers) + 1)]
    for link, link_to_gripper, finger in zip(hand.links, links, hand.finger_of_link, strict=True):
        for shape in link.shapes:
            ball = shape.radius_m is not None
            part = (
                trimesh.creation.icosphere(3, shape.radius_m)
                if ball
                else trimesh.creation.box(2 * shape.half_extents_m)
            )
            lifted = transform(translation=np.array([0, 0, height / 2]))
            fingers[finger + 1].append(part.apply_transform(lifted @ pose @ link_to_gripper @ shape.shape_to_link))
    return [merge_parts(some) for some in fingers]


def cards_picture(twins: list[manitwin.Twin]) -> Image.Image:
    """Stack the cards of twins vertically."""
    cards = [Image.open(twin.folder / "card.png").convert("RGB") for twin in twins]
    width, height = cards[0].size
    picture = Image.new("RGB", (width, height * len(cards)), "white")
    for index, card in enumerate(cards):
        picture.paste(card, (0, index * height))
    return picture


def sample_twins(folder: Path) -> list[manitwin.Twin]:
    """Build the project's samples and return the twins sorted by name."""
    report = manitwin.build(DOCS.parent / "samples" / "samples.csv", folder)
    twins = [manitwin.load(result.folder) for result in report.results if result.folder is not None]
    return sorted(twins, key=lambda twin: twin.record.name or "")


def made_of_twins(twins: list[manitwin.Twin]) -> dict[str, str]:
    """Return the digests of twins' records by name."""
    return {twin.record.name or twin.record.twin_id: of_twin(twin.record) for twin in twins}


def questions_picture() -> Image.Image:
    """Show the pictures from which a model chooses grasp points on the sample mug: clean, marked, and with rearranged markers."""
    with tempfile.TemporaryDirectory() as folder:
        report = manitwin.build(MUG, folder, name="mug", quick=True)
        asked = list_annotator_questions(report.results[0].folder or Path(), BuildConfig(), "openai:MODEL")
    shown = []
    for number, picture in (
        (4, 0),
        (4, 1),
        (5, 1),
    ):  # the first two grasp queries; the clean picture of each view comes first
        pictures = [part.png for part in asked.questions[number].question.parts if isinstance(part, ChatPicture)]
        one = Image.open(io.BytesIO(pictures[picture])).convert("RGB")
        shown.append(ImageOps.pad(one, (QUESTION_PX, QUESTION_PX), color="white"))
    picture = Image.new("RGB", (QUESTION_PX * len(shown), QUESTION_PX), "white")
    for index, one in enumerate(shown):
        picture.paste(one, (QUESTION_PX * index, 0))
    return picture


if __name__ == "__main__":
    frames_picture().save(DOCS / "frames.png", optimize=True)
    grippers_picture().save(DOCS / "grippers.png", optimize=True)
    with tempfile.TemporaryDirectory() as folder:
        samples = sample_twins(Path(folder))
        save_picture(cards_picture(samples), DOCS / "cards.png", made_of_twins(samples))
    questions_picture().save(DOCS / "questions.png", optimize=True)
