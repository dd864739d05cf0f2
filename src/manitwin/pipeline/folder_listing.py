"""List the files of a folder as a build takes them: an input, a part of one, or left alone with the reason."""

from __future__ import annotations

import os
import posixpath
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from stat import S_ISDIR, S_ISREG

from manitwin.formats.sniff import HEIC_NOT_READ, NOT_READ, image_format
from manitwin.formats.source_files import IMAGE_SUFFIXES, MESH_SUFFIXES, named_file, named_files, spellings
from manitwin.twin.import_record import IMPORT_RECORD, IMPORTED_MESH

_NAMES_SHOWN = 3
TWIN_RECORD = "twin.json"
_NEVER_NAMED = frozenset({"", ".txt", ".md", ".pdf", ".csv", ".jsonl", ".html", ".py", ".sh", ".log"})
"""What no mesh names: a folder of meshes and such files alone is listed without opening a mesh."""
_BY_SUFFIX = {
    **NOT_READ,
    **dict.fromkeys((".csv", ".jsonl"), "a manifest is read only where it is given by its own path"),
    ".mtl": "a material library that no mesh names",
    ".bin": "a buffer that no mesh names",
}
# the last word of the names that exporters give to texture maps
_MAP_WORDS = frozenset({
    "albedo", "ambientocclusion", "ao", "alpha", "basecolor", "basecolour", "bump", "diff", "diffuse", "disp",
    "displacement", "emission", "emissive", "gloss", "glossiness", "lightmap", "metallic", "metallicroughness",
    "metalness", "metalrough", "nor", "nrm", "normal", "normals", "normalmap", "normalgl", "normaldx", "occlusion",
    "occlusionroughnessmetallic", "opacity", "orm", "rough", "roughness", "rma", "spec", "specular", "tex",
    "texture", "texturemap",
})  # fmt: skip
_NO_WORDS = frozenset({"k", "px"})  # of 4k, 1024px

NOT_NAMED_HERE = "a mesh names a file of this name, but not where it lies, so it is not read"
TEXTURE_BY_NAME = "named like a texture map, and no mesh beside it names it; give it by its own path if it is a photo"


@dataclass(frozen=True)
class FolderListing:
    """All files below a folder: each is in one of ``inputs``, ``parts`` and ``left``.

    An imported asset's input is its folder, which stands for the mesh in it. ``parts`` gives the input that a file is a part
    of, ``left`` the reason why one is left alone. ``beside_meshes`` are the images among the inputs in a folder with a mesh.
    """

    folder: Path
    inputs: tuple[Path, ...]
    parts: dict[Path, Path]
    left: dict[Path, str]
    beside_meshes: tuple[Path, ...]

    @property
    def files(self) -> int:
        """The number of files of the folder, in all folders below it."""
        return len(self.inputs) + len(self.parts) + len(self.left)

    def remarks(self) -> list[str]:
        """Return what a person is told of the folder, a line each; none where every file is an input."""
        return listing_remarks(self.folder, self.inputs, self.parts, self.left, self.beside_meshes)


@dataclass
class _Found:
    """Files below the root by their path relative to it, with ``/``; ``closed`` are those that no input may be."""

    open: list[str] = field(default_factory=list)
    closed: dict[str, str] = field(default_factory=dict)
    asset_files: dict[str, str] = field(default_factory=dict)
    assets: list[str] = field(default_factory=list)
    links: dict[str, str] = field(default_factory=dict)


def list_folder(folder: Path) -> FolderListing:
    """List a folder for a build, everything sorted by path; links to folders are not followed.

    An image is a part of a mesh where the mesh names it and the reader finds it there; one that no mesh names is an input.
    """
    found = _walk(folder)
    meshes = [name for name in found.open if _suffix(name) in MESH_SUFFIXES]
    others = [name for name in found.open if _suffix(name) not in MESH_SUFFIXES]
    parts: dict[str, str] = {}
    elsewhere: set[str] = set()
    if any(_suffix(name) not in _NEVER_NAMED for name in (*others, *found.closed)):
        parts, elsewhere = _named_parts(folder, meshes, found)
    left = {name: reason for name, reason in found.closed.items() if name not in parts}
    inputs = [*found.assets, *meshes]
    mesh_folders = {posixpath.dirname(name) for name in meshes}
    beside: list[str] = []
    for name in others:
        if name in parts:
            continue
        reason = _why_left(folder, name, elsewhere, mesh_folders)
        if reason is None:
            inputs.append(name)
            beside += [name] if posixpath.dirname(name) in mesh_folders else []
        else:
            left[name] = reason
    _leave_links_to_listed(folder, found.links, inputs, left)
    whole = {**parts, **found.asset_files}
    return FolderListing(
        folder,
        tuple(folder / name for name in sorted(inputs)),
        {folder / name: folder / whole[name] for name in sorted(whole)},
        {folder / name: left[name] for name in sorted(left)},
        tuple(folder / name for name in sorted(beside)),
    )


def _suffix(name: str) -> str:
    return posixpath.splitext(name)[1].lower()


def _walk(folder: Path) -> _Found:
    found = _Found()
    stack: list[tuple[str, str | None, str | None]] = [("", None, None)]
    while stack:
        below, closed, asset = stack.pop()
        try:
            with os.scandir(folder / below) as scan:
                entries = list(scan)
        except OSError as error:
            found.closed[below] = f"a folder that cannot be read ({error.strerror or error})"
            continue
        names = {entry.name for entry in entries}
        if closed is None and asset is None and TWIN_RECORD in names and _is_twin(folder / below / TWIN_RECORD):
            closed = "part of a twin that manitwin built"
        if closed is None and asset is None and {IMPORT_RECORD, IMPORTED_MESH} <= names:
            asset = below
            found.assets.append(below)
        for entry in entries:
            name = posixpath.join(below, entry.name)
            reason = "hidden" if closed is None and entry.name.startswith(".") else closed
            if entry.is_dir(follow_symlinks=False):
                stack.append((name, reason, asset))
            else:
                _sort_in(entry, name, reason, asset, found)
    return found


def _sort_in(entry: os.DirEntry[str], name: str, closed: str | None, asset: str | None, found: _Found) -> None:
    if asset is not None:
        if name != posixpath.join(asset, IMPORTED_MESH):
            found.asset_files[name] = asset
        return
    reason = closed or _no_file(entry)
    if reason is not None:
        found.closed[name] = reason
        return
    found.open.append(name)
    if entry.is_symlink():
        found.links[name] = os.path.realpath(entry.path)


def _no_file(entry: os.DirEntry[str]) -> str | None:
    """Return why an entry that is no folder is no file either, or None where it is one."""
    try:
        mode = entry.stat().st_mode
    except OSError as error:
        return f"a link that leads nowhere ({error.strerror or error})"
    if S_ISDIR(mode):
        return "a link to a folder, not followed; give that folder by its own path"
    return None if S_ISREG(mode) else "no regular file"


def _is_twin(record: Path) -> bool:
    try:
        return b'"twin_id"' in record.read_bytes()
    except OSError:  # then it is listed, and named there
        return False


def _named_parts(folder: Path, meshes: list[str], found: _Found) -> tuple[dict[str, str], set[str]]:
    """Return what meshes name and the reader finds, with the mesh, and the names of what it does not find there."""
    root = folder.resolve()
    known = {*found.open, *found.closed} - set(meshes)
    parts: dict[str, str] = {}
    elsewhere: set[str] = set()
    for mesh in meshes:
        for name in _names(folder / mesh):
            file = named_file((folder / mesh).parent, name)
            paths = [] if file is None else _listed(file, root, mesh, name)
            if file is None:
                elsewhere.add(posixpath.basename(spellings(name)[-1]).lower())
            for path in paths:
                if path in known:
                    parts.setdefault(path, mesh)
    return parts, elsewhere


def _listed(file: Path, root: Path, mesh: str, name: str) -> list[str]:
    """Return the paths below the root under which a named file is listed: as it is named, and where a link leads."""
    resolved = [file.relative_to(root).as_posix()] if file.is_relative_to(root) else []
    return [posixpath.normpath(posixpath.join(posixpath.dirname(mesh), s)) for s in spellings(name)] + resolved


def _names(mesh: Path) -> Iterator[str]:
    try:
        yield from named_files(mesh)
    except OSError:  # the reader says so of this input
        return


def _why_left(folder: Path, name: str, elsewhere: set[str], mesh_folders: set[str]) -> str | None:
    image = _suffix(name) in IMAGE_SUFFIXES
    reason = None if image else why_no_input(folder / name)
    if reason is not None:
        return reason
    if posixpath.basename(name).lower() in elsewhere:
        return NOT_NAMED_HERE
    return TEXTURE_BY_NAME if is_texture_by_name(name) and _has_mesh_above(name, mesh_folders) else None


def _has_mesh_above(name: str, mesh_folders: set[str]) -> bool:
    while name:
        name = posixpath.dirname(name)
        if name in mesh_folders:
            return True
    return False


def _leave_links_to_listed(folder: Path, links: dict[str, str], inputs: list[str], left: dict[str, str]) -> None:
    """Take a link to a file that is an input already out of the inputs: it is no second one."""
    if not links:
        return
    root = str(folder.resolve())
    targets: dict[str, list[str]] = defaultdict(list)
    for name in sorted(inputs):
        targets[links.get(name) or posixpath.join(root, name)].append(name)
    seconds = {}
    for same in targets.values():
        first = next((name for name in same if name not in links), same[0])
        seconds.update({name: f"a link to {first}" for name in same if name != first})
    inputs[:] = [name for name in inputs if name not in seconds]
    left.update(seconds)


def listing_remarks(
    folder: Path,
    inputs: tuple[Path, ...],
    parts: dict[Path, Path],
    left: dict[Path, str],
    beside_meshes: tuple[Path, ...],
) -> list[str]:
    """Return a line of counts that add up to all files, then one a reason; none where every file is an input of its own."""
    if not (parts or left or beside_meshes):
        return []
    assets = {whole for whole in parts.values() if whole.suffix.lower() not in MESH_SUFFIXES}
    of_assets = sum(whole in assets for whole in parts.values())
    of_meshes = len(set(parts.values()) - assets)
    counts = [f"{_counted(len(inputs), 'input')}{_kinds(inputs, assets)}"]
    if of_meshes:
        textures = _counted(len(parts) - of_assets, "texture and material file", "textures and material files")
        counts.append(f"{textures} of {_counted(of_meshes, 'mesh', 'meshes')}")
    if assets:
        counts.append(f"{_counted(of_assets, 'file')} of {_counted(len(assets), 'imported asset')}")
    if left:
        counts.append(f"{len(left)} left alone")
    total = _counted(len(inputs) + len(parts) + len(left), "file")
    lines = [f"{folder}: {total}: {', '.join(counts)}"]
    if beside_meshes:
        one = len(beside_meshes) == 1
        lines.append(
            f"{folder}: {_counted(len(beside_meshes), 'image')} beside a mesh, named by none,"
            f" {'is an input' if one else 'are inputs'} of {'its' if one else 'their'} own: {_some(folder, beside_meshes)}"
        )
    by_reason: dict[str, list[Path]] = defaultdict(list)
    for path, reason in left.items():
        by_reason[reason].append(path)
    lines += [f"{folder}: left alone: {_some(folder, paths)}: {reason}" for reason, paths in by_reason.items()]
    return lines


def _kinds(inputs: tuple[Path, ...], assets: set[Path]) -> str:
    meshes = sum(path.suffix.lower() in MESH_SUFFIXES and path not in assets for path in inputs)
    imported = sum(path in assets for path in inputs)
    images = len(inputs) - meshes - imported
    said = [
        _counted(count, one, many)
        for count, one, many in (
            (meshes, "mesh", "meshes"),
            (images, "image", "images"),
            (imported, "imported asset", "imported assets"),
        )
        if count
    ]
    return f" ({', '.join(said)})" if said else ""


def _counted(count: int, one: str, many: str = "") -> str:
    return f"{count} {one if count == 1 else many or one + 's'}"


def _some(folder: Path, paths: Iterable[Path]) -> str:
    names = [str(path.relative_to(folder)) for path in paths]
    shown = ", ".join(names[:_NAMES_SHOWN])
    return shown if len(names) <= _NAMES_SHOWN else f"{len(names)} files ({shown}, ...)"


def why_no_input(path: Path) -> str | None:
    """Return why a file that has no suffix of an input is none, or None for an image under another name."""
    known = _BY_SUFFIX.get(path.suffix.lower())
    if known is not None:
        return known
    try:
        with path.open("rb") as stream:
            found = image_format(stream.read(64))
    except OSError as error:
        return f"cannot be read ({error.strerror or error})"
    if found == "heif":
        return HEIC_NOT_READ
    return None if found is not None else "no image or mesh"


def is_texture_by_name(name: str) -> bool:
    """Tell whether a name ends in what exporters call texture maps: ``mug_normal.png``, ``texture0.jpg``, ``base_color.png``."""
    stem = PurePosixPath(name).stem
    spaced = "".join(f" {c}" if c.isupper() and i and stem[i - 1].islower() else c for i, c in enumerate(stem))
    words = [w for w in "".join(c if c.isalpha() else " " for c in spaced.lower()).split() if w not in _NO_WORDS]
    return bool(words) and (words[-1] in _MAP_WORDS or "".join(words[-2:]) in _MAP_WORDS)
