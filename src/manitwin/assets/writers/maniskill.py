"""ManiSkill 3 export: models and info in the layout of its YCB objects, and a loader that sets the true physics.

Source: ManiSkill's mani_skill/utils/building/actors/ycb.py: ``info_raw.json`` with ``bbox``, ``scales`` and ``density`` by
name, ``models/<name>/collision.ply`` read by ``add_multiple_convex_collisions_from_file``, +Z up. ManiSkill's own loader
derives the mass from the density alone and ignores friction.
"""

from __future__ import annotations

from importlib import resources
from typing import Any

import numpy as np
import trimesh

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.licenses import license_of, provenance_lines
from manitwin.assets.writers.mass_properties import inertial_of
from manitwin.twin.store import canonical_json


def export(twin: TwinContent) -> Exported:
    """Write a twin as one object of ``info_raw.json``, with a ``load.py`` that builds it.

    Raises ExportError for mass properties that are impossible for a rigid body.
    """
    folder = f"models/{twin.name}"
    return Exported(
        files={
            f"{folder}/visual.glb": twin.visual_glb,
            f"{folder}/collision.ply": _collision_ply(twin),
            "info_raw.json": canonical_json({twin.name: _info(twin)}).encode(),
            "load.py": (resources.files("manitwin.assets.writers") / "maniskill_load.py").read_bytes(),
        },
        main="load.py",
        cannot_say=(
            "centre of mass, inertia and friction: ManiSkill's own loaders take a density alone (the one in info_raw.json"
            " gives the right mass); load.py sets them all.",
            "grasps and functional points: ManiSkill has no annotations; the formats graspgen and isaac_grasp have the grasps.",
        ),
    )


def _collision_ply(twin: TwinContent) -> bytes:
    """Return all hulls as one PLY file: SAPIEN builds a convex shape from each connected component.

    The file is ASCII: in a binary PLY whose first number begins with the byte of a line break, assimp skips that byte and
    SAPIEN crashes.
    """
    vertices, faces = trimesh.util.append_faces([v for v, _ in twin.hulls], [f for _, f in twin.hulls])
    lines = [
        "ply",
        "format ascii 1.0",
        f"element vertex {len(vertices)}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
        *(" ".join(map(repr, row)) for row in (np.asarray(vertices, float) + 0.0).tolist()),  # + 0.0: no negative zeros
        *(f"3 {a} {b} {c}" for a, b, c in np.asarray(faces).tolist()),
    ]
    return ("\n".join(lines) + "\n").encode("ascii")


def _info(twin: TwinContent) -> dict[str, Any]:
    physical, inertial = twin.physical, inertial_of(twin)
    corners = np.concatenate([vertices for vertices, _ in twin.hulls])
    # engines sum the volumes of the hulls including overlaps, so the density that yields the mass uses the same sum
    volume_m3 = sum(trimesh.Trimesh(v, f, process=False).convex_hull.volume for v, f in twin.hulls)
    return {
        "bbox": {"min": corners.min(axis=0).tolist(), "max": corners.max(axis=0).tolist()},
        "scales": [1.0],
        "density": float(inertial.mass_kg / volume_m3),
        "mass_kg": inertial.mass_kg,
        "center_of_mass_m": inertial.center_of_mass_m.tolist(),
        "inertia_kg_m2": inertial.inertia_kg_m2.tolist(),
        "principal_moments_kg_m2": inertial.principal_moments_kg_m2.tolist(),
        "principal_axes_quaternion_wxyz": inertial.principal_axes_wxyz.tolist(),
        "friction_static": physical.friction_static.value,
        "friction_dynamic": physical.friction_dynamic.value,
        "restitution": physical.restitution.value,
        "resting_poses": [
            {"position_m": rest.position_m, "quaternion_wxyz": rest.quaternion_wxyz, "probability": rest.probability}
            for rest in twin.record.placements or []
            if rest.settled
        ],
        "provenance": list(provenance_lines(twin.record)),
        "license": license_of(twin.record),
        "attribution": twin.record.source.attribution,
    }
