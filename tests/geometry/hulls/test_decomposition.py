import io
from itertools import combinations

import numpy as np
import pytest
import trimesh
from scipy.spatial import QhullError

from manitwin.geometry.cavity import find_opening
from manitwin.geometry.hull_holes import rod_passes
from manitwin.geometry.hulls.decomposition import Decomposition, _merged, convex_decomposition
from manitwin.geometry.hulls.error import hull_error
from manitwin.geometry.hulls.reduction import convex_corners, hull_to_obj, hull_volume
from manitwin.geometry.repair.cascade import repair
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.object_sampling import make_object
from real_meshes import VESSELS, cup, load_real_mesh, mesh_rows


def _decompose(mesh: trimesh.Trimesh) -> Decomposition:
    return convex_decomposition(mesh, max_hulls=32, max_vertices=64, oversplit=1.5, opening=find_opening(mesh))


def _assert_loadable(hulls: tuple[np.ndarray, ...], mesh: trimesh.Trimesh) -> None:
    """What a checker of finished twins asks of collision meshes."""
    assert 1 <= len(hulls) <= 32
    for hull in hulls:
        loaded = trimesh.load(io.BytesIO(hull_to_obj(hull)), file_type="obj", force="mesh")
        assert loaded.is_convex and len(loaded.vertices) <= 64
    corners = np.vstack(hulls)
    assert np.abs(np.array([corners.min(0), corners.max(0)]) - mesh.bounds).max() < 1e-3


def test_box_is_one_hull() -> None:
    box = trimesh.creation.box((0.1, 0.2, 0.05))
    found = _decompose(box)
    assert len(found.hulls) == 1 and found.method == "plane_cuts"
    _assert_loadable(found.hulls, box)


def test_two_boxes_in_an_l_are_two_hulls() -> None:
    corner = trimesh.boolean.union(
        [
            trimesh.creation.box(bounds=[(0, 0, 0), (0.1, 0.02, 0.02)]),
            trimesh.creation.box(bounds=[(0, 0, 0), (0.02, 0.02, 0.1)]),
        ]
    )
    found = _decompose(corner)
    error = hull_error(corner, found.hulls, None, np.random.default_rng(0))
    assert len(found.hulls) <= 3
    assert error.surface_error_max_m < 1e-3


def test_cup_stays_open() -> None:
    mesh = cup()
    found = _decompose(mesh)
    error = hull_error(mesh, found.hulls, find_opening(mesh), np.random.default_rng(0))
    assert error.cavity_kept is not None and error.cavity_kept > 0.9
    assert error.surface_uncovered_max_m < 1e-3
    _assert_loadable(found.hulls, mesh)


TILTED = trimesh.transformations.rotation_matrix(0.7, [1, 0.4, 0.2])


def _frame() -> trimesh.Trimesh:
    outer, inner = trimesh.creation.box((0.2, 0.14, 0.01)), trimesh.creation.box((0.16, 0.1, 1))
    return trimesh.boolean.difference([outer, inner])


def _plate() -> trimesh.Trimesh:
    hole = trimesh.creation.cylinder(0.012, 0.05).apply_translation((0.03, 0.01, 0))
    return trimesh.boolean.difference([trimesh.creation.box((0.1, 0.06, 0.01)), hole])


@pytest.mark.parametrize("to_object", [np.eye(4), TILTED], ids=["level", "tilted"])
@pytest.mark.parametrize(
    ("mesh", "middle_m", "radius_m"),
    [
        (trimesh.creation.annulus(0.02, 0.05, 0.025, sections=96), (0, 0, 0), 0.02),
        (trimesh.creation.annulus(0.02, 0.05, 0.1, sections=32), (0, 0, 0), 0.02),
        (trimesh.creation.annulus(0.005, 0.012, 0.0015, sections=48), (0, 0, 0), 0.005),
        (trimesh.creation.torus(0.02, 0.0015, major_sections=96, minor_sections=8), (0, 0, 0), 0.0185),
        (_frame(), (0, 0, 0), 0.05),
        (_plate(), (0.03, 0.01, 0), 0.012),
    ],
    ids=["tape", "roll", "washer", "ring", "frame", "plate"],
)
def test_a_hole_through_a_thing_stays_open(
    mesh: trimesh.Trimesh, middle_m: tuple[float, float, float], radius_m: float, to_object: np.ndarray
) -> None:
    mesh = mesh.copy().apply_transform(to_object)
    found = _decompose(mesh)
    _assert_loadable(found.hulls, mesh)
    middle = to_object[:3, :3] @ np.array(middle_m, float)
    assert rod_passes(found.hulls, middle, to_object[:3, 2], 0.7 * radius_m, 1.0)
    assert hull_error(mesh, found.hulls, None, np.random.default_rng(0)).volume_ratio < 1.05


@pytest.mark.parametrize("category", ["roll of tape", "curtain ring", "toilet paper"])
def test_a_hole_through_a_thing_of_a_template_stays_open(category: str) -> None:
    templates = load_templates()
    parted = make_object(templates[category], read_text(category, templates), np.random.default_rng(0)).mesh
    mesh = repair(trimesh.Trimesh(parted.vertices, parted.faces, process=False)).mesh
    found = _decompose(mesh)
    assert rod_passes(found.hulls, mesh.bounds.mean(axis=0), np.array([0.0, 0, 1]), 0.01, 1.0)
    assert hull_error(mesh, found.hulls, None, np.random.default_rng(0)).volume_ratio < 1.05


def test_same_mesh_gives_the_same_hulls() -> None:
    mesh = cup()
    first, second = _decompose(mesh), _decompose(mesh.copy())
    assert [hull.tobytes() for hull in first.hulls] == [hull.tobytes() for hull in second.hulls]


def test_mesh_that_is_no_manifold_gets_a_hull_a_component_and_says_so() -> None:
    left = trimesh.creation.box((0.1, 0.1, 0.1))
    right = trimesh.creation.icosphere(radius=0.05).apply_translation((0.3, 0, 0))
    broken = trimesh.util.concatenate([left, right])
    broken = trimesh.Trimesh(broken.vertices, broken.faces[1:], process=False)
    found = _decompose(broken)
    assert found.method == "component_hulls" and "manifold3d refused" in found.notes[0]
    assert len(found.hulls) == 2
    _assert_loadable(found.hulls, broken)


def test_more_components_than_hulls_are_merged() -> None:
    crowd = [
        trimesh.creation.box((0.01,) * 3).apply_translation((0.03 * (i % 7), 0.03 * (i // 7), 0)) for i in range(40)
    ]
    found = _decompose(trimesh.util.concatenate(crowd))
    assert len(found.hulls) == 32


def merged_by_exact_costs(clouds: list[np.ndarray], max_hulls: int, free_m3: float) -> list[np.ndarray]:
    """Merge the pair whose common hull adds least, whatever it costs to know."""
    clouds = list(clouds)
    while len(clouds) > 1:
        costs = {
            (i, j): hull_volume(np.vstack([clouds[i], clouds[j]])) - hull_volume(clouds[i]) - hull_volume(clouds[j])
            for i, j in combinations(range(len(clouds)), 2)
        }
        i, j = min(costs, key=lambda pair: (costs[pair], pair))
        if len(clouds) <= max_hulls and costs[i, j] > free_m3:
            break
        clouds[i] = convex_corners(np.vstack([clouds[i], clouds[j]]))[0]
        del clouds[j]
    return clouds


@pytest.mark.parametrize("seed", range(6))
def test_hulls_merged_by_bounds_of_what_they_add_are_those_merged_by_exact_costs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shapes = rng.uniform(0.02, 0.2, (10, 1, 3)) * rng.normal(size=(10, 30, 3))
    clouds = [convex_corners(shape + rng.uniform(-0.4, 0.4, 3))[0] for shape in shapes]
    max_hulls, free_m3 = int(rng.integers(2, 8)), float(rng.uniform(0, 0.02))
    everything_touches_m = 10.0
    found = _merged(clouds, max_hulls, free_m3, everything_touches_m)
    expected = merged_by_exact_costs(clouds, max_hulls, free_m3)
    assert len(found) == len(expected) <= len(clouds) - 2
    for said, true in zip(found, expected, strict=True):
        np.testing.assert_array_equal(said, true)


def test_flat_mesh_is_refused() -> None:
    with pytest.raises(QhullError):
        _decompose(trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]))


@pytest.mark.shared_data
@pytest.mark.parametrize("name", ["mug_ycb", "bowl_evo", "cracker_box"])
def test_real_objects_are_covered_and_open(shared_data, name: str) -> None:
    _check_real(shared_data, name)


@pytest.mark.slow
@pytest.mark.shared_data
def test_all_real_objects_are_covered_and_open(shared_data) -> None:
    for name in mesh_rows(shared_data):
        _check_real(shared_data, name)


def _check_real(data, name: str) -> None:
    mesh = load_real_mesh(data, name)
    opening = find_opening(mesh)
    found = _decompose(mesh)
    assert found.method == "plane_cuts", name
    _assert_loadable(found.hulls, mesh)
    error = hull_error(mesh, found.hulls, opening, np.random.default_rng(0))
    assert error.surface_uncovered_max_m < 0.002, name
    if name in VESSELS:
        assert error.cavity_kept is not None and error.cavity_kept >= VESSELS[name], name
