"""Cache of derived data in a mesh, valid while the mesh is unchanged."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import trimesh

Made = TypeVar("Made")


def cached_on_mesh(mesh: trimesh.Trimesh, name: str, make: Callable[[], Made]) -> Made:
    """Return ``make()`` for a mesh, computed once per ``name``.

    It is stored in the mesh's own cache (trimesh), which is cleared when vertices or faces change.
    """
    cache = mesh._cache
    cache.verify()
    key = f"manitwin {name}"
    if key not in cache.cache:
        made = make()  # ``make`` may use the mesh's cache itself
        cache.cache[key] = made
    return cast(Made, cache.cache[key])
