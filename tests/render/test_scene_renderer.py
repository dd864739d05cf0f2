"""Scenes against rays (Embree), shadows against geometry, colours against Lambert's law."""

from __future__ import annotations

import gc
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import trimesh

from manitwin.errors import UsageError
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.ray_caster import RayCaster
from manitwin.render import scene_renderer
from manitwin.render.cameras import Camera, look_at, pixel_rays, project
from manitwin.render.drawable import prepare_drawable
from manitwin.render.procedural_textures import ProceduralTexture, textured_box
from manitwin.render.raycast import cast_camera
from manitwin.render.scene_lighting import WHITE_PAPER, DirectionalLight, Lighting
from manitwin.render.scene_renderer import SceneRenderer, ShadowRegion, Surroundings
from manitwin.render.surfaces import plain_part, scene_shape

SIZE = 160
DIRECTION = np.array([0.6, 0.0, -0.8])
ONE_LIGHT = Lighting(np.full(3, 0.3), (DirectionalLight(DIRECTION, np.full(3, 2.0), casts_shadow=True),))


def cube(side_m: float) -> trimesh.Trimesh:
    return trimesh.creation.box([side_m] * 3)


def slab() -> trimesh.Trimesh:
    return trimesh.creation.box([1.2, 1.2, 0.04]).apply_translation([0, 0, -0.02])


THINGS = {
    "table": (slab(), np.eye(4)),
    "ball": (trimesh.creation.icosphere(4, 0.08), transform(translation=np.array([0.1, 0.15, 0.08]))),
    "ring": (trimesh.creation.torus(0.1, 0.03), transform(translation=np.array([-0.1, -0.2, 0.03]))),
    "cube": (
        cube(0.1),
        transform(trimesh.transformations.euler_matrix(0, 0, 0.4)[:3, :3], np.array([0.25, -0.1, 0.05])),
    ),
}


def camera(eye: list[float], target: list[float], size: int = SIZE, fov: float = 0.7) -> Camera:
    return Camera(look_at(np.array(eye), np.array(target)), fov, size, size)


CAMERAS = [camera([0.9, -0.3, 0.7], [0, 0, 0.03]), camera([0.1, -1.0, 0.4], [0, 0, 0.05])]


def filled(renderer: SceneRenderer, tolerance_m: float = 0.0) -> SceneRenderer:
    for name, (mesh, pose) in THINGS.items():
        renderer.add(name, prepare_drawable([plain_part(mesh, (200, 80, 40))], tolerance_m=tolerance_m), pose)
    return renderer


@pytest.fixture(scope="module")
def renderer() -> Iterator[SceneRenderer]:
    with SceneRenderer(surroundings=None) as made:
        yield filled(made)


def world_of(poses: dict[str, np.ndarray]) -> tuple[trimesh.Trimesh, np.ndarray]:
    """All things as one mesh, and the id of each face's thing."""
    meshes = [trimesh.Trimesh(transform_points(poses[name], m.vertices), m.faces) for name, (m, _) in THINGS.items()]
    owner = np.concatenate([np.full(len(mesh.faces), i + 1) for i, mesh in enumerate(meshes)])
    return trimesh.util.concatenate(meshes), owner


def assert_agrees_with_rays(renderer: SceneRenderer, poses: dict[str, np.ndarray]) -> None:
    mesh, owner = world_of(poses)
    caster = RayCaster(mesh)
    for view, frame in zip(CAMERAS, renderer.render(CAMERAS, geometry=True), strict=True):
        assert frame.depth_m is not None and frame.ids is not None and frame.normals is not None
        depth, normals, face = cast_camera(caster, view)
        expected = np.where(face >= 0, owner[face], 0)
        assert (frame.ids == expected).mean() > 0.9995
        same = (frame.ids == expected) & (expected > 0)
        assert np.quantile(np.abs(frame.depth_m - depth)[same], 0.999) < 2e-5
        assert ((frame.depth_m == 0) == (frame.ids == 0)).all()
        flat = same & np.isin(expected, (1, 4))  # table and cube: their shading normals are the faces' own
        np.testing.assert_allclose(frame.normals[flat], normals[flat], atol=1e-4)
        round_ones = same & np.isin(expected, (2, 3))
        cosine = (frame.normals * normals).sum(-1)[round_ones]
        assert np.quantile(cosine, 0.01) > np.cos(np.deg2rad(12))


def test_depth_normals_and_ids_are_those_of_rays(renderer: SceneRenderer) -> None:
    assert renderer.ids == {"table": 1, "ball": 2, "ring": 3, "cube": 4}
    assert_agrees_with_rays(renderer, {name: pose for name, (_, pose) in THINGS.items()})


def test_moved_things_are_drawn_where_they_are(renderer: SceneRenderer) -> None:
    poses = {name: pose for name, (_, pose) in THINGS.items()}
    for step in (0.0, 0.1):
        poses["cube"] = transform(
            trimesh.transformations.euler_matrix(0.3, 0.2, step)[:3, :3], np.array([0.3 - step, 0.2, 0.15])
        )
        renderer.set_pose("cube", poses["cube"])
        assert_agrees_with_rays(renderer, poses)
    renderer.set_pose("cube", THINGS["cube"][1])


def test_same_scene_gives_the_same_bytes_and_several_cameras_do_not_disturb_each_other(renderer: SceneRenderer) -> None:
    both = renderer.render(CAMERAS, geometry=True)
    alone = [renderer.render([view], geometry=True)[0] for view in CAMERAS]
    with SceneRenderer(surroundings=None) as other:
        fresh = filled(other).render(CAMERAS, geometry=True)
    for a, b, c in zip(both, alone, fresh, strict=True):
        for name in ("rgb", "depth_m", "normals", "ids"):
            assert getattr(a, name).tobytes() == getattr(b, name).tobytes() == getattr(c, name).tobytes()


def test_geometry_is_left_out_where_it_is_not_asked_for(renderer: SceneRenderer) -> None:
    frame = renderer.render(CAMERAS[:1])[0]
    assert frame.rgb.shape == (SIZE, SIZE, 3) and frame.rgb.dtype == np.uint8
    assert frame.depth_m is None and frame.ids is None and frame.normals is None


def test_nothing_shows_the_backdrop_and_has_no_depth() -> None:
    up = camera([0, 0, 0.5], [1.0, 0, 1.5])
    with SceneRenderer(surroundings=Surroundings(backdrop=(10, 120, 240))) as made:
        frame = made.render([up], geometry=True)[0]
    assert (frame.rgb == (10, 120, 240)).all()
    assert frame.depth_m is not None and (frame.depth_m == 0).all()


def test_floor_has_depth_and_the_id_of_nothing() -> None:
    down = camera([0, 0, 1.0], [0, 0, 0])
    with SceneRenderer(surroundings=Surroundings(floor_z_m=-0.5)) as made:
        frame = made.render([down], geometry=True)[0]
    assert frame.depth_m is not None and frame.ids is not None
    np.testing.assert_allclose(frame.depth_m, 1.5, atol=1e-5)
    assert (frame.ids == 0).all()


def lit_table(
    things: list[tuple[trimesh.Trimesh, np.ndarray]], lighting: Lighting = ONE_LIGHT, **kind: float
) -> np.ndarray:
    """The linear picture, straight from above, of a white table with things on it."""
    view = camera([0.0, 0.0, 1.5], [0, 0, 0], size=256, fov=0.8)
    with SceneRenderer(lighting, surroundings=None) as made:
        made.add("table", [plain_part(slab(), (255, 255, 255), roughness=1.0)])
        for index, (mesh, pose) in enumerate(things):
            made.add(str(index), prepare_drawable([plain_part(mesh, (255, 255, 255))], **kind), pose)
        rgb = made.render([view])[0].rgb
    return (rgb.astype(float) / 255) ** 2.2


def at(picture: np.ndarray, x_m: float, y_m: float) -> float:
    """The picture's value at a point of the table."""
    view = camera([0.0, 0.0, 1.5], [0, 0, 0], size=256, fov=0.8)
    (column, row), _ = (value[0] for value in project(np.array([[x_m, y_m, 0.0]]), view))
    return float(picture[int(row), int(column)].mean())


def compressed(linear: float) -> float:
    return linear if linear <= 0.7 else 1 - 0.3 * np.exp((0.7 - linear) / 0.3)


def test_level_white_paper_has_the_exposure_that_was_promised() -> None:
    picture = lit_table([])
    assert at(picture, 0.0, 0.0) == pytest.approx(compressed(WHITE_PAPER * 1.0), abs=0.05)
    dim = Lighting(
        ONE_LIGHT.ambient / 7, (DirectionalLight(DIRECTION, ONE_LIGHT.lights[0].color / 7, casts_shadow=True),)
    )
    np.testing.assert_allclose(lit_table([], dim), picture, atol=0.01)


@pytest.mark.parametrize("tolerance_m", [0.0, 0.0004])
def test_shadow_is_where_the_light_does_not_come(tolerance_m: float) -> None:
    """A cube of 0.1 m on the table under light that falls at 3 : 4 along x: its shadow is 0.075 m long."""
    picture = lit_table([(cube(0.1), transform(translation=np.array([0, 0, 0.05])))], tolerance_m=tolerance_m)
    open_table = at(picture, -0.4, -0.3)
    ambient, key = 0.3, 2.0 * 0.8 / np.pi
    left = WHITE_PAPER * ambient / (ambient + key)  # the ambient light, a part of it hidden
    assert 0.75 * left < at(picture, 0.05 + 0.055, 0.0) < left
    assert at(picture, 0.05 + 0.075 + 0.03, 0.0) > 0.85 * open_table
    assert at(picture, -0.05 - 0.06, 0.0) > 0.8 * open_table
    assert at(picture, 0.055, 0.0) < 0.5 * open_table  # right at the foot: no light leaks in


def test_only_the_light_that_casts_shadows_does() -> None:
    second = DirectionalLight(np.array([-0.6, 0.0, -0.8]), np.full(3, 2.0))
    lighting = Lighting(np.full(3, 0.3), (second, *ONE_LIGHT.lights))
    box = [(cube(0.1), transform(translation=np.array([0, 0, 0.2])))]  # in the air: it hides little of the sky
    picture = lit_table(box, lighting)
    shift = 0.2 * 0.6 / 0.8
    assert at(picture, shift, 0.0) < 0.75 * at(picture, -0.45, 0.4)
    assert at(picture, -shift, 0.0) > 0.9 * at(picture, -0.45, 0.4)


def test_sky_is_hidden_near_walls_and_not_far_from_them() -> None:
    ambient_only = Lighting(np.full(3, 0.5), ())
    picture = lit_table([(cube(0.1), transform(translation=np.array([0, 0, 0.05])))], ambient_only)
    far = at(picture, -0.45, -0.45)
    assert at(picture, 0.057, 0.0) < compressed(0.75 * WHITE_PAPER)  # of a long wall half would be hidden
    assert at(picture, 0.057, 0.0) < at(picture, 0.09, 0.0) < at(picture, 0.13, 0.0)
    assert at(picture, 0.3, 0.0) == pytest.approx(far, rel=0.03)


def test_simplified_things_look_alike() -> None:
    pictures = []
    for tolerance_m in (0.0, 0.0004):
        with SceneRenderer() as made:
            pictures.append(filled(made, tolerance_m).render(CAMERAS, geometry=True))
    for full, lean in zip(*pictures, strict=True):
        assert full.ids is not None and lean.ids is not None
        assert (full.ids == lean.ids).mean() > 0.995
        assert np.abs(full.rgb.astype(int) - lean.rgb).mean() < 0.5


def test_texture_lies_the_right_way_up_on_a_box() -> None:
    """Red where u < 0.5, and the upper half (v > 0.5) brighter: seen from above u runs along +X, v along +Y."""
    color = np.zeros((64, 64, 3), np.uint8)
    color[:, :32, 0], color[:, 32:, 2] = 120, 120
    color[:32] *= 2
    texture = ProceduralTexture(color, np.full((64, 64), 255, np.uint8), 0.0, 0.4)
    part = textured_box(np.array([0.2, 0.2, 0.02]), texture, offset_m=(0.2, 0.2))
    view = camera([0, 0, 1.0], [0, 0, 0], size=64, fov=0.45)
    with SceneRenderer(surroundings=None) as made:
        made.add("box", [part])
        rgb = made.render([view])[0].rgb.astype(int)
    upper_left, upper_right, lower_left, lower_right = rgb[20, 20], rgb[20, 44], rgb[44, 20], rgb[44, 44]
    assert upper_left[0] > lower_left[0] > lower_left[2]
    assert upper_right[2] > lower_right[2] > lower_right[0]


@pytest.mark.parametrize("side_px", [64, 16])
def test_roughness_of_a_textured_thing_is_that_of_its_map(side_px: int) -> None:
    """A mirror's lamp, seen where it is reflected: bright on the smooth half, dim on the rough one; also of a smaller map."""
    lamp = Lighting(np.full(3, 0.05), (DirectionalLight(np.array([0.0, 0.0, -1.0]), np.full(3, 1.0)),))
    rough = np.full((side_px, side_px), 230, np.uint8)
    rough[:, : side_px // 2] = 40
    texture = ProceduralTexture(np.full((64, 64, 3), 40, np.uint8), rough, 0.0, 0.4)
    with SceneRenderer(lamp, surroundings=None) as made:
        made.add("box", [textured_box(np.array([0.2, 0.2, 0.02]), texture, offset_m=(0.2, 0.2))])
        rgb = made.render([camera([0, 0, 3.0], [0, 0, 0], size=64, fov=0.15)])[0].rgb.astype(int)
    assert rgb[32, 20].mean() > rgb[32, 44].mean() + 40


def test_region_of_shadows_has_texels_for_the_picture() -> None:
    assert [ShadowRegion().for_pictures_of(px).map_px for px in (64, 256, 1000)] == [160, 640, 1024]


def test_name_can_be_given_once(renderer: SceneRenderer) -> None:
    with pytest.raises(UsageError, match="'ball' already"):
        renderer.add("ball", [plain_part(cube(0.1), (1, 2, 3))])


def test_process_ends_well_with_a_scene_left_open() -> None:
    program = """
import trimesh
from manitwin.render.cameras import Camera, look_at
from manitwin.render.scene_renderer import SceneRenderer
from manitwin.render.surfaces import plain_part
import numpy as np
scene = SceneRenderer()
scene.add("box", [plain_part(trimesh.creation.box([0.1] * 3), (200, 80, 40))])
print(scene.render([Camera(look_at(np.ones(3), np.zeros(3)), 0.5, 16, 16)])[0].rgb.mean() > 0)
"""
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", program], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout.strip()) == (0, "True"), done.stderr


def test_too_many_lights_are_refused() -> None:
    two = (ONE_LIGHT.lights[0], DirectionalLight(np.array([0.0, 0.1, -1.0]), np.ones(3), casts_shadow=True))
    with pytest.raises(UsageError, match="one at most casts shadows"):
        SceneRenderer(Lighting(np.ones(3), two))
    with pytest.raises(UsageError, match="at most 5"):
        SceneRenderer(Lighting(np.ones(3), (DirectionalLight(DIRECTION, np.ones(3)),) * 6))


def test_pixel_rays_meet_the_table_at_the_drawn_depth(renderer: SceneRenderer) -> None:
    """Closed form: a ray's parameter at the plane z = 0 is the depth."""
    frame = renderer.render(CAMERAS[:1], geometry=True)[0]
    assert frame.depth_m is not None and frame.ids is not None and frame.normals is not None
    origins, directions = pixel_rays(CAMERAS[0])
    top = (frame.ids == 1) & (frame.normals[..., 2] > 0.99)
    expected = (-origins[:, 2] / directions[:, 2]).reshape(SIZE, SIZE)
    assert top.sum() > 5000
    np.testing.assert_allclose(frame.depth_m[top], expected[top], atol=1e-5)


def test_thing_that_is_shown_again_is_uploaded_once_and_looks_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def counted(*arguments: Any, **options: Any) -> Any:
        made.append(arguments)
        return scene_shape(*arguments, **options)

    monkeypatch.setattr(scene_renderer, "scene_shape", counted)
    thing = prepare_drawable([plain_part(THINGS["ring"][0], (200, 80, 40))])
    frames = []
    for _ in range(2):
        with SceneRenderer(ONE_LIGHT, surroundings=None) as renderer:
            renderer.add("ring", thing)
            renderer.add("another", thing, transform(translation=np.array([0.1, 0.3, 0])))
            frames.append(renderer.render(CAMERAS, geometry=True))
    assert len(made) == 2  # what is seen, and what throws the shadow
    for first, second in zip(*frames, strict=True):
        assert np.array_equal(first.rgb, second.rgb) and np.array_equal(first.ids, second.ids)
        assert set(np.unique(first.ids)) == {0, 1, 2}


def test_what_was_uploaded_goes_with_the_thing() -> None:
    thing = prepare_drawable([plain_part(THINGS["ball"][0], (200, 80, 40))])
    with SceneRenderer(ONE_LIGHT) as renderer:
        renderer.add("ball", thing)
    assert thing in scene_renderer._shapes
    before = len(scene_renderer._shapes)
    del thing
    gc.collect()
    assert len(scene_renderer._shapes) < before


def test_edge_shows_the_share_of_each_pixel_that_lies_within_it() -> None:
    """A bright, level square on black, turned by 20 degrees: what its picture adds up to is its area in pixels."""
    turned = transform(trimesh.transformations.euler_matrix(0, 0, np.deg2rad(20))[:3, :3])
    square = trimesh.creation.box([0.3, 0.3, 0.002])
    view = camera([0.0, 0.0, 1.001], [0, 0, 0], size=64, fov=0.5)
    with SceneRenderer(Lighting(np.full(3, 0.5), ()), surroundings=Surroundings(-50, backdrop=(0, 0, 0))) as made:
        made.add("square", [plain_part(square, (255, 255, 255), roughness=1.0)], turned)
        rgb = made.render([view])[0].rgb.astype(float)
    share = rgb[..., 1] / rgb[32, 32, 1]
    side_px = 0.3 / 1.0 / np.tan(0.25) * 32
    assert share.sum() == pytest.approx(side_px**2, rel=0.01)
    between = share[(share > 0.02) & (share < 0.98)]
    assert len(np.unique(np.round(4 * between))) == 3  # a quarter, a half and three quarters


def test_pixel_of_a_texture_shows_the_mean_of_what_lies_within_it() -> None:
    """Stripes of a sample's width, half of them black: gamma-encoded they would be darker than the mean of their light."""
    color = np.zeros((128, 128, 3), np.uint8)
    color[:, ::2] = 255
    texture = ProceduralTexture(color, np.full((128, 128), 255, np.uint8), 0.0, 0.5)
    plain = ProceduralTexture(np.full((128, 128, 3), 188, np.uint8), texture.roughness, 0.0, 0.5)  # half the light
    shown = []
    for each in (texture, plain):
        with SceneRenderer(Lighting(np.full(3, 0.5), ()), surroundings=None) as made:
            made.add("box", [textured_box(np.array([0.25, 0.25, 0.002]), each)])
            shown.append(made.render([camera([0, 0, 1.0], [0, 0, 0], size=64, fov=0.5)])[0].rgb[24:40, 28:36].mean())
    assert shown[0] == pytest.approx(shown[1], rel=0.1)
