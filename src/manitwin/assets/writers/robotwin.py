"""RoboTwin 2.0 export: an object folder with visual and collision GLB, model_data and descriptions.

Sources: RoboTwin's envs/utils/create_actor.py (file names), envs/utils/actor_utils.py (frames, whose translations are
multiplied by the scale), envs/_base_task.py ``get_grasp_pose`` (contact frame to gripper frame), envs/robot/robot.py
``_trans_from_gripper_to_endlink`` and the manual's page on new embodiments (X of the gripper frame is the approach direction, Y
the direction in which the fingers move).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.grasp_rows import GraspRows, best_and_diverse, grasp_rows, parallel_grippers_of
from manitwin.assets.writers.licenses import license_of, provenance_lines
from manitwin.assets.writers.mass_properties import physics_of
from manitwin.errors import ExportError
from manitwin.formats.glb import write_glb
from manitwin.formats.markdown import one_line
from manitwin.formats.meshes.textures import make_part, pbr_material
from manitwin.geometry.grasp_diversity import fingertips
from manitwin.geometry.poses import OBJECT_TO_GLTF, rotation_between, rotation_from_quaternion_wxyz, transform
from manitwin.twin.point_records import FunctionalPoint
from manitwin.twin.record import Language, Placement
from manitwin.twin.store import canonical_json

MAX_GRASPS = 16
"""RoboTwin plans a path to every contact frame at each choice: two frames for each grasp make 32 plans."""
SEEN, UNSEEN = 12, 3  # phrases in a description, as in RoboTwin's own objects
STABLE_TILT_RAD = math.radians(3)  # RoboTwin's check_stable discards a scene in which an object rotated by more
_FIRST_NUMBER, _NUMBERS = 200, 800  # lower numbers belong to RoboTwin's own objects
FRANKA_GRIPPER_BIAS_M = 0.08  # of its franka-panda embodiment, by the manual's page on new embodiments
_MAX_WORDS = 20
_ARTICLE = re.compile(r"^(?:an?|the)\s+", re.IGNORECASE)
_KNOWN_CLAUSE = re.compile(r"^(?:to|for|used)\s", re.IGNORECASE)
# a caption with one of these verbs is a sentence about the object, not a noun phrase
_FINITE_VERB = re.compile(
    r"\b(?:is|are|was|has|have|sits|stands|lies|can|features|shows|appears|looks)\b", re.IGNORECASE
)


def export(twin: TwinContent) -> Exported:
    """Write a twin as object ``base0`` of a RoboTwin object folder: metres, Y up, scale 1.

    Each of the best held grasps is written as two contact frames, half a turn about the approach direction apart, for the two
    orientations of a two-finger hand. Raises ExportError if the descriptions cannot be composed.
    """
    name = object_name(twin)
    folder = f"assets/objects/{name}"
    gripper = next(iter(parallel_grippers_of(twin)), "")
    grasps = best_and_diverse(_from_above(grasp_rows(twin, gripper, controls=False)), MAX_GRASPS)
    files = {
        f"{folder}/visual/base0.glb": twin.visual_glb,
        f"{folder}/collision/base0.glb": _collision_glb(twin),
        f"{folder}/model_data0.json": canonical_json(_model_data(twin, grasps)).encode(),
        f"{folder}/physics0.json": canonical_json(_physics(twin)).encode(),
        f"description/objects_description/{name}/base0.json": canonical_json(_description(twin)).encode(),
        "object_mass.json": canonical_json({f"{name}/base0": twin.physical.mass_kg.value}).encode(),
    }
    return Exported(files=files, main=f"{folder}/model_data0.json", cannot_say=_omissions(twin, grasps))


def _from_above(rows: GraspRows) -> GraspRows:
    """Return the grasps from above, which a hand can reach when the object stands on a table; all grasps if there are none."""
    above = np.flatnonzero(rows.gripper_to_object[:, 2, 3] >= 0.0)
    return rows.take(above) if len(above) else rows


def object_name(twin: TwinContent) -> str:
    """Return ``NNN_name``: a number from the twin's id, which RoboTwin requires of clutter objects, and the unique twin name."""
    return f"{_FIRST_NUMBER + int(twin.record.twin_id, 16) % _NUMBERS}_{twin.name}"


def contact_frames(gripper_to_object: np.ndarray, depth_m: np.ndarray) -> np.ndarray:
    """Return RoboTwin's two contact frames ``(N, 2, 4, 4)``, Y up, of grasps ``(N, 4, 4)`` in the object frame.

    The origin lies between the fingertips, Y points against the approach direction, Z along the closing direction. The second
    frame is the first one rotated by half a turn about Y. RoboTwin's gripper frame is
    ``C_R [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]``, 0.12 m behind C along its own X, which is the approach direction; its Y is the
    closing direction.
    """
    closing, side, approach = (gripper_to_object[:, :3, i] for i in range(3))
    frames = np.tile(np.eye(4), (len(gripper_to_object), 2, 1, 1))
    for twin, sign in enumerate((1.0, -1.0)):
        frames[:, twin, :3, :3] = np.stack([-sign * side, -approach, sign * closing], axis=-1)
        frames[:, twin, :3, 3] = fingertips(gripper_to_object, depth_m)
    return OBJECT_TO_GLTF @ frames


def _model_data(twin: TwinContent, grasps: GraspRows) -> dict[str, Any]:
    low, high = _bounds(twin)
    contacts = contact_frames(grasps.gripper_to_object, grasps.depth_m).reshape(-1, 4, 4)
    points = twin.record.points
    functional = points.functional if points is not None else []
    words = {point.id: f"{point.type.replace('_', ' ')}: {point.scenario}" for point in points.grasp} if points else {}
    return {
        "scale": [1.0, 1.0, 1.0],
        # along the axes, not those of an oriented box: RoboTwin's clutter code reads index 1 as the height
        "center": ((low + high) / 2).tolist(),
        "extents": (high - low).tolist(),
        "transform_matrix": np.eye(4).tolist(),
        "target_pose": [],
        "target_point_description": [],
        "contact_points_pose": contacts.tolist(),
        "contact_points_group": [[2 * i, 2 * i + 1] for i in range(len(grasps))],
        "contact_points_mask": [True] * len(grasps),
        "contact_points_description": [words.get(p) or "a verified grasp" for p in grasps.point_ids for _ in range(2)],
        "functional_matrix": [_functional_frame(point).tolist() for point in functional],
        "functional_point_description": [f"{point.label}: {point.description}" for point in functional],
        "orientation_point": [transform(None, (low + high) / 2).tolist()],
        "orientation_point_description": ["the middle of the object, with the axes of its mesh: Y is up"],
        "stable": any(_is_upright_stable(placement) for placement in twin.record.placements or []),
        "provenance": list(provenance_lines(twin.record)),
        "license": license_of(twin.record),
        "attribution": twin.record.source.attribution,
    }


def _functional_frame(point: FunctionalPoint) -> np.ndarray:
    """Return the frame of a functional point, Y up; its Z axis points out of the object, to where an interaction comes from.

    It is the frame of the feature if the point has one, otherwise a frame at the point along its normal.
    """
    if point.frame is not None:
        rotation = rotation_from_quaternion_wxyz(np.array(point.frame.quaternion_wxyz))
        return OBJECT_TO_GLTF @ transform(rotation, np.array(point.frame.position_m))
    outward = OBJECT_TO_GLTF[:3, :3] @ np.array(point.normal)
    return transform(rotation_between(np.array([0.0, 0.0, 1.0]), outward), OBJECT_TO_GLTF[:3, :3] @ point.position_m)


def _bounds(twin: TwinContent) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest corner ``(3,)`` m of the hulls in RoboTwin's axes."""
    corners = np.concatenate([vertices for vertices, _ in twin.hulls]) @ OBJECT_TO_GLTF[:3, :3].T
    return corners.min(axis=0), corners.max(axis=0)


def _is_upright_stable(placement: Placement) -> bool:
    """Return whether the object is stable as RoboTwin places it, with the object frame's +Z up."""
    up = rotation_from_quaternion_wxyz(np.array(placement.quaternion_wxyz))[2, 2]
    return placement.settled and math.acos(min(1.0, float(up))) <= STABLE_TILT_RAD


def _collision_glb(twin: TwinContent) -> bytes:
    """Return the hulls as separate meshes: SAPIEN's ``load_multiple`` builds one convex shape from each."""
    grey = pbr_material("hull", base_color=(0.5, 0.5, 0.5))
    return write_glb(
        [
            make_part(vertices, faces, material=grey, name=f"{twin.name}_hull_{i:02d}")
            for i, (vertices, faces) in enumerate(twin.hulls)
        ]
    )


def _description(twin: TwinContent) -> dict[str, Any]:
    language = twin.record.language
    assert language is not None  # an accepted twin has language
    seen, unseen = split_phrases(language, SEEN, UNSEEN)
    return {"raw_description": language.category, "seen": seen, "unseen": unseen}


def _physics(twin: TwinContent) -> dict[str, Any]:
    return {
        **physics_of(twin),
        "frame": "object frame: +Z up; (x, y, z) of it is (x, z, -y) of the meshes and of model_data0.json",
        "remark": "RoboTwin reads none of this: set mass, centre of mass, inertia and friction on the actor yourself",
    }


def _omissions(twin: TwinContent, grasps: GraspRows) -> tuple[str, ...]:
    lines = [
        "mass: RoboTwin gives rigid objects 0.01 kg; where ROBOTWIN_OBJECT_MASS_CONFIG names object_mass.json, newer"
        " versions take the mass from it. The inertia stays that of density 1000 either way.",
        "friction and restitution: RoboTwin's scene has one material for all, 0.5 and 0.5; physics0.json has the object's.",
        "convex collision: create_actor needs convex=True, or the hulls become one mesh that no dynamic body may have.",
        f"how far a robot's fingertips reach past the contact frame: RoboTwin puts the hand gripper_bias behind it"
        f" ({FRANKA_GRIPPER_BIAS_M} m for its Franka); set it to the distance from hand to fingertips for the poses that"
        f" were verified{_depth_of(grasps)}.",
        "grasps that failed, and of other grippers: the formats graspgen and isaac_grasp have them.",
    ]
    if not len(grasps):
        lines.append("contacts: no grasp of this twin held, so contact_points_pose is empty and it cannot be grasped.")
    return tuple(lines)


def _depth_of(grasps: GraspRows) -> str:
    depths = sorted(set(grasps.depth_m.tolist()))
    return f": {depths[0]} m for {grasps.gripper}" if len(depths) == 1 else ""


def noun_phrases(language: Language, count: int) -> list[str]:
    """Return ``count`` distinct noun phrases without an article, those from captions first.

    Instructions use them after "the", so captions that are whole sentences or commands are skipped. Raises ExportError if too
    few phrases are available.
    """
    captions = (phrase for text in (language.caption, *language.captions) if (phrase := _caption_noun_phrase(text)))
    phrases = _distinct([*captions, *_attribute_phrases(language)])
    if len(phrases) < count:
        raise ExportError(
            f"only {len(phrases)} phrases for {language.category!r}, {count} are needed; give it captions"
        )
    return phrases[:count]


def split_phrases(language: Language, seen: int, unseen: int) -> tuple[list[str], list[str]]:
    """Return training phrases and disjoint test phrases, the latter spread evenly over all kinds of phrases."""
    phrases = noun_phrases(language, seen + unseen)
    step = (seen + unseen) // unseen
    held_out = phrases[step - 1 :: step][:unseen]
    return [phrase for phrase in phrases if phrase not in held_out], held_out


def _caption_noun_phrase(text: str) -> str | None:
    """Return the noun phrase of a caption, or None if the caption is not a noun phrase."""
    line = one_line(text).rstrip(".")
    if not _ARTICLE.match(line) or ". " in line or _FINITE_VERB.search(line) or len(line.split()) > _MAX_WORDS:
        return None
    return _ARTICLE.sub("", line)


def _attribute_phrases(language: Language) -> Iterator[str]:
    noun, material, shape, size = (
        one_line(text) for text in (language.category, language.material, language.shape, language.size)
    )
    function = one_line(language.function)
    use = function if _KNOWN_CLAUSE.match(function) else f"for {function}"
    color = one_line(language.color)
    if not color.lower().startswith("unknown"):
        yield from (
            f"{color} {noun}",
            f"{color} {material} {noun}",
            f"{color} {noun} {use}",
            f"{color} {noun}, {shape}",
        )
    yield from (
        noun,
        f"{material} {noun}",
        f"{noun} made of {material}",
        f"{noun} {use}",
        f"{material} {noun} {use}",
        f"{noun} made of {material}, {use}",
        f"{noun}, {shape}",
        f"{material} {noun}, {shape}",
        f"{noun} of {size}",
        f"{material} {noun} of {size}",
        f"{noun} {use}, {size}",
        f"{noun}, {shape}, {size}",
        f"{noun} made of {material}, {shape}",
        f"{noun} {use}, {shape}",
        f"{material} {noun} {use}, {shape}",
        f"{noun} made of {material}, {size}, {shape}",
    )


def _distinct(phrases: Iterable[str]) -> list[str]:
    """Remove phrases that repeat an earlier one up to letter case."""
    distinct: dict[str, str] = {}
    for phrase in phrases:
        distinct.setdefault(phrase.lower(), phrase)
    return list(distinct.values())
