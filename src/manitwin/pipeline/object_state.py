"""Read the object from what earlier stages left: solid, hulls, rigid body, annotator's subject; object frame, SI units."""

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

_ROUNDING = 1e-9  # of a factor of one

KEPT = 3
"""A worker has the stages of so many items in turn where two work: of each of two, one is done and one waits beside it;
one more would spare a worker a few loads, and costs it 10 MB."""
MOST_TEXTURE_PIXELS = 9_000_000
"""Of all that are kept, two scans' textures, 17 MB each; the mesh that was loaded last is kept whatever it has."""
_meshes: dict[str, OrderedDict[bytes, tuple[list[int], list[trimesh.Trimesh]]]] = {
    "solid": OrderedDict(), "visual": OrderedDict()
}  # fmt: skip
"""The meshes that were loaded last by the digests of their files, with their own: one stage after the other wants them."""


def load_solid(path: Path) -> trimesh.Trimesh:
    """Load the watertight mesh of ``solid.npz``; what was made of it for another stage (rays, its opening) comes with it."""

    def read(content: bytes) -> list[trimesh.Trimesh]:
        with np.load(io.BytesIO(content)) as arrays:
            return [trimesh.Trimesh(arrays["vertices"], arrays["faces"], process=False)]

    return _loaded("solid", path, read)[0]


def load_visual(path: Path) -> list[trimesh.Trimesh]:
    """Load the parts of ``visual.glb`` or ``canonical.glb``, the same ones for stage after stage: nobody changes them."""
    return list(_loaded("visual", path, lambda content: read_glb(path)))


def _loaded(kind: str, path: Path, read: Callable[[bytes], list[trimesh.Trimesh]]) -> list[trimesh.Trimesh]:
    content, known = path.read_bytes(), _meshes[kind]
    digest = hashlib.blake2b(content, digest_size=16).digest()
    hashes, meshes = known.pop(digest, ([], []))
    if not meshes or hashes != [hash(mesh) for mesh in meshes]:  # the last: somebody has changed one
        meshes = read(content)
        hashes = [hash(mesh) for mesh in meshes]
    known[digest] = hashes, meshes
    while len(known) > KEPT or (len(known) > 1 and _texture_pixels(known.values()) > MOST_TEXTURE_PIXELS):
        known.popitem(last=False)
    return meshes


def let_go_of_textures() -> None:
    """Forget the meshes with textures: of the next thing whole pictures are read, four times as large as those of most twins."""
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
    """Load the convex vertices of ``hulls.npz``, each ``(V, 3)``, in the order of their names."""
    with np.load(path) as arrays:
        return tuple(arrays[name] for name in sorted(arrays.files))


def load_body(draft: Draft) -> RigidBody:
    """Load the hulls and the surface of ``solid.npz`` with the mass properties and friction of the field ``physical``."""
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
    """Return what a trial wants to know of the grasps at ``index`` beside their poses: the joints of hands with more."""
    if JOINTS[0] not in proposals:
        return {}
    return {"joints_rad": np.stack([proposals[name][index] for name in JOINTS], axis=1)}


def read_subject(
    draft: Draft[Item], *, solid: str, visual: str, metric: bool, scale: float = 1.0, size_estimated: bool = False
) -> Subject:
    """Read the subject of a draft; ``solid`` and ``visual`` name the artifacts that hold the meshes.

    ``scale`` is how much larger these are than the canonical mesh, which the views were taken of; ``size_estimated`` says
    that an estimate gave it.
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
    """Read the subject at the size that the physical stage gave it; ``known_as`` is what it was found to be since."""
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
    """Return what an imported asset gives or a generator knows, moved as the mesh stage moved its mesh; None for others."""
    known = _known(draft)
    if known is not None:
        return ImportRecord.model_validate(known)
    if draft.payload.given is None:
        return None
    record = read_import_record(Path(draft.payload.given))
    to_object = np.array(draft.field("geometry")["input_to_object"]) @ OBJECT_TO_GLTF
    larger = float(np.cbrt(np.linalg.det(to_object[:3, :3])))  # than its file says, where a person does
    if abs(larger - 1.0) <= _ROUNDING:
        return record.moved(to_object)
    rigid = np.eye(4)
    rigid[:3] = to_object[:3] / larger
    return record.moved(rigid).resized(larger)


def object_name(draft: Draft[Item]) -> str | None:
    """Return what the object is called; None: nobody says.

    A person's word counts first, then that of a generator that knows what it made, then a classifier's.
    """
    said = name_by_person(draft)
    if said is not None:
        return said
    known = _known(draft)
    if known is not None:
        return str(known["name"])
    return cast(str | None, (draft.fields.get("naming") or {}).get("name"))


def likely_names(draft: Draft[Item]) -> tuple[tuple[str, float], ...]:
    """Return the names that a thing without one may have, each with its probability; none of what has a name."""
    if object_name(draft) is not None:
        return ()
    guesses = (draft.fields.get("naming") or {}).get("likeliest", [])
    return tuple((guess["name"], guess["probability"]) for guess in guesses)


def _known(draft: Draft[Item]) -> dict[str, Any] | None:
    """Return what the generator knows of the object, in the object frame once the mesh stage has left ``geometry``."""
    if "geometry" in draft.fields:
        known = draft.field("geometry").get("known")
    else:
        known = draft.field("generation").get("known") if "generation" in draft.fields else None
    return cast(dict[str, Any] | None, known)


def cut_out_photos(draft: Draft[Item]) -> tuple[Path, ...]:
    """Return the cut-out photos that the mesh was made of; none where it was made of something else."""
    if "photos/" in draft.paths:
        return tuple(sorted(draft.path("photos/").glob("*.png")))
    return (draft.path("photo.png"),) if "photo.png" in draft.paths else ()


def pictures(folder: Path, kind: str) -> tuple[Path, ...]:
    """Return the eight pictures of a kind ('rgb', 'marked') in the order of their numbers."""
    return tuple(sorted(folder.glob(f"{kind}_*.webp")))


def findings_of(answer: PhysicalEstimates | SelectedPoints) -> list[str] | None:
    """Return what still spoke against an answer when it was given again; None: nobody looked."""
    return None if answer.findings is None else list(answer.findings)
