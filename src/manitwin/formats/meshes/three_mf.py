"""Reader of 3MF archives (3D Manufacturing Format), which slicers and CAD programs save for printing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import trimesh
from trimesh.visual.material import PBRMaterial

from manitwin.formats.meshes.source import MAX_PARTS, MeshSource
from manitwin.formats.meshes.textures import (
    DEFAULT_COLOR,
    bake_transform,
    color_by_corner,
    decode_texture,
    linear_to_srgb,
    make_part,
    pbr_material,
    srgb_to_linear,
    without_unused_vertices,
)
from manitwin.formats.meshes.three_mf_model import NONE, UNITS_M, Component, Model, ModelObject, read_model
from manitwin.formats.meshes.three_mf_package import ThreeMfPackage
from manitwin.formats.meshes.three_mf_slicer import read_notes

_MATTER = ("model", "surface")
"""Types of objects that are part of the product; ``support``, ``solidsupport`` and ``other`` only help printing (section 4.1)."""
_MOST_PLAIN_COLORS = 64
"""Up to this many colours of an object become separate parts; more are painted into a texture."""
_DEEPEST = 64
_DEFAULT_SRGB = np.array([*np.round(255 * linear_to_srgb(np.array(DEFAULT_COLOR))), 255], np.uint8)
_WHITE = (1.0, 1.0, 1.0)


def read_three_mf(source: MeshSource) -> tuple[list[trimesh.Trimesh], float]:
    """Read everything that a 3MF archive builds: parts with transforms applied, and its unit in metres.

    The orientation on the print plate does not imply an up axis, so none is returned. Raises InputError ``unreadable`` or
    ``too_large``.
    """
    package = ThreeMfPackage(source)
    reader = _Reader(package, source)
    model = reader.model(package.model())
    unit_m = UNITS_M.get(model.unit)
    if unit_m is None:
        raise source.unreadable(f"its unit {model.unit[:20]!r} is none of {', '.join(UNITS_M)}", "export it again")
    parts: list[trimesh.Trimesh] = []
    faces = 0
    for part in reader.built(model):
        faces += len(part.faces)
        source.check_faces(faces)
        parts.append(part)
        source.check_parts(len(parts))
    return parts, unit_m


class _Reader:
    """The parts of a package's models; each model is read once, and each object's own parts are built once."""

    def __init__(self, package: ThreeMfPackage, source: MeshSource):
        self._package, self._source = package, source
        self._notes = read_notes(package, source)
        self._models: dict[str, Model] = {}
        self._parts: dict[tuple[int, int], list[trimesh.Trimesh]] = {}
        self._visited = 0

    def model(self, name: str) -> Model:
        """Return the model in a part of the package."""
        if name not in self._models:
            self._models[name] = read_model(self._package.blocks(name), self._source)
        return self._models[name]

    def built(self, model: Model) -> Iterator[trimesh.Trimesh]:
        """Yield the parts of everything that a model builds, in its frame."""
        items = model.items
        if not items:
            held = {each.object_id for some in model.objects.values() for each in some.components}
            items = [Component(number, None, np.eye(4)) for number in model.objects if number not in held]
            self._source.add_finding("it says nothing of what is to be built; all of its objects were taken")
        if len(items) > 1:
            self._source.add_finding(f"its plate has {len(items)} objects, which were taken together as they lie")
        for item in items:
            yield from self._placed(item, item.object_id, model, np.eye(4), 0)

    def _placed(
        self, component: Component, owner: int, model: Model, parent: np.ndarray, depth: int
    ) -> Iterator[trimesh.Trimesh]:
        """Yield the parts of a component of the object ``owner``, or of a build item."""
        self._visited += 1
        if self._visited > MAX_PARTS or depth > _DEEPEST:
            raise self._source.too_large(f"more than {MAX_PARTS} objects or {_DEEPEST} levels of them", "merge them")
        if component.path is not None:
            model = self.model(component.path)
        found = model.objects.get(component.object_id)
        if found is None:
            raise self._source.unreadable(f"object {component.object_id} is not there", "export it again")
        if found.kind not in _MATTER:
            self._source.add_finding(f"objects of type {found.kind[:20]!r} in it help to print it, and were left out")
            return
        if self._notes.is_print_aid(owner, component.object_id, self._source):
            return
        matrix = parent @ component.matrix
        key = id(found), owner
        if key not in self._parts:
            self._parts[key] = list(self._own_parts(found, owner, component.object_id, model))
        for part in self._parts[key]:
            yield bake_transform(part, matrix)
        for each in found.components:
            yield from self._placed(each, component.object_id, model, matrix, depth + 1)

    def _own_parts(self, found: ModelObject, owner: int, number: int, model: Model) -> Iterator[trimesh.Trimesh]:
        """Yield the parts of an object's own triangles, one for each texture and each colour."""
        count = len(found.triangles)
        is_matter = self._notes.is_product(number, count, self._source)
        textured = is_matter & _has_texture(found, model, self._source)
        for group in np.unique(found.groups[textured]):
            some = np.flatnonzero(textured & (found.groups == group))
            yield _textured(found, some, int(group), model, self._package, self._source)
        plain = np.flatnonzero(is_matter & ~textured)
        if len(plain):
            unpainted = self._notes.colors(owner, number, count, _DEFAULT_SRGB)
            yield from _plain_parts(found, plain, unpainted, model, self._source)


def _plain_parts(
    found: ModelObject, plain: np.ndarray, unpainted: np.ndarray, model: Model, source: MeshSource
) -> Iterator[trimesh.Trimesh]:
    """Yield the parts of ``plain`` (N,) triangles: one for each colour, or a single one with all colours painted on it.

    ``unpainted`` (F, 4) uint8 sRGB is the colour of each triangle that has no colour of its own.
    """
    colors, names = _colors(found, plain, unpainted, model, source)
    keys = np.column_stack([colors.reshape(len(plain), 12), names])
    distinct, of_triangle = np.unique(keys, axis=0, return_inverse=True)
    one_color = (colors == colors[:, :1]).all()
    if one_color and len(distinct) <= _MOST_PLAIN_COLORS:
        for number, key in enumerate(distinct):
            some = plain[of_triangle.reshape(-1) == number]
            group, place = found.groups[some[0]], found.corners[some[0], 0]
            name = model.names[int(group)][place] if key[12] >= 0 else None
            yield _part(found, found.triangles[some], _plain(key[:4], name or None))
        return
    yield color_by_corner(_part(found, found.triangles[plain], pbr_material()), colors[..., :3], source)


def _colors(
    found: ModelObject, triangles: np.ndarray, unpainted: np.ndarray, model: Model, source: MeshSource
) -> tuple[np.ndarray, np.ndarray]:
    """Return the sRGB corner colours (F, 3, 4) uint8 of triangles, and the index (F,) of each material name, -1 for none."""
    colors = np.repeat(unpainted[triangles][:, None], 3, axis=1)
    names = np.full(len(triangles), -1)
    for group in np.unique(found.groups[triangles]):
        some = found.groups[triangles] == group
        table = model.colors.get(int(group))
        if table is None:
            if group != NONE and int(group) not in model.texture_coordinates:
                source.add_finding("properties in it are of no kind that is read; what has them is grey")
            continue
        corners = found.corners[triangles[some]]
        is_there = ((corners >= 0) & (corners < len(table))).all(axis=1)
        if not is_there.all():
            source.add_finding("colours that triangles in it name are not there; what has them is grey")
        some = np.flatnonzero(some)[is_there]
        colors[some] = table[corners[is_there]]
        if model.names[int(group)]:
            names[some] = corners[is_there, 0]
    return colors, names


def _plain(color: np.ndarray, name: str | None) -> PBRMaterial:
    linear = srgb_to_linear(np.asarray(color[:3]) / 255)
    alpha = float(color[3]) / 255
    return pbr_material(name, base_color=(*linear, alpha), alpha_mode="BLEND" if alpha < 1 else None)


def _has_texture(found: ModelObject, model: Model, source: MeshSource) -> np.ndarray:
    """Return which (F,) of an object's triangles have texture coordinates."""
    textured = np.zeros(len(found.groups), bool)
    for group, (_, places) in model.texture_coordinates.items():
        some = found.groups == group
        is_there = ((found.corners >= 0) & (found.corners < len(places))).all(axis=1)
        if (some & ~is_there).any():
            source.add_finding("texture coordinates that triangles in it name are not there; what has them is grey")
        textured |= some & is_there
    return textured


def _textured(
    found: ModelObject, triangles: np.ndarray, group: int, model: Model, package: ThreeMfPackage, source: MeshSource
) -> trimesh.Trimesh:
    texture, places = model.texture_coordinates[group]
    corners = found.corners[triangles].reshape(-1)
    name = model.textures.get(texture)
    data = None if name is None else package.texture(name)
    image = None if data is None or name is None else decode_texture(data, name, source)
    material = pbr_material(base_color=DEFAULT_COLOR if image is None else _WHITE, base_color_texture=image)
    # corners that share a vertex and a texture coordinate share a vertex of the part
    keys = np.column_stack([found.triangles[triangles].reshape(-1), corners])
    distinct, inverse = np.unique(keys, axis=0, return_inverse=True)
    return make_part(
        found.vertices[distinct[:, 0]],
        inverse.reshape(-1, 3),
        material=material,
        name=found.name,
        uv=places[distinct[:, 1]],
    )


def _part(found: ModelObject, triangles: np.ndarray, material: PBRMaterial) -> trimesh.Trimesh:
    part = make_part(found.vertices, triangles, material=material, name=found.name)
    return without_unused_vertices(part) if len(triangles) < len(found.triangles) else part
