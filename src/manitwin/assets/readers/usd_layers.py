"""Composition of a USD stage only from layers below its root, for files from untrusted sources."""

from __future__ import annotations

import os
import posixpath
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf, Tf, Usd

from manitwin.assets.readers.usd_mtlx import SUFFIX, mtlx_layer
from manitwin.errors import AssetError
from manitwin.formats.bounded_file import open_regular, read_bytes
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.usd_errors import broken_usd_cause
from manitwin.formats.meshes.usdz_package import UsdzArchive, package_path
from manitwin.formats.sniff import placeholder_description

_LAYERS = (".usd", ".usda", ".usdc", ".usdz", SUFFIX)
_MAX_LAYERS = 1_000
MAX_PRIMS = 100_000
_MAX_DEPTH = 300
_HEAD_BYTES = 4096
_OF_A_MACHINE = re.compile(r"[/\\~]|\w+:")
"""Start of a path from the root of a file system, drive or server, specific to the machine that wrote the file."""
_MOST_PARTS = 16


@dataclass(frozen=True)
class Place:
    """The location of a layer or texture: a file, and a member of it if the file is a package."""

    file: Path
    member: str | None = None


class LayerFiles:
    """The layers of an asset, opened without composition and linked to each other inside the root of the source.

    Every layer is copied into memory, and each layer name in it is replaced by the copy of that layer, or removed if it leads
    outside the root; composition then opens no files. Value clips, which would be opened later, are removed too. ``missing``
    are the names of files that do not exist.
    """

    def __init__(self, source: MeshSource):
        self._source = source
        self._folder = source.path.parent.resolve()
        self._root = self._folder if source.root is None else source.root.resolve()
        self._archives: dict[Path, UsdzArchive] = {}
        self._layers: dict[Place, Sdf.Layer] = {}
        self._places: dict[str, Place] = {}
        self.files: set[Path] = set()
        self.missing: set[str] = set()

    def compose(self) -> Usd.Stage:
        """Return the stage. Raises AssetError and InputError ``unreadable``, and Tf.ErrorException for broken USD."""
        if told := _placeholder_reason(self._folder / self._source.path.name):
            raise AssetError(f"{self._source.path}: {told}")
        start = self._inside_package(self._folder / self._source.path.name)
        root = self._open(start)
        if root is None:
            raise AssetError(f"{self._source.path}: no USD layer; export it again")
        waiting = [start]
        while waiting:
            place = waiting.pop()
            waiting += self._join(self._layers[place], place)
            if len(self._layers) > _MAX_LAYERS:
                raise AssetError(f"{self._source.path}: more than {_MAX_LAYERS} layers; flatten it with usdcat")
        prims = composed_prims(root, {layer.identifier: layer for layer in self._layers.values()})
        if prims is None or prims > MAX_PRIMS:
            raise AssetError(f"{self._source.path}: it composes to more than {MAX_PRIMS} prims; it is no single object")
        return Usd.Stage.Open(root)

    def texture(self, layer: Sdf.Layer, name: str) -> bytes | None:
        """Return the content of the texture file that ``layer`` names, or None with a finding."""
        base = self._places[layer.identifier]
        place = self._find_foreign_path(base, name) or self._locate(base, name, "texture")
        if place is None:
            return None
        if place.member is not None:
            return self._archives[place.file].read(place.member, "texture")
        data = self._source.sibling(Path(os.path.relpath(place.file, self._folder)).as_posix(), "texture")
        if data is None:
            self.missing.add(name)
        else:
            self._use(place.file)
        return data

    def _open(self, place: Place) -> Sdf.Layer | None:
        """Open a layer as a copy in memory; return None if there is no such file, or it is not a layer."""
        if place in self._layers:
            return self._layers[place]
        if not place.file.is_file():
            return None
        self._source.bytes_read += place.file.stat().st_size
        if self._source.bytes_read > self._source.limits.max_bytes:
            raise AssetError(
                f"{self._source.path}: it and the layers that it names have more than {self._source.limits.max_bytes} bytes"
                "; simplify it"
            )
        layer = self._copy_layer(place)
        if layer is not None:
            self._layers[place] = layer
            self._places[layer.identifier] = place
            self._use(place.file)
        return layer

    def _copy_layer(self, place: Place) -> Sdf.Layer | None:
        name = place.file.name if place.member is None else place.member
        if not name.lower().endswith(SUFFIX):
            named = str(place.file) if place.member is None else package_path(place.file, place.member)
            return Sdf.Layer.OpenAsAnonymous(named)
        try:
            if place.member is None:
                content = read_bytes(place.file, self._source.limits.max_bytes, AssetError, inside=self._root)
            else:
                content = self._archives[place.file].read(place.member, "layer") or b""
            return mtlx_layer(content, name, self._source)
        except AssetError as error:
            self._source.add_finding(f"{error}; its materials were not read")
            return None

    def _use(self, file: Path) -> None:
        self.files.add(file)
        if not file.is_relative_to(self._folder):
            self._source.add_finding(f"files were read from above its own folder, below the root {self._root.name!r}")

    def _join(self, layer: Sdf.Layer, place: Place) -> list[Place]:
        """Replace the layer names in a layer by their copies; return the places of newly opened layers."""
        opened = []
        for named in layer.GetCompositionAssetDependencies():
            if not named:  # a reference to a prim of this layer
                continue
            target = self._locate(place, named, "layer")
            known = target in self._layers
            copy = None if target is None else self._open_named(target, named)
            layer.UpdateCompositionAssetDependency(named, "" if copy is None else copy.identifier)
            if target is not None and copy is not None and not known:
                opened.append(target)
        self._take_out_clips(layer)
        return opened

    def _open_named(self, place: Place, named: str) -> Sdf.Layer | None:
        if not place.file.is_file() or (place.member and place.member not in self._archives[place.file].names):
            self.missing.add(named)
            return None
        if told := _placeholder_reason(place.file):
            self.missing.add(named)
            self._source.add_finding(f"layer {named[:80]!r} {told}")
            return None
        try:
            return self._open(place)
        except Tf.ErrorException as error:
            self._source.add_finding(
                f"layer {named[:80]!r} cannot be read: {broken_usd_cause(error)}; carried on without it"
            )
            return None

    def _locate(self, base: Place, name: str, what: str) -> Place | None:
        """Return the place that a name in a layer denotes; None with a finding if it is outside the root or package."""
        clean = Sdf.Layer.SplitIdentifier(name)[0].replace("\\", "/")
        outside = not clean or clean.startswith(("/", "~")) or re.search(r"[:`\[\]\0]", clean) is not None
        if not outside and base.member is not None:
            member = posixpath.normpath(posixpath.join(posixpath.dirname(base.member), clean))
            if not member.startswith("../"):
                return Place(base.file, member)
        elif not outside:
            file = _resolved(base.file.parent / clean)
            if (
                file is not None
                and file.is_relative_to(self._root)
                and (what != "layer" or file.suffix.lower() in _LAYERS)
            ):
                return self._inside_package(file) if what == "layer" else Place(file)
        kind = ", or is no USD layer" if what == "layer" else ""
        self._source.add_finding(f"{what} {name[:80]!r} lies outside the asset's folder{kind}; it was not followed")
        return None

    def _find_foreign_path(self, base: Place, name: str) -> Place | None:
        """Return the local file for a texture path of another machine, by the longest end of the path that exists near the
        layer.
        """
        if base.member is not None or _OF_A_MACHINE.match(name) is None:
            return None
        parts = [part for part in name.replace("\\", "/").split("/") if part not in ("", ".", "..")][-_MOST_PARTS:]
        for first in range(len(parts)):
            file = _resolved(base.file.parent.joinpath(*parts[first:]))
            if file is not None and file.is_relative_to(self._root) and file.is_file():
                self._source.add_finding(
                    f"textures are not where it says, and were read from beside it, such as {file.name[:80]}"
                )
                return Place(file)
        return None

    def _inside_package(self, file: Path) -> Place:
        """Return the first layer of a package, or the file itself if it is not a package."""
        if file.suffix.lower() != ".usdz" or not file.is_file():
            return Place(file)
        if file not in self._archives:
            self._archives[file] = UsdzArchive(MeshSource(file, self._source.limits, self._source.findings))
        root = self._archives[file].root
        if root is None:
            raise AssetError(f"{file}: its first member is no USD layer; pack it with usdzip")
        return Place(file, root)

    def _take_out_clips(self, layer: Sdf.Layer) -> None:
        found: list[Sdf.Path] = []

        def look(path: Sdf.Path) -> None:
            prim = layer.GetPrimAtPath(path) if path.IsPrimPath() or path.IsPrimVariantSelectionPath() else None
            if prim is not None and (prim.HasInfo("clips") or prim.HasInfo("clipSets")):
                found.append(path)

        layer.Traverse(Sdf.Path.absoluteRootPath, look)
        for path in found:
            self._source.add_finding("its animation by value clips was left out")
            layer.GetPrimAtPath(path).ClearInfo("clips")
            layer.GetPrimAtPath(path).ClearInfo("clipSets")


def composed_prims(root: Sdf.Layer, layers: Mapping[str, Sdf.Layer]) -> int | None:
    """Return an upper bound for the number of prims in the composition of ``root``, None if they are nested too deep.

    ``layers`` are all layers by identifier. All variants are counted, and an override counts as another prim.
    """
    try:
        return _Expansion(layers).of_stack(root, Sdf.Path.absoluteRootPath, 0)
    except _TooDeep:
        return None


class _TooDeep(Exception):
    """Prims or references nested deeper than ``_MAX_DEPTH``."""


class _Expansion:
    def __init__(self, layers: Mapping[str, Sdf.Layer]):
        self._layers = layers
        self._known: dict[tuple[str, Sdf.Path], int] = {}

    def of_stack(self, layer: Sdf.Layer, path: Sdf.Path, depth: int) -> int:
        """Count the prims at and below a path in a layer and its sublayers."""
        seen: dict[str, Sdf.Layer] = {}
        waiting = [layer]
        while waiting:
            each = waiting.pop()
            if each.identifier not in seen:
                seen[each.identifier] = each
                waiting += [self._layers[name] for name in each.subLayerPaths if name in self._layers]
        return sum(self._of(each, layer, path, depth) for each in seen.values())

    def _of(self, layer: Sdf.Layer, stack: Sdf.Layer, path: Sdf.Path, depth: int) -> int:
        if depth > _MAX_DEPTH:
            raise _TooDeep
        while not path.IsAbsoluteRootPath() and layer.GetPrimAtPath(path) is None:
            path = path.GetParentPath()  # it is defined in the reference of a prim above it
        key = (layer.identifier, path)
        if key not in self._known:
            self._known[key] = 0  # a cycle, which USD ignores
            spec = layer.pseudoRoot if path.IsAbsoluteRootPath() else layer.GetPrimAtPath(path)
            self._known[key] = 1 + sum(
                self._of(layer, stack, child.path, depth + 1) for child in _children(spec)
            ) + sum(self.of_stack(*target, depth + 1) for target in self._targets(spec, stack))  # fmt: skip
        return self._known[key]

    def _targets(self, spec: Sdf.PrimSpec, stack: Sdf.Layer) -> Iterator[tuple[Sdf.Layer, Sdf.Path]]:
        """Yield the targets of a prim's references, payloads, inherits and specializes; ``stack`` is the root of its layer
        stack.
        """
        for item in [*_items(spec.referenceList), *_items(spec.payloadList)]:
            layer = self._layers.get(item.assetPath) if item.assetPath else stack
            if layer is None:
                continue
            default = Sdf.Path.absoluteRootPath.AppendChild(layer.defaultPrim) if layer.defaultPrim else None
            path = item.primPath or default
            if path is not None:
                yield layer, path
        for path in [*_items(spec.inheritPathList), *_items(spec.specializesList)]:
            yield stack, path


def _children(spec: Sdf.PrimSpec) -> Iterator[Sdf.PrimSpec]:
    yield from spec.nameChildren
    for variants in spec.variantSets.values():
        for variant in variants.variants.values():
            yield variant.primSpec


def _items(edits: Sdf.PathListOp) -> list[Sdf.Reference]:
    return list(edits.GetAddedOrExplicitItems())


def _placeholder_reason(file: Path) -> str | None:
    """Return what a file is instead of a layer, such as a Git LFS pointer, and a remedy; None for other files."""
    if not file.is_file():
        return None
    with open_regular(file, AssetError) as stream:
        return placeholder_description(stream.read(_HEAD_BYTES))


def _resolved(path: Path) -> Path | None:
    """Return a path with links resolved; None for a loop of links, or a name that no file system can hold."""
    try:
        file = path.resolve()
        return None if file.is_symlink() else file  # from Python 3.13 on, a loop is returned unresolved
    except (OSError, ValueError, RuntimeError):
        return None
