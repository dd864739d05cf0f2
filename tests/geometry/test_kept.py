import trimesh

from manitwin.geometry.cavity import find_opening
from manitwin.geometry.mesh_cache import cached_on_mesh


def test_made_once_while_the_mesh_stays_as_it_is() -> None:
    mesh, made = trimesh.creation.box(), list[float]()

    def volume() -> float:
        made.append(float(mesh.volume))
        return made[-1]

    assert cached_on_mesh(mesh, "volume", volume) == cached_on_mesh(mesh, "volume", volume) and len(made) == 1
    mesh.apply_scale(2.0)
    assert cached_on_mesh(mesh, "volume", volume) == 8 * made[0]
    mesh.vertices[:, 2] *= 3
    assert cached_on_mesh(mesh, "volume", volume) == 24 * made[0]


def test_copies_have_what_is_their_own() -> None:
    mesh = trimesh.creation.box()
    assert cached_on_mesh(mesh, "name", lambda: "first") == "first"
    assert cached_on_mesh(mesh.copy(), "name", lambda: "second") == "second"


def test_opening_is_found_anew_after_the_mesh_was_closed() -> None:
    cup = trimesh.creation.annulus(0.03, 0.04, 0.08)
    floor = trimesh.creation.cylinder(
        0.04, 0.005, transform=trimesh.transformations.translation_matrix([0, 0, -0.0425])
    )
    cup = trimesh.util.concatenate([cup, floor])
    opening = find_opening(cup)
    assert opening is not None and find_opening(cup) is opening
    cup.vertices = trimesh.creation.box([0.08, 0.08, 0.08]).vertices
    cup.faces = trimesh.creation.box().faces
    assert find_opening(cup) is None
