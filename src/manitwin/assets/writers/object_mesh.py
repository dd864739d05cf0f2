"""The object's surface as one OBJ in the object frame, for tools that want a shape without looks."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.assets.writers.content import TwinContent
from manitwin.assets.writers.obj_file import obj_file


def object_mesh(twin: TwinContent) -> bytes:
    """Return all visual parts as one OBJ file without materials: metres, +Z up, origin at the bottom centre."""
    vertices, faces = trimesh.util.append_faces([p.vertices for p in twin.visual], [p.faces for p in twin.visual])
    return obj_file(np.asarray(vertices, np.float32), np.asarray(faces))  # a GLB has no more than these digits
