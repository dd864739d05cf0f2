"""Export of parts in the PartNeXt format: a GLB file per object and one table of faces by part.

The format is that of the toolkit ``partnext`` 1.0.1: ``data/<type_id>/<model_id>.glb``, and in ``PartNeXt`` a data set saved to
disk by Hugging Face ``datasets``, with ``model_id``, ``type_id``, ``masks`` (JSON: part, mesh of the file, faces) and
``hierarchyList`` (JSON: ``name``, ``nodeId``, ``maskId``, ``children``; geometry at the leaves).
"""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path
from types import TracebackType

import numpy as np
import pyarrow as pa

from manitwin.twin.loaded_twin import Twin
from manitwin.twin.part_records import NO_PART

_COLUMNS = ("model_id", "type_id", "masks", "hierarchyList")
_SCHEMA = pa.schema([(name, pa.string()) for name in _COLUMNS])
_TABLE = "data-00000-of-00001.arrow"
ANNOTATIONS, MESHES = "PartNeXt", "data"


class PartNextFolder:
    """A folder in PartNeXt format, written object by object; leaving the ``with`` block completes its table."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.count = 0
        self._digest = hashlib.sha256()
        (folder / ANNOTATIONS).mkdir(parents=True)
        self._table = pa.ipc.new_stream(str(folder / ANNOTATIONS / _TABLE), _SCHEMA)

    def add(self, twin: Twin, category: str) -> None:
        """Add a twin with known parts: an unchanged copy of its ``visual.glb``, and the faces of its parts."""
        name = twin.record.twin_id
        mesh = self.folder / MESHES / category / f"{name}.glb"
        mesh.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(twin.folder / "visual.glb", mesh)
        row = (name, category, json.dumps(part_masks(twin)), json.dumps(part_tree(twin, category)))
        self._digest.update("\0".join(row).encode())
        columns = [pa.array([value], pa.string()) for value in row]
        self._table.write_batch(pa.record_batch(columns, schema=_SCHEMA))
        self.count += 1

    def __enter__(self) -> PartNextFolder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._table.close()
        state: dict[str, object] = {
            "_data_files": [{"filename": _TABLE}], "_fingerprint": self._digest.hexdigest()[:16], "_format_columns": None,
            "_format_kwargs": {}, "_format_type": None, "_output_all_columns": False, "_split": None,
        }  # fmt: skip
        features = {name: {"dtype": "string", "_type": "Value"} for name in _COLUMNS}
        info = {"citation": "", "description": "", "features": features, "homepage": "", "license": ""}
        for name, content in (("state.json", state), ("dataset_info.json", info)):
            (self.folder / ANNOTATIONS / name).write_text(json.dumps(content, indent=1, sort_keys=True) + "\n")


def part_masks(twin: Twin) -> dict[str, dict[str, list[int]]]:
    """Return, for each part by its index in the twin's record, its faces in each mesh of ``visual.glb``."""
    faces = [len(mesh.faces) for mesh in twin.visual]
    labels = np.split(twin.face_parts(), np.cumsum(faces)[:-1])
    masks: dict[str, dict[str, list[int]]] = {}
    for mesh, of_mesh in enumerate(labels):
        for part in np.unique(of_mesh[of_mesh != NO_PART]).tolist():
            masks.setdefault(str(part), {})[str(mesh)] = np.flatnonzero(of_mesh == part).tolist()
    return dict(sorted(masks.items(), key=lambda each: int(each[0])))


def part_tree(twin: Twin, category: str) -> list[dict[str, object]]:
    """Return the hierarchy of an object: one root with the parts as leaves."""
    leaves = [
        {"name": part.name, "nodeId": number, "maskId": number - 1, "children": []}
        for number, part in enumerate(twin.record.parts, 1)
    ]
    return [{"name": category, "nodeId": 0, "maskId": -1, "children": leaves}]
