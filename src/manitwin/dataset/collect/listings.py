"""Published listings of mesh data sets as list entries: Objaverse metadata and Gazebo Fuel models.

Objaverse 1.0 (Deitke et al. 2023) has ``metadata/<shard>.json.gz``, an object of annotations by uid, and
``glbs/<shard>/<uid>.glb``. Fuel, which hosts Google Scanned Objects, answers ``GET /1.0/OWNER/models`` with a JSON list of
models; an unpacked model has ``NAME/meshes/model.obj``.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

from manitwin.errors import UsageError
from manitwin.formats.bounded_file import open_regular

SUFFIXES = (".json", ".json.gz")
FUEL = "https://fuel.gazebosim.org/1.0"
SKETCHFAB = "https://sketchfab.com/3d-models"
LICENCES = {
    "by": "CC-BY-4.0",
    "by-sa": "CC-BY-SA-4.0",
    "by-nd": "CC-BY-ND-4.0",
    "by-nc": "CC-BY-NC-4.0",
    "by-nc-sa": "CC-BY-NC-SA-4.0",
    "by-nc-nd": "CC-BY-NC-ND-4.0",
    "cc-by": "CC-BY-4.0",
    "cc by 4.0": "CC-BY-4.0",
    "cc by-sa 4.0": "CC-BY-SA-4.0",
    "cc by-nc 4.0": "CC-BY-NC-4.0",
    "cc0": "CC0-1.0",
    "cc0 1.0": "CC0-1.0",
    "cc-0": "CC0-1.0",
    "creative commons attribution 4.0 international": "CC-BY-4.0",
    "creative commons - attribution": "CC-BY-4.0",
    "creative commons zero v1.0 universal": "CC0-1.0",
}
"""SPDX identifiers of the licence names used in listings; other names stay as they are written."""


def is_listing(path: Path) -> bool:
    """Return whether a file is a listing, judged by its suffix."""
    return path.name.lower().endswith(SUFFIXES)


def read_listing(path: Path, *, files: bool) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the number and row of each entry of a listing; raises UsageError for JSON of an unknown form.

    With ``files``, a row names the file below the data set's folder, else the URL of the object's web page.
    """
    from manitwin.formats.json_file import parse_json  # imports NumPy, which only listings need

    told = parse_json(_text(path), str(path), UsageError, remedy="give the file as it was published")
    if isinstance(told, dict) and told and all(isinstance(each, dict) and "license" in each for each in told.values()):
        shard = path.name.split(".", 1)[0]
        for number, (uid, each) in enumerate(told.items(), 1):
            yield number, _objaverse_row(uid, each, shard, files=files)
    elif isinstance(told, list) and told and all(isinstance(each, dict) and "owner" in each for each in told):
        for number, each in enumerate(told, 1):
            yield number, _fuel_row(each, files=files)
    else:
        raise UsageError(
            f"{path}: is not a known listing; give Objaverse's metadata (an object of annotations by uid) or Fuel's"
            f" (a list"
            " of models with owner and name), or convert it to .csv or .jsonl"
        )


def _text(path: Path) -> bytes:
    from manitwin.formats.json_file import MAX_JSON_BYTES

    with open_regular(path, UsageError, name=str(path)) as stream:
        try:
            source = gzip.GzipFile(fileobj=stream) if path.suffix.lower() == ".gz" else stream
            content = source.read(MAX_JSON_BYTES + 1)
        except (OSError, EOFError, zlib.error) as error:
            raise UsageError(f"{path}: cannot be unpacked ({error}); download it again") from error
    if len(content) > MAX_JSON_BYTES:
        raise UsageError(f"{path}: more than {MAX_JSON_BYTES >> 20} MiB after unpacking; split it")
    return content


def _objaverse_row(uid: str, told: dict[str, Any], shard: str, *, files: bool) -> dict[str, Any]:
    said = told.get("user")
    user: dict[str, Any] = said if isinstance(said, dict) else {}
    address = told.get("viewerUrl") or f"{SKETCHFAB}/{quote(uid)}"
    place = {"file": f"glbs/{shard}/{uid}.glb"} if files else {"url": address}
    who = user.get("displayName") or user.get("username")
    credit = f"{who}, {address}" if isinstance(who, str) else None
    return {**place, "name": told.get("name"), "source": "Objaverse 1.0", "license": _licence(told.get("license"))} | (
        {} if credit is None else {"attribution": credit}
    )


def _fuel_row(told: dict[str, Any], *, files: bool) -> dict[str, Any]:
    owner, name = told.get("owner"), told.get("name")
    if not isinstance(owner, str) or not isinstance(name, str):
        return {"name": name, "source": owner}  # a row without a place is refused later
    address = f"{FUEL}/{quote(owner)}/models/{quote(name)}"
    place = {"file": f"{name}/meshes/model.obj"} if files else {"url": address}
    words = " ".join(name.replace("_", " ").split())
    source = f"Gazebo Fuel: {owner}"
    return {
        **place,
        "name": words,
        "source": source,
        "license": _licence(told.get("license_name")),
        "attribution": f"{owner}, {address}",
    }


def _licence(told: Any) -> Any:
    return LICENCES.get(told.strip().lower(), told) if isinstance(told, str) else told
