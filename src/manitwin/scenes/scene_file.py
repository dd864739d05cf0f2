"""Scene files: written whole or not at all, the same bytes for the same scene."""

from __future__ import annotations

import json
from pathlib import Path

from pydantic import ValidationError

from manitwin.errors import UsageError
from manitwin.scenes.scene import SCENE, SCENE_SCHEMA_VERSION, SceneRecord
from manitwin.twin.store import canonical_json, write_bytes_atomically


def scene_bytes(record: SceneRecord) -> bytes:
    """Return the content of a scene file: canonical JSON."""
    return canonical_json(record.model_dump(mode="json")).encode()


def write_scene(record: SceneRecord, folder: Path) -> Path:
    """Write ``folder/scene.json``; returns its path. Makes the folder where it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / SCENE
    write_bytes_atomically(path, scene_bytes(record))
    return path


def read_scene(path: Path) -> SceneRecord:
    """Read a scene file, or that of a scene's folder. Raises UsageError naming the file, the cause and the remedy."""
    file = path / SCENE if path.is_dir() else path
    if not file.is_file():
        raise UsageError(f"{path}: no {SCENE} there; give a scene that `manitwin layout` made")
    return parse_scene(file.read_bytes(), file)


def parse_scene(content: bytes, path: str | Path = SCENE) -> SceneRecord:
    """Read the content of a scene file; raises UsageError naming ``path``, the cause and the remedy."""
    try:
        data = json.loads(content)
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise UsageError(f"{path}: not JSON ({error}); sample the layout again") from error
    version = data.get("schema_version") if isinstance(data, dict) else None
    if version != SCENE_SCHEMA_VERSION:
        raise UsageError(
            f"{path}: scene version {version}, this package reads {SCENE_SCHEMA_VERSION}; sample the layout again"
        )
    try:
        return SceneRecord(**data)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise UsageError(f"{path}: {where}: {first['msg']}; sample the layout again") from error
