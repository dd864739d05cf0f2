"""Parts of small solids whose parts are known by construction."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from trimesh.creation import annulus, box, cylinder, icosphere, revolve

from manitwin.geometry.parts.membership import PartRule
from manitwin.geometry.parts.segmentation import Segmentation, segment_by_rule, transfer_face_labels
from manitwin.geometry.parts.shape import HeadEnd, measure_shape


def turned(*profile: tuple[float, float]) -> trimesh.Trimesh:
    return revolve(np.array(profile), sections=36)


def along_x(radius_m: float, length_m: float, at_m: float) -> trimesh.Trimesh:
    bar = cylinder(radius_m, length_m, sections=24)
    bar.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    bar.apply_translation([at_m, 0, 0])
    return bar


def at(mesh: trimesh.Trimesh, *offset_m: float) -> trimesh.Trimesh:
    mesh.apply_translation(offset_m)
    return mesh


def hammer() -> trimesh.Trimesh:
    return trimesh.boolean.union([along_x(0.012, 0.26, 0.0), box((0.03, 0.11, 0.03), at_(-0.13))])


def at_(x_m: float) -> np.ndarray:
    return trimesh.transformations.translation_matrix([x_m, 0, 0])


def mug() -> trimesh.Trimesh:
    cup = turned((0, 0), (0.04, 0), (0.04, 0.09), (0.036, 0.09), (0.036, 0.006), (0, 0.006))
    ring = annulus(0.018, 0.028, 0.012)
    ring.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    ring = at(ring, 0.048, 0, 0.045)
    return trimesh.boolean.union([cup, trimesh.boolean.difference([ring, at(cylinder(0.038, 0.2), 0, 0, 0.05)])])


def bottle() -> trimesh.Trimesh:
    return turned(
        *((0, 0), (0.035, 0), (0.035, 0.13), (0.013, 0.165), (0.013, 0.18)),
        *((0.017, 0.18), (0.017, 0.205), (0, 0.205)),
    )


def told(
    mesh: trimesh.Trimesh, rule: PartRule, stands: bool, head_end: HeadEnd = "wide", noise_m: float = 0.0
) -> Segmentation | None:
    if noise_m:
        mesh = mesh.subdivide_to_size(0.004)
        mesh = trimesh.Trimesh(mesh.vertices, mesh.faces)
        mesh.vertices += np.random.default_rng(0).normal(0, noise_m, mesh.vertices.shape)
    shape = measure_shape(mesh, mesh.center_mass, head_end, stands, np.random.default_rng(0))
    found = segment_by_rule(mesh, shape, rule)
    if found is not None:
        assert found.role.shape == (len(mesh.faces),) and 0.5 <= found.confidence <= 0.9
    return found


def areas(mesh: trimesh.Trimesh, found: Segmentation) -> dict[str, float]:
    share = np.bincount(found.role, mesh.area_faces, len(found.roles)) / mesh.area
    return dict(zip(found.roles, share.tolist(), strict=True))


@pytest.mark.parametrize("rough", [False, True])
def test_head_and_handle_of_a_hammer_meet_where_they_were_joined(rough: bool) -> None:
    mesh = hammer()
    found = told(mesh, "ended", stands=False)
    assert found is not None and found.roles == ("head", "handle")
    inside = np.abs(mesh.triangles_center[:, 0] + 0.13) <= 0.0151
    truth = np.where(inside & (np.hypot(*mesh.triangles_center[:, 1:].T) > 0.0121), 0, 1)
    wrong = mesh.area_faces[(found.role != truth) & (np.abs(mesh.triangles_center[:, 0] + 0.13) > 0.02)].sum()
    assert wrong < 0.02 * mesh.area
    if rough:
        noisy = told(mesh, "ended", stands=False, noise_m=0.0002)
        assert noisy is not None and noisy.roles == found.roles


def test_handle_of_a_mug_reaches_down_to_its_wall() -> None:
    mesh = mug()
    found = told(mesh, "handled", stands=True)
    assert found is not None and found.roles == ("body", "handle")
    away_m = np.hypot(*mesh.triangles_center[:, :2].T)
    assert (away_m[found.role == 1] > 0.0395).all()
    missed = mesh.area_faces[(away_m > 0.0405) & (found.role == 0)].sum()
    assert missed < 0.05 * mesh.area_faces[away_m > 0.0405].sum()


def test_cap_of_a_bottle_begins_above_its_neck() -> None:
    mesh = bottle()
    found = told(mesh, "capped", stands=True)
    assert found is not None and found.roles == ("body", "cap")
    heights = mesh.triangles_center[:, 2]
    assert (found.role[heights > 0.181] == 1).all() and (found.role[heights < 0.175] == 0).all()


def test_stem_is_between_bowl_and_foot() -> None:
    glass = turned(
        (0, 0), (0.035, 0), (0.035, 0.004), (0.004, 0.008), (0.004, 0.1), (0.035, 0.13), (0.035, 0.18), (0, 0.18)
    )
    found = told(glass, "stemmed", stands=True)
    assert found is not None
    share = areas(glass, found)
    assert 0.05 < share["stem"] < 0.12 and share["bowl"] > 0.5 and share["foot"] > 0.15


def test_neck_is_what_is_thinner_than_head_and_handle() -> None:
    spoon = trimesh.boolean.union(
        [along_x(0.018, 0.05, -0.075), along_x(0.003, 0.08, -0.02), along_x(0.008, 0.1, 0.05)]
    )
    found = told(spoon, "ended", stands=False)
    assert found is not None and found.roles == ("head", "neck", "handle")
    x = spoon.triangles_center[found.role == 1, 0]
    assert x.min() > -0.055 and x.max() < 0.005


def cup() -> trimesh.Trimesh:
    return turned((0, 0), (0.04, 0), (0.04, 0.09), (0.036, 0.09), (0.036, 0.006), (0, 0.006))


@pytest.mark.parametrize("noise_m", [0.0, 0.0003])
def test_both_sides_of_a_wall_are_inside_and_body_and_its_edge_is_the_rim(noise_m: float) -> None:
    mesh = cup().subdivide_to_size(0.004)
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces)
    clean, away_m = mesh.triangles_center.copy(), np.hypot(*mesh.triangles_center[:, :2].T)
    mesh.vertices += np.random.default_rng(0).normal(0, noise_m, mesh.vertices.shape) if noise_m else 0.0
    found = told(mesh, "open", stands=True)
    assert found is not None and found.roles == ("body", "inside", "rim", "base")
    upper, high = clean[:, 2] > 0.09 - 0.014, clean[:, 2] < 0.09 - 0.022
    assert (found.role[upper] == 2).mean() > 0.99  # a finger's width on either side
    assert (found.role[high & (away_m < 0.037) & (clean[:, 2] > 0.005)] == 1).mean() > 0.99
    assert (found.role[high & (away_m > 0.039) & (clean[:, 2] > 0.004)] == 0).mean() > 0.99
    assert (found.role[(clean[:, 2] < 0.001) & (away_m < 0.038)] == 3).mean() > 0.99


def test_wall_of_one_face_from_top_to_bottom_is_no_rim_but_its_edge_is() -> None:
    mesh = cup()
    found = told(mesh, "open", stands=True)
    assert found is not None and set(np.unique(found.role)) == {0, 1, 2, 3}
    edge = (mesh.face_normals[:, 2] > 0.9) & (mesh.triangles_center[:, 2] > 0.08)
    assert np.array_equal(found.role == 2, edge)


def test_sloping_underside_beside_the_foot_of_a_saucer_is_no_base() -> None:
    saucer = turned((0, 0), (0.03, 0), (0.075, 0.012), (0.075, 0.015), (0.03, 0.004), (0, 0.004)).subdivide_to_size(
        0.005
    )
    mesh = trimesh.Trimesh(saucer.vertices, saucer.faces)
    found = told(mesh, "open", stands=True)
    assert found is not None
    flat = mesh.face_normals[:, 2] < -0.999
    assert mesh.area_faces[(found.role == 3) != flat].sum() < 0.03 * mesh.area  # the band of 5 % that may be a fillet


def test_hollow_underside_is_base() -> None:
    bowl = turned(
        *((0, 0.02), (0.05, 0.02), (0.06, 0), (0.07, 0), (0.07, 0.06), (0.066, 0.06), (0.066, 0.024), (0, 0.024)),
    ).subdivide_to_size(0.005)
    mesh = trimesh.Trimesh(bowl.vertices, bowl.faces)
    found = told(mesh, "open", stands=True)
    assert found is not None
    under = mesh.face_normals[:, 2] < -0.3
    assert mesh.area_faces[(found.role == 3) != under].sum() < 0.03 * mesh.area


def trough(lower_m: float, upper_m: float, length_m: float, bottom_m: float) -> trimesh.Trimesh:
    """Return the hull of a lower and a longer, wider upper edge, 0.06 m high."""
    corners = [
        [sx * x, sy * y, z]
        for y, x, z in ((lower_m, length_m, bottom_m), (upper_m, length_m, 0.07))
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]
    return trimesh.convex.convex_hull(np.array(corners))


def test_wall_that_hangs_over_between_two_wide_feet_is_no_base() -> None:
    wall, hollow = trough(0.02, 0.04, 0.07, 0.01), trough(0.016, 0.036, 0.066, 0.014)
    feet = [at(box((0.02, 0.1, 0.012)), x, 0, 0.006) for x in (-0.06, 0.06)]
    vessel = trimesh.boolean.difference([trimesh.boolean.union([wall, *feet]), at(hollow, 0, 0, 0.0005)])
    mesh = vessel.subdivide_to_size(0.006)
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces)
    found = told(mesh, "open", stands=True)
    assert found is not None
    center, normal = mesh.triangles_center, mesh.face_normals
    hangs = (np.abs(center[:, 0]) < 0.045) & (normal[:, 2] < -0.2) & (normal[:, 2] > -0.6)
    assert hangs.any() and not (found.role[hangs] == 3).any()
    assert (found.role[(normal[:, 2] < -0.99) & (center[:, 2] < 0.011)] == 3).mean() > 0.95


@pytest.mark.parametrize("noise_m", [0.0, 0.0002])
def test_sunk_lid_with_its_bead_is_the_top_of_a_can(noise_m: float) -> None:
    half = [(0.0, 0.003), (0.03, 0.003), (0.03, 0.0), (0.0335, 0.0), (0.0335, 0.004), (0.032, 0.006)]
    can = turned(*half, *((r, 0.1 - z) for r, z in reversed(half))).subdivide_to_size(0.002)
    mesh = trimesh.Trimesh(can.vertices, can.faces)
    height = mesh.triangles_center[:, 2].copy()
    mesh.vertices += np.random.default_rng(0).normal(0, noise_m, mesh.vertices.shape) if noise_m else 0.0
    found = told(mesh, "closed", stands=True)
    assert found is not None
    truth = np.where(height > 0.095, 1, np.where(height < 0.005, 2, 0))
    assert mesh.area_faces[found.role != truth].sum() < 0.03 * mesh.area


def test_inside_of_a_vase_goes_on_behind_its_shoulder() -> None:
    vase = turned(
        *((0, 0), (0.05, 0), (0.06, 0.08), (0.02, 0.15), (0.02, 0.2)),
        *((0.017, 0.2), (0.017, 0.15), (0.056, 0.08), (0.046, 0.004), (0, 0.004)),
    )
    found = told(vase, "open", stands=True)
    assert found is not None
    radial = np.einsum("ij,ij->i", vase.face_normals[:, :2], vase.triangles_center[:, :2])
    shoulder = (vase.triangles_center[:, 2] > 0.09) & (vase.triangles_center[:, 2] < 0.145)
    assert (found.role[shoulder & (radial < 0)] == 1).all() and (found.role[shoulder & (radial > 0)] == 0).all()


@pytest.mark.parametrize("noise_m", [0.0, 0.0003])
def test_top_and_base_of_a_can_end_at_its_edges(noise_m: float) -> None:
    can = at(cylinder(0.033, 0.1), 0, 0, 0.05).subdivide_to_size(0.004)
    mesh = trimesh.Trimesh(can.vertices, can.faces)
    flat, height = np.abs(mesh.face_normals[:, 2]) > 0.5, mesh.triangles_center[:, 2].copy()
    mesh.vertices += np.random.default_rng(0).normal(0, noise_m, mesh.vertices.shape) if noise_m else 0.0
    found = told(mesh, "closed", stands=True)
    assert found is not None and found.roles == ("body", "top", "base")
    truth = np.where(flat, np.where(height > 0.05, 1, 2), 0)
    assert mesh.area_faces[found.role != truth].sum() < 0.03 * mesh.area


@pytest.mark.parametrize("noise_m", [0.0, 0.0002])
def test_large_faces_and_edge_of_a_slab_in_any_pose(noise_m: float) -> None:
    slab = box((0.1, 0.07, 0.02)).subdivide_to_size(0.004)
    mesh = trimesh.Trimesh(slab.vertices, slab.faces)
    truth = np.where(mesh.face_normals[:, 2] > 0.9, 1, np.where(mesh.face_normals[:, 2] < -0.9, 2, 0))
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.5, [1, 2, 0.5]))
    mesh.vertices += np.random.default_rng(0).normal(0, noise_m, mesh.vertices.shape) if noise_m else 0.0
    found = told(mesh, "faced", stands=False)
    assert found is not None and found.roles == ("side", "front", "back")
    assert mesh.area_faces[found.role != truth].sum() < 0.04 * mesh.area


def test_cups_of_headphones_end_where_the_band_is_thin() -> None:
    band = annulus(0.08, 0.085, 0.02).difference(at(box((0.2, 0.2, 0.1)), 0, -0.1, 0))
    cups = [at(box((0.03, 0.07, 0.07)), side * 0.082, -0.02, 0) for side in (1, -1)]
    mesh = trimesh.boolean.union([band, *cups])
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1, 0, 2]))
    found = told(mesh, "arched", stands=False)
    assert found is not None and found.roles == ("band", "cup")
    true = trimesh.boolean.union(cups).area / mesh.area
    assert areas(mesh, found)["cup"] == pytest.approx(true, abs=0.06)


@pytest.mark.parametrize(
    ("mesh", "rule", "stands"),
    [
        (box((0.2, 0.02, 0.02)), "ended", False),
        (at(cylinder(0.03, 0.12), 0, 0, 0.06), "capped", True),
        (at(cylinder(0.03, 0.12), 0, 0, 0.06), "handled", True),
        (at(cylinder(0.03, 0.12), 0, 0, 0.06), "spouted", True),
        (at(cylinder(0.03, 0.12), 0, 0, 0.06), "stemmed", True),
        (box((0.1, 0.1, 0.1)), "pistol", False),
        (box((0.1, 0.1, 0.1)), "arched", False),
        (icosphere(3, 0.05), "faced", False),
        (box((0.2, 0.02, 0.02)).union(at(icosphere(3, 0.02), 0.1, 0, 0)), "faced", False),
        (box((0.1, 0.1, 0.1)), "open", True),
        (icosphere(3, 0.05), "closed", True),
    ],
)
def test_what_a_form_does_not_show_is_not_guessed(mesh: trimesh.Trimesh, rule: PartRule, stands: bool) -> None:
    assert told(mesh, rule, stands) is None


def test_labels_are_carried_to_another_mesh_of_the_surface_and_not_through_a_wall() -> None:
    plate = box((0.1, 0.1, 0.001))
    labels = (plate.face_normals[:, 2] > 0.5).astype(np.uint8)
    fine = plate.subdivide().subdivide().subdivide()
    over = transfer_face_labels(labels, plate, fine)
    flat = np.abs(fine.face_normals[:, 2]) > 0.5
    assert np.array_equal(over[flat], (fine.face_normals[flat, 2] > 0).astype(np.uint8))
