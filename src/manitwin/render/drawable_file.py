"""Storage of untextured drawables as one file of arrays, so that simplification is done only once."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np

from manitwin.formats.npz_file import npz_arrays
from manitwin.render.drawable import Drawable
from manitwin.render.surfaces import RenderSurface

ARRAYS = {"vertices": (np.float32, 3), "faces": (np.uint32, 3), "normals": (np.float32, 3), "uv": (np.float32, 2)}
"""Data type and number of columns of each array of a surface."""
MOST_BYTES = 64 << 20
NUMBERS = 5
"""Scalars of a surface: linear colour (3), metallic, roughness."""


def drawables_to_bytes(things: Mapping[str, Drawable]) -> bytes | None:
    """Return the content of a NumPy archive (.npz) with drawables by name; None if one of them has a texture."""
    arrays: dict[str, np.ndarray] = {}
    for place, thing in enumerate(things.values()):
        surfaces = (*thing.surfaces, thing.shadow)  # the last one is the shadow caster
        for number, surface in enumerate(surfaces):
            if any(each is not None for each in (surface.color_map, surface.roughness_map, surface.metallic_map)):
                return None
            name = f"{place}.{number}"
            arrays |= {f"{name}.{kind}": getattr(surface, kind) for kind in ARRAYS}
            arrays[f"{name}.numbers"] = np.array([*surface.color, surface.metallic, surface.roughness])
    arrays["names"] = np.array(list(things), np.str_)
    arrays["counts"] = np.array([len(thing.surfaces) + 1 for thing in things.values()], np.int64)
    stream = io.BytesIO()
    np.savez(stream, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()


def drawables_from_bytes(content: bytes) -> dict[str, Drawable]:
    """Return the drawables by name from ``drawables_to_bytes``. Raises ValueError for damaged content."""
    arrays, found = npz_arrays(content, MOST_BYTES), {}
    try:
        told = zip(arrays["names"].tolist(), arrays["counts"].tolist(), strict=True)
        for place, (name, count) in enumerate(told):
            *surfaces, shadow = (_surface(arrays, f"{place}.{number}") for number in range(count))
            found[name] = Drawable(tuple(surfaces), shadow)
    except (KeyError, TypeError) as error:
        raise ValueError(f"no file of drawables: {error!r}") from error
    return found


def _surface(arrays: Mapping[str, np.ndarray], name: str) -> RenderSurface:
    """Return one surface. Raises ValueError if its arrays are inconsistent."""
    read = {kind: arrays[f"{name}.{kind}"] for kind in ARRAYS}
    for kind, (dtype, columns) in ARRAYS.items():
        array = read[kind]
        if array.dtype != dtype or array.ndim != 2 or array.shape[1] != columns:
            raise ValueError(f"{name}.{kind} is {array.dtype} {array.shape}, not {np.dtype(dtype)} (N, {columns})")
        if kind != "faces" and (len(array) != len(read["vertices"]) or not np.isfinite(array).all()):
            raise ValueError(f"{name}.{kind} does not fit the vertices")
    if len(read["faces"]) and int(read["faces"].max()) >= len(read["vertices"]):
        raise ValueError(f"{name}.faces name vertices that are not there")
    numbers = arrays[f"{name}.numbers"]
    if numbers.shape != (NUMBERS,) or not np.isfinite(numbers).all():
        raise ValueError(f"{name}.numbers are not {NUMBERS} finite ones")
    red, green, blue, metallic, roughness = numbers.tolist()
    return RenderSurface(
        **read,
        color=(red, green, blue),
        color_map=None,
        metallic=metallic,
        metallic_map=None,
        roughness=roughness,
        roughness_map=None,
    )
