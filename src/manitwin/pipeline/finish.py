"""Collection of quality findings, and the card (paper, "Consolidated Output"; appendix, "Dataset Examples": four columns)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import trimesh
from PIL import Image

from manitwin.config import NO_SETTINGS, Resource, Section
from manitwin.engine.stage import Draft
from manitwin.geometry.boxes import extents_along_sides
from manitwin.geometry.grasp_diversity import farthest_grasps
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.pipeline.grasps import GRASP_POINTS
from manitwin.pipeline.guesses import template_fill_note
from manitwin.pipeline.human_corrections import corrected_name
from manitwin.pipeline.item import Item
from manitwin.pipeline.joint_checks import joint_checks
from manitwin.pipeline.object_state import load_hulls, load_solid, load_visual, object_name
from manitwin.pipeline.quality import quality_checks
from manitwin.render.card import CardText, make_card
from manitwin.render.card_panels import CardGrasp, CardPoint
from manitwin.render.center_of_mass import CenterOfMass
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.grasp_table import read_grasp_table


@dataclass(frozen=True)
class FinishStage:
    """Draw ``card.png`` and return the field ``quality``."""

    gripper: Gripper

    name: ClassVar[str] = "finish"
    version: ClassVar[str] = "26"
    reads: ClassVar[tuple[str, ...]] = (
        "visual.glb", "solid.npz", "hulls.npz", "grasps.parquet", "photo.png?", "matte?", "naming?", "generation?", "geometry",
        "gate", "physical", "size", "collision", "language", "points", "frames_missing", GRASP_POINTS, "grasps",
        "placements", "canonical.npz",
    )  # fmt: skip
    writes: ClassVar[tuple[str, ...]] = ("card.png", "quality")
    needs: ClassVar[Resource] = "cpu"
    backend: ClassVar[str] = "builtin"
    model: ClassVar[str | None] = None
    settings: ClassVar[Section] = NO_SETTINGS

    def run(self, draft: Draft[Item], folder: Path) -> dict[str, Any]:
        """Draw the card of an accepted twin."""
        photo = np.asarray(Image.open(draft.path("photo.png"))) if "photo.png" in draft.paths else None
        physical = draft.field("physical")
        mass = CenterOfMass(np.array(physical["center_of_mass_m"]), float(physical["center_of_mass_uncertainty_m"]))
        solid = load_solid(draft.path("solid.npz"))
        card = make_card(
            parts=load_visual(draft.path("visual.glb")),
            solid=solid,
            hulls=load_hulls(draft.path("hulls.npz")),
            points=_card_points(draft.field("points") | draft.field(GRASP_POINTS)),
            grasps=self._card_grasps(draft.path("grasps.parquet")),
            text=card_text(draft, solid),
            mass=mass,
            photo=photo,
            prompt=draft.payload.text,
        )
        (folder / "card.png").write_bytes(card)
        checks = [*quality_checks(draft), *(check.model_dump() for check in joint_checks(draft))]
        return {"quality": {"checks": checks}}

    def _card_grasps(self, path: Path) -> list[CardGrasp]:
        """Return the first gripper's verified grasps, ordered by farthest point sampling, as the card shows only the first
        ones.
        """
        table = read_grasp_table(path).to_pydict()
        own = (gripper == self.gripper.name for gripper in table["gripper"])
        chosen = zip(own, table["verified"], table["proposer"], strict=True)
        rows = [i for i, (is_own, held, proposer) in enumerate(chosen) if is_own and held and ":" not in proposer]
        rotations = rotation_from_quaternion_wxyz(
            np.array([table["quaternion_wxyz"][i] for i in rows], float).reshape(-1, 4)
        )
        positions = np.array([table["position_m"][i] for i in rows], float).reshape(-1, 3)
        poses = np.array([transform(r, t) for r, t in zip(rotations, positions, strict=True)]).reshape(-1, 4, 4)
        order = farthest_grasps(poses, np.array([table["depth_m"][i] for i in rows]), len(poses))
        return [CardGrasp(poses[i], self.gripper.symbol(table["width_m"][rows[i]])) for i in order]


def _card_points(points: dict[str, Any]) -> list[CardPoint]:
    functional = [
        CardPoint(np.array(p["position_m"]), np.array(p["normal"]), p["label"], True, _frame_to_object(p["frame"]))
        for p in points["functional"]
    ]
    grasp = [
        CardPoint(np.array(p["position_m"]), np.array(p["normal"]), p["type"].replace("_", " "), False)
        for p in points["grasp"]
    ]
    return functional + grasp


def _frame_to_object(frame: dict[str, Any] | None) -> np.ndarray | None:
    if frame is None:
        return None
    return transform(rotation_from_quaternion_wxyz(np.array(frame["quaternion_wxyz"])), np.array(frame["position_m"]))


def card_text(draft: Draft[Item], solid: trimesh.Trimesh) -> CardText:
    """Return the text of a card: description, size, mass, friction, grasps, and the sources of the numbers.

    The size is length, width and height along the object's own sides; extents along X and Y are larger if it is oblique.
    """
    language, physical, grasps = (draft.field(name) for name in ("language", "physical", "grasps"))
    mass, friction = physical["mass_kg"], physical["friction_static"]
    facts = (
        ("size", " x ".join(f"{100 * side:.1f}" for side in extents_along_sides(solid.vertices)) + " cm"),
        ("mass", _mass_between(mass["value"], mass["low"], mass["high"])),
        ("friction", f"{friction['value']:.2f}"),
        ("grasps held", f"{grasps['verified']} of {grasps['simulated']}"),
    )
    made_by = f"made by {draft.field('generation')['generator']}" if "generation" in draft.fields else "mesh given"
    said, seen = (draft.fields.get("naming") or {}).get("name"), template_fill_note(draft)
    if said is not None and said == object_name(draft):
        made_by += f"   named by {draft.field('naming')['probability']['source']}"
    elif (stated := corrected_name(draft)) is not None and stated.value == object_name(draft):
        made_by += f"   named by {stated.source}"
    elif seen is not None:
        made_by += f"   template by {seen['source']}"
    footer = f"{draft.item_id}   {made_by}   mass: {mass['source']}   friction: {friction['source']}"
    stamp = "REHEARSAL" if draft.rehearsed else None
    return CardText(language["category"], language["caption"], facts, footer, stamp)


def _mass_between(value_kg: float, low_kg: float, high_kg: float) -> str:
    value, low, high = (_mass(each) for each in (value_kg, low_kg, high_kg))
    return value if low == value == high else f"{value} ({low} to {high})"


def _mass(kilograms: float) -> str:
    if kilograms >= 1:
        return f"{kilograms:.2f} kg"
    return f"{1000 * kilograms:.0f} g" if kilograms >= 0.01 else f"{1000 * kilograms:.2g} g"
