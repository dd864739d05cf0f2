"""Where the rules of collision shapes fire, and what they leave alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from broken_mugs import BROKEN, box, codes, errors, one_concave_mesh
from made_mug import clean, moved, shape, textured

from manitwin.assets.asset import Asset, Inertial
from manitwin.assets.audit.check import audit_asset, audit_path
from manitwin.assets.audit.engine_shapes import A_HULL_EACH_GROUP, ONE_HULL, TRIANGLES
from manitwin.assets.audit.rules import RULES, RULES_BY_CODE
from manitwin.assets.audit.run import TAKEN_BY, audit_assets
from manitwin.errors import UsageError


def test_the_corners_of_hulls_are_counted_and_not_those_of_meshes() -> None:
    asset = clean()
    shape = asset.collision[0]
    extra = shape.vertices.mean(0) + 1e-4 * np.random.default_rng(0).normal(size=(1000, 3))
    dense = replace(shape, vertices=np.concatenate([shape.vertices, extra]))
    found = audit_asset(replace(asset, collision=(dense, *asset.collision[1:])), RULES)
    assert "COL007" not in {finding.code for finding in found}
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.02)
    round_one = replace(
        shape, vertices=np.asarray(ball.vertices) + shape.vertices.mean(0), faces=np.asarray(ball.faces)
    )
    found = audit_asset(replace(asset, collision=(*asset.collision, round_one)), RULES)
    assert "COL007" in {finding.code for finding in found}


def test_the_shape_of_what_lacks_a_mesh_is_not_judged() -> None:
    half = replace(
        clean(), visual=(textured(box((0.01, 0.01, 0.01), (0, 0, 0))),), rests=(), missing_files=("mug.dae",)
    )
    assert errors(audit_asset(half, RULES)) == {"FIL002"}
    assert "COM002" in errors(audit_asset(replace(half, missing_files=("paint.png",)), RULES))
    unweighed = replace(half, inertial=Inertial())  # of a density, say: without the mesh there is no mass to tell
    assert "MAS001" not in codes(audit_asset(unweighed, RULES))


def test_a_mark_that_shows_a_goal_is_no_obstacle_and_a_mass_of_zero_is_one_finding() -> None:
    for name, found in (("milk", True), ("milk-visual", False), ("goal_marker", False)):
        asset = replace(clean(), name=name, path=Path(f"{name}.xml"), category=None, collision=(), grasps=(), frames=())
        assert ("COL001" in codes(audit_asset(asset, RULES))) == found, name
    weightless = replace(moved(clean(), np.array([0, 0, 0.05])), inertial=Inertial(0.0, np.zeros(3), np.zeros((3, 3))))
    assert codes(audit_asset(weightless, RULES)) & {"MAS002", "INE002", "COM003"} == {"MAS002"}
    template = replace(weightless, inertial=Inertial(0.0, None, np.eye(3)), collision=())
    assert codes(audit_asset(template, RULES)) & {"MAS002", "INE004", "COL001"} == {"MAS002"}


def test_a_frame_around_a_picture_is_no_vessel_and_a_box_on_its_side_is_one() -> None:
    def opened(depth_m: float) -> Asset:
        outer, inner = box((0.02 + depth_m, 0.4, 0.4), (0, 0, 0.2)), box((depth_m, 0.36, 0.36), (0.01, 0, 0.2))
        wall = trimesh.boolean.difference([outer, inner], engine="manifold")
        return replace(
            clean(), name="thing", category=None, captions=(), frames=(), grasps=(), rests=(),
            visual=(textured(wall),), collision=(shape("hull", np.asarray(outer.vertices)),),
        )  # fmt: skip

    assert "COL003" not in codes(audit_asset(opened(0.05), RULES))
    assert "COL003" in codes(audit_asset(opened(0.3), RULES))
    assert "COL003" not in codes(audit_asset(replace(opened(0.3), partial=True), RULES))
    cupboard = codes(audit_asset(replace(opened(0.3), up="y"), RULES))
    assert "SCL003" not in codes(audit_asset(replace(opened(0.3), up="y", static=True), RULES)), cupboard


def test_a_ball_is_a_primitive_however_finely_it_is_drawn(tmp_path: Path) -> None:
    in_urdf = '<collision><geometry><sphere radius="0.02"/></geometry></collision>'
    in_sdf = '<collision name="c"><geometry><sphere><radius>0.02</radius></sphere></geometry></collision>'
    for text, name in (
        ('<mujoco><worldbody><body><freejoint/><geom size="0.02"/></body></worldbody></mujoco>', "ball.xml"),
        (f'<robot name="ball"><link name="l">{in_urdf}</link></robot>', "ball.urdf"),
        (f'<sdf version="1.9"><model name="ball"><link name="l">{in_sdf}</link></model></sdf>', "ball.sdf"),
    ):
        (tmp_path / name).write_text(text)
        assert "COL007" not in codes(audit_path(tmp_path / name, RULES).findings), name


def test_groups_of_an_obj_are_hulls_of_their_own_where_the_engine_makes_them_so(tmp_path: Path) -> None:
    """Two boxes apart in one file: PyBullet makes two hulls of them, MuJoCo one that fills the gap."""
    lines, count = [], 0
    for number, x in enumerate((-0.1, 0.1)):
        piece = box((0.04, 0.2, 0.2), (x, 0, 0))
        lines += [f"o piece_{number}", *(f"v {a} {b} {c}" for a, b, c in piece.vertices)]
        lines += [f"f {a} {b} {c}" for a, b, c in piece.faces + 1 + count]
        count += len(piece.vertices)
    (tmp_path / "gap.obj").write_text("\n".join(lines))
    mesh = '<geometry><mesh filename="gap.obj" scale="1 1 0.5"/></geometry>'
    path = tmp_path / "gap.urdf"
    path.write_text(
        f'<robot name="thing"><link name="l"><visual>{mesh}</visual><collision>{mesh}</collision></link></robot>'
    )

    def found(engine: str | None) -> set[str]:
        return codes(audit_path(path, RULES, engine=engine).findings) & {"COL002", "COL003", "COL004", "COL005"}

    assert found(None) == found("pybullet") == found("gazebo") == set()
    faces = "\n".join(line for line in lines if not line.startswith("o ")).replace("f ", "o face\nf ")
    (tmp_path / "faces.obj").write_text(faces)  # a group for every face is no decomposition
    path.write_text(path.read_text().replace("gap.obj", "faces.obj"))
    assert found(None) == {"COL004"}
    path.write_text(path.read_text().replace("faces.obj", "gap.obj"))
    assert found("mujoco") == found("sapien") == found("physx") == {"COL004"}
    assert {*ONE_HULL, *A_HULL_EACH_GROUP, *TRIANGLES} == set(TAKEN_BY)
    with pytest.raises(UsageError, match="mujoco"):
        audit_assets([path], engine="mujuco")


def test_concave_meshes_of_sdf_count_as_they_are_drawn_unless_an_engine_is_named() -> None:
    def mesh(asset: Asset) -> Asset:
        return replace(
            one_concave_mesh(asset),
            format="sdf",
            collision=(replace(one_concave_mesh(asset).collision[0], convex=True),),
        )

    about_collision = {code for code in RULES_BY_CODE if code.startswith("COL")}
    assert codes(audit_asset(mesh(clean()), RULES)) & about_collision == set()
    assert "COL003" in codes(audit_asset(mesh(clean()), RULES, engine="mujoco"))
    filled = replace(BROKEN["COL003"](clean()), format="sdf")
    assert "COL003" in codes(audit_asset(filled, RULES)), "convex pieces are what they are"


def test_of_what_stands_fast_it_is_meant_that_only_a_part_collides() -> None:
    legs = replace(clean(), visual=(*clean().visual, textured(box((0.01, 0.01, 0.5), (0.04, 0.04, -0.25)))))
    assert "COL002" in codes(audit_asset(legs, RULES))
    assert not {c for c in codes(audit_asset(replace(legs, static=True), RULES)) if c.startswith("COL")}


def test_a_bore_that_no_pencil_fits_into_is_no_opening() -> None:
    def tube(bore_m: float) -> Asset:
        outer, inner = box((0.03, 0.03, 0.2), (0, 0, 0.1)), box((bore_m, bore_m, 0.19), (0, 0, 0.11))
        mesh = trimesh.boolean.difference([outer, inner], engine="manifold")
        return replace(
            clean(), visual=(textured(mesh),), collision=(shape("hull", np.asarray(outer.vertices)),), frames=()
        )

    assert "COL003" in codes(audit_asset(tube(0.018), RULES))
    assert "COL003" not in codes(audit_asset(tube(0.008), RULES))


def test_the_ground_may_be_a_slab_under_what_is_seen_and_walls_enclose_air() -> None:
    asset = clean()
    wider = replace(asset, collision=(shape("slab", np.asarray(trimesh.creation.box((3, 3, 1)).vertices)),))
    assert "COL002" in codes(audit_asset(wider, RULES))
    ground = replace(wider, inertial=replace(wider.inertial, mass_kg=0.0))
    assert "COL002" not in codes(audit_asset(ground, RULES))
    sides = [trimesh.creation.box((0.02, 4, 3)), trimesh.creation.box((0.02, 4, 3))]
    sides[1].apply_translation((4, 0, 0))
    walls = tuple(shape(f"wall_{n}", np.asarray(side.vertices)) for n, side in enumerate(sides))
    room = replace(asset, name="room", category=None, visual=tuple(map(textured, sides)), collision=walls)
    said = codes(audit_asset(replace(room, inertial=Inertial(10.0)), RULES))
    assert "SCL001" not in said, "10 kg in 0.5 m3, which enclose 48 m3 of air"
    assert "SCL001" in codes(audit_asset(replace(room, inertial=Inertial(0.1)), RULES))
