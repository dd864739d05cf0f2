"""RoboTwin folders as RoboTwin's own loader would take them: our own export, old spellings, and what is wrong with them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from handmade import visual
from known_twins import TWINS, brick, hammer
from manitwin.assets.readers.robotwin import read
from manitwin.assets.writers import robotwin
from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.grasp_rows import grasp_rows
from manitwin.errors import AssetError
from manitwin.formats.glb import write_glb

Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def exported(twin: TwinContent, root: Path) -> Path:
    files = robotwin.export(twin)
    for name, data in files.files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_bytes(data)
    return (root / files.main).parent


def folder_of(root: Path, data: Any, name: str = "003_toy_car", number: str = "0", glb: str = "base0.glb") -> Path:
    """A folder with one cube of 2 units, bottom on y = 0, and the given model_data."""
    folder = root / name
    cube = trimesh.creation.box([2, 2, 2])
    cube.apply_translation([0, 0, 1])
    folder.mkdir(parents=True, exist_ok=True)
    (folder / glb).parent.mkdir(parents=True, exist_ok=True)
    (folder / glb).write_bytes(write_glb([visual(cube, baseColorFactor=[255, 0, 0, 255])]))
    if data is not None:
        text = data if isinstance(data, str) else json.dumps(data)
        (folder / f"model_data{number}.json").write_text(text)
    return folder


@pytest.mark.parametrize("make", TWINS)
def test_own_export_comes_back_with_the_twins_frames(make: Any, tmp_path: Path) -> None:
    twin = make()
    asset = read(exported(twin, tmp_path))
    rows = grasp_rows(twin, "panda", controls=False)
    held = rows.gripper_to_object[rows.held]
    contacts = [frame for frame in asset.frames if frame.kind == "contact"]
    tips = np.array([frame.frame_to_asset[:3, 3] for frame in contacts])
    assert len(contacts) == 2 * len(held)
    for pose in held:
        tip = Y_UP @ (pose[:3, 3] + 0.1034 * pose[:3, 2])
        pair = [
            frame
            for frame, at in zip(contacts, tips, strict=True)
            if np.allclose(at, tip)
            and np.allclose(frame.approach, Y_UP @ pose[:3, 2])
            and np.isclose(abs(frame.closing @ Y_UP @ pose[:3, 0]), 1)
        ]
        assert len(pair) == 2
        signs = sorted(float(frame.closing @ (Y_UP @ pose[:3, 0])) for frame in pair)
        assert np.allclose(signs, [-1, 1])
    assert not asset.missing_files
    assert not asset.remarks


def test_own_export_comes_back_with_mass_words_and_rest(tmp_path: Path) -> None:
    twin = brick()
    asset = read(exported(twin, tmp_path))
    physical = twin.physical
    assert asset.inertial.mass_kg == physical.mass_kg.value
    assert np.allclose(asset.inertial.center_of_mass_m, Y_UP @ physical.center_of_mass_m)
    assert np.allclose(asset.inertial.inertia_kg_m2, Y_UP @ np.array(physical.inertia_kg_m2) @ Y_UP.T)
    assert asset.contact.friction_static == physical.friction_static.value
    assert (asset.category, len(asset.captions), asset.up) == ("brick", 15, "y")
    assert (asset.license, asset.attribution) == ("CC-BY-4.0", "Ada")
    assert np.allclose(asset.rests[0][:3, :3] @ [0, 1, 0], [0, 0, 1])
    assert len(asset.files) == 4
    assert asset.visual[0].bounds[1][1] == pytest.approx(0.1)


def test_hulls_come_back_one_shape_each(tmp_path: Path) -> None:
    twin = hammer()
    asset = read(exported(twin, tmp_path))
    assert len(asset.collision) == len(twin.hulls)
    for shape, (vertices, _) in zip(asset.collision, twin.hulls, strict=True):
        assert shape.convex
        assert np.allclose(sorted((vertices @ Y_UP.T).tolist()), sorted(shape.vertices.tolist()), atol=1e-6)


def test_scale_goes_onto_meshes_and_translations_but_not_onto_axes(tmp_path: Path) -> None:
    matrix = np.eye(4)
    matrix[:3, 3] = [1, 2, 3]
    folder = folder_of(tmp_path, {"scale": [0.1, 0.2, 0.3], "contact_points_pose": [matrix.tolist()]})
    asset = read(folder)
    assert np.allclose(asset.visual[0].extents, [0.2, 0.4, 0.6])
    assert np.allclose(asset.collision[0].vertices.max(0), [0.1, 0.4, 0.3])
    (frame,) = asset.frames
    assert np.allclose(frame.frame_to_asset[:3, 3], [0.1, 0.4, 0.9])
    assert np.array_equal(frame.frame_to_asset[:3, :3], np.eye(3))
    assert np.allclose(frame.approach, [0, -1, 0]) and np.allclose(frame.closing, [0, 0, 1])


def test_left_handed_and_stretched_matrices_are_kept(tmp_path: Path) -> None:
    wrong = np.diag([-1.0, 2.0, 1.0, 1.0])
    (frame,) = read(folder_of(tmp_path, {"contact_points_pose": [wrong.tolist()]})).frames
    assert np.array_equal(frame.frame_to_asset, wrong)
    assert np.allclose(frame.approach, [0, -1, 0])


def test_axis_without_length_says_no_direction(tmp_path: Path) -> None:
    flat = np.diag([1.0, 0.0, 1.0, 1.0])
    (frame,) = read(folder_of(tmp_path, {"contact_points_pose": [flat.tolist()]})).frames
    assert frame.approach is None and frame.closing is not None


def test_old_spellings_and_group_descriptions(tmp_path: Path) -> None:
    eye = np.eye(4).tolist()
    data = {
        "contact_points_pose": [eye] * 4,
        "contact_points_group": [[0, 1], [2, 3]],
        "contact_points_mask": [True, True],
        "contact_points_discription": ["the rim", "the handle"],
        "functional_matrix": [eye],
        "functional_point_discription": ["the bottom"],
    }
    frames = read(folder_of(tmp_path, data)).frames
    assert [f.label for f in frames] == ["the rim", "the rim", "the handle", "the handle", "the bottom"]
    assert [f.number for f in frames] == [0, 1, 2, 3, 0]


def test_contact_pose_of_robotwin_1_is_turned_by_its_trans_matrix(tmp_path: Path) -> None:
    pose, turn = np.eye(4), np.eye(4)
    pose[:3, 3] = [1, 0, 0]
    turn[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    turn[:3, 3] = [0, 0, 0.5]
    data = {"scale": 0.1, "contact_pose": pose.tolist(), "trans_matrix": turn.tolist(), "target_pose": pose.tolist()}
    folder = folder_of(tmp_path, data, number="", glb="base.glb")
    contact, target = read(folder).frames
    assert np.allclose(contact.frame_to_asset[:3, 3], [0.1, 0, 0.5])
    assert np.allclose(contact.frame_to_asset[:3, :3], turn[:3, :3])
    assert target.kind == "target" and np.allclose(target.frame_to_asset[:3, 3], [0.1, 0, 0])


def test_groups_that_name_contacts_that_are_not_there_are_told(tmp_path: Path) -> None:
    data = {
        "contact_points_pose": [np.eye(4).tolist()] * 2,
        "contact_points_group": [[0, 2, 3, 4]],
        "contact_points_mask": [True, False],
    }
    remarks = read(folder_of(tmp_path, data)).remarks
    assert any("no contact 2" in line for line in remarks)
    assert any("2 values for 1 groups" in line for line in remarks)


def test_extents_in_the_order_of_an_oriented_box_are_told(tmp_path: Path) -> None:
    true, swapped = {"extents": [2, 2, 2], "scale": [1, 2, 1]}, {"extents": [4, 2, 2], "scale": [1, 1, 1]}
    assert not read(folder_of(tmp_path, true, "001_a")).remarks
    assert any("extents" in line for line in read(folder_of(tmp_path, swapped, "002_b")).remarks)


def test_files_are_looked_up_as_robotwin_does(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, {}, glb="collision/base0.glb")
    folder_of(tmp_path, None, glb="base0.glb")
    asset = read(folder)
    assert asset.collision[0].file == (folder / "collision" / "base0.glb").resolve()
    assert (folder / "base0.glb").resolve() in asset.files  # the visual mesh falls back to the folder itself
    assert not asset.missing_files


def test_missing_meshes_are_named(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, {}, glb="visual/base0.glb")
    asset = read(folder)
    assert asset.missing_files == ("collision/base0.glb",)
    assert not asset.collision and asset.visual


def test_variant_by_its_file_and_the_lowest_by_the_folder(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, {"scale": 1.0}, number="3", glb="base3.glb")
    folder_of(tmp_path, {"scale": 0.5}, number="10", glb="base10.glb")
    assert any("2 variants" in line for line in read(folder).remarks)
    assert read(folder).visual[0].extents[0] == pytest.approx(2.0)
    tenth = read(folder / "model_data10.json")
    assert (tenth.name, tenth.category) == ("003_toy_car/base10", "toy car")
    assert tenth.visual[0].extents[0] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        ("{", "JSON is broken"),
        ("[1]", "contains a JSON list, not an object"),
        ({"scale": [1, 2]}, "scale is neither"),
        ({"scale": "big"}, "scale is not made of numbers"),
        ('{"scale": [1e300, 1, 1]}', "scale holds a number"),
        (
            '{"contact_points_pose": [[[NaN, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]]}',
            "not a finite number",
        ),
        ({"contact_points_pose": [[1, 2, 3]]}, "no list of 4x4 matrices"),
        ({"contact_points_pose": [[[1]], [[1, 2]]]}, "not made of numbers"),
        ({"contact_points_group": [3]}, "no list of lists"),
        ({"contact_points": [{"matrix": [], "base": "link"}]}, "articulated"),
        ({"mass": {"link": 1.0}}, "articulated"),
    ],
)
def test_what_cannot_be_read_is_one_line(tmp_path: Path, data: Any, complaint: str) -> None:
    with pytest.raises(AssetError, match=complaint) as caught:
        read(folder_of(tmp_path, data))
    assert "\n" not in str(caught.value)


def test_folder_without_model_data_is_none_of_robotwins(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="no model_data"):
        read(folder_of(tmp_path, None))


def test_broken_mesh_is_an_error_that_names_it(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, {})
    (folder / "base0.glb").write_bytes(b"glTF broken")
    with pytest.raises(AssetError, match=r"base0\.glb"):
        read(folder)


def test_link_that_leads_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    folder = folder_of(tmp_path, {})
    (folder / "base0.glb").rename(tmp_path / "secret.glb")
    (folder / "base0.glb").symlink_to(tmp_path / "secret.glb")
    asset = read(folder)
    assert not asset.visual
    assert any("outside" in line for line in asset.remarks)
