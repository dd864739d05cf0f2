"""Horizontal directions, with words that name their frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.render.cameras import Camera

ALIGNED = 0.94
"""Least cosine between the forward directions of robot and camera: within 20 degrees their sides agree or are opposite."""
STEEP = 0.8
"""Least cosine between a camera's view and straight down for a view from above."""
FROM_ABOVE = "straight towards the upper edge of the picture", "straight towards the lower edge of the picture"
"""The words for away from and towards a camera that looks down."""
ROBOT_FACES = np.array([1.0, 0.0])
"""The robot stands at the world's origin and faces +X; +Y is to its left."""


@dataclass(frozen=True)
class Direction:
    """A direction ``vector (2,)`` in the world's XY plane; ``frame`` is ``picture`` or ``robot``, ``key`` its name there."""

    frame: str
    key: str
    words: str
    vector: tuple[float, float]
    robot: str
    """The sentence that states the robot's position, with a trailing space; empty for directions of the picture."""


def picture_directions(camera: Camera) -> list[Direction]:
    """Return right, left, away and towards in the picture, projected onto the horizontal plane.

    In a view from above, away and towards are the upper and lower edge of the picture.
    """
    right = _level(camera.camera_to_object[:3, 0])
    ahead = np.array([-right[1], right[0]])
    from_above = camera.camera_to_object[2, 2] > STEEP
    away, towards = FROM_ABOVE if from_above else ("straight away from the camera", "straight towards the camera")
    return [
        Direction("picture", "right", "to the right as seen in the picture", _pair(right), ""),
        Direction("picture", "left", "to the left as seen in the picture", _pair(-right), ""),
        Direction("picture", "away", away, _pair(ahead), ""),
        Direction("picture", "towards", towards, _pair(-ahead), ""),
    ]


def robot_directions(camera: Camera, first_object_m: np.ndarray) -> list[Direction]:
    """Return the robot's right, left, forward and backward, if the picture determines them; else none.

    It does if the camera faces the robot across the objects, or looks the same way; ``first_object_m`` is a world point.
    """
    right = _level(camera.camera_to_object[:3, 0])
    ahead = np.array([-right[1], right[0]])
    cosine = float(ahead @ ROBOT_FACES)
    from_above = camera.camera_to_object[2, 2] > STEEP
    if cosine < -ALIGNED and first_object_m[0] > 0:
        far = "The robot stands beyond the upper edge of the picture and faces its lower edge. "
        robot = far if from_above else "The robot stands on the far side and faces the camera. "
    elif cosine > ALIGNED:
        near = "The robot stands beyond the lower edge of the picture and faces its upper edge. "
        robot = near if from_above else "The robot faces the same way as the camera. "
    else:
        return []
    return [
        Direction("robot", "right", "to the robot's right", (0.0, -1.0), robot),
        Direction("robot", "left", "to the robot's left", (0.0, 1.0), robot),
        Direction("robot", "away", "straight away from the robot", (1.0, 0.0), robot),
        Direction("robot", "towards", "straight towards the robot", (-1.0, 0.0), robot),
    ]


def _level(vector: np.ndarray) -> np.ndarray:
    flat: np.ndarray = np.asarray(vector[:2], float)
    return flat / np.linalg.norm(flat)


def _pair(vector: np.ndarray) -> tuple[float, float]:
    return float(vector[0]), float(vector[1])
