"""A second reader of drawn scenes: what is where, what is seen, what touches what, and which things some words may mean.

It shares no code with what makes the questions: JSON, PNG and OBJ are read as they lie, points are projected by the written
matrices, and what touches what is asked of MuJoCo.
"""

from __future__ import annotations

import json
import re
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import mujoco
import numpy as np
import trimesh

STEP_M = 0.002
LEAST_PX_OF_512 = 20
COUNTER = re.compile(r"(?:pair|piece|bar|loaf|roll|pack|can|tube|ear) of ")
NO_SUCH_KIND = (
    "magnifying glass",
    "trash can",
    "watering can",
    "toy car",
    "rolling pin",
    "flower pot",
    "cup and saucer",
    "allen key",
)
"""Categories that their last word alone does not mean."""


class SecondScene:
    """One drawn scene, read as it lies."""

    def __init__(self, folder: Path, dataset: Path):
        self.folder = folder
        self.scene = json.loads((folder / "scene.json").read_text())
        self.facts = json.loads((folder / "pictures" / "pictures.json").read_text())
        self.objects = {each["name"]: each for each in self.scene["objects"]}
        self.twins = {
            name: dataset / "twins" / each["twin_id"][:2] / each["twin_id"] for name, each in self.objects.items()
        }
        self.records = {name: json.loads((twin / "twin.json").read_text()) for name, twin in self.twins.items()}
        self.ids = self.facts["ids"]

    def pose(self, name: str) -> np.ndarray:
        each, pose = self.objects[name], np.eye(4)
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, np.array(each["quaternion_wxyz"], float))
        pose[:3, :3], pose[:3, 3] = matrix.reshape(3, 3), each["position_m"]
        return pose

    @cached_property
    def hulls(self) -> dict[str, list[np.ndarray]]:
        found = {}
        for name, twin in self.twins.items():
            files = sorted((twin / "collision").glob("hull_*.obj"))
            found[name] = [
                np.array([line.split()[1:4] for line in file.read_text().splitlines() if line.startswith("v ")], float)
                for file in files
            ]
        return found

    def corners(self, name: str) -> np.ndarray:
        pose = self.pose(name)
        return np.concatenate(self.hulls[name]) @ pose[:3, :3].T + pose[:3, 3]

    @cached_property
    def physics(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        spec = mujoco.MjSpec()
        spec.option.gravity = [0, 0, 0]
        for name in self.objects:
            body = spec.worldbody.add_body(name=name)
            body.add_freejoint()
            body.explicitinertial, body.mass, body.inertia = True, 1.0, [1, 1, 1]
            for number, hull in enumerate(self.hulls[name]):
                shape = trimesh.convex.convex_hull(hull)
                mesh = spec.add_mesh(
                    name=f"{name}_{number}", uservert=shape.vertices.ravel(), userface=shape.faces.ravel()
                )
                mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
                mesh.refpos, mesh.refquat = [0, 0, 0], [1, 0, 0, 0]
                body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"{name}_{number}")
        model = spec.compile()
        return model, mujoco.MjData(model)

    def place(self, moved: dict[str, np.ndarray]) -> None:
        model, data = self.physics
        for name, each in self.objects.items():
            start = model.jnt_qposadr[model.body_jntadr[model.body(name).id]]
            data.qpos[start : start + 3] = np.array(each["position_m"]) + moved.get(name, 0.0)
            data.qpos[start + 3 : start + 7] = each["quaternion_wxyz"]
        mujoco.mj_kinematics(model, data)

    def gap(self, first: str, second: str) -> float:
        self.place({})
        model, data = self.physics
        geoms = {name: np.flatnonzero(model.geom_bodyid == model.body(name).id) for name in (first, second)}
        line = np.zeros(6)
        return min(
            mujoco.mj_geomDistance(model, data, int(a), int(b), 1.0, line) for a in geoms[first] for b in geoms[second]
        )

    def slide(self, name: str, legs: list[tuple[np.ndarray, float]]) -> str | None:
        """Move an object along legs of (direction, metres); return what it touches first."""
        model, data = self.physics
        moved = np.zeros(3)
        for direction, length in legs:
            unit = np.array([*direction, 0.0])
            for along in np.arange(0, length + 1e-9, STEP_M):
                self.place({name: moved + unit * along})
                mujoco.mj_collision(model, data)
                touched = [
                    {model.geom_bodyid[pair] for pair in contact.geom} - {model.body(name).id}
                    for contact in data.contact
                    if contact.dist < 0 and model.body(name).id in {model.geom_bodyid[g] for g in contact.geom}
                ]
                if touched:
                    return str(model.body(touched[0].pop()).name)
            moved = moved + unit * length
        return None


class SecondView:
    """One picture of it."""

    def __init__(self, scene: SecondScene, camera: str):
        self.scene, self.name = scene, camera
        self.camera = scene.facts["cameras"][camera]
        self.to_world = np.array(self.camera["camera_to_world"])
        self.width, self.height = self.camera["width_px"], self.camera["height_px"]
        self.scale = self.width * self.height / 512**2

    def picture(self, what: str) -> np.ndarray:
        return cv2.imread(str(self.scene.folder / "pictures" / f"{self.name}_{what}.png"), cv2.IMREAD_UNCHANGED)

    @cached_property
    def ids(self) -> np.ndarray:
        return self.picture("ids")

    @cached_property
    def parts(self) -> np.ndarray:
        return self.picture("parts")

    @cached_property
    def depth(self) -> np.ndarray:
        return self.picture("depth") * self.scene.facts["depth_unit_m"]

    def mask(self, name: str) -> np.ndarray:
        return self.ids == self.scene.ids[name]

    @cached_property
    def shown(self) -> list[str]:
        return [name for name in self.scene.objects if self.mask(name).sum() > LEAST_PX_OF_512 * self.scale]

    def at(self, point: list[float]) -> tuple[int, int]:
        return int(point[1] * self.height), int(point[0] * self.width)

    def object_at(self, point: list[float]) -> str | None:
        number = self.ids[self.at(point)]
        return next((name for name in self.scene.objects if self.scene.ids[name] == number), None)

    def projected(self, world: np.ndarray) -> np.ndarray:
        seen = (world - self.to_world[:3, 3]) @ self.to_world[:3, :3] * [1, -1, -1]
        pixels = seen @ np.array(self.camera["K"]).T
        return np.column_stack([pixels[:, :2] / pixels[:, 2:], seen[:, 2]])

    def direction(self, words: str) -> np.ndarray:
        right = self.to_world[:2, 0] / np.linalg.norm(self.to_world[:2, 0])
        back = np.array([right[1], -right[0]])
        return {
            "to the right as seen in the picture": right, "to the left as seen in the picture": -right,
            "straight towards the camera": back, "straight away from the camera": -back,
            "straight towards the lower edge of the picture": back,
            "straight towards the upper edge of the picture": -back,
            "to the robot's right": np.array([0, -1]), "to the robot's left": np.array([0, 1]),
            "straight away from the robot": np.array([1, 0]), "straight towards the robot": np.array([-1, 0]),
        }[words]  # fmt: skip

    def meant(self, words: str) -> list[str]:
        """Return the objects in the picture that some words may mean."""
        said = re.sub(r"^the ", "", words)
        outermost = re.search(r" that is (left|right)most in the picture$", said)
        said = COUNTER.sub("", re.sub(r" that is \w+ in the picture$", "", said))
        head = said.split()[-1]
        head = next((each for each in NO_SUCH_KIND if said.endswith(each)), head)
        kinds = {name: self.scene.objects[name]["category"] for name in self.shown}
        same = [name for name, kind in kinds.items() if head == (kind if kind in NO_SUCH_KIND else kind.split()[-1])]
        if outermost:
            columns = {name: np.nonzero(self.mask(name))[1].mean() for name in same}
            return [(min if outermost[1] == "left" else max)(columns, key=lambda name: columns[name])]
        nouns = max(
            (
                category
                for category in (self.scene.objects[name]["category"] for name in same)
                if said.endswith(category)
            ),
            key=len,
            default="",
        )
        color = said.removesuffix(nouns).strip()
        return [name for name in same if not color or color_said(self.scene.records[name]) in (color, "")]


def color_said(record: dict[str, Any]) -> str:
    """Return the first colour that a twin's record says, without its share."""
    return re.sub(r" \(.*", "", record["language"]["color"].split(",")[0])
