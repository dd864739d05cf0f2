"""Model part of a 3MF archive: objects of triangles or components, their colours, and the build items.

Source: 3MF Core Specification 1.3, Materials and Properties Extension 1.2, Production Extension 1.1 (3MF Consortium).
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from manitwin.errors import InputError
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.xml_walk import walk_xml

UNITS_M = {"micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0}
"""Core Specification, section 3.4; the default unit is the millimetre."""
_NOT_NEEDED = ("/core/", "/material/", "/production/", "/slice/", "/trianglesets/")
"""Parts of the namespaces of extensions that a model may require and that reading its triangles does not depend on."""
NONE = -1
"""The property group of a triangle without properties."""
_WHITE = (255, 255, 255, 255)


@dataclass(frozen=True)
class Component:
    """A component or build item: the object's id, the part that holds it (None: this one), its transform."""

    object_id: int
    path: str | None
    matrix: np.ndarray


@dataclass(frozen=True)
class ModelObject:
    """An object: ``vertices`` (V, 3), ``triangles`` (F, 3), or ``components``; ``kind`` is its type.

    ``groups`` (F,) are the ids of the triangles' property groups, ``NONE`` without one, and ``corners`` (F, 3) the indices of
    the corners' properties in the group.
    """

    kind: str
    name: str
    vertices: np.ndarray
    triangles: np.ndarray
    groups: np.ndarray
    corners: np.ndarray
    components: tuple[Component, ...]


@dataclass
class Model:
    """The content of one model part of an archive, in tables by resource id.

    ``colors`` are (N, 4) uint8 sRGB, ``names`` those of base materials, ``texture_coordinates`` a texture's id and (N, 2),
    origin at the lower left, ``textures`` names of package parts, ``items`` the build items.
    """

    unit: str = "millimeter"
    objects: dict[int, ModelObject] = field(default_factory=dict)
    colors: dict[int, np.ndarray] = field(default_factory=dict)
    names: dict[int, list[str]] = field(default_factory=dict)
    texture_coordinates: dict[int, tuple[int, np.ndarray]] = field(default_factory=dict)
    textures: dict[int, str] = field(default_factory=dict)
    items: list[Component] = field(default_factory=list)


def read_model(blocks: Iterable[bytes], source: MeshSource) -> Model:
    """Read one model part of an archive; raises InputError ``unreadable`` or ``too_large``."""

    def refusal(line: str) -> InputError:
        return InputError("unreadable", line)

    walker = _Walker(source)
    walk_xml(blocks, walker, source.name, refusal=refusal)
    return walker.model


def matrix_of(text: str | None) -> np.ndarray:
    """Return the transform (4, 4) given by twelve numbers: 3MF multiplies row vectors (section 3.3). Raises ValueError."""
    matrix = np.eye(4)
    if text is not None:
        matrix[:3, :] = np.array(text.split(), dtype=np.float64).reshape(4, 3).T
    return matrix


def color_of(text: str) -> tuple[int, int, int, int]:
    """Return the sRGB colour of ``#RRGGBB`` or ``#RRGGBBAA``. Raises ValueError."""
    red, green, blue, *alpha = bytes.fromhex(text.strip().removeprefix("#"))
    return red, green, blue, *(alpha or [255])[:1]  # type: ignore[return-value]


class _Walker:
    """Builds a model from its elements, with one method for each relevant element."""

    def __init__(self, source: MeshSource):
        self.model = Model()
        self._source = source
        self._elements: dict[str, Callable[[Mapping[str, str]], None]] = {
            "object": self._object, "vertex": self._vertex, "triangle": self._triangle, "component": self._component,
            "item": self._item, "basematerials": self._colors, "base": self._base, "colorgroup": self._colors,
            "color": self._color, "texture2d": self._texture, "texture2dgroup": self._coordinates,
            "tex2coord": self._coordinate, "compositematerials": self._mixtures, "composite": self._mixture,
            "multiproperties": self._multiproperties, "multi": self._multi,
        }  # fmt: skip
        self._group = NONE
        self._rows: list[tuple[int, ...]] = []
        self._places = array("d")
        self._aliases: dict[int, tuple[int, list[int]]] = {}
        self._layer, self._mixed = 0, np.array([_WHITE], np.uint8)
        self._open_object()

    def start(self, tag: str, attributes: Mapping[str, str], namespaces: Mapping[str | None, str]) -> None:
        if tag == "model":
            self._check_required(attributes.get("requiredextensions", ""), namespaces)
            self.model.unit = attributes.get("unit", "millimeter")
        elif tag == "beamlattice":
            self._source.add_finding("its lattice of beams is no mesh, and was left out")
        elif (element := self._elements.get(tag)) is not None:
            element(attributes)

    def end(self, tag: str) -> None:
        if tag == "object":
            self._close_object()
        elif tag in ("basematerials", "colorgroup", "compositematerials"):
            self.model.colors[self._group] = np.array(self._rows or [_WHITE], np.uint8)
        elif tag == "texture2dgroup":
            texture, _ = self.model.texture_coordinates[self._group]
            self.model.texture_coordinates[self._group] = texture, np.array(self._places).reshape(-1, 2)

    def _check_required(self, prefixes: str, namespaces: Mapping[str | None, str]) -> None:
        for prefix in prefixes.split():
            named = namespaces.get(prefix, prefix)
            if not any(part in named.lower() for part in _NOT_NEEDED):
                raise self._source.unreadable(f"it requires {named[:80]!r}", "export its mesh without extensions")

    def _open_object(self) -> None:
        self._attributes: Mapping[str, str] = {}
        self._vertices, self._triangles = array("d"), array("q")
        self._components: list[Component] = []

    def _object(self, attributes: Mapping[str, str]) -> None:
        self._open_object()
        self._attributes = attributes

    def _vertex(self, attributes: Mapping[str, str]) -> None:
        self._vertices.extend((float(attributes["x"]), float(attributes["y"]), float(attributes["z"])))
        if len(self._vertices) % 3_000_000 == 0:
            self._source.check_vertices(len(self._vertices) // 3)

    def _triangle(self, attributes: Mapping[str, str]) -> None:
        group, first = attributes.get("pid"), attributes.get("p1")
        if group is None:
            group = self._attributes.get("pid", str(NONE))
        if first is None:
            first = self._attributes.get("pindex", "0")
        second, third = attributes.get("p2", first), attributes.get("p3", first)
        corners = int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"])
        self._triangles.extend((*corners, int(group), int(first), int(second), int(third)))
        if len(self._triangles) % 7_000_000 == 0:
            self._source.check_faces(len(self._triangles) // 7)

    def _component(self, attributes: Mapping[str, str]) -> None:
        self._components.append(_component(attributes))

    def _item(self, attributes: Mapping[str, str]) -> None:
        self.model.items.append(_component(attributes))

    def _close_object(self) -> None:
        rows = np.array(self._triangles, np.int64).reshape(-1, 7)
        self._source.check_faces(len(rows))
        groups, corners = rows[:, 3].copy(), rows[:, 4:].copy()
        for alias, (group, places) in self._aliases.items():
            some = groups == alias
            if some.any():
                groups[some], corners[some] = group, np.array(places, np.int64)[corners[some]]
        vertices = np.array(self._vertices).reshape(-1, 3)
        if len(rows) and not (rows[:, :3].min() >= 0 and rows[:, :3].max() < len(vertices)):
            raise self._source.unreadable("a triangle refers to a vertex that does not exist", "export it again")
        self.model.objects[int(self._attributes["id"])] = ModelObject(
            kind=self._attributes.get("type", "model"),
            name=self._attributes.get("name", ""),
            vertices=vertices,
            triangles=rows[:, :3],
            groups=groups,
            corners=corners,
            components=tuple(self._components),
        )

    def _colors(self, attributes: Mapping[str, str]) -> None:
        self._group, self._rows = int(attributes["id"]), []
        self.model.names[self._group] = []

    def _base(self, attributes: Mapping[str, str]) -> None:
        self._rows.append(color_of(attributes.get("displaycolor", "#cccccc")))
        self.model.names[self._group].append(attributes.get("name", ""))

    def _color(self, attributes: Mapping[str, str]) -> None:
        self._rows.append(color_of(attributes["color"]))

    def _mixtures(self, attributes: Mapping[str, str]) -> None:
        self._colors(attributes)
        of = self.model.colors.get(int(attributes["matid"]), np.array([_WHITE], np.uint8))
        places = np.array(attributes["matindices"].split(), np.int64)
        self._mixed = of[np.clip(places, 0, len(of) - 1)]

    def _mixture(self, attributes: Mapping[str, str]) -> None:
        """Append the colour of a mixture: the mean of its materials weighted by their shares."""
        shares = np.zeros(len(self._mixed))
        given = np.array(attributes["values"].split(), np.float64)[: len(shares)]
        shares[: len(given)] = given
        if not (np.isfinite(shares).all() and shares.sum() > 0):
            raise ValueError("a mixture of nothing")
        self._rows.append(tuple(np.round(shares @ self._mixed / shares.sum()).clip(0, 255).astype(int).tolist()))

    def _texture(self, attributes: Mapping[str, str]) -> None:
        self.model.textures[int(attributes["id"])] = attributes["path"]

    def _coordinates(self, attributes: Mapping[str, str]) -> None:
        self._group, self._places = int(attributes["id"]), array("d")
        self.model.texture_coordinates[self._group] = int(attributes["texid"]), np.empty((0, 2))

    def _coordinate(self, attributes: Mapping[str, str]) -> None:
        self._places.extend((float(attributes["u"]), float(attributes["v"])))

    def _multiproperties(self, attributes: Mapping[str, str]) -> None:
        """Select the last known layer of layered properties, which is on top of the others."""
        self._group = int(attributes["id"])
        layers = [int(each) for each in attributes["pids"].split()]
        known = [
            k for k, each in enumerate(layers) if each in self.model.colors or each in self.model.texture_coordinates
        ]
        self._layer = known[-1] if known else 0
        self._aliases[self._group] = layers[self._layer], []

    def _multi(self, attributes: Mapping[str, str]) -> None:
        places = [int(each) for each in attributes["pindices"].split()]
        self._aliases[self._group][1].append(places[self._layer] if self._layer < len(places) else 0)


def _component(attributes: Mapping[str, str]) -> Component:
    return Component(int(attributes["objectid"]), attributes.get("path"), matrix_of(attributes.get("transform")))
