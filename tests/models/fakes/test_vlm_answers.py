"""The rehearsal's answers: of the form that is asked for, equal for equal questions, and good enough for real meshes."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.fakes.picture_proportions import measure_proportions
from manitwin.models.fakes.vlm_answers import rehearsal_answer
from manitwin.render.cameras import ORBIT_ELEVATIONS_DEG, orbit_cameras
from manitwin.render.raycast import cast_camera

VIEWS = [((300.0 + 45 * i) % 360, elevation) for i, elevation in enumerate(ORBIT_ELEVATIONS_DEG)]


def outlines(mesh: trimesh.Trimesh) -> list[bytes]:
    pngs = []
    for camera in orbit_cameras(np.asarray(mesh.vertices), fov_y_deg=30.0, size_px=128):
        face = cast_camera(RayCaster(mesh), camera)[2]
        stream = io.BytesIO()
        Image.fromarray(np.where((face >= 0)[..., None], 90, 235).astype(np.uint8).repeat(3, axis=2)).save(
            stream, "PNG"
        )
        pngs.append(stream.getvalue())
    return pngs


@pytest.mark.parametrize(
    ("mesh", "sides"),
    [
        (trimesh.creation.box([0.2, 0.15, 0.06]), (1, 0.75, 0.3)),
        (trimesh.creation.cylinder(radius=0.03, height=0.2), (1, 0.3, 0.3)),
        (trimesh.creation.icosphere(subdivisions=3, radius=0.05), (1, 1, 1)),
        (trimesh.creation.box([0.2, 0.02, 0.01]), (1, 0.1, 0.05)),
    ],
)
def test_proportions_are_seen_in_outlines(mesh: trimesh.Trimesh, sides: tuple[float, ...]) -> None:
    seen = measure_proportions(outlines(mesh), VIEWS)
    assert np.abs(np.array(seen) - sides).max() < 0.12


def test_points_are_chosen_by_what_the_list_says() -> None:
    schema: dict[str, Any] = {"properties": {"points": {"items": {"properties": {"id": {"enum": ["4", "7", "9"]}}}}}}
    first = rehearsal_answer(
        "grasp_points",
        schema,
        "The user calls it: mug. Choose: 4: 50 mm, 90 mm, 8 mm; 7: 10 mm, 40 mm, unknown; 9: 20 mm, 0 mm, 70 mm.",
        [],
    )
    assert [point["id"] for point in first["points"]] == ["7", "9"]
    other = rehearsal_answer(
        "grasp_points", schema, "The user calls it: mug. Choose: 9: 50 mm, 90 mm; 4: 10 mm, 40 mm; 7: 20 mm, 0 mm.", []
    )
    assert [point["id"] for point in other["points"]] == ["4", "7"]


def test_other_schemas_get_a_value_of_their_form() -> None:
    schema = {
        "type": "object",
        "properties": {"a": {"enum": ["x", "y"]}, "b": {"type": "array", "items": {"type": "number"}}},
    }
    assert rehearsal_answer("anything", schema, "", []) == {"a": "x", "b": [0.0]}
