"""The user's folder of weights: ONNX files named by the start of their digests, with a record beside each."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

from manitwin.errors import UsageError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.json_file import read_json_object
from manitwin.formats.onnx_file import MAX_ONNX_BYTES
from manitwin.models.weights.catalog import KNOWN_WEIGHTS, KnownWeights

FOLDER = "MANITWIN_MODELS"
"""Environment variable that names another folder."""


@dataclass(frozen=True)
class StoredWeights:
    """Record of added weights: ``path`` of the file, ``licence`` as the user confirmed it."""

    name: str
    path: Path
    sha256: str
    source: str
    licence: str


def weights_folder() -> Path:
    """Return ``$MANITWIN_MODELS``, else ``$XDG_DATA_HOME/manitwin/models`` (XDG Base Directory: ``~/.local/share``)."""
    named = os.environ.get(FOLDER, "")
    if named:
        return Path(named).absolute()
    base = os.environ.get("XDG_DATA_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".local" / "share") / "manitwin" / "models"


def store(weights: KnownWeights, content: bytes) -> StoredWeights:
    """Write verified weights and then their record; raises UsageError if the folder cannot be written."""
    folder = weights_folder()
    path = folder / f"{weights.name}-{weights.sha256[:12]}.onnx"
    record = {"file": path.name, "sha256": weights.sha256, "source": weights.source, "licence": weights.licence}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _write(path, content)
        _write(folder / f"{weights.name}.json", json.dumps(record, indent=1).encode() + b"\n")
    except OSError as error:
        raise UsageError(
            f"{folder}: cannot be written ({error.strerror or error}); name another folder in {FOLDER}"
        ) from error
    return StoredWeights(weights.name, path, weights.sha256, weights.source, weights.licence)


def find_stored(name: str) -> StoredWeights | None:
    """Return the record of added weights, None if they were not added; raises UsageError for a broken record."""
    path = weights_folder() / f"{name}.json"
    if not path.exists():
        return None
    remedy = f"manitwin models add {name}"
    record = read_json_object(path, UsageError, remedy=remedy)
    values = {key: record.get(key) for key in ("file", "sha256", "source", "licence")}
    if not all(isinstance(value, str) for value in values.values()) or Path(str(values["file"])).name != values["file"]:
        raise UsageError(f"{path}: not a record of weights; {remedy}")
    file = path.parent / str(values["file"])
    return StoredWeights(name, file, str(values["sha256"]), str(values["source"]), str(values["licence"]))


def read_stored(weights: StoredWeights) -> bytes:
    """Return the bytes of added weights; raises UsageError if the file is missing or has another digest."""
    content = read_bytes(weights.path, MAX_ONNX_BYTES, UsageError)
    if hashlib.sha256(content).hexdigest() != weights.sha256:
        raise UsageError(f"{weights.path}: not the file that was added (sha256); manitwin models add {weights.name}")
    return content


def all_weights() -> list[tuple[KnownWeights, StoredWeights | None]]:
    """Return all known weights by name, each with its record if it was added."""
    return [(KNOWN_WEIGHTS[name], find_stored(name)) for name in sorted(KNOWN_WEIGHTS)]


def _write(path: Path, content: bytes) -> None:
    """Write a file atomically."""
    descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".part")
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
