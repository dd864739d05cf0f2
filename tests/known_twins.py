"""Twins made of boxes, in memory, whose grasps and physics are known: what exporters are given."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh

from handmade import visual
from manitwin.assets.writers.exporter import TwinContent, export_name
from manitwin.formats.glb import write_glb
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.geometry.rigid_body import RigidBody
from manitwin.twin.grasp_table import SCHEMA
from manitwin.twin.record import TwinRecord
from record_overlay import overlaid
from rehearsal_cube import CUBE
from rigid_boxes import above

FROM_ABOVE_ALONG_Y = np.column_stack([[0.0, 1, 0], [1.0, 0, 0], [0.0, 0, -1]])
FROM_PLUS_Y = np.column_stack([[1.0, 0, 0], [0.0, 0, 1], [0.0, -1, 0]])  # closes along x
FROM_PLUS_X = np.column_stack([[0.0, 1, 0], [0.0, 0, -1], [-1.0, 0, 0]])
HELD, FAILED = "held", "slips"

Box = tuple[list[float], list[float]]
"""The lower and the upper corner."""


def brick() -> TwinContent:
    """40 x 60 x 100 mm, upright: narrow along x."""
    grasps = [
        above([0, 0, 0.09]), above([0, 0.01, 0.085]), above([0, -0.01, 0.09]),
        above([0, 0, 0.05], FROM_PLUS_Y), above([0, 0.005, 0.06], FROM_PLUS_Y), above([0, 0, 0.07], FROM_PLUS_Y),
        above([0, 0, 0.09], FROM_ABOVE_ALONG_Y), above([0, 0, 0.05], FROM_PLUS_X),
    ]  # fmt: skip
    return made_twin(1, "brick", [([-0.02, -0.03, 0], [0.02, 0.03, 0.1])], grasps, failed=[above([0, 0.045, 0.09])])


def hammer() -> TwinContent:
    """A handle of 24 x 120 x 24 mm along y that lies on the plane, with a head of 80 x 30 x 24 mm at its end."""
    boxes = [([-0.012, -0.075, 0], [0.012, 0.045, 0.024]), ([-0.04, 0.045, 0], [0.04, 0.075, 0.024])]
    grasps = [above([0, y, 0.012]) for y in (0.0, 0.01, 0.02, 0.03, -0.01)]
    grasps += [above([0.028, 0.06, 0.012], FROM_ABOVE_ALONG_Y), above([-0.028, 0.06, 0.012], FROM_ABOVE_ALONG_Y)]
    return made_twin(2, "claw hammer", boxes, grasps, failed=[above([0, 0.12, 0.012])])


def tray() -> TwinContent:
    """An open box of 100 x 100 x 60 mm with walls of 6 mm: grasped by its walls from above."""
    boxes = [
        ([-0.05, -0.05, 0], [0.05, 0.05, 0.006]),
        ([-0.05, -0.05, 0.006], [-0.044, 0.05, 0.06]),
        ([0.044, -0.05, 0.006], [0.05, 0.05, 0.06]),
        ([-0.044, -0.05, 0.006], [0.044, -0.044, 0.06]),
        ([-0.044, 0.044, 0.006], [0.044, 0.05, 0.06]),
    ]
    grasps = [above([side * 0.047, y, 0.045]) for side in (-1, 1) for y in (-0.01, 0.0, 0.01)]
    grasps += [above([x, 0.047, 0.045], FROM_ABOVE_ALONG_Y) for x in (-0.01, 0.0)]
    return made_twin(3, "storage tray", boxes, grasps, failed=[above([0, 0, 0.03])])


TWINS = (brick, hammer, tray)


def made_twin(
    number: int,
    category: str,
    boxes: list[Box],
    held: list[np.ndarray],
    failed: list[np.ndarray],
    mass_kg: float = 0.12,
) -> TwinContent:
    """A twin of boxes that fill the object, with grasps of the Panda: those that hold, then those that do not."""
    hulls = [trimesh.creation.box(bounds=np.array(bounds)) for bounds in boxes]
    solid = trimesh.util.concatenate(hulls)
    solid.density = mass_kg / sum(hull.volume for hull in hulls)
    record = TwinRecord.model_validate(
        {
            **_identity(number, category),
            **overlaid(
                CUBE,
                {
                    "physical": {
                        "extents_m": solid.extents.tolist(),
                        "mass_kg": {"value": mass_kg, "low": 0.1, "high": 0.2, "source": "measured"},
                        "friction_static": {"value": 0.8, "low": 0.7, "high": 0.9, "source": "measured"},
                        "center_of_mass_m": solid.center_mass.tolist(),
                        "inertia_kg_m2": solid.moment_inertia.tolist(),
                    },
                    "language": {"category": category, "function": "testing exporters", "shape": "boxy"},
                    "points": {
                        "functional": [_point("f0", [0.01, 0.02, 0.0], [0.0, 0.0, -1.0], label="base", description="stand")],
                        "grasp": [_point("g0", [0.02, 0.0, 0.05], [1.0, 0.0, 0.0], type="pinch", scenario="lift it")],
                    },
                    "grasps": {"gripper": "panda"},
                },
            ),
        }
    )  # fmt: skip
    part = visual(solid, baseColorFactor=[200, 180, 160, 255])
    return TwinContent(
        name=export_name(record),
        record=record,
        visual_glb=write_glb([part]),
        visual=(part,),
        hulls=tuple((np.array(hull.vertices), np.array(hull.faces)) for hull in hulls),
        grasps=grasp_columns(held, failed),
        source=b"v 0 0 0\n",
    )


def body_of(twin: TwinContent) -> RigidBody:
    """The twin as simulations take it."""
    physical = twin.physical
    return RigidBody(
        tuple(vertices for vertices, _ in twin.hulls),
        physical.mass_kg.value,
        np.array(physical.center_of_mass_m),
        np.array(physical.inertia_kg_m2),
        physical.friction_static.value,
        physical.friction_dynamic.value,
    )


def grasp_columns(held: list[np.ndarray], failed: list[np.ndarray]) -> dict[str, list[Any]]:
    """Rows of grasps.parquet; the last of those that failed is of the unfiltered sample."""
    poses, count = [*held, *failed], len(held) + len(failed)
    columns: dict[str, list[Any]] = {name: [None] * count for name in SCHEMA.names}
    return columns | {
        "grasp_id": [f"panda-{i:04d}" for i in range(count)],
        "gripper": ["panda"] * count,
        "position_m": [pose[:3, 3].tolist() for pose in poses],
        "quaternion_wxyz": [quaternion_wxyz(pose[:3, :3]).tolist() for pose in poses],
        "width_m": [0.03] * count,
        "depth_m": [0.1034] * count,
        "score": [0.9 - 0.01 * i for i in range(count)],
        "proposer": ["antipodal"] * (count - 1) + ["antipodal:unfiltered"],
        "grasp_point_id": ["g0"] * count,
        "outcome": [HELD] * len(held) + [FAILED] * len(failed),
        "verified": [True] * len(held) + [False] * len(failed),
        "retired": [False] * count,
    }


def _identity(number: int, category: str) -> dict[str, Any]:
    return {
        "twin_id": f"{number:02x}{'5a' * 7}", "revision": "ab" * 32, "files": {}, "name": category, "status": "accepted",
        "rejection": None, "quality": {"checks": []},
        "source": {
            "kind": "mesh", "file": "source.obj", "sha256": "cd" * 32, "license": "CC-BY-4.0", "attribution": "Ada",
        },
        "provenance": {"manitwin_version": "0", "config_sha256": "c0", "seed": 0, "stages": {}},
    }  # fmt: skip


def _point(name: str, position_m: list[float], normal: list[float], **more: str) -> dict[str, Any]:
    return {
        "id": name, "candidate": 0, "position_m": position_m, "normal": normal, "confidence": 0.5, "rationale": "so", **more
    }  # fmt: skip
