import numpy as np
import pytest
import trimesh

from manitwin.geometry.mass_properties import shell_mass_properties, solid_mass_properties
from real_meshes import cup


def test_solid_box_off_the_origin_is_the_closed_form() -> None:
    a, b, c, mass_kg = 0.06, 0.10, 0.20, 0.7
    box = trimesh.creation.box((a, b, c)).apply_translation((0.3, -0.2, 0.1))
    found = solid_mass_properties(box, mass_kg)
    assert found.volume_m3 == pytest.approx(a * b * c)
    assert found.center_of_mass_m == pytest.approx([0.3, -0.2, 0.1])
    expected = mass_kg / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    assert found.inertia_kg_m2 == pytest.approx(expected, abs=1e-12)


def test_solid_cylinder_is_the_closed_form_of_its_polygon() -> None:
    radius, height, sides, mass_kg = 0.033, 0.101, 64, 0.349
    can = trimesh.creation.cylinder(radius=radius, height=height, sections=sides)
    angle = 2 * np.pi / sides
    area = sides * radius**2 * np.sin(angle) / 2
    about_axis = mass_kg * radius**2 / 6 * (2 + np.cos(angle))  # polar second moment of a regular polygon
    found = solid_mass_properties(can, mass_kg)
    assert found.volume_m3 == pytest.approx(area * height)
    across = about_axis / 2 + mass_kg * height**2 / 12
    assert np.diag(found.inertia_kg_m2) == pytest.approx([across, across, about_axis])


def test_inertia_turns_with_the_object() -> None:
    box = trimesh.creation.box((0.06, 0.10, 0.20))
    turn = trimesh.transformations.random_rotation_matrix(rand=np.array([0.1, 0.5, 0.9]))[:3, :3]
    turned = trimesh.Trimesh(box.vertices @ turn.T, box.faces, process=False)
    expected = turn @ solid_mass_properties(box, 1.0).inertia_kg_m2 @ turn.T
    assert solid_mass_properties(turned, 1.0).inertia_kg_m2 == pytest.approx(expected, abs=1e-12)


def _cup_parts(radius: float, height: float, wall: float) -> tuple[float, float, float]:
    """Return volume, height of the centre of mass, and Izz per mass of a cup from a tube and a disc."""
    inner = radius - wall
    tube, disc = np.pi * (radius**2 - inner**2) * (height - wall), np.pi * radius**2 * wall
    volume = tube + disc
    center = (tube * (wall + (height - wall) / 2) + disc * wall / 2) / volume
    about_axis = (tube * (radius**2 + inner**2) / 2 + disc * radius**2 / 2) / volume
    return volume, center, about_axis


def test_cup_with_both_walls_is_a_tube_on_a_disc() -> None:
    volume, center, about_axis = _cup_parts(0.040, 0.100, 0.003)
    found = solid_mass_properties(cup(0.040, 0.100, 0.003), 0.2)
    assert found.volume_m3 == pytest.approx(volume, rel=1e-3)
    assert found.center_of_mass_m[2] == pytest.approx(center, abs=1e-5)
    assert found.inertia_kg_m2[2, 2] == pytest.approx(0.2 * about_axis, rel=1e-3)


def test_outer_sheet_of_a_cup_as_a_shell_is_the_cup() -> None:
    radius, height, wall = 0.040, 0.100, 0.003
    sheet = trimesh.creation.revolve(np.array([(0, 0), (radius, 0), (radius, height)]), sections=256)
    faces = sheet.faces if sheet.face_normals[:, 2].min() < -0.9 else sheet.faces[:, ::-1]
    sheet = trimesh.Trimesh(sheet.vertices, faces, process=False)
    volume, center, about_axis = _cup_parts(radius, height, wall)
    found = shell_mass_properties(sheet, 0.2, wall)
    assert found.volume_m3 == pytest.approx(volume, rel=0.02)
    assert found.center_of_mass_m[2] == pytest.approx(center, abs=1e-3)
    assert found.inertia_kg_m2[2, 2] == pytest.approx(0.2 * about_axis, rel=0.02)


def test_closed_box_as_a_shell_is_the_box_less_its_inside() -> None:
    sides, wall, mass_kg = np.array([0.06, 0.16, 0.21]), 0.001, 0.4
    found = shell_mass_properties(trimesh.creation.box(sides), mass_kg, wall)
    outer, inner = np.prod(sides), np.prod(sides - 2 * wall)
    second = (outer * sides**2 - inner * (sides - 2 * wall) ** 2) / 12 / (outer - inner)
    assert found.volume_m3 == pytest.approx(outer - inner, rel=0.02)
    expected = mass_kg * (second.sum() - second)
    assert np.diag(found.inertia_kg_m2) == pytest.approx(expected, rel=1e-3)
