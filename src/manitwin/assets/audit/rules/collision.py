"""COL rules: agreement of collision shapes with the visual geometry."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from manitwin.assets.asset import CollisionShape
from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset

SEEN_ONLY = frozenset({"visual", "vis", "marker", "ghost", "target", "goal"})
"""Words in names of pure markers, such as goal poses, which are not meant to collide."""

BOX_SLACK_M, BOX_SLACK_SHARE = 0.003, 0.03
"""Allowed distance between sides of the collision box and the visual box, in metres and as share of the longest side."""

LEAST_KEPT = 0.5
"""Least share of an open cavity that collision shapes must leave open, so that objects can be put inside."""

LEAST_OPENING_M = 0.01
"""Least width of an opening, about that of a pencil; narrower ones, such as the bore of a flute, are ignored."""

STICKS_OUT_M, STICKS_OUT_SHARE = 0.01, 0.05
"""How far collision shapes may reach into open air: about the thickness of a finger."""

UNCOVERED_M, UNCOVERED_SHARE = 0.005, 0.03
"""How far the visual surface may lie outside all collision shapes; fingers penetrate it by this much."""

CONVEX_SHARE = 0.97
"""A mesh that fills a smaller share of its convex hull is concave."""

MANY_SHAPES, MANY_VERTICES = 128, 255
"""PhysX cooks hulls with at most 255 vertices (its manual); hundreds of shapes make every contact slow."""


def missing(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a movable asset without collision shapes, unless it is a marker."""
    if measured.asset.collision or measured.visual is None or measured.asset.static or measured.asset.partial:
        return
    if measured.asset.inertial.mass_kg == 0:  # reported by MAS002; Bullet treats it as static
        return
    named = re.split(r"[^a-z]+", f"{measured.asset.name} {measured.asset.path.stem}".lower())
    if not SEEN_ONLY & set(named):
        yield Complaint("there are no collision shapes: the object falls through the table")


def flat(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report shapes without volume."""
    if not measured.shapes.flat:
        return
    shapes = [measured.asset.collision[index] for index in measured.shapes.flat]
    names = ", ".join(shape.name for shape in shapes[:4])
    yield Complaint(
        f"{len(shapes)} of {len(measured.asset.collision)} collision shapes have no volume: {names}",
        file=shapes[0].file,
    )


def box_differs(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a collision box that differs from the visual box."""
    if measured.visual is None or measured.collision is None or measured.asset.static:
        return  # static assets often collide only where they are touched, such as a table's top
    if measured.asset.inertial.mass_kg == 0:  # static in Bullet: a ground is often a slab below the visible surface
        return
    seen, felt = np.asarray(measured.visual.bounds), np.asarray(measured.collision.bounds)
    apart = float(np.abs(seen - felt).max())
    if apart > max(BOX_SLACK_M, BOX_SLACK_SHARE * measured.longest_m):
        sides = ["x".join(f"{1000 * side:.4g}" for side in np.ptp(box, axis=0)) for box in (seen, felt)]
        yield Complaint(
            f"what is seen measures {sides[0]} mm, what collides {sides[1]} mm, and a side is {1000 * apart:.3g} mm off",
            values={"visual_bounds_m": seen.tolist(), "collision_bounds_m": felt.tolist(), "apart_m": apart},
        )


def has_convex_pieces(measured: MeasuredAsset) -> bool:
    """Return whether the collision consists of convex pieces in the same box as the visual, so that both are comparable."""
    if any(shape.as_drawn for shape in measured.asset.collision) or measured.measure_once(_concave_meshes):
        return False
    return bool(len(measured.shapes)) and not measured.complaints(box_differs) and not measured.complaints(not_convex)


def filled_opening(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a container that the collision shapes fill."""
    air = measured.free_space
    if measured.asset.static or air is None or air.opens is None or not has_convex_pieces(measured):
        return
    if measured.asset.partial:  # a link of a robot is hollow where the next one is mounted
        return
    across = np.ptp(air.points_m[air.hollow], axis=0)[np.abs(air.opens) < 0.5]
    if not len(across) or float(across.min()) < LEAST_OPENING_M:
        return
    kept = 1 - float(measured.shapes.is_within(air.points_m[air.hollow]).mean())
    if kept < LEAST_KEPT:
        yield Complaint(
            f"the collision shapes fill the opening: {kept:.0%} of its volume is kept, nothing can be put in",
            values={"cavity_kept": kept, "opens": air.opens.tolist()},
        )


def sticks_out(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report collision shapes that reach far into open air beside the object, except in hollows of containers."""
    air = measured.free_space
    if measured.asset.static or air is None or not has_convex_pieces(measured):
        return
    limit = max(STICKS_OUT_M, STICKS_OUT_SHARE * measured.longest_m)
    beside = air.points_m[~air.hollow]
    inside = beside[measured.shapes.is_within(beside)]
    if not len(inside):
        return
    distance = measured.distance_m(inside, limit)
    if float(distance.max()) > limit:
        worst = inside[int(distance.argmax())]
        yield Complaint(
            f"collision shapes reach {1000 * distance.max():.3g} mm into the air beside the object, as at"
            f" {', '.join(f'{1000 * v:.3g}' for v in worst)} mm: unseen walls, a filled handle or concavity",
            values={"reach_m": float(distance.max()), "at_m": worst.tolist()},
        )


def has_graspable_collision(measured: MeasuredAsset) -> bool:
    """Return whether fingers would touch the collision shapes where they would touch the object."""
    return (
        has_convex_pieces(measured) and not measured.complaints(filled_opening) and not measured.complaints(sticks_out)
    )


def uncovered(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report visible surface that is not covered by collision shapes."""
    if measured.visual is None or measured.asset.static or not has_convex_pieces(measured):
        return
    limit = max(UNCOVERED_M, UNCOVERED_SHARE * measured.longest_m)
    looked = measured.samples[::3]
    bare = looked[~measured.shapes.is_within(looked, limit)]
    if len(bare):
        depth, share = float(measured.shapes.depth_outside(bare).max()), len(bare) / len(looked)
        yield Complaint(
            f"{share:.1%} of the visible surface lies up to {1000 * depth:.3g} mm outside all collision shapes: fingers sink"
            " in",
            values={"uncovered_m": depth, "share": share},
        )


def not_convex(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report concave triangle meshes that are to be used unchanged."""
    concave = [shape for shape, volume in _hull_volumes(measured) if not shape.convex and _is_concave(shape, volume)]
    if concave:
        names = ", ".join(shape.name for shape in concave[:4])
        yield Complaint(
            f"{len(concave)} collision shapes are concave triangle meshes ({names}): engines refuse them for bodies that"
            " move, or take their convex hulls",
            file=concave[0].file,
        )


def _hull_volumes(measured: MeasuredAsset) -> Iterator[tuple[CollisionShape, float]]:
    for index, volume in zip(measured.shapes.kept, measured.shapes.volumes_m3, strict=True):
        yield measured.asset.collision[index], float(volume)


def _is_concave(shape: CollisionShape, hull_volume_m3: float) -> bool:
    corners = np.asarray(shape.vertices, float)[shape.faces] - np.asarray(shape.vertices, float).mean(0)
    volume = float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6
    return abs(volume) < CONVEX_SHARE * hull_volume_m3


def _concave_meshes(measured: MeasuredAsset) -> list[CollisionShape]:
    """Return the concave meshes that collide with their triangles."""
    if not measured.as_drawn:
        return []
    volumes = _hull_volumes(measured)
    return [shape for shape, volume in volumes if not shape.primitive and _is_concave(shape, volume)]


def costly(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report more shapes, or convex hulls with more vertices, than engines handle well."""
    shapes = measured.asset.collision
    if len(shapes) > MANY_SHAPES:
        yield Complaint(f"{len(shapes)} collision shapes: every contact becomes slow", values={"shapes": len(shapes)})
    drawn = {id(shape) for shape in measured.measure_once(_concave_meshes)}
    corners = zip(measured.shapes.kept, measured.shapes.corners, strict=True)
    large = [
        (shapes[index], count)
        for index, count in corners
        if shapes[index].convex
        and not (shapes[index].primitive or shapes[index].as_drawn or id(shapes[index]) in drawn)
        and count > MANY_VERTICES
    ]
    if large:
        most = max(count for _, count in large)
        yield Complaint(
            f"the hulls of {len(large)} convex shapes have more than {MANY_VERTICES} vertices, up to {most}: PhysX"
            " simplifies them",
            file=large[0][0].file,
            values={"vertices": most},
        )


RULES = (
    Rule(
        "COL001",
        "collision-missing",
        "error",
        why="DexVerse had to add collision to every USDZ of ManiTwin-100K before an object stayed on a table.",
        remedy="Add convex hulls; `manitwin import` and `manitwin build` make them.",
        check=missing,
    ),
    Rule(
        "COL002",
        "collision-box-differs",
        "error",
        why="Visual and collision that differ in size, place or axes come from a scale or turn applied to one of them (IsaacLab"
        " PR #7476, obj2mjcf #28): a policy sees the object where it cannot be touched.",
        remedy="Bake scale and axes into both meshes; use one frame for both.",
        check=box_differs,
    ),
    Rule(
        "COL003",
        "opening-filled",
        "error",
        why="One convex hull around a bowl fills it: nothing can be put in (ManiSkill #867 'my bowl is filled', #1205). The"
        " open cavity that is seen is held against what the collision shapes leave open; half of it must stay.",
        remedy="Decompose the shape (a wall of convex pieces) instead of taking its hull.",
        check=filled_opening,
    ),
    Rule(
        "COL004",
        "collision-sticks-out",
        "error",
        why="Unseen walls: a single hull over a handle leaves no room for a finger, over a banana none for a pad; decomposers"
        " also inflate (CoACD #67: hulls 5 mm larger). Grasps then fail, or hold on nothing.",
        remedy="Decompose finer, or cut the hulls to the surface.",
        check=sticks_out,
    ),
    Rule(
        "COL005",
        "surface-uncovered",
        "warning",
        why="Where the visible surface is outside all collision shapes, fingers and other objects sink in, and rendered data"
        " shows it.",
        remedy="Decompose finer, or with more hulls.",
        check=uncovered,
    ),
    Rule(
        "COL006",
        "collision-not-convex",
        "warning",
        why="PhysX refuses triangle meshes on bodies that move; MuJoCo takes the convex hull of every mesh, which fills what is"
        " hollow (CoACD #53).",
        remedy="Ship convex pieces, each as a shape of its own.",
        check=not_convex,
    ),
    Rule(
        "COL007",
        "collision-costly",
        "warning",
        why="BEHAVIOR-1K #1678: objects of more than 3000 pieces; CoACD #10: users need at most 64 hulls of 60 vertices. PhysX"
        " cooks at most 255 vertices a hull and drops the rest.",
        remedy="Merge and simplify the pieces.",
        check=costly,
    ),
    Rule(
        "COL008",
        "collision-flat",
        "error",
        why="MuJoCo does not load a mesh without volume, PhysX leaves the shape out.",
        remedy="Give the piece a thickness, or leave it out.",
        check=flat,
    ),
)
