"""Scene files of a run, at ``SCENES/scenes/<thousand>/<scene_id>/scene.json``: paths, reading and writing."""

from __future__ import annotations

import os
from pathlib import Path

from pydantic import ValidationError

from manitwin.errors import UsageError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.json_file import MAX_JSON_BYTES, parse_json_object, read_json_object
from manitwin.formats.printable import printable_line
from manitwin.formats.schema_version import is_newer, newer_schema_message
from manitwin.scenes.scene import SCENE, SCENE_SCHEMA_VERSION, SCENE_SCHEMA_VERSIONS, SceneRecord
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import canonical_json, write_bytes_atomically

SCENES = "scenes"
CONFIG = "config.json"


def scene_bytes(record: SceneRecord) -> bytes:
    """Return the content of a scene file as canonical JSON."""
    return canonical_json(record.model_dump(mode="json")).encode()


def write_scene(record: SceneRecord, folder: Path) -> Path:
    """Write ``folder/scene.json``, making the folder if needed, and return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / SCENE
    write_bytes_atomically(path, scene_bytes(record))
    return path


def read_scene(path: Path) -> SceneRecord:
    """Read a scene file, or that in a scene's folder. Raises UsageError naming the file, the cause and the remedy."""
    file = path / SCENE if path.is_dir() else path
    if not os.path.lexists(file):
        raise UsageError(f"{path}: it contains no {SCENE}; give a scene that `manitwin layout` made")
    return parse_scene(read_bytes(file, MAX_JSON_BYTES, UsageError, inside=file.parent, name=str(file)), file)


def parse_scene(content: bytes, path: str | Path = SCENE) -> SceneRecord:
    """Parse the content of a scene file; raises UsageError naming ``path``, the cause and the remedy."""
    data = parse_json_object(content, str(path), UsageError, remedy="sample the layout again")
    version = data.get("schema_version")
    if is_newer(version, SCENE_SCHEMA_VERSION):
        raise UsageError(newer_schema_message(path, version, SCENE_SCHEMA_VERSION))
    if version not in SCENE_SCHEMA_VERSIONS or isinstance(version, bool):
        version = printable_line(str(version), max_characters=40)
        raise UsageError(
            f"{path}: scene version {version}, this package reads 1 to {SCENE_SCHEMA_VERSION}; sample the layout again"
        )
    try:
        return SceneRecord(**data)
    except ValidationError as error:
        first = error.errors()[0]
        where = printable_line(".".join(map(str, first["loc"])), max_characters=80)
        raise UsageError(f"{path}: {where}: {first['msg']}; sample the layout again") from error


def scene_name(scene_id: str) -> str:
    """Return a scene's folder below the root; a thousand scenes share a parent folder."""
    number = scene_id.rpartition("_")[2]
    return f"{SCENES}/{int(number) // 1000:04d}/{scene_id}"


def read_scene_content(root: DatasetRoot, scene_id: str) -> bytes | None:
    """Return the content of a scene's file in a run; None if it is missing or unreadable.

    Raises UsageError for a file that a newer version of this package wrote, which must not be replaced.
    """
    name = f"{scene_name(scene_id)}/{SCENE}"
    try:
        content = root.read_bytes(name, UsageError, limit_bytes=MAX_JSON_BYTES)
        said = parse_json_object(content, name, UsageError)
    except (FileNotFoundError, UsageError):
        return None
    if is_newer(version := said.get("schema_version"), SCENE_SCHEMA_VERSION):
        raise UsageError(newer_schema_message(root.full(name), version, SCENE_SCHEMA_VERSION))
    try:
        parse_scene(content, name)
    except UsageError:
        return None
    return content


def dataset_of(scene: Path) -> str:
    """Return the data set that a scene of a run was sampled from; raises UsageError if its folder does not state it."""
    for folder in scene.resolve().parents:
        if folder.name == SCENES and (folder.parent / CONFIG).is_file():
            said = read_json_object(
                folder.parent / CONFIG, UsageError, inside=folder.parent, name=f"{folder.parent}/{CONFIG}"
            )
            if isinstance(said.get("dataset"), str):
                return str(said["dataset"])
    raise UsageError(f"{scene}: not in a folder that `manitwin layout` wrote; say which data set it was sampled from")


def scene_ids(root: Path) -> list[str]:
    """Return the sorted ids of the accepted scenes below a root; raises UsageError if there are none."""
    found = sorted(path.parent.name for path in (root / SCENES).glob(f"*/*/{SCENE}"))
    if not found:
        raise UsageError(f"{root}: no scene there; `manitwin layout DATASET -o {root}` makes some")
    return found


def scene_files(place: Path) -> list[Path]:
    """Return the scene files at a path: a scene file, that in a scene's folder, or all of a run; empty if there are none."""
    if place.is_file():
        return [place] if place.name == SCENE else []
    if (place / SCENE).is_file():
        return [place / SCENE]
    return sorted((place / SCENES).glob(f"*/*/{SCENE}"))
