"""The least that an accepted twin says: a cube, for rehearsals and tests to take and to change."""

from __future__ import annotations

import io
from functools import lru_cache
from typing import Any


def _estimate(value: float) -> dict[str, Any]:
    return {"value": value, "low": value, "high": value, "source": "user"}


_EYE3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
_EYE4 = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
CUBE: dict[str, Any] = {
    "mesh": {
        "vertices": 8, "faces": 12, "watertight": True, "components": 1, "euler_number": 2, "volume_m3": 1.25e-4,
        "area_m2": 0.015, "repairs": [],
        "hulls": {
            "count": 1, "max_vertices": 8, "volume_ratio": 1.0, "surface_error_p95_m": 0.0,
            "surface_uncovered_max_m": 0.0, "keeps_opening": None,
        },
    },
    "physical": {
        "extents_m": [0.05] * 3, "obb": {"extents_m": [0.05] * 3, "obb_to_object": _EYE4}, "scale_applied": 1.0,
        "material": "wood", "mass_kg": _estimate(0.125), "friction_static": _estimate(0.5),
        "friction_dynamic": _estimate(0.4), "restitution": _estimate(0.1), "density_kg_m3": 1000.0,
        "center_of_mass_m": [0.0, 0.0, 0.025], "center_of_mass_uncertainty_m": 0.0,
        "inertia_kg_m2": [[5.2e-5 * x for x in row] for row in _EYE3], "mass_distribution": "solid",
    },
    "language": {
        "category": "cube", "color": "brown", "material": "wood", "size": "small", "shape": "cube",
        "function": "rehearsing", "caption": "a small cube", "captions": [],
    },
    "points": {"candidates": {"positions_m": [], "normals": []}, "functional": [], "grasp": []},
    "grasps": {
        "gripper": "none", "gripper_sha256": "", "proposed": 0, "proposed_by_filter": {}, "simulated": 0, "verified": 0,
        "success_rate": 0.0, "unfiltered_simulated": 0, "unfiltered_success_rate": None, "failures": {},
        "approach_octants": 0, "file": "grasps.parquet", "association_radius_m": 0.03,
        "association_radius_widened": False, "share_beyond_3cm": 0.0,
        "trial": {
            "engine": "none", "finger_friction": 1.0, "object_friction": 0.5, "combine": "average", "force_n": 0.0,
            "timestep_s": 0.0, "solver_iterations": 0, "max_steps": 0, "stable_frames": 0, "max_displacement_m": 0.0,
            "slide_distance_m": 0.0,
        },
        "failure_table": {"by_grasp_type": {}, "by_region": {}}, "second_opinion": None, "robustness": None,
    },
    "placements": [
        {
            "position_m": [0.0] * 3, "quaternion_wxyz": [1.0, 0.0, 0.0, 0.0], "probability": 1.0, "upright": True,
            "settled": True, "collision_radius_m": 0.0354,
        },
    ],
}  # fmt: skip
"""A cube of 5 cm and 125 g that nothing ever grasped: an accepted record's sections, without what names its twin."""


@lru_cache(maxsize=1)
def cube_files() -> dict[str, bytes]:
    """Return the files that go with the record: the cube that is seen, its shape, and an empty table of grasps."""
    # here, for every worker of a rehearsal imports this module, and only where the run begins the files are made
    import pyarrow.parquet as pq
    import trimesh
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    from manitwin.formats.glb import write_glb
    from manitwin.geometry.shape_descriptor import shape_descriptor
    from manitwin.twin.grasp_table import SCHEMA
    from manitwin.twin.shape_file import shape_to_json

    cube = trimesh.creation.box([0.05] * 3).apply_translation([0, 0, 0.025])  # it stands on z = 0
    cube.metadata["name"] = "cube"
    cube.visual = TextureVisuals(
        material=PBRMaterial(baseColorFactor=[150, 110, 70, 255], metallicFactor=0.0, roughnessFactor=0.8)
    )
    table = io.BytesIO()
    pq.write_table(SCHEMA.empty_table(), table)
    shape = shape_to_json(shape_descriptor(cube, seed=0))
    return {"visual.glb": write_glb([cube]), "shape.json": shape, "grasps.parquet": table.getvalue()}
