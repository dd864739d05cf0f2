"""RoboTwin's files against what RoboTwin's loader asks for, and frames against examples computed by hand."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import trimesh
from sapien import physx

from known_twins import FROM_PLUS_Y, TWINS, brick, hammer, made_twin, tray
from manitwin.assets.writers import robotwin
from manitwin.assets.writers.exporter import TwinContent
from manitwin.geometry.distance import distance_to_surface
from rigid_boxes import FROM_ABOVE, above


def model_data(twin: TwinContent) -> dict[str, Any]:
    exported = robotwin.export(twin)
    content: dict[str, Any] = json.loads(exported.files[exported.main])
    return content


def contacts(twin: TwinContent) -> np.ndarray:
    return np.array(model_data(twin)["contact_points_pose"])


def test_grasp_from_above_by_hand() -> None:
    # tips at (0, 0, 0.09), approach -z, closing +x, side -y in the object frame; there (x, y, z) -> (x, z, -y)
    first, second = robotwin.contact_frames(above([0, 0, 0.09])[None], np.array([0.1034]))[0]
    expected = np.eye(4)
    expected[:3, 0] = [0, 0, -1]  # minus the side: (0, 1, 0) -> (0, 0, -1)
    expected[:3, 1] = [0, 1, 0]  # out of the object
    expected[:3, 2] = [1, 0, 0]  # closing
    expected[:3, 3] = [0, 0.09, 0]
    assert np.allclose(first, expected)
    assert np.allclose(second[:3, :3], expected[:3, :3] @ np.diag([-1, 1, -1]))
    assert np.allclose(second[:3, 3], expected[:3, 3])


def test_grasp_from_the_side_by_hand() -> None:
    # approach -y: Y points along +y of the object, which is -z of the mesh; closing along x
    first, _ = robotwin.contact_frames(above([0.01, 0.02, 0.05], FROM_PLUS_Y)[None], np.array([0.1034]))[0]
    assert np.allclose(first[:3, 1], [0, 0, -1])
    assert np.allclose(first[:3, 2], [1, 0, 0])
    assert np.allclose(first[:3, 3], [0.01, 0.05, -0.02])


@pytest.mark.parametrize("make", TWINS)
def test_every_frame_is_a_rotation_and_a_place(make: Any) -> None:
    data = model_data(make())
    for key in ("contact_points_pose", "functional_matrix", "orientation_point"):
        matrices = np.array(data[key])
        assert matrices.shape[1:] == (4, 4)
        assert np.allclose(matrices[:, :3, :3] @ matrices[:, :3, :3].transpose(0, 2, 1), np.eye(3), atol=1e-9)
        assert np.allclose(np.linalg.det(matrices[:, :3, :3]), 1)
        assert (matrices[:, 3] == [0, 0, 0, 1]).all()


@pytest.mark.parametrize("make", TWINS)
def test_frames_come_in_pairs_half_a_turn_about_the_approach_apart(make: Any) -> None:
    twin = make()
    pairs = contacts(twin).reshape(-1, 2, 4, 4)
    assert len(pairs) == sum(twin.grasps["verified"])
    turn = pairs[:, 0, :3, :3].transpose(0, 2, 1) @ pairs[:, 1, :3, :3]
    assert np.allclose(turn, np.diag([-1, 1, -1]), atol=1e-9)
    assert np.array_equal(pairs[:, 0, :3, 3], pairs[:, 1, :3, 3])


@pytest.mark.parametrize("make", TWINS)
def test_contact_frames_lie_within_a_pad_of_the_surface(make: Any) -> None:
    twin = make()
    # between the fingertips: inside what they hold, so nearer to its surface than half of the opening
    points = contacts(twin)[:, :3, 3] @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    surface = trimesh.util.concatenate([trimesh.Trimesh(v, f) for v, f in twin.hulls])
    assert distance_to_surface(points, surface).max() < 0.04


def test_groups_and_masks_name_every_contact_once() -> None:
    data = model_data(tray())
    count = len(data["contact_points_pose"])
    assert sorted(i for group in data["contact_points_group"] for i in group) == list(range(count))
    assert data["contact_points_mask"] == [True] * len(data["contact_points_group"])
    assert data["contact_points_description"] == ["pinch: lift it"] * count


def test_best_grasps_are_kept_and_bounded() -> None:
    poses = [above([0.0001 * i, 0, 0.09]) for i in range(40)]
    twin = made_twin(4, "brick", [([-0.02, -0.03, 0], [0.02, 0.03, 0.1])], poses, [above([0, 0.2, 0.09])])
    twin.grasps["robustness"] = [None] * 41
    found = contacts(twin)
    assert len(found) == 2 * robotwin.MAX_GRASPS
    assert np.allclose(found[0, :3, 3], [0, 0.09, 0])  # the first has the highest score
    twin.grasps["robustness"] = [0.1] * 39 + [1.0, None]
    assert np.allclose(contacts(twin)[0, :3, 3], [0.0039, 0.09, 0])


def test_retired_and_failed_grasps_are_not_written() -> None:
    twin = brick()
    twin.grasps["retired"][0] = True
    assert len(contacts(twin)) == 2 * (sum(twin.grasps["verified"]) - 1)


def test_twin_without_a_held_grasp_says_that_it_cannot_be_grasped() -> None:
    twin = brick()
    twin.grasps["verified"] = [False] * len(twin.grasps["verified"])
    exported = robotwin.export(twin)
    assert json.loads(exported.files[exported.main])["contact_points_pose"] == []
    assert any("cannot be grasped" in line for line in exported.cannot_say)


def test_suction_grasps_are_no_contacts() -> None:
    twin = brick()
    twin.grasps["width_m"] = [0.0] * len(twin.grasps["width_m"])
    assert len(contacts(twin)) == 0


def test_extents_are_along_the_axes_with_the_height_second() -> None:
    data = model_data(hammer())
    assert data["extents"] == pytest.approx([0.08, 0.024, 0.15])
    assert data["center"] == pytest.approx([0.0, 0.012, 0.0])
    assert data["scale"] == [1.0, 1.0, 1.0]


def test_functional_frame_points_outward() -> None:
    frame = np.array(model_data(brick())["functional_matrix"][0])
    assert np.allclose(frame[:3, 2], [0, -1, 0])  # out of the bottom
    assert np.allclose(frame[:3, 3], [0.01, 0, -0.02])


@pytest.mark.parametrize(
    ("tilt_rad", "settled", "stable"), [(0.0, True, True), (0.04, True, True), (0.2, True, False), (0.0, False, False)]
)
def test_stable_is_what_stays_upright(tilt_rad: float, settled: bool, stable: bool) -> None:
    twin = brick()
    assert twin.record.placements is not None
    quaternion = [float(np.cos(tilt_rad / 2)), float(np.sin(tilt_rad / 2)), 0.0, 0.0]
    placement = twin.record.placements[0].model_copy(update={"quaternion_wxyz": quaternion, "settled": settled})
    object.__setattr__(twin, "record", twin.record.model_copy(update={"placements": [placement]}))
    assert model_data(twin)["stable"] is stable


@pytest.mark.parametrize("make", TWINS)
def test_sapien_makes_one_convex_shape_of_each_hull(make: Any, tmp_path: Any) -> None:
    twin = make()
    file = tmp_path / "base0.glb"
    file.write_bytes(next(d for n, d in robotwin.export(twin).files.items() if n.endswith("collision/base0.glb")))
    shapes = physx.PhysxCollisionShapeConvexMesh.load_multiple(
        str(file), np.ones(3, np.float32), physx.get_default_material()
    )
    assert len(shapes) == len(twin.hulls)
    for shape, (vertices, _) in zip(shapes, twin.hulls, strict=True):
        y_up = np.stack([vertices[:, 0], vertices[:, 2], -vertices[:, 1]], axis=1)
        assert np.allclose([shape.vertices.min(0), shape.vertices.max(0)], [y_up.min(0), y_up.max(0)], atol=1e-6)


def test_names_are_those_that_robotwin_takes_for_clutter() -> None:
    files = robotwin.export(brick()).files
    name = robotwin.object_name(brick())
    assert name.split("_", 1)[0].isdigit() and int(name.split("_")[0]) >= 200
    assert set(files) == {
        f"assets/objects/{name}/visual/base0.glb",
        f"assets/objects/{name}/collision/base0.glb",
        f"assets/objects/{name}/model_data0.json",
        f"assets/objects/{name}/physics0.json",
        f"description/objects_description/{name}/base0.json",
        "object_mass.json",
    }
    assert json.loads(files["object_mass.json"]) == {f"{name}/base0": 0.12}


def test_physics_beside_it_says_that_robotwin_reads_none_of_it() -> None:
    files = robotwin.export(brick()).files
    physics = json.loads(next(data for name, data in files.items() if name.endswith("physics0.json")))
    assert physics["mass_kg"]["value"] == 0.12
    assert physics["friction_static"]["value"] == 0.8
    assert "RoboTwin reads none" in physics["remark"]


def test_license_and_credit_travel_along() -> None:
    data = model_data(brick())
    assert (data["license"], data["attribution"]) == ("CC-BY-4.0", "Ada")


@pytest.mark.parametrize("make", TWINS)
def test_same_twin_gives_the_same_bytes(make: Any) -> None:
    assert robotwin.export(make()) == robotwin.export(make())


def test_closing_axis_is_the_one_along_which_robotwins_franka_closes() -> None:
    # robot.py _trans_from_gripper_to_endlink with the Franka's delta_matrix of RoboTwin's manual (new embodiments): the end
    # link is panda_hand, which closes along its Y; with gripper_bias at the fingertips it is the hand that was verified
    delta = np.array([[0.0, 0, 1], [0, -1, 0], [1, 0, 0]])
    grasp = above([0.005, 0.01, 0.08], FROM_ABOVE)
    for contact in robotwin.contact_frames(grasp[None], np.array([0.1034]))[0]:
        contact_z_up = np.vstack([contact[[0]], -contact[[2]], contact[[1]], contact[[3]]])
        gripper = contact_z_up[:3, :3] @ np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
        origin = contact_z_up[:3, 3] - 0.12 * gripper[:, 0] + (0.12 - 0.1034) * gripper[:, 0]
        panda_hand = gripper @ np.linalg.inv(delta)
        assert np.allclose(origin, grasp[:3, 3])
        assert np.allclose(panda_hand[:, 2], grasp[:3, 2])
        assert np.isclose(abs(panda_hand[:, 1] @ grasp[:3, 0]), 1)
