"""Questions about functional points: their place in a picture, and whether another object occludes them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from manitwin.geometry.poses import inverse, rotation_from_quaternion_wxyz, transform_points
from manitwin.render.cameras import project
from manitwin.render.raycast import cast_pixels
from manitwin.scenes.vqa.context import LEAST_INNER_PX, Context, sentence
from manitwin.scenes.vqa.part_words import ALL_ROUND, OPENINGS, PART_GONE_PX
from manitwin.scenes.vqa.posed_objects import ObjectInPicture
from manitwin.scenes.vqa.question import YES_NO, Draft, Point
from manitwin.scenes.vqa.references import region
from manitwin.twin.point_records import FunctionalFrame, FunctionalPoint

AROUND_M, AROUND_SHARE = 0.010, 0.10
"""Radius (m, share of the object's length) around an interaction point whose whole surface must be visible, or occluded."""
INTO_COSINE = np.cos(np.radians(65))
"""Least cosine between an opening's axis and the line of sight at which the camera looks into it."""
OPEN_SHARE = 0.8
"""Share of an opening's radius that is tested, which excludes its rim."""
COVERED_SHARE = 0.02
"""An object is uncovered if at most this share of its silhouette in the frame is hidden."""
POINT_DEPTH_M, IN_FRONT_M = 0.006, 0.015
"""Tolerance between a visible point's depth and the picture's, and least depth difference of an occluder."""


@dataclass(frozen=True)
class _PointSurroundings:
    """A point in the world ``(3,)`` and the pixels ``(N, 2)`` (row, column) that would show its surroundings if unoccluded.

    ``on_surface``: a visible point has the picture's depth; else the picture shows what lies behind it.
    """

    point_m: np.ndarray
    around_px: np.ndarray
    on_surface: bool


def interaction_points(asked: Context, seen: ObjectInPicture) -> Iterator[Draft]:
    """Ask for each functional point with a unique label whether another object occludes it."""
    points = seen.thing.shape.twin.record.points
    words, camera = asked.words_of(seen), asked.view.camera
    labels = [point.label for point in points.functional] if points else []
    for point in points.functional if points else ():
        if labels.count(point.label) > 1 or point.label in ALL_ROUND:
            continue
        place = _point_surroundings(asked, seen, point)
        if place is None:
            continue
        column, row, depth_m = asked.view.pixel(place.point_m)
        share: Point = (column / camera.width_px, row / camera.height_px)
        at_depth_m = float(asked.view.picture.depth_m[int(row), int(column)])
        around = asked.view.picture.ids[place.around_px[:, 0], place.around_px[:, 1]]
        evidence = {
            "objects": asked.names(seen), "point": point.id, "label": point.label, "point_depth_m": round(depth_m, 4),
            "picture_depth_m": round(at_depth_m, 4),
        }  # fmt: skip
        slots = {"part": point.label, "a": words}
        where = region(*share)
        at = "at <p0>" if where is None else f"at <p0>, in the {where} of the picture"
        whole = seen.view.amodal_in_frame_px - seen.view.visible_px <= COVERED_SHARE * seen.view.amodal_in_frame_px
        farthest_m = depth_m + POINT_DEPTH_M if place.on_surface else np.inf
        if whole and (around == seen.thing.number).all() and depth_m - POINT_DEPTH_M < at_depth_m < farthest_m:
            yield Draft(
                "interaction_point_occluded", asked.view.name, YES_NO, slots, "no",
                sentence(f"no, it is {at}, and no other object is in front of it"), evidence, points=(share,),
            )  # fmt: skip
        front = [each for each in asked.named_objects if each is not seen and (around == each.thing.number).all()]
        if front and at_depth_m < depth_m - IN_FRONT_M and not _shows_part(asked, seen, point.label):
            yield Draft(
                "interaction_point_occluded", asked.view.name, YES_NO, slots, "yes",
                sentence(f"yes, {asked.words_of(front[0])} hides it; it is behind <p0>"),
                {**evidence, "objects": asked.names(seen, front[0]), "hidden_by": front[0].thing.name}, points=(share,),
            )  # fmt: skip


def _point_surroundings(asked: Context, seen: ObjectInPicture, point: FunctionalPoint) -> _PointSurroundings | None:
    """Return the place of a functional point: the centre of an opening, otherwise a point on the surface.

    None if the object occludes the point itself, if the frame cuts off its surroundings, or for an opening without a frame.
    """
    if point.label in OPENINGS:
        frame = point.frame
        return None if frame is None or frame.kind != "opening" else _opening(asked, seen, frame)
    world_m = transform_points(seen.thing.pose, np.array([point.position_m]))[0]
    if not _is_inside(asked, world_m) or not _faces_camera(asked, seen, world_m):
        return None
    around_px = _surrounding_pixels(asked, seen, world_m)
    return None if around_px is None else _PointSurroundings(world_m, around_px, on_surface=True)


def _opening(asked: Context, seen: ObjectInPicture, frame: FunctionalFrame) -> _PointSurroundings | None:
    """Return the centre of an opening that the camera looks into, without the object itself in between; None if it does not."""
    camera, eye = asked.view.camera, asked.view.camera.position
    rotation = rotation_from_quaternion_wxyz(np.array(frame.quaternion_wxyz))
    across = np.mgrid[-1:1:9j, -1:1:9j].reshape(2, -1).T
    across = OPEN_SHARE * frame.size_m * across[np.linalg.norm(across, axis=1) <= 1]
    of_object_m = np.array(frame.position_m) + across @ rotation[:, :2].T
    center_m, *disc_m = transform_points(seen.thing.pose, np.vstack([[frame.position_m], of_object_m]))
    sight = (eye - center_m) / np.linalg.norm(eye - center_m)
    if (seen.thing.pose[:3, :3] @ rotation[:, 2]) @ sight < INTO_COSINE or not _is_inside(asked, center_m):
        return None
    met_m, lengths_m = _self_occlusion_distances_m(asked, seen, np.array(disc_m))
    pixels = project(np.array(disc_m), camera)[0]
    inside = (pixels >= 0).all(1) & (pixels < [camera.width_px, camera.height_px]).all(1)
    if (met_m < lengths_m - POINT_DEPTH_M).any() or not inside.all():
        return None
    return _PointSurroundings(center_m, np.unique(pixels[:, ::-1].astype(int), axis=0), on_surface=False)


def _is_inside(asked: Context, world_m: np.ndarray) -> bool:
    """Return whether a point is in the picture, and not at its border."""
    camera = asked.view.camera
    column, row, _ = asked.view.pixel(world_m)
    edge_px = LEAST_INNER_PX * camera.width_px / 512
    return edge_px <= column < camera.width_px - edge_px and edge_px <= row < camera.height_px - edge_px


def _surrounding_pixels(asked: Context, seen: ObjectInPicture, world_m: np.ndarray) -> np.ndarray | None:
    """Return the pixels ``(N, 2)`` (row, column) that would show the object's surface near one of its points if unoccluded.

    None if the frame cuts them off.
    """
    camera, thing = asked.view.camera, seen.thing
    radius_m = max(AROUND_M, AROUND_SHARE * thing.longest_m)
    column, row, depth_m = asked.view.pixel(world_m)
    reach = radius_m * camera.focal_px / depth_m
    down, across = np.mgrid[-1:1:9j, -1:1:9j].reshape(2, -1) * reach
    pixels = np.column_stack([row + down, column + across]).astype(int)
    inside = (pixels >= 0).all(1) & (pixels < [camera.height_px, camera.width_px]).all(1)
    if not inside.all():
        return None
    pixels = np.unique(pixels, axis=0)
    to_thing = inverse(thing.pose)
    of_thing = replace(camera, camera_to_object=to_thing @ camera.camera_to_object)
    met_m, _, faces = cast_pixels(thing.shape.caster, of_thing, pixels)
    point_m = transform_points(to_thing, world_m[None])[0]
    near = (faces >= 0) & (np.linalg.norm(met_m - point_m, axis=1) <= radius_m)
    return np.vstack([pixels[near], [[int(row), int(column)]]])


def _shows_part(asked: Context, seen: ObjectInPicture, label: str) -> bool:
    """Return whether the picture shows some of a part with the label of the point, whose place on the part is then unclear."""
    numbers = [
        number for number, each in asked.scene.parts.items()
        if each.object == seen.thing.name
        and any(part.id == each.part_id and part.name == label for part in seen.thing.parts)
    ]  # fmt: skip
    return bool(np.isin(asked.view.picture.parts, numbers).sum() > PART_GONE_PX * seen.scale)


def _faces_camera(asked: Context, seen: ObjectInPicture, world_m: np.ndarray) -> bool:
    """Return whether the object alone leaves one of its points visible to the camera."""
    met_m, lengths_m = _self_occlusion_distances_m(asked, seen, world_m[None])
    return bool(abs(met_m[0] - lengths_m[0]) < POINT_DEPTH_M)


def _self_occlusion_distances_m(
    asked: Context, seen: ObjectInPicture, points_m: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances from the camera to the object alone along the ray to each point ``(N, 3)``, and to the point."""
    eye = asked.view.camera.position
    lengths_m = np.linalg.norm(points_m - eye, axis=1)
    to_thing = inverse(seen.thing.pose)
    origins = np.broadcast_to(transform_points(to_thing, eye[None]), points_m.shape)
    directions = ((points_m - eye) / lengths_m[:, None]) @ to_thing[:3, :3].T
    return np.asarray(seen.thing.shape.caster.first_hits(origins, directions)[0]), lengths_m
