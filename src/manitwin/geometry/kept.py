"""What is costly to make of a mesh, made once while the mesh stays as it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import trimesh

Made = TypeVar("Made")


def kept(mesh: trimesh.Trimesh, name: str, make: Callable[[], Made]) -> Made:
    """Return what ``make`` makes of a mesh, the same object each time it is asked for by ``name``.

    It lies in the mesh's own cache (trimesh), which is emptied when vertices or faces change.
    """
    cache = mesh._cache
    cache.verify()
    key = f"manitwin {name}"
    if key not in cache.cache:
        made = make()  # it may ask the mesh for more, so the cache is looked at only now
        cache.cache[key] = made
    return cast(Made, cache.cache[key])
