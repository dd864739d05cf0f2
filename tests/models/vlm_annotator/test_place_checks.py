"""Places by name and by grasp, against the geometry of handmade solids."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from handmade import cylinder, mug
from manitwin.models.annotators.protocol import PointsRequest, Subject
from manitwin.models.annotators.vlm.place_checks import PlaceChecks

# On the mug: rim, outer wall half way up, underside, outermost of the handle at +x, opposite wall.
PLACES = {"rim": [0, 0.0385, 0.1], "wall": [0, 0.04, 0.05], "underside": [0, 0, 0], "handle": [0.075, 0, 0.05],
          "back": [-0.04, 0, 0.05]}  # fmt: skip
NORMALS = {"rim": [0, 0, 1], "wall": [0, 1, 0], "underside": [0, 0, -1], "handle": [1, 0, 0], "back": [-1, 0, 0]}


def checks(
    mesh: trimesh.Trimesh, positions: list[list[float]], normals: list[list[float]], opening_m: float = 0.08
) -> PlaceChecks:
    rest = mesh.vertices[:: max(len(mesh.vertices) // 30, 1)]  # gives the candidates a spacing
    of = Subject(None, mesh, (mesh,), True, (), (), 0)
    return PlaceChecks(
        PointsRequest(
            of, np.vstack([positions, rest]), np.vstack([normals, np.zeros_like(rest)]).astype(float), (), (),
            mesh.center_mass, opening_m,
        )
    )  # fmt: skip


@pytest.fixture(scope="module")
def of_mug() -> PlaceChecks:
    return checks(mug(), list(PLACES.values()), list(NORMALS.values()))


@pytest.mark.parametrize(
    ("label", "place", "contradicted"),
    [
        ("rim", "rim", False),
        ("rim", "underside", True),
        ("opening", "back", True),
        ("drinking rim", "rim", False),
        ("base", "underside", False),
        ("bottom", "rim", True),
        ("flat base", "wall", False),
        ("base", "rim", True),
        ("handle", "handle", False),
        ("handle", "back", True),
        ("ring handle", "wall", True),
        ("handle attachment", "wall", False),
        ("side wall", "wall", False),
        ("body", "underside", False),
        ("top", "underside", True),
        ("can opener tool", "back", False),
    ],
)
def test_label_is_contradicted_where_geometry_knows_better(
    of_mug: PlaceChecks, label: str, place: str, contradicted: bool
) -> None:
    assert (of_mug.label_contradiction(label, list(PLACES).index(place)) is not None) == contradicted


def test_width_of_a_box_is_that_which_fingers_can_span() -> None:
    box = trimesh.creation.box([0.2, 0.15, 0.06])
    box.apply_translation([0, 0, 0.03])
    of = checks(box, [[0.1, 0, 0.03], [0, 0.075, 0.03], [0, 0, 0.06]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert [of.width_m(i) for i in range(3)] == pytest.approx([0.06, 0.06, 0.06], abs=1e-5)
    assert all(of.grasp_contradiction("parallel_jaw", i) is None for i in range(3))


def test_thick_cylinder_is_too_wide_for_two_fingers_only() -> None:
    of = checks(cylinder(0.06, 0.3), [[0.06, 0, 0.15]], [[1, 0, 0]])
    # a chord through a point 20 mm below the surface of a circle of 60 mm: 2 sqrt(60^2 - 40^2) = 89 mm
    assert of.width_m(0) == pytest.approx(0.0894, abs=0.002)
    assert (
        "89 mm" in (of.grasp_contradiction("pinch", 0) or "") and of.grasp_contradiction("parallel_jaw", 0) is not None
    )
    assert (
        of.grasp_contradiction("power", 0) is None
        and of.grasp_contradiction("enveloping", 0) is None
        and of.grasp_contradiction("three_finger", 0) is None
    )
    assert checks(cylinder(0.03, 0.3), [[0.03, 0, 0.15]], [[1, 0, 0]]).grasp_contradiction("parallel_jaw", 0) is None


def test_bottom_rim_is_that_of_the_bottom_not_of_the_opening(of_mug: PlaceChecks) -> None:
    for label in ("bottom rim", "base rim", "lower rim"):
        assert of_mug.label_contradiction(label, list(PLACES).index("underside")) is None
    assert of_mug.label_contradiction("bottom rim", list(PLACES).index("rim")) is not None


def test_ends_of_a_lying_can_are_its_bottom_and_top() -> None:
    can = cylinder(0.033, 0.12)
    can.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    can.apply_translation([0, 0, -can.bounds[0, 2]])
    low, high = can.bounds[:, 0]
    at = {
        "upper edge of an end": [low, 0, 0.065],
        "other end": [high, 0, 0.001],
        "side on top": [(low + high) / 2, 0, 0.066],
    }
    of = checks(can, list(at.values()), [[-1, 0, 0], [1, 0, 0], [0, 0, 1]])
    assert (
        of.label_contradiction("bottom rim", 0) is None
        and of.label_contradiction("top", 1) is None
        and of.label_contradiction("base", 0) is None
    )
    assert of.label_contradiction("bottom", 2) is not None, "the middle of its side is no end"


def test_pinch_is_for_what_is_thin_and_widths_are_said() -> None:
    box = trimesh.creation.box([0.2, 0.15, 0.06])
    of = checks(box, [[0.1, 0, 0]], [[1, 0, 0]])
    assert (
        "parallel_jaw" in (of.grasp_contradiction("pinch", 0) or "")
        and of.grasp_contradiction("parallel_jaw", 0) is None
    )
    assert of.width_phrase(0) == "60 mm"
    thin = checks(trimesh.creation.box([0.2, 0.15, 0.008]), [[0.1, 0, 0]], [[1, 0, 0]])
    assert thin.grasp_contradiction("pinch", 0) is None and thin.width_phrase(0) == "8 mm"
