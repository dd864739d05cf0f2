"""Where the scenes of a run are: ``SCENES/scenes/<thousand>/<scene_id>/scene.json``."""

from __future__ import annotations

import json
from pathlib import Path

from manitwin.errors import UsageError
from manitwin.scenes.scene import SCENE

SCENES = "scenes"
CONFIG = "config.json"


def scene_name(scene_id: str) -> str:
    """Return a scene's folder below the root: a thousand scenes share one."""
    number = scene_id.rpartition("_")[2]
    return f"{SCENES}/{int(number) // 1000:04d}/{scene_id}"


def dataset_of(scene: Path) -> str:
    """Return the data set that a scene of a run was sampled from; raises UsageError where its folder does not say so."""
    for folder in scene.resolve().parents:
        if folder.name == SCENES and (folder.parent / CONFIG).is_file():
            said = json.loads((folder.parent / CONFIG).read_bytes())
            if isinstance(said.get("dataset"), str):
                return str(said["dataset"])
    raise UsageError(f"{scene}: not in a folder that `manitwin layout` wrote; say which data set it was sampled from")


def scene_ids(root: Path) -> list[str]:
    """Return the ids of the accepted scenes below a root, sorted; raises UsageError where there are none."""
    found = sorted(path.parent.name for path in (root / SCENES).glob(f"*/*/{SCENE}"))
    if not found:
        raise UsageError(f"{root}: no scene there; `manitwin layout DATASET -o {root}` makes some")
    return found


def scene_files(place: Path) -> list[Path]:
    """Return the scene files at a place: a scene's file, that of a scene's folder, or all of a run; none where it has none."""
    if place.is_file():
        return [place] if place.name == SCENE else []
    if (place / SCENE).is_file():
        return [place / SCENE]
    return sorted((place / SCENES).glob(f"*/*/{SCENE}"))
