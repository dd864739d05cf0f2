import numpy as np
import pytest
import trimesh

from handmade import cup, hammer, mug, screwdriver
from manitwin.dataset.index.near_duplicates import MAX_SHAPE_DISTANCE
from manitwin.geometry.shape_descriptor import QUANTILES, shape_descriptor, surface_moments

NOISE = 0.012


def distance(first: trimesh.Trimesh, second: trimesh.Trimesh, seeds: tuple[int, int] = (0, 1)) -> float:
    values = [shape_descriptor(mesh, seed=seed).values for mesh, seed in zip((first, second), seeds, strict=True)]
    return float(np.linalg.norm(values[0] - values[1]))


def moved(mesh: trimesh.Trimesh, scale: float) -> trimesh.Trimesh:
    turned = mesh.copy()
    turned.apply_transform(trimesh.transformations.random_rotation_matrix(np.array([0.2, 0.7, 0.4])))
    turned.apply_translation([0.3, -2.0, 1.0])
    return turned.apply_scale(scale)


@pytest.mark.parametrize("make", [mug, hammer, screwdriver])
def test_turned_moved_scaled_and_finer_surfaces_have_one_descriptor(make) -> None:
    mesh = make()
    finer = moved(mesh, 12.5).subdivide()
    assert distance(mesh, finer) < NOISE
    sizes = [shape_descriptor(each, seed=0).radius_of_gyration_m for each in (mesh, finer)]
    assert sizes[1] == pytest.approx(12.5 * sizes[0], rel=1e-9)


def test_mirrored_surface_has_the_same_descriptor() -> None:
    mirrored = hammer()
    mirrored.vertices[:, 0] *= -1
    mirrored.invert()
    assert distance(hammer(), mirrored) < NOISE


def test_different_shapes_lie_farther_apart_than_what_counts_as_alike() -> None:
    shapes = [mug(), cup(), hammer(), screwdriver(), trimesh.creation.box([1, 1, 1]), trimesh.creation.icosphere(4)]
    for i, first in enumerate(shapes):
        for second in shapes[:i]:
            assert distance(first, second, (0, 0)) > 1.5 * MAX_SHAPE_DISTANCE


def test_distances_on_a_sphere_follow_their_closed_form() -> None:
    # a chord of a sphere is shorter than t with probability t^2 / 4 R^2, its mean square is 2 R^2; every radius is R
    found = shape_descriptor(trimesh.creation.icosphere(5, radius=0.7), seed=3)
    levels = (np.arange(QUANTILES) + 0.5) / QUANTILES
    scaled = found.values * np.sqrt(QUANTILES)
    assert scaled[:QUANTILES] == pytest.approx(np.sqrt(2 * levels), abs=0.02)
    assert scaled[QUANTILES:-2] == pytest.approx(1, abs=1e-3)
    assert found.values[-2:] == pytest.approx([1, 1], abs=1e-3)
    assert found.radius_of_gyration_m == pytest.approx(0.7, rel=1e-3)
    assert found.values.shape == (2 * QUANTILES + 2,)


def test_moments_of_a_box_surface_are_exact() -> None:
    a, b, c = sides = np.array([0.3, 1.0, 2.0])
    mesh = trimesh.creation.box(sides)
    place = [50, 20, -70]
    mesh.apply_translation(place)
    # on the two faces across an axis its coordinate is half a side, on the four others uniform
    areas = np.array([b * c, a * c, a * b])
    expected = (areas * sides**2 / 4 + (areas.sum() - areas) * sides**2 / 12) / areas.sum()
    centroid, covariance = surface_moments(mesh)
    assert centroid == pytest.approx(place)
    assert covariance == pytest.approx(np.diag(expected), abs=1e-10)


def test_seed_decides_the_bytes() -> None:
    first, again, other = (shape_descriptor(mug(), seed=seed).values for seed in (4, 4, 5))
    assert first.tobytes() == again.tobytes() != other.tobytes()


@pytest.mark.parametrize("scale", [0.0, 1e-200, 1e200])
def test_surface_whose_area_is_zero_or_not_finite_is_refused(scale: float) -> None:
    with pytest.raises(ValueError, match="has no shape"):
        shape_descriptor(trimesh.Trimesh(scale * np.eye(3), [[0, 1, 2]], process=False), seed=0)
