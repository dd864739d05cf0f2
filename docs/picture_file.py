"""Documentation pictures with provenance: a PNG text chunk holds digests of the content, which a test checks against the code."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.scenes.scene import SceneRecord
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import sha256_of_json

KEY = "made_of"
DECIMALS = 6


def save_picture(picture: Image.Image, path: Path, made_of: dict[str, str]) -> None:
    """Write a PNG with the digest of each of its subjects, by name."""
    text = PngInfo()
    text.add_text(KEY, json.dumps(made_of, sort_keys=True))
    picture.save(path, optimize=True, pnginfo=text)


def made_of(path: Path) -> dict[str, str]:
    """Return the digests stored in a picture; empty if it has none."""
    with Image.open(path) as picture:
        found: dict[str, str] = json.loads(picture.info.get(KEY, "{}"))
    return found


def of_twin(record: TwinRecord) -> str:
    """Return the digest of what a card shows of a twin, without backends, dates and checks, which it does not show."""
    said = record.model_dump(mode="json", include={"twin_id", "mesh", "physical", "language", "points", "grasps"})
    return sha256_of_json(said)[:16]


def of_scene(scene: SceneRecord) -> str:
    """Return the digest of the twins of a scene and their poses."""
    placed = [[each.twin_id, _rounded([*each.position_m, *each.quaternion_wxyz])] for each in scene.objects]
    return sha256_of_json(placed)[:16]


def of_episode(episode: StoredEpisode) -> str:
    """Return the digest of an episode's twins and joint motion."""
    moved = _rounded(episode.recording.joint_positions_rad)
    return sha256_of_json([[each.twin_id for each in episode.objects], moved])[:16]


def _rounded(values: object) -> list[float]:
    return (np.asarray(values, float).ravel().round(DECIMALS) + 0.0).tolist()
