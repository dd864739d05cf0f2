"""The rasteriser against rays (Embree) and against colours that are known."""

from __future__ import annotations

import hashlib
import subprocess
import sys

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.formats.meshes.textures import make_part, pbr_material
from manitwin.geometry.ray_caster import RayCaster
from manitwin.render.cameras import Camera, framing_camera, look_at, orbit_cameras, project
from manitwin.render.raycast import cast_camera, merge_parts
from manitwin.render.renderer import BACKDROP, Renderer, max_pixels_per_unit, shared_renderer
from manitwin.render.surfaces import plain_part

DIGEST = """
import hashlib
import trimesh
from manitwin.render.cameras import orbit_cameras
from manitwin.render.renderer import shared_renderer
from manitwin.render.surfaces import plain_part
part = plain_part(trimesh.creation.torus(0.04, 0.015), (200, 80, 40))
frame = shared_renderer().render([part], orbit_cameras(part.vertices, fov_y_deg=30.0, size_px=96)[3:4])[0]
print(hashlib.sha256(frame.rgb.tobytes() + frame.depth.tobytes()).hexdigest())
"""


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return shared_renderer()


def scene() -> list[trimesh.Trimesh]:
    ring = trimesh.creation.torus(0.04, 0.012)
    ball = trimesh.creation.icosphere(4, 0.02).apply_translation([0.05, 0.02, 0.03])
    box = trimesh.creation.box([0.03, 0.05, 0.02]).apply_translation([-0.03, 0.0, 0.04])
    return [plain_part(mesh, (200, 80, 40)) for mesh in (ring, ball, box)]


def quad(colors: np.ndarray, **material: object) -> trimesh.Trimesh:
    """A square in the plane y = 0 that faces -Y, its texture's first row at the top."""
    vertices = np.array([[-1.0, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]) * 0.1
    uv = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    texture = Image.fromarray(colors.astype(np.uint8))
    return make_part(
        vertices,
        np.array([[0, 1, 2], [0, 2, 3]]),
        material=pbr_material(base_color_texture=texture, **material),  # type: ignore[arg-type]
        name="quad",
        uv=uv,
    )


def front_camera(distance: float = 1.0, size: int = 64) -> Camera:
    return Camera(look_at(np.array([0.0, -distance, 0.0]), np.zeros(3)), np.deg2rad(15.0), size, size)


@pytest.mark.parametrize("supersample", [1, 2])
def test_depth_and_mask_are_those_of_rays(renderer: Renderer, supersample: int) -> None:
    parts = scene()
    whole = merge_parts(parts)
    for camera in orbit_cameras(whole.vertices, fov_y_deg=30.0, size_px=160)[:4]:
        frame = renderer.render(parts, [camera], supersample=supersample)[0]
        depth, _, face = cast_camera(RayCaster(whole), camera)
        hit, drawn = face >= 0, frame.depth > 0
        error_m = np.abs(depth - frame.depth)[hit & drawn]
        assert (frame.depth[frame.coverage < 0.5] == 0).all()
        assert abs(frame.coverage.sum() - hit.sum()) < 0.005 * hit.sum()
        if supersample == 1:
            assert (hit == drawn).mean() > 0.9995
            assert np.quantile(error_m, 0.999) < 2e-5
        else:  # what is at the centre is not sampled itself: edges and creases are off
            assert (hit == drawn).mean() > 0.99
            assert np.median(error_m) < 1e-6
            assert np.quantile(error_m, 0.95) < 2e-4


def test_projection_meets_the_picture_within_a_pixel(renderer: Renderer) -> None:
    parts = scene()
    points = np.concatenate([part.vertices for part in parts])
    for camera in orbit_cameras(points, fov_y_deg=30.0, size_px=200):
        y, x = np.nonzero(renderer.render(parts, [camera])[0].coverage > 0)
        pixels, _ = project(points, camera)
        assert np.abs(pixels.min(0) - [x.min(), y.min()]).max() < 1
        assert np.abs(pixels.max(0) - [x.max() + 1, y.max() + 1]).max() < 1


def test_texture_is_upright(renderer: Renderer) -> None:
    colors = np.zeros((64, 64, 3))
    colors[:32, :32], colors[:32, 32:], colors[32:, :32] = (220, 30, 30), (30, 220, 30), (30, 30, 220)
    rgb = renderer.render([quad(colors)], [front_camera()])[0].rgb.astype(int)
    assert rgb[20, 20].argmax() == 0
    assert rgb[20, 44].argmax() == 1
    assert rgb[44, 20].argmax() == 2
    assert rgb[44, 44].max() < 60


def test_colour_factor_tints_the_texture(renderer: Renderer) -> None:
    white = np.full((8, 8, 3), 255)
    plain = renderer.render([quad(white)], [front_camera()])[0].rgb[32, 32].astype(int)
    tinted = (
        renderer.render([quad(white, base_color=(1.0, 0.5, 0.1, 1.0))], [front_camera()])[0].rgb[32, 32].astype(int)
    )
    assert tinted[0] == pytest.approx(plain[0], abs=2)
    assert plain[1] * 0.65 < tinted[1] < plain[1] * 0.85  # half the light is 0.73 of the sRGB value
    assert tinted[2] < plain[2] * 0.5


def test_white_paper_is_exposed_bright_but_not_clipped(renderer: Renderer) -> None:
    rgb = renderer.render([quad(np.full((8, 8, 3), 255))], [front_camera()])[0].rgb[32, 32]
    assert 225 < rgb.min() <= rgb.max() < 255


def test_open_sheet_is_seen_from_both_sides(renderer: Renderer) -> None:
    sheet = quad(np.full((8, 8, 3), 200))
    behind = Camera(look_at(np.array([0.0, 1.0, 0.0]), np.zeros(3)), np.deg2rad(15.0), 64, 64)
    front, back = renderer.render([sheet], [front_camera(), behind])
    assert front.coverage.sum() == pytest.approx(back.coverage.sum(), rel=0.02)
    assert back.rgb[32, 32].min() > 120


def test_background_is_exact_where_nothing_is(renderer: Renderer) -> None:
    frame = renderer.render(scene(), [front_camera()], background=(10, 200, 30))[0]
    assert (frame.rgb[frame.coverage == 0] == (10, 200, 30)).all()
    assert (renderer.render(scene(), [front_camera()])[0].rgb[0, 0] == BACKDROP).all()


def test_scale_of_the_object_changes_nothing_but_depth(renderer: Renderer) -> None:
    mesh = trimesh.creation.torus(0.04, 0.015)
    camera = framing_camera(mesh.vertices, azimuth_deg=30, elevation_deg=40, fov_y_deg=30, width_px=96, height_px=96)
    large = mesh.copy().apply_scale(100.0)
    a = renderer.render([plain_part(mesh, (200, 80, 40))], [camera])[0]
    b = renderer.render([plain_part(large, (200, 80, 40))], [camera.scaled(100.0)])[0]
    assert np.abs(a.rgb.astype(int) - b.rgb).max() <= 3
    assert b.depth == pytest.approx(100 * a.depth, rel=1e-4, abs=1e-3)


def test_another_process_draws_the_same_bytes(renderer: Renderer) -> None:
    part = plain_part(trimesh.creation.torus(0.04, 0.015), (200, 80, 40))
    camera = orbit_cameras(part.vertices, fov_y_deg=30.0, size_px=96)[3]
    renderer.render(scene(), [front_camera()])  # what was drawn before leaves no trace
    frame = renderer.render([part], [camera])[0]
    here = hashlib.sha256(frame.rgb.tobytes() + frame.depth.tobytes()).hexdigest()
    done = subprocess.run([sys.executable, "-c", DIGEST], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr  # also: no crash at the end of the process
    assert done.stdout.strip() == here


def test_the_camera_of_a_size_that_is_not_drawn_any_more_is_given_up(renderer: Renderer) -> None:
    part = plain_part(trimesh.creation.torus(0.04, 0.015), (200, 80, 40))
    before = renderer.render([part], [front_camera()])[0]
    there = len(renderer._scene.entities)
    for width in range(400, 480, 8):  # each twice that each way: 8 million pixels in all
        renderer.render([part], [Camera(front_camera().camera_to_object, 0.5, width, 456)])
    assert len(renderer._scene.entities) == there
    np.testing.assert_array_equal(renderer.render([part], [front_camera()])[0].rgb, before.rgb)


def test_textures_are_let_go_with_the_pictures_that_they_were_for(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[str] = []
    let_go = renderer._let_go
    monkeypatch.setattr(renderer, "_let_go", lambda: (drawn.append("nothing"), let_go()))
    before = renderer.render([quad(np.full((8, 8, 3), 200))], [front_camera()])[0]
    assert drawn == ["nothing"]
    renderer.render([plain_part(trimesh.creation.torus(0.04, 0.015), (200, 80, 40))], [front_camera()])
    assert drawn == ["nothing"], "what has no texture takes little"
    np.testing.assert_array_equal(renderer.render([quad(np.full((8, 8, 3), 200))], [front_camera()])[0].rgb, before.rgb)


def test_the_nearest_camera_says_how_fine_a_texture_is_seen() -> None:
    near, far = (Camera(look_at(np.array([d, 0, 0]), np.zeros(3)), np.radians(40), 256, 256) for d in (0.5, 2.0))
    of_far = 256 / 2.0 / (2 * np.tan(np.radians(40) / 2))
    assert max_pixels_per_unit([far], np.zeros(3), 0.1) == pytest.approx(of_far)
    assert max_pixels_per_unit([far, near], np.zeros(3), 0.1) == pytest.approx(4 * of_far)


def test_fine_textures_are_averaged_for_small_pictures(renderer: Renderer) -> None:
    stripes = np.zeros((2048, 2048, 3), np.uint8)
    stripes[:, ::2] = 200
    picture = renderer.render([quad(stripes)], [front_camera()])[0].rgb
    middle = picture[
        picture.shape[0] // 2 - 8 : picture.shape[0] // 2 + 8, picture.shape[1] // 2 - 8 : picture.shape[1] // 2 + 8
    ]
    assert np.ptp(middle.astype(int).mean(axis=2)) <= 10, (
        "an even grey: no moire of stripes of 200 finer than its pixels"
    )
