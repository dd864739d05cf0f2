"""The plainest OBJ: positions and triangles and nothing else, as collision hulls are written; read many times faster."""

from __future__ import annotations

import numpy as np


def plain_triangles(text: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Return vertices ``(V, 3)`` and triangles ``(F, 3)`` of such a text, None for any other or a broken one.

    All vertices are used by some triangle: the full reader leaves out others.
    """
    if "/" in text or "\\" in text:
        return None
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    places = [line[2:] for line in lines if line.startswith("v ")]
    corners = [line[2:] for line in lines if line.startswith("f ")]
    if not corners or len(places) + len(corners) != len(lines):
        return None
    try:
        vertices = np.array(" ".join(places).split(), dtype=np.float64)
        faces = np.array(" ".join(corners).split(), dtype=np.int64)
    except (ValueError, OverflowError):
        return None
    # three of each in every line: a sum that fits by chance is told by the lines themselves
    if len(vertices) != 3 * len(places) or len(faces) != 3 * len(corners) or not np.isfinite(vertices).all():
        return None
    if any(len(line.split()) != 3 for line in (*places, *corners)):
        return None
    if len(np.unique(faces)) != len(places) or faces.min() < 1 or faces.max() > len(places):
        return None
    return vertices.reshape(-1, 3), faces.reshape(-1, 3) - 1
