"""Finished twins of known shape with collision hulls, for scenes: folders, and the same in memory."""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import trimesh

from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose
from manitwin.scenes.loaded_scene import Scene
from manitwin.twin.store import RECORD, read_record, write_twin_record
from rigid_boxes import block
from twin_folders import twin_id, write_accepted

BOWL_RADIUS_M, BOWL_HEIGHT_M = 0.09, 0.06


@dataclass(frozen=True)
class Thing:
    """A solid that stands on z = 0 about the z axis, by its convex hulls."""

    category: str
    hulls: tuple[np.ndarray, ...]
    mass_kg: float = 0.2
    vessel: bool = False

    def solid(self) -> trimesh.Trimesh:
        parts = [trimesh.convex.convex_hull(hull) for hull in self.hulls]
        solid = trimesh.util.concatenate(parts)
        solid.density = self.mass_kg / sum(part.volume for part in parts)
        return solid

    def body(self) -> RigidBody:
        solid = self.solid()
        return RigidBody(
            self.hulls, self.mass_kg, np.array(solid.center_mass), np.array(solid.moment_inertia), 0.5, 0.4
        )

    @property
    def radius_m(self) -> float:
        return max(float(np.linalg.norm(hull[:, :2], axis=1).max()) for hull in self.hulls)


def slab(category: str, x_m: float, y_m: float, z_m: float, mass_kg: float = 0.2) -> Thing:
    """A box on z = 0."""
    return Thing(category, (block([-x_m / 2, -y_m / 2, 0], [x_m / 2, y_m / 2, z_m]),), mass_kg)


def bowl() -> Thing:
    """Twelve walls of 6 mm around a floor of 6 mm: 18 cm wide, 6 cm high."""
    around = np.linspace(0, 2 * np.pi, 13)
    floor = np.array(
        [[BOWL_RADIUS_M * np.cos(a), BOWL_RADIUS_M * np.sin(a), z] for a in around[:12] for z in (0, 0.006)]
    )
    walls = [
        np.array(
            [
                [radius * np.cos(a), radius * np.sin(a), z]
                for a in pair
                for radius in (BOWL_RADIUS_M - 0.006, BOWL_RADIUS_M)
                for z in (0.006, BOWL_HEIGHT_M)
            ]
        )
        for pair in pairwise(around)
    ]
    return Thing("mixing bowl", (floor, *walls), 0.3, vessel=True)


def can() -> Thing:
    """A cylinder of 24 sides, 7 cm wide and 10 cm high."""
    around = np.linspace(0, 2 * np.pi, 25)[:24]
    return Thing(
        "can", (np.array([[0.035 * np.cos(a), 0.035 * np.sin(a), z] for a in around for z in (0, 0.1)]),), 0.35
    )


THINGS = (
    slab("knife", 0.22, 0.02, 0.01, 0.08),
    slab("box", 0.12, 0.08, 0.06, 0.3),
    slab("tea box", 0.09, 0.07, 0.05),
    slab("board", 0.24, 0.16, 0.015, 0.5),
    slab("dice", 0.03, 0.03, 0.03, 0.05),
    slab("sponge", 0.1, 0.07, 0.03, 0.05),
    can(),
    bowl(),
)


def pool_of_things(things: tuple[Thing, ...] = THINGS) -> Pool:
    """A pool in memory; every thing has one placement, upright."""
    bodies = {twin_id(i): thing for i, thing in enumerate(things)}
    twins = [
        PoolTwin(name, "ab" * 32, thing.category, (StandingPose(0, np.eye(4), 1.0, thing.radius_m),), thing.vessel)
        for name, thing in bodies.items()
    ]
    return Pool(twins, lambda name: bodies[name].body())


def write_thing(root: Path, number: int, thing: Thing) -> str:
    """Write a thing as an accepted twin of a data set; returns its id."""
    solid = thing.solid()
    identity = write_accepted(root, number, category=thing.category, mass_kg=thing.mass_kg, mesh=solid, grasps=4)
    folder = root / "twins" / identity[:2] / identity
    (folder / "collision").mkdir(exist_ok=True)
    for i, hull in enumerate(thing.hulls):
        (folder / "collision" / f"hull_{i:02d}.obj").write_text(
            trimesh.convex.convex_hull(hull).export(file_type="obj", digits=9)
        )
    record = json.loads((folder / RECORD).read_bytes())
    record["physical"]["center_of_mass_m"] = solid.center_mass.tolist()
    record["physical"]["inertia_kg_m2"] = solid.moment_inertia.tolist()
    record["mesh"]["hulls"] |= {"count": len(thing.hulls), "keeps_opening": True if thing.vessel else None}
    record["placements"] = [
        {
            "position_m": [0.0, 0.0, 0.0], "quaternion_wxyz": [1.0, 0.0, 0.0, 0.0], "probability": 0.75, "upright": True,
            "settled": True, "collision_radius_m": thing.radius_m,
        },
        {
            "position_m": [0.0, 0.0, 0.0], "quaternion_wxyz": [0.0, 1.0, 0.0, 0.0], "probability": 0.25,
            "upright": False, "settled": False, "collision_radius_m": thing.radius_m,
        },
    ]  # fmt: skip
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    read_record(folder, verify=True)
    return identity


def write_things(root: Path, things: tuple[Thing, ...] = THINGS) -> list[str]:
    """Write a data set of things; returns their ids."""
    return [write_thing(root, number, thing) for number, thing in enumerate(things)]


def distances_in_mujoco(scene: Scene) -> dict[tuple[str, str], float]:
    """The distance of every pair of objects, and of objects and furniture, by MuJoCo; negative where they overlap."""
    model = scene.to_mujoco()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    owners = [
        model.body(model.geom_bodyid[g]).name if model.geom_bodyid[g] else model.geom(g).name
        for g in range(model.ngeom)
    ]
    found: dict[tuple[str, str], float] = {}
    for first in range(model.ngeom):
        for second in range(first + 1, model.ngeom):
            if owners[first] == owners[second] or not (model.geom_bodyid[first] or model.geom_bodyid[second]):
                continue
            pair = owners[first], owners[second]
            gap = mujoco.mj_geomDistance(model, data, first, second, 1.0, None)
            found[pair] = min(found.get(pair, np.inf), gap)
    return found


def standing_at(x_m: float, y_m: float, z_m: float = 0.0) -> np.ndarray:
    """An upright pose."""
    return transform(translation=np.array([x_m, y_m, z_m]))
