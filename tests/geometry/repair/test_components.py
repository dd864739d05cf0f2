from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.geometry.repair.components import SeparateObjects, connected_parts, separate_objects


def _box(x: float, side: float = 0.04) -> trimesh.Trimesh:
    return trimesh.creation.box((side, side, side)).apply_translation((x, 0, 0))


def _count(*meshes: trimesh.Trimesh, gap_m: float = 0.002) -> SeparateObjects:
    return separate_objects(
        trimesh.util.concatenate(list(meshes)), gap_m=gap_m, object_share=0.05, rng=np.random.default_rng(0)
    )


def test_parts_share_area_and_hull_volume() -> None:
    parts = connected_parts(trimesh.util.concatenate([_box(0), _box(0.1, side=0.08)]))
    assert [part.hull_volume_share for part in parts] == pytest.approx([8 / 9, 1 / 9])
    assert [part.area_share for part in parts] == pytest.approx([4 / 5, 1 / 5])


def test_boxes_side_by_side_are_as_many_objects() -> None:
    assert _count(_box(0), _box(0.05), _box(0.1)) == SeparateObjects(3, 0)


def test_boxes_a_millimetre_apart_are_one_object() -> None:
    assert _count(_box(0), _box(0.041)) == SeparateObjects(1, 0)


def test_what_lies_inside_a_cup_belongs_to_it() -> None:
    cup = trimesh.creation.annulus(r_min=0.045, r_max=0.05, height=0.1)
    assert _count(cup, trimesh.creation.icosphere(radius=0.02)) == SeparateObjects(1, 0)


def test_floating_crumbs_are_specks_and_no_objects() -> None:
    crumbs = [
        trimesh.creation.icosphere(subdivisions=1, radius=0.001).apply_translation((0.05, y, 0))
        for y in (0, 0.01, 0.02)
    ]
    found = _count(_box(0), *crumbs)
    assert (found.count, found.specks) == (1, 3)
    assert found.larger_m == pytest.approx((0.031, 0.001, 0.0), abs=1e-3)


def test_chain_of_parts_that_touch_is_one_object() -> None:
    links = [
        trimesh.creation.torus(0.01, 0.002)
        .apply_transform(trimesh.transformations.rotation_matrix(i * np.pi / 2, (1, 0, 0)))
        .apply_translation((0.016 * i, 0, 0))
        for i in range(8)
    ]
    assert _count(*links) == SeparateObjects(1, 0)


@pytest.mark.shared_data
def test_scene_of_four_objects_is_four(shared_data: Path) -> None:
    scene = trimesh.load(shared_data / "bad" / "scene_four_objects.glb")
    mesh = scene.to_geometry()
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    gap_m = 0.02 * float(np.linalg.norm(mesh.extents))
    assert separate_objects(mesh, gap_m=gap_m, object_share=0.05, rng=np.random.default_rng(0)).count == 4
