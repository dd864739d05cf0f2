"""Assembly of the finished twin folder, accepted or rejected, and the hint whether a name would improve the result."""

from __future__ import annotations

import hashlib
import platform
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from manitwin.engine.amendments import amendments_sha256
from manitwin.engine.stage import Draft, Stage
from manitwin.engine.stage_runner import StageCost
from manitwin.errors import InputError, Rejected
from manitwin.formats.camera_poses.transforms_json import transforms_of
from manitwin.formats.installation import installed_version
from manitwin.formats.npy_file import labels_to_npy
from manitwin.formats.packed_source import mask_name, mask_names, masks_beside, pack_photos, pack_source, photo_names
from manitwin.geometry.hulls.reduction import hull_to_obj
from manitwin.models.annotators.prior_names import find_prior
from manitwin.pipeline.drawn_masks import drawn_mask, with_drawn_masks
from manitwin.pipeline.grasps import GRASP_POINTS
from manitwin.pipeline.guesses import (
    OF_NO_NAME,
    likeliest_words,
    naming_checks,
    size_checks,
    template_checks,
    typical_size_words,
    unknown_name_words,
)
from manitwin.pipeline.item import Item
from manitwin.pipeline.links import link_table, read_articulation, visual_labels
from manitwin.pipeline.object_state import object_name
from manitwin.pipeline.parts import PARTS_FILE
from manitwin.pipeline.quality import rehearsal_checks
from manitwin.pipeline.stated_poses import StatedPoses, poses_of
from manitwin.pipeline.suspicious_size import suspicious_size_words
from manitwin.twin.integrity import write_sizes
from manitwin.twin.link_records import FACE_LINKS
from manitwin.twin.part_records import FACE_PARTS
from manitwin.twin.record import REJECTION_REASONS, Rejection, TwinRecord
from manitwin.twin.shape_file import SHAPE, compute_shape, shape_to_json
from manitwin.twin.store import RUN, canonical_json, write_bytes_atomically, write_twin_record

NAME_HINT = "say what it is with --name (mug, fork, ...) or a column name"

RULES = "rules"
"""The annotator that uses only priors; for an unnamed object, the prior for any object."""

OF_SIZE = frozenset({"too_wide", "too_thin", "no_proposal", "none_held"})
OF_MASS = frozenset({"none_held"})
IMPLAUSIBLE = frozenset({"implausible_size", "implausible_mass"})


def assemble(
    draft: Draft[Item],
    *,
    kind: str,
    stages: list[Stage],
    costs: dict[str, StageCost],
    config_sha256: str,
    rejected: Rejected | None,
    rejecting_stage: str | None,
    fresh: Path,
    keep_source: bool = True,
) -> TwinRecord:
    """Write the twin's folder into the empty folder ``fresh``, and return its record.

    ``stages`` are those that ran, including the rejecting one. With ``rejected``, only the source, the reason and the
    rejection's files are written. Without ``keep_source``, the input is represented by names, sizes and digests, and
    ``run.json`` contains its path.
    """
    source = _write_source(draft, kind, fresh, keep_source)
    record: dict[str, Any] = {
        "twin_id": draft.item_id,
        "name": object_name(draft),
        "naming": draft.fields.get("naming"),
        "status": "rejected" if rejected else "accepted",
        "rejection": _rejection(rejected, rejecting_stage, draft).model_dump() if rejected else None,
        "source": source,
        "provenance": {
            "manitwin_version": installed_version(),
            "config_sha256": config_sha256,
            "seed": draft.seed,
            "stages": {s.name: _provenance(s, draft) for s in stages},
            "amendments_sha256": amendments_sha256(draft.amendments),
        },
        "quality": {"checks": _checks_so_far(draft)},
    }
    if rejected is not None:
        for name, content in rejected.files.items():
            (fresh / name).write_bytes(content)
    else:
        _write_accepted(draft, fresh)
        record |= _accepted_sections(draft) | _write_links(draft, fresh)
    host: dict[str, Any] = {
        "machine": platform.machine(), "system": platform.system(), "python": platform.python_version()
    }  # fmt: skip
    if not keep_source and draft.payload.file is not None:
        host["source"] = [
            str(Path(file).resolve()) for file in (*draft.payload.files, *filter(None, draft.payload.masks))
        ]
    run = {"stages": {name: vars(cost) for name, cost in costs.items()}, "host": host}
    write_bytes_atomically(fresh / RUN, canonical_json(run).encode())
    sealed = write_twin_record(fresh, record)
    write_sizes(fresh)
    return sealed


def _provenance(stage: Stage, draft: Draft[Item]) -> dict[str, Any]:
    return {
        "version": stage.version,
        "backend": stage.backend,
        "model": _model(stage, draft),
        "rehearsal": stage.name in draft.rehearsed,
    }


def _checks_so_far(draft: Draft[Item]) -> list[dict[str, Any]]:
    """Return the checks for a rejected twin; an accepted twin gets those of the ``finish`` stage instead."""
    made = [*rehearsal_checks(draft), *naming_checks(draft), *size_checks(draft), *template_checks(draft)]
    return [*(check.model_dump() for check in made), *draft.fields.get("gate", {}).get("checks", [])]


def _model(stage: Stage, draft: Draft[Item]) -> str | None:
    """Return the model of a stage; a generator may report it only afterwards (lift: the fitted primitive)."""
    if stage.name == "generate" and "generation" in draft.fields:
        return stage.model or draft.field("generation")["model"]
    return stage.model


def _write_source(draft: Draft[Item], kind: str, folder: Path, keep: bool) -> dict[str, Any]:
    item, poses, mask = draft.payload, None, None
    if item.file is None:
        name, content = "prompt.txt", (item.text or "").encode()
        (folder / name).write_bytes(content)
        sha256 = hashlib.sha256(content).hexdigest()
    elif item.views:
        paths = [Path(file) for file in item.files]
        with TemporaryDirectory() as place:
            masked = with_drawn_masks(draft, Path(place)) if keep else item
            poses = _readable_poses(masked)
            beside = masks_beside(masked.masks)
            cameras = None if poses is None else Path(place) / "transforms.json"
            if poses is not None and cameras is not None:
                masks = list(dict.fromkeys(camera.mask for camera in poses.cameras if camera.mask is not None))
                kept = dict(zip(masks, mask_names(masks), strict=True))
                stated = transforms_of(poses.cameras, photo_names(paths), poses.unit_m, kept)
                cameras.write_text(canonical_json(stated), encoding="utf-8")
                beside = {cameras.name: cameras} | {called: mask for mask, called in kept.items()}
            name, sha256 = pack_photos(paths, folder, keep=keep, beside=beside)
    else:
        given = [] if item.given is None else [Path(item.given)]
        drawn = drawn_mask(draft) if keep else None
        outline = Path(item.masks[0]) if item.masks and drawn is None else None
        name, sha256 = pack_source(Path(item.file), folder, given, keep=keep, mask=outline)
        mask = mask_name(outline) if outline is not None and keep else None
        if drawn is not None:
            mask = mask_name(Path("drawn.png"))
            (folder / mask).write_bytes(drawn)
    return {
        "kind": kind,
        "file": name,
        "sha256": sha256,
        "prompt": item.text,
        "variation": item.variation,
        "turns_deg": list(item.turns_deg) or None,
        "poses": None if poses is None else poses.to_json(),
        "mask": mask,
        "box_px": list(item.box_px) or None,
        "license": item.license or "unknown",
        "attribution": item.attribution,
    }


def _readable_poses(item: Item) -> StatedPoses | None:
    """Return the stated camera poses; None if there are none or they cannot be read."""
    try:
        return poses_of(item)
    except InputError:
        return None


def _rejection(rejected: Rejected, stage: str | None, draft: Draft[Item]) -> Rejection:
    """Return the rejection with its stage; if an unknown or suspicious size may be the cause, the detail says so."""
    named = rejected.stage or stage or ""
    if rejected.reason not in REJECTION_REASONS.get(named, frozenset()):
        named = next((s for s, reasons in REJECTION_REASONS.items() if rejected.reason in reasons), named)
    detail = rejected.detail
    unsaid = typical_size_words(draft)
    if rejected.reason in OF_SIZE and unsaid is not None:
        detail += f", but {unsaid}"
    suspicious = suspicious_size_words(draft) if rejected.reason in OF_SIZE else None
    if suspicious is not None:
        detail = f"{suspicious}; {detail}"
    return Rejection(stage=named, reason=rejected.reason, detail=detail)


def _write_accepted(draft: Draft[Item], folder: Path) -> None:
    for name in ("visual.glb", "grasps.parquet", "card.png"):
        shutil.copyfile(draft.path(name), folder / name)
    (folder / SHAPE).write_bytes(shape_to_json(compute_shape(folder / "visual.glb")))
    if draft.field("parts"):
        with np.load(draft.path(PARTS_FILE)) as arrays:
            (folder / FACE_PARTS).write_bytes(labels_to_npy(arrays["visual"]))
    (folder / "views").mkdir()
    for artifact in ("views/", "marked/", "closer/"):
        for picture in sorted(draft.path(artifact).iterdir()):
            shutil.copyfile(picture, folder / "views" / picture.name)
    (folder / "collision").mkdir()
    with np.load(draft.path("hulls.npz")) as hulls:
        for index, name in enumerate(sorted(hulls.files)):
            (folder / "collision" / f"hull_{index:02d}.obj").write_bytes(hull_to_obj(hulls[name]))


def _write_links(draft: Draft[Item], folder: Path) -> dict[str, Any]:
    """Write the link of each face of an articulated object; return its links and joints, or an empty dict for other objects."""
    articulation = read_articulation(draft)
    if articulation is None:
        return {}
    labels = visual_labels(draft, articulation)
    (folder / FACE_LINKS).write_bytes(labels_to_npy(labels))
    links = [link.model_dump() for link in link_table(draft, articulation, labels)]
    return {"links": links, "joints": [joint.model_dump() for joint in articulation.joints]}


def _accepted_sections(draft: Draft[Item]) -> dict[str, Any]:
    geometry, collision, points = draft.field("geometry"), draft.field("collision"), draft.field("points")
    mesh = {key: geometry[key] for key in ("vertices", "faces", "watertight", "components", "euler_number", "repairs")}
    with np.load(draft.path("solid.npz")) as solid:
        triangles = solid["vertices"][solid["faces"]]
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    mesh["volume_m3"] = float(np.einsum("ij,ij->", triangles[:, 0], cross) / 6)
    mesh["area_m2"] = float(np.linalg.norm(cross, axis=1).sum() / 2)
    mesh["hulls"] = {
        key: value for key, value in collision.items() if key not in ("holes_kept", "method", "notes", "links")
    }
    return {
        "mesh": mesh,
        "physical": draft.field("physical"),
        "language": draft.field("language"),
        "points": {"candidates": _candidates(draft), **points, **draft.field(GRASP_POINTS)},
        "parts": draft.field("parts"),
        "grasps": draft.field("grasps"),
        "placements": draft.field("placements"),
        "quality": draft.field("quality"),
    }


def _candidates(draft: Draft[Item]) -> dict[str, Any]:
    """Return the candidates, with those moved by a closer look at the positions of their functional points."""
    candidates, refined = draft.field("candidates"), draft.field("refined_candidates")
    positions, normals = list(candidates["positions_m"]), list(candidates["normals"])
    moved = {row["candidate"] for row in refined}
    for point in draft.field("points")["functional"]:
        if point["candidate"] in moved:
            positions[point["candidate"]], normals[point["candidate"]] = point["position_m"], point["normal"]
    return {"positions_m": positions, "normals": normals, "refined": refined}


def name_hint(record: TwinRecord) -> str | None:
    """Return a hint to give a name, with the classifier's guesses; None if a name would not change the result."""
    if not name_would_help(record):
        return None
    if record.naming is None:
        return NAME_HINT if record.name is None else unknown_name_words(record.name)
    return f"{NAME_HINT}; by its pictures it is {likeliest_words(record.naming.model_dump())}"


def name_would_help(record: TwinRecord) -> bool:
    """Return whether the result depends on a generic prior or a classifier's guess that a known name would replace.

    For an accepted twin: the mass or friction comes from a generic prior. For a rejected one: a generic size or mass was
    decisive, or size and mass contradict each other, or a lifted photo has no stable pose, as its posture depends on the name.
    """
    if record.naming is None and find_prior(record.name) is not None:
        return False
    if record.physical is not None:
        physical = record.physical
        return not OF_NO_NAME.isdisjoint((physical.mass_kg.source, physical.friction_static.source))
    if record.rejection is None:
        return False
    reason, stages = record.rejection.reason, record.provenance.stages
    if reason in IMPLAUSIBLE:
        return True
    if reason == "no_stable_pose":
        return "generate" in stages and stages["generate"].backend == "lift"
    if "physical" not in stages or stages["physical"].backend != RULES:
        return False
    size_known = any(check.name == "plausible_size" and check.passed is not None for check in record.quality.checks)
    return reason in (OF_MASS if size_known else OF_SIZE)
