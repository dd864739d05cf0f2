"""Fixtures of skills: static boxes such as a peg on a stand, a block to strike, a board, a holder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.goals.world_state import Holder, Peg
from manitwin.geometry.boxes import footprint
from manitwin.geometry.poses import quaternion_wxyz, transform, transform_points
from manitwin.geometry.rigid_body import StaticBox

PEG_RISES_RAD = np.radians(10)  # towards its tip, as for coat hooks: hung objects slide to the post
PEG_RADIUS_M, PEG_LENGTH_M, PEG_HEIGHT_M = 0.004, 0.09, 0.28
POST_HALF_M, FOOT_HALF_M, FOOT_HALF_HEIGHT_M = 0.012, 0.05, 0.006
BLOCK_HALF_M, BLOCK_HALF_HEIGHT_M = 0.025, 0.06
"""Slender and tall: room for the hand beside a short head, and for the arm above the table."""
PANEL_HALF_M, PANEL_HALF_HEIGHT_M = (0.07, 0.05), 0.02
BUTTON_HALF_M, BUTTON_HALF_HEIGHT_M = 0.010, 0.003
HOLDER_FLOOR_M, HOLDER_WALL_M = 0.010, 0.006

_CORNERS = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)])


@dataclass(frozen=True)
class Fixture:
    """Static boxes, each a body of the episode's world with its own name.

    ``frame_to_world (4, 4)`` is the functional frame, at the box ``name``: a peg's foot with Z towards its tip and X upwards,
    or the centre of a face, a button or a bore's rim with Z outwards. ``size_m`` is a peg's length, or the half width of
    other fixtures.
    """

    kind: Literal["peg", "block", "panel", "holder", "board"]
    name: str
    boxes: tuple[StaticBox, ...]
    frame_to_world: np.ndarray
    size_m: float

    @property
    def footprint_m(self) -> np.ndarray:
        """Vertices ``(K, 2)`` of its footprint, seen from above."""
        return footprint(np.concatenate([_corners(box) for box in self.boxes]))

    @property
    def bearing(self) -> frozenset[str]:
        """Names of its boxes that count as furniture for objects resting on them: all except the box ``name`` and a post."""
        if self.kind == "holder":
            return frozenset()
        return frozenset(box.name for box in self.boxes) - {self.name, f"{self.name}_post"}

    @property
    def peg(self) -> Peg | None:
        """The peg for hanging objects; None for other kinds."""
        if self.kind != "peg":
            return None
        return Peg(self.frame_to_world[:3, 3], self.frame_to_world[:3, 2], self.size_m, PEG_RADIUS_M)

    @property
    def holder(self) -> Holder | None:
        """The holder for inserting objects; None for other kinds."""
        if self.kind != "holder":
            return None
        depth_m = 2 * float(self.boxes[1].half_extents_m[2]) - HOLDER_FLOOR_M
        half_m = np.asarray(self.boxes[0].half_extents_m[:2]) - HOLDER_WALL_M
        return Holder(self.frame_to_world, half_m, depth_m, frozenset(box.name for box in self.boxes))


def peg_stand(position_m: np.ndarray, yaw_rad: float, *, height_m: float = PEG_HEIGHT_M, name: str = "peg") -> Fixture:
    """Return a peg 8 mm thick and 9 cm long that rises by 10 degrees from a post on a foot.

    ``position_m (3,)`` is on the table below the peg's foot, which is ``height_m`` above; the peg points along ``yaw_rad``.
    """
    upright = transform(Rotation.from_euler("z", yaw_rad).as_matrix(), np.asarray(position_m, float))
    along = upright[:3, :3] @ np.array([np.cos(PEG_RISES_RAD), 0.0, np.sin(PEG_RISES_RAD)])
    across = upright[:3, 1]
    upward = np.cross(along, across)
    foot_m = upright[:3, 3] + [0.0, 0.0, height_m]
    rotation = np.stack([upward, np.cross(along, upward), along], axis=1)
    half_m = np.array([PEG_RADIUS_M, PEG_RADIUS_M, PEG_LENGTH_M / 2])
    behind = upright @ transform(translation=np.array([-POST_HALF_M, 0.0, (height_m + POST_HALF_M) / 2]))
    post = StaticBox(f"{name}_post", np.array([POST_HALF_M, POST_HALF_M, (height_m + POST_HALF_M) / 2]), behind)
    below = upright @ transform(translation=np.array([-POST_HALF_M, 0.0, FOOT_HALF_HEIGHT_M]))
    foot = StaticBox(f"{name}_foot", np.array([FOOT_HALF_M, FOOT_HALF_M, FOOT_HALF_HEIGHT_M]), below)
    peg = StaticBox(name, half_m, transform(rotation, foot_m + along * PEG_LENGTH_M / 2))
    return Fixture("peg", name, (peg, post, foot), transform(rotation, foot_m), PEG_LENGTH_M)


def block(position_m: np.ndarray, yaw_rad: float, *, name: str = "block") -> Fixture:
    """Return a block of 5 x 5 x 12 cm that stands on the table at ``position_m (3,)``; its frame is at its top."""
    upright = transform(Rotation.from_euler("z", yaw_rad).as_matrix(), np.asarray(position_m, float))
    half_m = np.array([BLOCK_HALF_M, BLOCK_HALF_M, BLOCK_HALF_HEIGHT_M])
    middle = upright @ transform(translation=np.array([0.0, 0.0, BLOCK_HALF_HEIGHT_M]))
    top = upright @ transform(translation=np.array([0.0, 0.0, 2 * BLOCK_HALF_HEIGHT_M]))
    return Fixture("block", name, (StaticBox(name, half_m, middle),), top, BLOCK_HALF_M)


def board(position_m: np.ndarray, yaw_rad: float, half_m: np.ndarray, *, name: str = "board") -> Fixture:
    """Return a level board on the table at ``position_m (3,)`` with half extents ``(3,)`` m; its frame is at its top's centre."""
    upright = transform(Rotation.from_euler("z", yaw_rad).as_matrix(), np.asarray(position_m, float))
    high_m = float(half_m[2])
    box = StaticBox(name, np.asarray(half_m, float), upright @ transform(translation=np.array([0.0, 0, high_m])))
    return Fixture(
        "board", name, (box,), upright @ transform(translation=np.array([0.0, 0, 2 * high_m])), float(half_m[0])
    )


def panel(position_m: np.ndarray, yaw_rad: float, *, name: str = "button") -> Fixture:
    """Return a flat box on the table at ``position_m (3,)`` with a button 2 cm wide that protrudes by 6 mm."""
    upright = transform(Rotation.from_euler("z", yaw_rad).as_matrix(), np.asarray(position_m, float))
    housing_m = np.array([*PANEL_HALF_M, PANEL_HALF_HEIGHT_M])
    button_m = np.array([BUTTON_HALF_M, BUTTON_HALF_M, BUTTON_HALF_HEIGHT_M])
    level_m = 2 * PANEL_HALF_HEIGHT_M

    def at(height_m: float) -> np.ndarray:
        return upright @ transform(translation=np.array([0.0, 0.0, height_m]))

    housing = StaticBox(f"{name}_panel", housing_m, at(PANEL_HALF_HEIGHT_M))
    button = StaticBox(name, button_m, at(level_m + BUTTON_HALF_HEIGHT_M))
    return Fixture("panel", name, (button, housing), at(level_m + 2 * BUTTON_HALF_HEIGHT_M), BUTTON_HALF_M)


def holder(
    position_m: np.ndarray, yaw_rad: float, bore_half_m: np.ndarray, depth_m: float, *, name: str = "holder"
) -> Fixture:
    """Return a holder on the table at ``position_m (3,)`` with a bore of half widths ``(2,)`` m that opens upwards.

    Its frame is at the centre of the bore's rim, Z upwards; ``size_m`` is the larger half width.
    """
    upright = transform(Rotation.from_euler("z", yaw_rad).as_matrix(), np.asarray(position_m, float))
    outer_m, half_height_m = bore_half_m + HOLDER_WALL_M, (HOLDER_FLOOR_M + depth_m) / 2
    floor_m = np.array([*outer_m, HOLDER_FLOOR_M / 2])
    boxes = [StaticBox(name, floor_m, upright @ transform(translation=np.array([0.0, 0, HOLDER_FLOOR_M / 2])))]
    for number, (x, y) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1))):
        half_m = np.array([*np.where([x, y], HOLDER_WALL_M / 2, outer_m), half_height_m])
        middle = np.array([*((bore_half_m + HOLDER_WALL_M / 2) * np.array([x, y])), half_height_m])
        boxes.append(StaticBox(f"{name}_wall_{number}", half_m, upright @ transform(translation=middle)))
    rim = upright @ transform(translation=np.array([0.0, 0, 2 * half_height_m]))
    return Fixture("holder", name, tuple(boxes), rim, float(np.max(bore_half_m)))


def to_json(fixture: Fixture) -> dict[str, Any]:
    """Return a fixture as JSON values, as stored in episode records."""
    boxes = [
        {
            "name": box.name,
            "half_extents_m": np.asarray(box.half_extents_m, float).tolist(),
            "position_m": box.box_to_world[:3, 3].tolist(),
            "quaternion_wxyz": quaternion_wxyz(box.box_to_world[:3, :3]).tolist(),
        }
        for box in fixture.boxes
    ]
    return {"kind": fixture.kind, "name": fixture.name, "boxes": boxes}


def _corners(box: StaticBox) -> np.ndarray:
    return transform_points(box.box_to_world, _CORNERS * box.half_extents_m)
