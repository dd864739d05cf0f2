"""XML of an MJCF file with its composition resolved: includes inlined, attached models collected, files replaced by keys.

MuJoCo receives only texts and opens no files: a mesh, texture or height field is named by a key that stands for its path.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

import numpy as np
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.readers.mjcf_contents import ACTING, expanded_size, keep_rigid_objects
from manitwin.errors import AssetError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.xml_file import MAX_NUMBER, MAX_XML_BYTES, comments_before, read_xml, xml_text

_MAX_INCLUDES, _MAX_DEPTH = 32, 8
_HEAD_BYTES = 1 << 16
_HOME = "folder_of_its_document"
"""An attribute used only while documents are composed."""
UNNAMED = "MuJoCo Model"
"""MuJoCo's name for a model without one."""


@dataclass
class MjcfSource:
    """The XML passed to MuJoCo, and what was extracted from it.

    - ``texts``: the comments at its head, and the entries of <custom> as ``name: data``.
    - ``models``: attached XMLs by the names that the document uses for them.
    - ``places``: for the key of a mesh, texture or height field, the written name, the expected path, and the name below the
      compiler's folder; ``homes``: an alternative path, from the folder of the included document that names it.
    - ``soft``: soft bodies were left out, or are read from ``soft_files``, keyed by their names in the XML.
    - ``acting``: sections that act on joints and were left out.
    - ``apart``: pairs of bodies that the main document excludes from contact; ``paired``: pairs of geoms with their own
      contact.
    - ``keys``: the positions of its keyframes; ``total_mass_kg``: the mass to which all bodies together are scaled.
    """

    file: Path
    root: etree._Element
    texts: tuple[str, ...] = ()
    models: dict[str, etree._Element] = field(default_factory=dict)
    places: dict[str, tuple[str, Path, str]] = field(default_factory=dict)
    homes: dict[str, Path] = field(default_factory=dict)
    soft: bool = False
    acting: set[str] = field(default_factory=set)
    soft_files: dict[str, bytes] = field(default_factory=dict)
    apart: set[frozenset[str]] = field(default_factory=set)
    paired: set[frozenset[str]] = field(default_factory=set)
    keys: list[np.ndarray] = field(default_factory=list)
    total_mass_kg: float | None = None

    def has_geom_attribute(self, attributes: tuple[str, ...]) -> bool:
        """Return whether a geom, or a default for geoms, has one of these attributes."""
        geoms = [geom for root in (self.root, *self.models.values()) for geom in root.iter("geom")]
        return any(geom.get(name) is not None for geom in geoms for name in attributes)

    def has_geom_density(self, density_kg_m3: float) -> bool:
        """Return whether a geom, or a default for geoms, has exactly this density."""
        for root in (self.root, *self.models.values()):
            for geom in root.iter("geom"):
                with suppress(ValueError):
                    if float(geom.get("density", "nan")) == density_kg_m3:
                        return True
        return False

    def has_mass_data(self) -> bool:
        """Return whether the file writes a mass or density of geoms, or a total mass."""
        return self.total_mass_kg is not None or self.has_geom_attribute(("mass", "density"))

    def model_texts(self) -> dict[str, bytes]:
        """Return the attached XMLs as bytes, and the files of soft bodies."""
        return {name: xml_text(root).encode() for name, root in self.models.items()} | self.soft_files


def open_mjcf(file: Path, files: AssetFiles, *, keep_soft: bool = False) -> MjcfSource:
    """Parse an MJCF file with everything it includes and attaches; raises AssetError for broken or unsupported content.

    ``keep_soft``: soft bodies stay.
    """
    source = MjcfSource(file, etree.Element("mujoco"))
    source.root = _Composition(source, files, keep_soft).document(file, (file.resolve(),))
    return source


class _Composition:
    """Reads the documents of one MJCF file, each attached document once."""

    def __init__(self, source: MjcfSource, files: AssetFiles, keep_soft: bool):
        self._source, self._files, self._keep_soft = source, files, keep_soft
        self._keys: dict[Path, str] = {}
        self._sizes: dict[str, float] = {}

    def document(self, file: Path, above: tuple[Path, ...]) -> etree._Element:
        """Return the root of one document, with its models read and its files replaced by keys."""
        root = read_xml(file, "mujoco")
        comments = comments_before(root)
        self._inline_includes(file, root, file, {file.resolve()})
        texts = (*comments, *(f"{t.get('name')}: {t.get('data')}" for t in root.iterfind("custom/text")))
        if len(above) == 1:
            self._source.texts += texts
            self._source.total_mass_kg = _total_mass_kg(root)
            pairs = root.iterfind("contact/exclude")
            self._source.apart |= {frozenset((pair.get("body1") or "", pair.get("body2") or "")) for pair in pairs}
            pairs = root.iterfind("contact/pair")
            self._source.paired |= {frozenset((pair.get("geom1") or "", pair.get("geom2") or "")) for pair in pairs}
            self._source.keys += [key for each in root.iterfind("keyframe/key") if (key := _position(each)) is not None]
        sizes = self._read_attached_models(file, root, above)
        self._source.acting |= {section.tag for section in root if section.tag in ACTING and len(section)}
        self._source.soft |= keep_rigid_objects(file, root, self._files, sizes, keep_soft=self._keep_soft)
        self._name_files(file, root)
        self._sizes[str(file.resolve())] = expanded_size(root, sizes)
        return root

    def _inline_includes(self, main: Path, root: etree._Element, file: Path, done: set[Path], depth: int = 0) -> None:
        """Replace each <include> by the children of the included root, as MuJoCo does; each file may be included once.

        A file is looked up in the folder of the main file, then in that of the including ``file``.
        """
        while (include := root.find(".//include")) is not None:
            name = (include.get("file") or "").replace("\\", "/")
            found = self._found(file, name, [main.parent / name, file.parent / name], "includes")
            if found in done or len(done) > _MAX_INCLUDES or depth > _MAX_INCLUDES:
                raise AssetError(f"{file.name}: includes {name[:80]!r} twice, or too many files")
            done.add(found)
            head = read_bytes(found, MAX_XML_BYTES, AssetError)[:_HEAD_BYTES]
            tag = "mujocoinclude" if b"<mujocoinclude" in head else "mujoco"
            included = read_xml(found, tag)
            for entry in included.xpath("asset/*[@file]"):
                entry.set(_HOME, str(found.parent))
            self._inline_includes(main, included, found, done, depth + 1)
            parent, position = include.getparent(), include.getparent().index(include)
            parent.remove(include)
            for offset, child in enumerate(list(included)):
                parent.insert(position + offset, child)

    def _read_attached_models(self, file: Path, root: etree._Element, above: tuple[Path, ...]) -> dict[str, float]:
        """Read the models that a document attaches; return their numbers of elements by name."""
        sizes = {}
        for model in root.xpath("asset/model"):
            name = (model.get("file") or "").replace("\\", "/")
            found = self._found(file, name, [file.parent / name], "attaches")
            if found in above or len(above) > _MAX_DEPTH:
                raise AssetError(
                    f"{file.name}: the model {name[:80]!r} attaches itself, or models are attached too deep"
                )
            key = self._keys.setdefault(found, f"model_{len(self._keys)}.xml")
            if key not in self._source.models:
                self._source.models[key] = self.document(found, (*above, found))
            model.set("file", key)
            child = self._source.models[key]
            sizes[model.get("name") or child.get("model") or UNNAMED] = self._sizes[str(found)]
        return sizes

    def _found(self, file: Path, name: str, places: list[Path], verb: str) -> Path:
        found = self._files.find(name, places)
        if found is None:
            raise AssetError(
                f"{file.name}: the file {name[:80]!r} that it {verb} is not there, or above the root"
                f" {self._files.root.name!r}; give the folder that holds all of it"
            )
        return found

    def _name_files(self, file: Path, root: etree._Element) -> None:
        """Replace each file name of a document by a key, and give unnamed meshes and height fields MuJoCo's default name."""
        folders = {"mesh": "", "hfield": "", "texture": ""}
        strip = False
        for compiler in root.iterfind("compiler"):
            strip = compiler.get("strippath", str(strip)).lower() == "true"
            for kind, own in (("mesh", "meshdir"), ("hfield", "meshdir"), ("texture", "texturedir")):
                written = compiler.attrib.get(own, compiler.get("assetdir"))
                folders[kind] = folders[kind] if written is None else written.replace("\\", "/")
        for entry in [*root.xpath("asset/*[@file]"), *root.iterfind(".//flexcomp[@file]")]:
            kind = "mesh" if entry.tag == "flexcomp" else entry.tag
            if kind not in folders:
                entry.attrib.pop(_HOME, None)
                continue
            name = entry.get("file").replace("\\", "/")
            plain = name.rpartition("/")[2] if strip else name
            key = f"{len(self._source.places)}.file"
            home = entry.attrib.pop(_HOME, None)
            if home is not None:
                self._source.homes[key] = Path(home) / plain
            below = PurePosixPath(folders[kind], plain).as_posix()
            self._source.places[key] = (plain, file.parent / folders[kind] / plain, below)
            if entry.tag in ("mesh", "hfield") and not entry.get("name"):
                entry.set("name", Path(plain).stem)
            entry.set("file", key)


def _position(key: etree._Element) -> np.ndarray | None:
    """Return the position of a keyframe, or None if it has none or it is malformed."""
    try:
        position = np.array([float(word) for word in (key.get("qpos") or "").split()])
    except ValueError:
        return None
    return position if len(position) and np.isfinite(position).all() else None


def _total_mass_kg(root: etree._Element) -> float | None:
    """Remove ``settotalmass``, which MuJoCo warns about, and return its value; None if it is not a mass."""
    total = None
    for compiler in root.iterfind("compiler"):
        with suppress(ValueError):
            said = float(compiler.attrib.pop("settotalmass", "0"))
            total = said if 0 < said <= MAX_NUMBER else total
    return total
