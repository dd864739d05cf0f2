"""GraspGen training data: the object, all tried grasps with their outcome, and the lists that its loader reads.

Sources: GraspGen docs/GRASP_DATASET_FORMAT.md, docs/GRIPPER_DESCRIPTION.md and grasp_gen/dataset/dataset_utils.py:
``GraspJsonDatasetReader`` (file names) and ``load_object_grasp_data``, which multiplies each transform by the
``transform_offset_from_asset_to_graspgen_convention`` of GraspGen's own gripper configuration. For ``franka_panda``
(config/grippers) this offset is the identity, and the fingers of its hand are apart along X (``GripperModel``). The file
therefore holds poses of the grasp frame, +Z approach and X closing, and not of the URDF's ``panda_hand``, which closes along Y.
"""

from __future__ import annotations

from typing import Any

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.grasp_rows import ASSETS, GraspRows, grasp_rows, parallel_gripper, parallel_grippers_of
from manitwin.assets.writers.licenses import license_of, provenance_lines
from manitwin.assets.writers.mesh_files import object_mesh
from manitwin.errors import ExportError
from manitwin.twin.store import canonical_json

FRAME = (
    "transforms: poses of the gripper's base link, +Z approach and X closing, in the frame of the object file (metres, +Z up),"
    " at its scale"
)
VALID_SHARE = 0.2  # GraspDataGen's default share of validation objects
FEWEST = 5  # held grasps: GraspGen skips objects with fewer (its discriminator also those with fewer failed ones)


def export(twin: TwinContent) -> Exported:
    """Write a twin as one object of a GraspGen data set, with a grasp file for each of its parallel grippers.

    The object root is ``objects/``, the grasp root ``grasp_data/<gripper>/``, and the split root ``splits/<gripper>/``. The
    split of an object follows from the twin's id. The mesh is the visual one in the object frame, +Z up. Failed grasps are
    included with ``object_in_gripper`` false, retired ones are not. Raises ExportError for a twin without grasps of a parallel
    gripper.
    """
    grippers = parallel_grippers_of(twin)
    if not grippers:
        raise ExportError(
            f"{twin.name}: it has no grasps of a parallel gripper, which GraspGen data is about alone; build it with one"
        )
    object_file = f"{twin.name}.obj"
    files = {f"objects/{object_file}": object_mesh(twin)}
    lines: list[str] = []
    for gripper in grippers:
        rows = grasp_rows(twin, gripper, controls=True)
        block, known = _gripper(gripper, rows)
        name = block["name"]
        files[f"grasp_data/{name}/{twin.name}.json"] = canonical_json(_content(twin, object_file, block, rows)).encode()
        files[f"grasp_data/{name}/map_uuid_to_path.json"] = canonical_json({object_file: f"{twin.name}.json"}).encode()
        for split in ("train", "valid"):
            chosen = split == ("valid" if _is_valid(twin) else "train")
            files[f"splits/{name}/{split}.txt"] = f"{object_file}\n".encode() if chosen else b""
        lines += known + _few(name, rows)
    return Exported(
        files=files,
        main=f"grasp_data/{ASSETS[grippers[0]].name if grippers[0] in ASSETS else grippers[0]}/{twin.name}.json",
        cannot_say=(
            "mass, inertia and friction of the object: GraspGen takes a mesh and its scale.",
            "a set of several objects: put the folders into one, and the entries of map_uuid_to_path.json and the lines of the"
            " splits together.",
            "why a grasp failed, its width and its robustness: the format has one truth value a grasp.",
            *lines,
        ),
    )


def _content(twin: TwinContent, object_file: str, gripper: dict[str, Any], rows: GraspRows) -> dict[str, Any]:
    return {
        "object": {"file": object_file, "scale": 1.0},
        "gripper": gripper,
        "grasps": {"transforms": rows.gripper_to_object.tolist(), "object_in_gripper": rows.held.tolist()},
        "frame": FRAME,
        "provenance": list(provenance_lines(twin.record)),
        "license": license_of(twin.record),
        "attribution": twin.record.source.attribution,
    }


def _gripper(name: str, rows: GraspRows) -> tuple[dict[str, Any], list[str]]:
    """Return the gripper's JSON block, and remarks for users of the file."""
    asset, gripper = ASSETS.get(name), parallel_gripper(name)
    depths = sorted(set(rows.depth_m.tolist()))
    block: dict[str, Any] = {
        "name": asset.name if asset else name,
        "depth": gripper.tip_depth_m if gripper else depths[-1],
        "transform_offset_from_asset_to_graspgen_convention": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]],
    }
    if gripper is not None:
        block["width"] = gripper.opening_m
    if asset is not None:
        return block, [
            f"poses of a hand that closes along Y: GraspGen's own configuration of {asset.name} has it close along X, with the"
            " identity as offset. One that GraspDataGen wrote in its place turns all grasps by a quarter."
        ]
    return block, [
        f"which link of {name} the poses are of: they are of the grasp frame (+Z approach, X closing), with the identity as"
        " offset; GraspGen's configuration of that gripper must have the same offset."
    ]


def _few(name: str, rows: GraspRows) -> list[str]:
    held, failed = int(rows.held.sum()), int((~rows.held).sum())
    return [
        f"enough of {name}: {count} grasps {word}, and GraspGen passes over objects with less than {FEWEST}."
        for word, count in (("held", held), ("failed", failed))
        if count < FEWEST
    ]


def _is_valid(twin: TwinContent) -> bool:
    return int(twin.record.twin_id, 16) % 1000 < 1000 * VALID_SHARE
