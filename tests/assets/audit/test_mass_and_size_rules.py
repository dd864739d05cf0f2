"""Where the rules of mass, size and friction fire, and what they leave alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import trimesh
from broken_mugs import box, codes, errors, with_contact, with_inertial
from made_mug import clean, scaled, shape, textured

from manitwin.assets.asset import Contact, Inertial
from manitwin.assets.audit.check import audit_asset
from manitwin.assets.audit.rules import RULES


def test_a_mass_alone_is_one_finding() -> None:
    found = audit_asset(with_inertial(inertia_kg_m2=None, center_of_mass_m=None)(clean()), RULES)
    assert [finding.code for finding in found] == ["INE001"] and "no centre of mass" in found[0].message
    of_mujoco = replace(with_inertial(inertia_kg_m2=None, center_of_mass_m=None)(clean()), format="mjcf")
    assert not {"INE001", "COM001"} & {finding.code for finding in audit_asset(of_mujoco, RULES)}


def test_what_stands_fast_is_asked_for_no_mass_and_judged_by_no_hand() -> None:
    static = replace(scaled(clean(), 100), static=True, inertial=Inertial(), contact=Contact())
    codes = {finding.code for finding in audit_asset(static, RULES)}
    assert not codes & {"MAS001", "SCL001", "COL003", "COL004", "FRI001"}
    wrong = replace(clean(), static=True, collision=(), inertial=Inertial(0.0, np.full(3, 9.0), -np.eye(3)))
    assert errors(audit_asset(wrong, RULES)) == set()


def test_a_size_is_wrong_where_its_own_mass_says_so() -> None:
    """A rail of 4 m that weighs as a rail does is none of a hand's things, and not wrong."""

    def long(sides: tuple[float, float, float], mass_kg: float | None, name: str = "rail") -> set[str]:
        mesh = box(sides, (0, 0, sides[2] / 2))
        return codes(
            audit_asset(
                replace(
                    clean(), name=name, category=None, captions=(), visual=(textured(mesh),), frames=(), grasps=(), rests=(),
                    collision=(shape("rail", np.asarray(mesh.vertices)),), inertial=Inertial(mass_kg),
                ),
                RULES,
            )
        )  # fmt: skip

    assert "SCL001" not in long((4.0, 0.2, 0.2), 30.0)
    assert "SCL001" in long((4.0, 4.0, 2.0), 30.0)  # lighter than 32 m3 of air
    assert "SCL001" not in long((4.0, 0.2, 0.2), None) and "SCL001" in long((40.0, 2.0, 2.0), None)
    assert "SCL001" not in long((40.0, 2.0, 2.0), 0.0)  # a scene of Bullet's
    assert "SCL001" in long((2.1, 1.6, 0.4), 1.0) and "SCL001" not in long((2.1, 1.6, 0.4), 1.0, "quilt")
    assert "SCL001" not in long((0.002, 0.002, 0.001), 1e-5) and "SCL001" in long((8e-5, 8e-5, 8e-5), 0.3)


def test_a_plane_is_a_ground_and_no_aeroplane() -> None:
    ground = trimesh.creation.box((1.9, 1.9, 0.01))
    plane = replace(clean(), name="ground_plane", category=None, visual=(textured(ground),), collision=())
    assert "SCL002" not in codes(audit_asset(plane, RULES))
    for wider in ("door_lock", "fire_truck", "street_lamp", "floor_tile"):  # no padlock, toy, desk lamp, domino
        assert "SCL002" not in codes(audit_asset(replace(plane, name=wider), RULES)), wider
    assert "SCL002" in codes(audit_asset(replace(plane, name="toy_airplane"), RULES))


def test_the_name_of_a_whole_says_nothing_of_one_part_of_it() -> None:
    robot = replace(scaled(clean(), 10), name="mug", category=None, collision=(), grasps=(), frames=(), rests=())
    assert {"SCL002", "COL001"} <= codes(audit_asset(robot, RULES))
    assert not {"SCL002", "COL001"} & codes(audit_asset(replace(robot, partial=True), RULES))


def test_friction_that_another_body_of_the_file_declares_is_declared() -> None:
    assert "FRI001" not in codes(
        audit_asset(with_contact(friction_static=None, friction_dynamic=None, of_others=True)(clean()), RULES)
    )


def test_castors_of_a_robot_may_slide_and_an_object_may_not() -> None:
    smooth = with_contact(friction_static=0.0)(clean())
    assert "FRI002" in {each.code for each in audit_asset(smooth, RULES)}
    assert "FRI002" not in {each.code for each in audit_asset(replace(smooth, partial=True), RULES)}


def test_where_the_mass_is_zero_its_centre_does_not_matter() -> None:
    asset = clean()
    outside = replace(asset, inertial=replace(asset.inertial, center_of_mass_m=np.array([0.0, 0, 0.5])))
    assert "COM002" in {each.code for each in audit_asset(outside, RULES)}
    still = replace(outside, inertial=replace(outside.inertial, mass_kg=0.0))
    codes = {each.code for each in audit_asset(still, RULES)}
    assert "MAS002" in codes and "COM002" not in codes
