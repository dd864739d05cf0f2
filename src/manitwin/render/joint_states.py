"""Images of an articulated twin at several joint positions, side by side, with a common camera."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence

import numpy as np
import trimesh
from PIL import Image

from manitwin.render.cameras import hero_camera
from manitwin.render.card_panels import render_panel
from manitwin.twin.loaded_links import joints_of
from manitwin.twin.loaded_twin import Twin

PANEL_PX, MOST_PANELS = 384, 9
_FOV_Y_DEG = 30.0
_FULL_TURN = np.pi / 2
"""Range drawn to either side for a joint without limits."""


def representative_states(twin: Twin) -> list[dict[str, float]]:
    """Return joint states that show a twin's motion: the reference state, then each joint at the ends of its range."""
    states: list[dict[str, float]] = [{}]
    for joint in joints_of(twin.record):
        low, high = joint.lower, joint.upper
        ends = (
            joint.stands_at - _FULL_TURN if low is None else low,
            joint.stands_at + _FULL_TURN if high is None else high,
        )
        states += [{joint.name: end} for end in ends if abs(end - joint.stands_at) > 1e-9]
    return states[:MOST_PANELS]


def draw_joint_states(twin: Twin, states: Sequence[Mapping[str, float]], panel_px: int = PANEL_PX) -> bytes:
    """Return a PNG with one panel per state: joint positions by name, with other joints in their reference position.

    Raises UsageError like ``Twin.posed_visual``, RendererMissing if no renderer is available.
    """
    posed = [twin.posed_visual(state) for state in states]
    points = np.concatenate([part.vertices for parts in posed for part in parts])
    camera = hero_camera(points, fov_y_deg=_FOV_Y_DEG, width_px=panel_px, height_px=panel_px)
    panels = [render_panel(parts, _joined(parts), camera) for parts in posed]
    stream = io.BytesIO()
    Image.fromarray(np.hstack(panels)).save(stream, "PNG", compress_level=6)
    return stream.getvalue()


def _joined(parts: Sequence[trimesh.Trimesh]) -> trimesh.Trimesh:
    vertices, faces = trimesh.util.append_faces([part.vertices for part in parts], [part.faces for part in parts])
    return trimesh.Trimesh(vertices, faces, process=False)
