"""Access to the object as left by earlier stages: solid, hulls, rigid body, annotator's subject; object frame, SI units."""

from __future__ import annotations

import hashlib
import io
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import trimesh
from trimesh.visual.material import PBRMaterial

from manitwin.engine.stage import Draft
from manitwin.formats.glb import read_glb
from manitwin.geometry.poses import OBJECT_TO_GLTF
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.rigid_body import RigidBody
from manitwin.models.annotators.protocol import PhysicalEstimates, SelectedPoints, Subject
from manitwin.pipeline.human_corrections import name_by_person
from manitwin.pipeline.item import Item
from manitwin.render.cameras import Camera
from manitwin.twin.grasp_table import JOINTS
from manitwin.twin.import_record import ImportRecord, read_import_record

_ROUNDING = 1e-9  # tolerated deviation of a scale factor from 1

KEPT = 3
"""Number of loaded meshes kept per worker. With two workers, the stages of two items alternate in each of them, with one more
waiting; keeping another would save a few loads and cost 10 MB.
"""
MOST_TEXTURE_PIXELS = 9_000_000
"""Limit over all kept meshes: the textures of two scans, 17 MB each; the mesh loaded last is always kept."""
_meshes: dict[str, OrderedDict[bytes, tuple[list[int], list[trimesh.Trimesh]]]] = {
    "solid": OrderedDict(), "visual": OrderedDict()
}  # fmt: skip
"""The most recently loaded meshes by file digest, with their hashes: consecutive stages need the same meshes."""


def load_solid(path: Path) -> trimesh.Trimesh:
    """Load the watertight mesh of ``solid.npz``, with cached data that other stages derived from it (rays, its opening)."""

    def read(content: bytes) -> list[trimesh.Trimesh]:
        with np.load(io.BytesIO(content)) as arrays:
            return [trimesh.Trimesh(arrays["vertices"], arrays["faces"], process=False)]

    return _loaded("solid", path, read)[0]


def load_visual(path: Path) -> list[trimesh.Trimesh]:
    """Load the parts of ``visual.glb`` or ``canonical.glb``; stages share them, so they must not be modified."""
    return list(_loaded("visual", path, lambda content: read_glb(path)))


def _loaded(kind: str, path: Path, read: Callable[[bytes], list[trimesh.Trimesh]]) -> list[trimesh.Trimesh]:
    content, known = path.read_bytes(), _meshes[kind]
    digest = hashlib.blake2b(content, digest_size=16).digest()
    hashes, meshes = known.pop(digest, ([], []))
    if not meshes or hashes != [hash(mesh) for mesh in meshes]:  # a stage has modified a mesh
        meshes = read(content)
        hashes = [hash(mesh) for mesh in meshes]
    known[digest] = hashes, meshes
    while len(known) > KEPT or (len(known) > 1 and _texture_pixels(known.values()) > MOST_TEXTURE_PIXELS):
        known.popitem(last=False)
    return meshes


def drop_cached_textures() -> None:
    """Drop cached meshes with textures before reading a new input, whose full textures are four times as large as most twins'."""
    known = _meshes["visual"]
    for digest in [digest for digest, each in known.items() if _texture_pixels([each])]:
        del known[digest]


def _texture_pixels(kept: Iterable[tuple[list[int], list[trimesh.Trimesh]]]) -> int:
    materials = [getattr(mesh.visual, "material", None) for _, meshes in kept for mesh in meshes]  # a solid has none
    pictures = {
        id(picture): picture.width * picture.height
        for material in materials
        if isinstance(material, PBRMaterial)
        for picture in (material.baseColorTexture, material.metallicRoughnessTexture, material.normalTexture)
        if picture is not None
    }
    return sum(pictures.values())


def load_hulls(path: Path) -> tuple[np.ndarray, ...]:
    """Load the vertices of the convex hulls in ``hulls.npz``, each ``(V, 3)``, sorted by name."""
    with np.load(path) as arrays:
        return tuple(arrays[name] for name in sorted(arrays.files))


def load_body(draft: Draft) -> RigidBody:
    """Load the hulls and the surface of ``solid.npz``, with mass properties and friction from the field ``physical``."""
    physical = draft.field("physical")
    return RigidBody(
        hulls=load_hulls(draft.path("hulls.npz")),
        mass_kg=physical["mass_kg"]["value"],
        center_of_mass_m=np.array(physical["center_of_mass_m"]),
        inertia_kg_m2=np.array(physical["inertia_kg_m2"]),
        friction_static=physical["friction_static"]["value"],
        friction_dynamic=physical["friction_dynamic"]["value"],
        surface=RayCaster(load_solid(draft.path("solid.npz"))),
    )


def joints_of(proposals: Mapping[str, np.ndarray], index: np.ndarray) -> dict[str, np.ndarray]:
    """Return the trial arguments of the grasps at ``index`` besides their poses: the joint values of hands with several
    joints.
    """
    if JOINTS[0] not in proposals:
        return {}
    return {"joints_rad": np.stack([proposals[name][index] for name in JOINTS], axis=1)}


def read_subject(
    draft: Draft[Item], *, solid: str, visual: str, metric: bool, scale: float = 1.0, size_estimated: bool = False
) -> Subject:
    """Read the subject of a draft; ``solid`` and ``visual`` are the names of the mesh artifacts.

    ``scale`` is the scale of these meshes relative to the canonical mesh, which the views show; ``size_estimated``: it is an
    estimate.
    """
    given = read_given(draft)
    return Subject(
        name=object_name(draft),
        solid=load_solid(draft.path(solid)),
        parts=tuple(load_visual(draft.path(visual))),
        metric=metric,
        views=pictures(draft.path("views/"), "rgb"),
        cameras=tuple(Camera.from_json(value).scaled(scale) for value in draft.field("cameras")),
        seed=draft.seed,
        given=given if given is None or scale == 1.0 else given.scaled(scale),
        size_estimated=size_estimated,
        likely=likely_names(draft),
    )


def read_scaled_subject(draft: Draft[Item], *, known_as: str | None) -> Subject:
    """Read the subject at the size determined by the physical stage; ``known_as`` is what it has been identified as since."""
    subject = read_subject(
        draft,
        solid="solid.npz",
        visual="visual.glb",
        metric=True,
        scale=draft.field("physical")["scale_applied"],
        size_estimated=draft.field("size") is not None,
    )
    return replace(subject, known_as=known_as)


def read_given(draft: Draft[Item]) -> ImportRecord | None:
    """Return an imported asset's record, or a generator's knowledge, in the object frame at the mesh stage's scale; None for
    others.
    """
    known = _known(draft)
    if known is not None:
        return ImportRecord.model_validate(known)
    if draft.payload.given is None:
        return None
    record = read_import_record(Path(draft.payload.given))
    to_object = np.array(draft.field("geometry")["input_to_object"]) @ OBJECT_TO_GLTF
    larger = float(np.cbrt(np.linalg.det(to_object[:3, :3])))  # scale relative to the file, if a person stated the size
    if abs(larger - 1.0) <= _ROUNDING:
        return record.moved(to_object)
    rigid = np.eye(4)
    rigid[:3] = to_object[:3] / larger
    return record.moved(rigid).resized(larger)


def object_name(draft: Draft[Item]) -> str | None:
    """Return the object's name; None if unknown.

    A person's statement takes precedence, then a generator that knows what it made, then a classifier.
    """
    said = name_by_person(draft)
    if said is not None:
        return said
    known = _known(draft)
    if known is not None:
        return str(known["name"])
    return cast(str | None, (draft.fields.get("naming") or {}).get("name"))


def likely_names(draft: Draft[Item]) -> tuple[tuple[str, float], ...]:
    """Return the possible names of an unnamed object with their probabilities; empty for a named one."""
    if object_name(draft) is not None:
        return ()
    guesses = (draft.fields.get("naming") or {}).get("likeliest", [])
    return tuple((guess["name"], guess["probability"]) for guess in guesses)


def _known(draft: Draft[Item]) -> dict[str, Any] | None:
    """Return the generator's knowledge of the object, in the object frame once the mesh stage has written ``geometry``."""
    if "geometry" in draft.fields:
        known = draft.field("geometry").get("known")
    else:
        known = draft.field("generation").get("known") if "generation" in draft.fields else None
    return cast(dict[str, Any] | None, known)


def cut_out_photos(draft: Draft[Item]) -> tuple[Path, ...]:
    """Return the cut-out photos from which the mesh was made; empty for other inputs."""
    if "photos/" in draft.paths:
        return tuple(sorted(draft.path("photos/").glob("*.png")))
    return (draft.path("photo.png"),) if "photo.png" in draft.paths else ()


def pictures(folder: Path, kind: str) -> tuple[Path, ...]:
    """Return the eight images of a kind ('rgb', 'marked'), sorted by number."""
    return tuple(sorted(folder.glob(f"{kind}_*.webp")))


def findings_of(answer: PhysicalEstimates | SelectedPoints) -> list[str] | None:
    """Return the remaining objections to an answer after it was repeated; None if it was not examined."""
    return None if answer.findings is None else list(answer.findings)
