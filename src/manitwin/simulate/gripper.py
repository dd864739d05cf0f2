"""A parallel gripper as data: a TOML file of dimensions, not code.

Grasp frame (that of GraspGen, ACRONYM and Contact-GraspNet): origin at the gripper's base link, +Z the approach direction,
X the closing direction. The finger on +X is the first one.
"""

from __future__ import annotations

import hashlib
import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np

from manitwin.errors import UsageError, choose_from


@dataclass(frozen=True)
class Box:
    """A box of a gripper part: its centre (m), half extents (m) and rotation about Y (rad), in the grasp frame."""

    center_m: tuple[float, float, float]
    half_extents_m: tuple[float, float, float]
    rotation_y_rad: float = 0.0


@dataclass(frozen=True)
class Gripper:
    """A parallel-jaw gripper.

    ``finger_boxes`` are those of the +X finger when closed (its inner face touches x = 0); the other finger is its half turn
    about Z. ``opening_m`` is the full stroke; ``tip_depth_m`` is the fingertips' centre along +Z; ``pad_half_extents_m`` is
    half of the pad's width (Y) and height (Z), centred on the tip depth.
    """

    name: str
    sha256: str
    opening_m: float
    tip_depth_m: float
    force_n: float
    finger_friction: float
    pad_half_extents_m: tuple[float, float]
    finger_boxes: tuple[Box, ...]
    palm_boxes: tuple[Box, ...]
    source: str

    def boxes(self, opening_m: float) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return ``(box_to_gripper 4x4, half_extents_m (3,))`` of palm and both fingers at a given opening between the pads."""
        placed = [_placed(box, 0.0, 1) for box in self.palm_boxes]
        for side in (1, -1):
            placed += [_placed(box, opening_m / 2, side) for box in self.finger_boxes]
        return placed


def _placed(box: Box, offset_m: float, side: int) -> tuple[np.ndarray, np.ndarray]:
    angle = side * box.rotation_y_rad
    cosine, sine = np.cos(angle), np.sin(angle)
    box_to_gripper = np.eye(4)
    box_to_gripper[:3, :3] = [[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]
    x, y, z = box.center_m
    box_to_gripper[:3, 3] = [side * (x + offset_m), side * y, z]
    return box_to_gripper, np.array(box.half_extents_m)


def shipped_grippers() -> list[str]:
    """Return the names of the grippers that come with the package."""
    folder = resources.files("manitwin.simulate") / "grippers"
    return sorted(Path(str(p)).stem for p in folder.iterdir() if str(p).endswith(".toml"))


def load_gripper(name_or_path: str) -> Gripper:
    """Load a gripper by its shipped name or from a TOML file; raises UsageError naming what would be valid."""
    if name_or_path.endswith(".toml"):
        path = Path(name_or_path)
        if not path.is_file():
            raise UsageError(
                f"gripper file {name_or_path} is not there; give a .toml file or one of {', '.join(shipped_grippers())}"
            )
        text = path.read_text()
    else:
        if name_or_path not in shipped_grippers():
            raise UsageError(choose_from("gripper", name_or_path, shipped_grippers()))
        text = (resources.files("manitwin.simulate") / "grippers" / f"{name_or_path}.toml").read_text()
    data = tomllib.loads(text)

    def boxes(key: str) -> tuple[Box, ...]:
        return tuple(
            Box(tuple(b["center_m"]), tuple(b["half_extents_m"]), float(b.get("rotation_y_rad", 0.0)))
            for b in data[key]
        )

    return Gripper(
        name=data["name"],
        sha256=hashlib.sha256(text.encode()).hexdigest(),
        opening_m=data["opening_m"],
        tip_depth_m=data["tip_depth_m"],
        force_n=data["force_n"],
        finger_friction=data["finger_friction"],
        pad_half_extents_m=tuple(data["pad_half_extents_m"]),
        finger_boxes=boxes("finger_boxes"),
        palm_boxes=boxes("palm_boxes"),
        source=data["source"],
    )
