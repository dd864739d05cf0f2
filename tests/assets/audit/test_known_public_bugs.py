"""Bugs that users of public asset sets have reported, each made again on a mug, a bowl, a hammer or a table."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import trimesh
from made_mug import clean, contact, shape, solid, textured, write_urdf

from handmade import cup, hammer
from manitwin.assets.asset import AnnotatedFrame, Asset, Contact, Inertial
from manitwin.assets.audit.check import audit_asset, audit_path
from manitwin.assets.audit.finding import Finding
from manitwin.assets.audit.rules import RULES
from manitwin.geometry.cavity import find_opening
from manitwin.geometry.hulls.decomposition import convex_decomposition
from manitwin.geometry.mass_properties import solid_mass_properties


def errors_of(asset: Asset) -> dict[str, str]:
    """What is wrong, by code."""
    return {f.code: f.message for f in audit_asset(asset, RULES) if f.severity == "error"}


@cache
def bowl_pieces() -> tuple[trimesh.Trimesh, tuple[np.ndarray, ...]]:
    mesh = cup(radius_m=0.075, height_m=0.06, wall_m=0.004)
    pieces = convex_decomposition(mesh, max_hulls=32, max_vertices=64, oversplit=1.5, opening=find_opening(mesh))
    return mesh, pieces.hulls


def made(
    mesh: trimesh.Trimesh, pieces: tuple[np.ndarray, ...], mass_kg: float, name: str, material: str | None
) -> Asset:
    """An asset of a solid mesh with the inertia that belongs to its mass."""
    body = solid_mass_properties(mesh, mass_kg)
    return replace(
        clean(),
        name=name,
        category=None,
        visual=(textured(mesh),),
        collision=tuple(shape(f"hull_{i:02d}", piece) for i, piece in enumerate(pieces)),
        inertial=Inertial(mass_kg, body.center_of_mass_m, body.inertia_kg_m2),
        contact=Contact(0.45, 0.36, 0.3, material),
        frames=(),
        grasps=(),
        rests=(),
    )


def bowl(mass_kg: float = 0.3) -> Asset:
    mesh, pieces = bowl_pieces()
    return made(mesh, pieces, mass_kg, "akita_black_bowl", None)


def hammer_asset(mass_kg: float) -> Asset:
    mesh = hammer()
    head, handle = (mesh.vertices[mesh.vertices[:, 0] < 0.0151], mesh.vertices[mesh.vertices[:, 0] > -0.0151])
    handle = handle[np.abs(handle[:, 1]) < 0.0101]
    return made(mesh, (np.asarray(head), np.asarray(handle)), mass_kg, "020_hammer", "steel and wood")


def test_true_bowl_and_hammer_have_no_error() -> None:
    assert errors_of(bowl()) == {} and errors_of(hammer_asset(0.6)) == {}


def test_libero_154_porcelain_mug_of_16_grams() -> None:
    inertia = clean().inertial.inertia_kg_m2
    assert inertia is not None
    light = replace(clean(), category=None, name="porcelain_mug", contact=Contact(0.45, 0.36))
    found = errors_of(
        replace(light, inertial=Inertial(0.016, clean().inertial.center_of_mass_m, inertia * 0.016 / 0.3))
    )
    assert set(found) == {"MAS003"} and "0.016 kg" in found["MAS003"] and "ceramic" in found["MAS003"]


def test_libero_154_bowl_of_5_6_grams() -> None:
    found = errors_of(bowl(0.0056))
    assert set(found) == {"MAS004"} and "every bowl" in found["MAS004"]


def test_robodojo_41_hammer_of_0_kg() -> None:
    asset = hammer_asset(0.6)
    found = errors_of(replace(asset, inertial=replace(asset.inertial, mass_kg=0.0)))
    assert set(found) == {"MAS002"}


def test_robotwin_508_hammer_of_1_gram() -> None:
    assert set(errors_of(hammer_asset(0.001))) & {"MAS003", "MAS004"}


@pytest.mark.parametrize("tool", ["EmbodiedGen", "PhysX-Anything", "scene_synthesizer"])
def test_inertia_of_1_in_every_urdf(tool: str, tmp_path: Path) -> None:
    text = '<mass value="0.3"/><inertia ixx="1.0" ixy="0.0" ixz="0.0" iyy="1.0" iyz="0.0" izz="1.0"/>'
    if tool == "EmbodiedGen":
        text = '<origin xyz="0 0 0" rpy="0 0 0"/>' + text
    findings: tuple[Finding, ...] = audit_path(write_urdf(tmp_path, inertial=text), RULES).findings
    assert {f.code for f in findings if f.severity == "error"} == {"INE004"}
    assert "COM003" in {f.code for f in findings}, "the centre of mass is left at the origin too"


def robotwin(*frames: AnnotatedFrame) -> Asset:
    return replace(clean(), format="robotwin", frames=frames, rests=())


def test_robotwin_486_contact_frame_below_the_object() -> None:
    found = errors_of(robotwin(contact(0, (0.07, 0, -0.04), (-1, 0, 0), (0, 1, 0))))
    assert set(found) == {"GRA004"} and "contact 0" in found["GRA004"]


def test_robotwin_486_contact_frame_upside_down() -> None:
    assert set(errors_of(robotwin(contact(3, (0.07, 0, 0.05), (0, 0, 1), (0, 1, 0))))) == {"GRA003"}


def test_robotwin_482_contact_wider_than_the_gripper() -> None:
    block = trimesh.creation.box([0.12, 0.07, 0.1])
    block.apply_translation([0, 0, 0.05])
    asset = made(block, (np.asarray(block.vertices),), 0.5, "block", "wood")
    across = (contact(0, (0, 0, 0.09), (0, 0, -1), (1, 0, 0)), contact(1, (0, 0, 0.09), (0, 0, -1), (0, 1, 0)))
    found = errors_of(replace(asset, format="robotwin", frames=across))
    assert set(found) == {"GRA002"}
    assert found["GRA002"].startswith("contact 0: up to 120 mm wide") and "panda opens 80 mm" in found["GRA002"]


def test_maniskill_867_bowl_is_filled() -> None:
    mesh, _ = bowl_pieces()
    found = errors_of(made(mesh, (np.asarray(mesh.vertices),), 0.3, "bowl", "ceramic"))
    assert set(found) == {"COL003"} and "0%" in found["COL003"]


def test_genesis_2237_table_glb_is_z_up() -> None:
    top = trimesh.creation.box([1.2, 0.8, 0.04])
    top.apply_translation([0, 0, 0.73])
    boxes = [top]
    for x in (-0.55, 0.55):
        for y in (-0.35, 0.35):
            leg = trimesh.creation.box([0.06, 0.06, 0.71])
            leg.apply_translation([x, y, 0.355])
            boxes.append(leg)
    table = trimesh.util.concatenate(boxes)
    asset = made(table, tuple(np.asarray(box.vertices) for box in boxes), 20.0, "table", "wood")
    assert "SCL003" not in {f.code for f in audit_asset(asset, RULES)}
    findings = [f for f in audit_asset(replace(asset, up="y", format="embodiedgen"), RULES) if f.code == "SCL003"]
    assert len(findings) == 1 and "+z" in findings[0].message


def test_robodojo_41_dynamic_friction_above_static() -> None:
    found = errors_of(replace(clean(), contact=Contact(0.6, 1.5, 0.0, "ceramic")))
    assert set(found) == {"FRI003"}


def test_urdf_usd_converter_145_masses_more_than_double() -> None:
    # the volume of the hull at the density of steel instead of the mug's 0.3 kg
    steel_kg = 7850 * float(solid().convex_hull.volume)
    body = solid_mass_properties(solid(), steel_kg)
    heavy = Inertial(steel_kg, body.center_of_mass_m, body.inertia_kg_m2)
    assert set(errors_of(replace(clean(), inertial=heavy))) == {"MAS003"}


def test_dexverse_place_position_off_the_lowest_point() -> None:
    turned = trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0])
    turned[2, 3] = 0.05  # half of the height of the box as it stood, not as it lies
    assert set(errors_of(replace(clean(), rests=(turned,)))) == {"PLC001"}
