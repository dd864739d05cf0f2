from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import trimesh
from scipy.optimize import minimize

from manitwin.config import CollisionConfig, PlacementConfig
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.geometry.hulls.reduction import hull_to_obj
from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.pipeline.collision import CollisionStage
from manitwin.pipeline.item import Item
from manitwin.pipeline.object_state import load_hulls
from manitwin.pipeline.placement import PlacementStage
from manitwin.twin.record import Placement
from manitwin.twin.store import canonical_json
from real_meshes import cup, load_real_mesh, mesh_rows

BULK_DENSITY_KG_M3 = 800.0  # where the manifest has no mass


def _draft(folder: Path, mesh: trimesh.Trimesh, mass_kg: float, hulls: list[np.ndarray] | None = None) -> Draft:
    np.savez(folder / "solid.npz", vertices=mesh.vertices, faces=mesh.faces)
    properties = solid_mass_properties(mesh, mass_kg)
    physical = {
        "mass_kg": {"value": mass_kg},
        "center_of_mass_m": properties.center_of_mass_m.tolist(),
        "inertia_kg_m2": properties.inertia_kg_m2.tolist(),
        "friction_static": {"value": 0.6},
        "friction_dynamic": {"value": 0.5},
    }
    paths = {name: folder / name for name in ("solid.npz", "hulls.npz")}
    draft = Draft("id", Item(None, text="thing"), 0, fields={"physical": physical}, paths=paths)
    if hulls is None:
        CollisionStage(CollisionConfig()).run(draft, folder)
    else:
        np.savez(folder / "hulls.npz", **{f"hull_{i:02d}": hull for i, hull in enumerate(hulls)})
    return draft


def _placements(draft: Draft, folder: Path) -> list[dict[str, Any]]:
    found = PlacementStage(PlacementConfig()).run(draft, folder)["placements"]
    for placement in found:
        Placement(**placement)
    canonical_json(found)
    assert [(not p["settled"], -p["probability"]) for p in found] == sorted(
        (not p["settled"], -p["probability"]) for p in found
    )
    return found


def _set_down_in_mujoco(draft: Draft, placement: dict[str, Any]) -> tuple[float, float]:
    """Return how far (m) and how much (deg) it moves in 2 s when released 1 mm above a placement."""
    physical, hulls = draft.field("physical"), load_hulls(draft.path("hulls.npz"))
    inertia = np.array(physical["inertia_kg_m2"])
    full = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    contact = 'friction="0.7 0.005 0.0005" condim="6"'
    meshes = "".join(f'<mesh name="h{i}" file="h{i}.obj"/>' for i in range(len(hulls)))
    geoms = "".join(f'<geom type="mesh" mesh="h{i}" {contact}/>' for i in range(len(hulls)))
    center, moments = " ".join(map(str, physical["center_of_mass_m"])), " ".join(map(str, full))
    inertial = f'<inertial pos="{center}" mass="{physical["mass_kg"]["value"]}" fullinertia="{moments}"/>'
    xml = (
        '<mujoco><compiler boundmass="1e-9"/><option timestep="0.002" integrator="implicitfast" cone="elliptic"/>'
        f'<asset>{meshes}</asset><worldbody><geom type="plane" size="2 2 .1" {contact}/>'
        f"<body><freejoint/>{inertial}{geoms}</body></worldbody></mujoco>"
    )
    model = mujoco.MjModel.from_xml_string(xml, {f"h{i}.obj": hull_to_obj(hull) for i, hull in enumerate(hulls)})
    data = mujoco.MjData(model)
    start = np.add(placement["position_m"], [0, 0, 0.001])
    data.qpos[:3], data.qpos[3:] = start, placement["quaternion_wxyz"]
    mujoco.mj_step(model, data, 1000)
    cosine = min(1.0, abs(float(np.dot(data.qpos[3:], placement["quaternion_wxyz"]))))
    return float(np.linalg.norm(data.qpos[:3] - start)), float(np.degrees(2 * np.arccos(cosine)))


def test_box_rests_on_its_six_sides_upright_among_them(tmp_path: Path) -> None:
    box = trimesh.creation.box((0.10, 0.08, 0.06)).apply_translation((0, 0, 0.03))
    draft = _draft(tmp_path, box, 0.3, [np.asarray(box.vertices)])
    found = _placements(draft, tmp_path)
    assert len(found) == 6 and all(p["settled"] for p in found)
    assert sum(p["probability"] for p in found) == pytest.approx(1.0)
    upright = [p for p in found if p["upright"]]
    assert len(upright) == 1
    assert upright[0]["quaternion_wxyz"] == pytest.approx([1, 0, 0, 0], abs=1e-6)
    assert upright[0]["position_m"] == pytest.approx([0, 0, 0], abs=1e-6)
    assert upright[0]["collision_radius_m"] == pytest.approx(np.hypot(0.05, 0.04), abs=1e-6)


def test_circle_of_a_placement_is_the_smallest_and_centred(tmp_path: Path) -> None:
    corner = trimesh.boolean.union(
        [
            trimesh.creation.box(bounds=[(0, 0, 0), (0.1, 0.02, 0.02)]),
            trimesh.creation.box(bounds=[(0, 0, 0), (0.02, 0.07, 0.02)]),
        ]
    )
    first = _placements(_draft(tmp_path, corner, 0.1), tmp_path)[0]
    rotation = rotation_from_quaternion_wxyz(np.array(first["quaternion_wxyz"]))
    placed = corner.vertices @ rotation.T + first["position_m"]

    def largest(center: np.ndarray) -> float:
        return float(np.linalg.norm(placed[:, :2] - center, axis=1).max())

    best = minimize(largest, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12})
    assert largest(np.zeros(2)) == pytest.approx(first["collision_radius_m"], abs=1e-6)
    assert first["collision_radius_m"] == pytest.approx(best.fun, abs=1e-6)
    assert placed[:, 2].min() == pytest.approx(0, abs=1e-5)


def test_can_on_its_side_rolls_and_does_not_come_first(tmp_path: Path) -> None:
    can = trimesh.creation.cylinder(radius=0.033, height=0.1, sections=120).apply_translation((0, 0, 0.05))
    draft = _draft(tmp_path, can, 0.35, [np.asarray(can.vertices)])
    found = _placements(draft, tmp_path)
    on_its_side = [p for p in found if abs(rotation_from_quaternion_wxyz(np.array(p["quaternion_wxyz"]))[2, 2]) < 0.5]
    assert found[0]["settled"] and found[0] not in on_its_side
    assert on_its_side and not any(p["settled"] for p in on_its_side)


def test_a_tall_can_stands_though_its_centre_moves_as_it_falls_back_from_a_tilt(tmp_path: Path) -> None:
    can = trimesh.creation.cylinder(radius=0.08, height=0.36, sections=64).apply_translation((0, 0, 0.18))
    assert np.hypot(0.08, 0.18) * np.radians(4) > 0.013, "the way back alone is longer than a body may move"
    found = _placements(_draft(tmp_path, can, 0.5, [np.asarray(can.vertices)]), tmp_path)
    assert any(p["upright"] and p["settled"] for p in found)


@pytest.mark.parametrize(("foot_m", "stays"), [(0.0018, True), (0.0010, False)])
def test_upright_pose_on_a_narrow_foot_counts_where_it_falls_back_from_tilts(
    foot_m: float, stays: bool, tmp_path: Path
) -> None:
    """A bar that is wide above and narrow below, as a spoon on its bowl: it lies firmly the other way up."""
    section = [(-foot_m / 2, 0.0), (foot_m / 2, 0.0), (0.01, 0.01), (-0.01, 0.01)]
    corners = np.array([(x, y, z) for x in (-0.06, 0.06) for y, z in section])
    bar = trimesh.convex.convex_hull(corners)
    found = _placements(_draft(tmp_path, bar, 0.04, [corners]), tmp_path)
    assert any(p["settled"] and not p["upright"] for p in found)
    assert any(p["settled"] and p["upright"] for p in found) == stays


def _lying_prism(sides: int) -> trimesh.Trimesh:
    """Return a marker: a regular prism along x, 19 mm across its corners and 12 cm long, on one of its facets."""
    angle = (np.arange(sides) + 0.5) * 2 * np.pi / sides
    ring = 0.0095 * np.stack([np.sin(angle), -np.cos(angle)], 1)
    mesh = trimesh.convex.convex_hull(np.vstack([np.insert(ring, 0, x, axis=1) for x in (-0.06, 0.06)]))
    return mesh.apply_translation((0, 0, -mesh.bounds[0, 2]))


def _up(placement: dict[str, Any]) -> np.ndarray:
    return rotation_from_quaternion_wxyz(np.array(placement["quaternion_wxyz"]))[2]


def _center_height(draft: Draft, placement: dict[str, Any]) -> float:
    return float(np.array(draft.field("physical")["center_of_mass_m"]) @ _up(placement) + placement["position_m"][2])


def _lies(placement: dict[str, Any]) -> bool:
    return bool(abs(_up(placement)[0]) < 0.1)


@pytest.mark.parametrize("sides", [12, 18, 24])
def test_marker_of_wide_facets_lies_on_one(tmp_path: Path, sides: int) -> None:
    draft = _draft(tmp_path, _lying_prism(sides), 0.016, [_lying_prism(sides).vertices])
    found = _placements(draft, tmp_path)
    stay = [p for p in found if p["settled"]]
    assert len(stay) == 6 and all(map(_lies, stay))  # an end takes 1.2 % of the solid angle, both together
    inradius = 0.0095 * np.cos(np.pi / sides)
    for placement in stay:
        assert -(_lying_prism(sides).vertices @ _up(placement)).min() == pytest.approx(placement["position_m"][2])
        assert _center_height(draft, placement) == pytest.approx(inradius, abs=2e-6)  # flat on a facet
    moved_m, turned_deg = _set_down_in_mujoco(draft, found[0])
    assert moved_m < 0.01 and turned_deg < 5


@pytest.mark.parametrize("sides", [48, 64, 120])
def test_marker_of_narrow_facets_rolls_and_only_stays_on_its_end(tmp_path: Path, sides: int) -> None:
    draft = _draft(tmp_path, _lying_prism(sides), 0.016, [_lying_prism(sides).vertices])
    found = _placements(draft, tmp_path)
    assert [p["settled"] for p in found if _lies(p)] == [False]
    assert found[0]["settled"] and not _lies(found[0])
    end_solid_angle = 2 * np.pi * (1 - 0.06 / np.hypot(0.06, 0.0095))
    assert found[0]["probability"] == pytest.approx(end_solid_angle / (4 * np.pi), rel=0.02)
    moved_m, turned_deg = _set_down_in_mujoco(draft, found[0])
    assert moved_m < 0.01 and turned_deg < 5


def test_cup_stands_on_either_end_in_a_second_engine(tmp_path: Path) -> None:
    draft = _draft(tmp_path, cup(), 0.2)
    found = _placements(draft, tmp_path)
    assert any(p["upright"] and p["settled"] for p in found)
    moved_m, turned_deg = _set_down_in_mujoco(draft, found[0])
    assert moved_m < 0.01 and turned_deg < 5


def test_ball_that_only_rolls_is_rejected_or_nearly_still(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.04).apply_translation((0, 0, 0.04))
    draft = _draft(tmp_path, ball, 0.2, [np.asarray(ball.vertices)])
    try:
        first = _placements(draft, tmp_path)[0]
    except Rejected as rejected:
        assert rejected.reason == "no_stable_pose"
    else:
        assert first["settled"]


@pytest.mark.slow
@pytest.mark.shared_data
def test_first_placement_of_every_real_object_stays_in_a_second_engine(shared_data: Path, tmp_path: Path) -> None:
    for name, row in mesh_rows(shared_data).items():
        mesh = load_real_mesh(shared_data, name)
        folder = tmp_path / name
        folder.mkdir()
        mass_kg = float(row["mass_kg"]) if row["mass_kg"] else BULK_DENSITY_KG_M3 * mesh.volume
        draft = _draft(folder, mesh, mass_kg)
        moved_m, turned_deg = _set_down_in_mujoco(draft, _placements(draft, folder)[0])
        assert moved_m < 0.01 and turned_deg < 5, f"{name}: {moved_m * 1000:.1f} mm, {turned_deg:.1f} deg"
