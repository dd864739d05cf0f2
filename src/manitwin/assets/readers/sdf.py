"""SDF reader: the first object of a model, with links on fixed joints merged, and optionally its movable joints."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.articulation import Articulation, AssetLink, LinkTree
from manitwin.assets.asset import Asset, Contact, Inertial, combined_inertial
from manitwin.assets.asset_files import MESH_LIMITS, AssetFiles
from manitwin.assets.joints import Joints
from manitwin.assets.licence_text import stated_licence, stated_or_none
from manitwin.assets.read import is_file_below, only_file
from manitwin.assets.readers.drake_friction import drake_contact
from manitwin.assets.readers.joint_elements import sdf_joints
from manitwin.assets.readers.sdf_links import chosen_links
from manitwin.assets.readers.sdf_shapes import ModelFrames, SdfShapes, pose_of
from manitwin.assets.readers.upright import Shapes, concatenate_links, upright_shapes
from manitwin.assets.readers.urdf_shapes import candidates
from manitwin.assets.root import root_of
from manitwin.errors import AssetError
from manitwin.formats.meshes.source import MeshLimits
from manitwin.formats.xml_file import comments_before, number, read_xml, text_of

_MAX_INCLUDES, _MOST_LOOKED_UP = 8, 16
MAIN_FILE, CONFIG_FILE = "model.sdf", "model.config"
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


@dataclass(frozen=True)
class SdfModel:
    """An SDF model with the links of the selected object; ``config`` is the root of the model.config beside it.

    ``moving`` is the tree of supported joints between these links, None if none is kept.
    """

    file: Path
    root: etree._Element
    config: etree._Element | None
    model: etree._Element
    links: tuple[etree._Element, ...]
    frames: ModelFrames
    files: AssetFiles
    moving: LinkTree | None = None


def read(path: Path, root: Path | None = None, limits: MeshLimits = MESH_LIMITS, *, joints: Joints = "part") -> Asset:
    """Read an SDF file, or a model folder; the asset's axes are those of the model.

    Meshes are looked up in the folder of the file and in those above it up to ``root`` (default: ``root_of`` the path); those
    of ``model://`` first in the folder with the name of the model. Links behind movable joints are left out with a remark,
    locked in the pose of the file, or kept (``joints``). Nested and included models are left out with a remark. Raises
    AssetError naming what is broken. Source: the SDFormat specification, version 1.9.
    """
    opened = open_sdf(path, root, limits, joints=joints)
    return asset_of(opened, path)


def open_sdf(
    path: Path, folder: Path | None = None, limits: MeshLimits = MESH_LIMITS, *, joints: Joints = "part"
) -> SdfModel:
    """Parse an SDF file and select the object in it; raises AssetError."""
    file = path
    if path.is_dir():
        file = path / MAIN_FILE if is_file_below(path / MAIN_FILE, path) else only_file(path)
    files = AssetFiles(folder or root_of(path), file.resolve().parent, limits)
    files.used.add(file.resolve())
    file, root = _included(file, read_xml(file, "sdf"), files)
    config = file.parent / CONFIG_FILE
    beside = None
    if is_file_below(config, config.parent):
        try:
            beside = read_xml(config, "model", inside=config.parent)
        except AssetError as error:
            files.remark_leniency(f"{error}; its name, author and licence were not read")
    if beside is not None:
        files.used.add(config.resolve())
    model = _only_model(file, root, files)
    frames = ModelFrames(file, model)
    links, moving = tuple(model.findall("link")), None
    if not _is_static(model):
        links, moving = chosen_links(model, frames, files, joints, root.get("version"))
    return SdfModel(file, root, beside, model, links, frames, files, moving)


def _included(file: Path, root: etree._Element, files: AssetFiles) -> tuple[Path, etree._Element]:
    """Return file and root of the first existing model that a file without shapes includes; otherwise the file itself.

    Includes of a model come first, then those of the world and of the file.
    """
    for _ in range(_MAX_INCLUDES):
        if root.find(".//visual") is not None or root.find(".//collision") is not None:
            break
        holders = [*root.findall("model"), *root.findall("world/model"), *root.findall("world"), root]
        uris = [uri for holder in holders for include in holder.findall("include") if (uri := text_of(include, "uri"))]
        places = {uri: list(_main_files(uri, file, files)) for uri in uris[:_MOST_LOOKED_UP]}
        there = [uri for uri, tried in places.items() if any(is_file_below(place, files.root) for place in tried)]
        for absent in [uri for uri in places if uri not in there] if there else ():
            files.find(f"{absent}/{MAIN_FILE}", ())
        uri = next(iter(there or places), None)
        found = None if uri is None else files.find(uri, places[uri])
        if found is None:
            break
        files.remark(f"it has no shape of its own; of the models that it includes, {uri!r} was read")
        file, root = found, read_xml(found, "sdf")
    return file, root


def _main_files(uri: str, file: Path, files: AssetFiles) -> Iterator[Path]:
    """Yield candidate main files of a named model: those that its model.config states, then model.sdf."""
    for config in candidates(f"{uri}/{CONFIG_FILE}", file, files.root):
        if is_file_below(config, files.root) and config.resolve().is_relative_to(files.root.resolve()):
            with suppress(AssetError):  # model.sdf remains
                said = [(each.text or "").strip() for each in read_xml(config, "model").findall("sdf")]
                yield from (config.parent / name for name in reversed(said) if name)
    yield from candidates(f"{uri}/{MAIN_FILE}", file, files.root)


def asset_of(opened: SdfModel, path: Path) -> Asset:
    """Return the asset that the SDF elements describe; raises AssetError."""

    def shapes(turn: bool) -> list[Shapes]:
        return SdfShapes(opened.file, opened.frames, opened.files, turn_gltf=turn).by_link(opened.links)

    by_link = upright_shapes(shapes, opened.files)
    visual, collision, owners = concatenate_links(by_link)
    if not visual and not collision and not opened.files.missing:
        terrain = any(link.find(".//heightmap") is not None for link in opened.links)
        raise AssetError(
            f"{opened.file.name}: its shape is a <heightmap>, a terrain, whose picture cannot be read"
            if terrain
            else f"{opened.file.name}: no link of it has a shape"
        )
    licence, attribution = _licence(opened)
    named = None if opened.config is None else text_of(opened.config, "name")
    return Asset(
        format="sdf",
        path=path,
        name=(named or opened.model.get("name") or opened.file.stem).replace("_", " "),
        visual=tuple(visual),
        collision=tuple(collision),
        up="z",
        unit_m=1.0,
        inertial=_declared_inertial(opened, opened.links),
        contact=_declared_contact(opened),
        static=_is_static(opened.model),
        license=licence,
        attribution=attribution,
        files=opened.files.sorted_files(),
        missing_files=opened.files.missing_names(),
        remarks=tuple(opened.files.remarks),
        lenient=tuple(opened.files.lenient),
        joints=sdf_joints(opened.model),
        partial=opened.files.partial,
        articulation=None if opened.moving is None else _articulation(opened, opened.moving, owners),
    )


def _articulation(opened: SdfModel, moving: LinkTree, owners: list[int]) -> Articulation:
    """Return links and joints; ``owners`` are the indices of the links of each visual part, before merging."""
    links = []
    for place, head in enumerate(moving.heads):
        mine = tuple(link for link, of in zip(opened.links, moving.link_of, strict=True) if of == place)
        links.append(AssetLink(str(opened.links[head].get("name")), _declared_inertial(opened, mine)))
    return Articulation(tuple(links), moving.joints, tuple(moving.link_of[owner] for owner in owners))


def _only_model(file: Path, root: etree._Element, files: AssetFiles) -> etree._Element:
    models = root.findall("model") or root.findall("world/model")
    if not models:
        raise AssetError(f"{file.name}: it holds no <model>; give an SDF file with one")
    if len(models) > 1:
        files.remark(f"it holds {len(models)} models; the first was read")
    model = models[0]
    for tag in ("include", "model"):
        for other in model.findall(tag):
            name = other.get("name") or text_of(other, "uri") or ""
            files.remark(f"the {'included' if tag == 'include' else 'nested'} model {name[:60]!r} was left out")
    if model.find("link") is None:
        included = text_of(model, "include/uri")
        if included is not None:
            raise AssetError(
                f"{file.name}: its model has no <link> of its own, and the model {included[:80]!r} that it includes is not there;"
                " give the folder that holds both"
            )
        raise AssetError(f"{file.name}: its model has no <link>; give one that has")
    return model


def _is_static(model: etree._Element) -> bool:
    return (text_of(model, "static") or "").lower() in ("true", "1")


def _declared_inertial(opened: SdfModel, links: tuple[etree._Element, ...]) -> Inertial:
    found = [_link_inertial(opened, link) for link in links if link.find("inertial") is not None]
    with_mass = [entry for entry in found if entry.mass_kg is not None]
    return combined_inertial(with_mass) if with_mass else found[0] if found else Inertial()


def _link_inertial(opened: SdfModel, link: etree._Element) -> Inertial:
    inertial = link.find("inertial")
    what = f"{opened.file.name}: link {link.get('name')} inertial"
    if (inertial.get("auto") or "").strip().lower() in ("true", "1"):
        opened.files.remark("its mass is left to the simulator to compute (auto), and is not declared")
        return Inertial()
    mass = text_of(inertial, "mass")
    pose = inertial.find("pose")
    base = None if pose is None else pose.get("relative_to")
    to_model = opened.frames.to_model(base or link.get("name")) @ pose_of(inertial, what)
    tensor = None
    if inertial.find("inertia") is not None:
        lacks = [key for key in ("ixx", "iyy", "izz") if text_of(inertial, f"inertia/{key}") is None]
        if lacks:
            opened.files.remark_leniency(
                f"the inertia of link {link.get('name')!r} lacks {', '.join(lacks)}, and was not read"
            )
        else:
            xx, xy, xz, yy, yz, zz = (number(text_of(inertial, f"inertia/{k}") or "0", f"{what} {k}") for k in _MOMENTS)
            rotation = to_model[:3, :3]
            tensor = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
    return Inertial(None if mass is None else number(mass, f"{what} mass"), to_model[:3, 3], tensor)


def _declared_contact(opened: SdfModel) -> Contact:
    """Return the friction of the first collision that declares any: Drake's, or ``mu``; ``mu2`` is for another direction."""
    drake = drake_contact(opened.links, opened.files, opened.file.name)
    surfaces = [surface for link in opened.links for surface in link.findall("collision/surface")]
    said_mu = [(s, text) for s in surfaces if (text := text_of(s, "friction/ode/mu")) is not None]
    bounces = [text for s in surfaces if (text := text_of(s, "bounce/restitution_coefficient")) is not None]
    restitution = number(bounces[0], f"{opened.file.name}: restitution_coefficient") if bounces else None
    if drake is not None:
        return replace(drake, restitution=restitution)
    if not said_mu:  # PyBullet reads its URDF element <contact> in SDF too
        lateral = next((t for link in opened.links if (t := text_of(link, "contact/lateral_friction"))), None)
        friction = None if lateral is None else number(lateral, f"{opened.file.name}: lateral_friction")
        others = next(opened.model.iter("mu", "lateral_friction"), None) is not None
        return Contact(friction, friction, restitution, of_others=others)
    values = [number(text, f"{opened.file.name}: mu") for _, text in said_mu]
    if max(values) > min(values):
        opened.files.remark(
            f"its collisions have frictions from {min(values):g} to {max(values):g}; a twin has one: the first, between these"
        )
    second = text_of(said_mu[0][0], "friction/ode/mu2")
    if second is not None and number(second, f"{opened.file.name}: mu2") != values[0]:
        opened.files.remark(f"mu {values[0]:g} and mu2 {second} are two directions; the first was taken")
    spread = (min(values), max(values)) if max(values) > min(values) else None
    return Contact(values[0], None, restitution, friction_range=spread)


def _licence(opened: SdfModel) -> tuple[str | None, str | None]:
    """Return licence and attribution from elements of model.config, or else from comments."""
    comments = [*comments_before(opened.root), *(comments_before(opened.config) if opened.config is not None else ())]
    licence, attribution = stated_licence(comments)
    if opened.config is not None:
        licence = stated_or_none(text_of(opened.config, "license")) or licence
        attribution = stated_or_none(text_of(opened.config, "author/name")) or attribution
    return licence, attribution
