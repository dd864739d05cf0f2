"""Classification of the files of an input folder: an input, a part of an input, or ignored with a reason."""

from __future__ import annotations

import os
import posixpath
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from stat import S_ISDIR, S_ISREG

from manitwin.formats.source_files import IMAGE_SUFFIXES, MESH_SUFFIXES, named_file, spellings
from manitwin.pipeline.inspection import NotInspected, are_imported, are_twins, names_of, why_no_inputs
from manitwin.pipeline.listing_remarks import listing_remarks
from manitwin.pipeline.mask_matching import match_masks
from manitwin.twin.import_record import IMPORT_RECORD, IMPORTED_MESH

Told = Callable[[str], None]
"""Callback with a progress message."""
TWIN_RECORD = "twin.json"
_NEVER_NAMED = frozenset({"", ".txt", ".md", ".pdf", ".csv", ".jsonl", ".html", ".py", ".sh", ".log"})
"""Suffixes that meshes never reference; if a folder has only meshes and such files, no mesh is opened."""
# last words of the names that exporters give to texture maps
_MAP_WORDS = frozenset({
    "albedo", "ambientocclusion", "ao", "alpha", "basecolor", "basecolour", "bump", "diff", "diffuse", "disp",
    "displacement", "emission", "emissive", "gloss", "glossiness", "lightmap", "metallic", "metallicroughness",
    "metalness", "metalrough", "nor", "nrm", "normal", "normals", "normalmap", "normalgl", "normaldx", "occlusion",
    "occlusionroughnessmetallic", "opacity", "orm", "rough", "roughness", "rma", "spec", "specular", "tex",
    "texture", "texturemap",
})  # fmt: skip
_NO_WORDS = frozenset({"k", "px"})  # in 4k, 1024px

NOT_NAMED_HERE = "a mesh names a file of this name, but not where it lies, so it is not read"
TEXTURE_BY_NAME = "named like a texture map, but no mesh in its folder uses it; if it is a photo, give its own path"


@dataclass(frozen=True)
class FolderListing:
    """All files below a folder: each is in exactly one of ``inputs``, ``parts`` and ``left``.

    The input of an imported asset is its folder, which stands for the mesh in it. ``parts`` maps a file to the input that it
    belongs to, and a mask to its photo. ``left`` maps ignored files to the reason. ``beside_meshes`` are the images among the
    inputs in a folder with a mesh.
    """

    folder: Path
    inputs: tuple[Path, ...]
    parts: dict[Path, Path]
    left: dict[Path, str]
    beside_meshes: tuple[Path, ...]

    @property
    def files(self) -> int:
        """The number of files in the folder and all its subfolders."""
        return len(self.inputs) + len(self.parts) + len(self.left)

    @property
    def masks(self) -> dict[Path, Path]:
        """The masks among the parts, by photo."""
        return {whole: part for part, whole in self.parts.items() if whole.suffix.lower() in IMAGE_SUFFIXES}

    def remarks(self) -> list[str]:
        """Return remarks on the folder, one line each; empty if every file is an input."""
        return listing_remarks(self.folder, self.inputs, self.parts, self.left, self.beside_meshes)


@dataclass
class _Found:
    """Files by path relative to the root, with ``/``; ``closed`` are those that cannot be inputs, with the reason."""

    open: list[str] = field(default_factory=list)
    closed: dict[str, str] = field(default_factory=dict)
    asset_files: dict[str, str] = field(default_factory=dict)
    assets: list[str] = field(default_factory=list)
    links: dict[str, str] = field(default_factory=dict)


def list_folder(folder: Path, told: Told = lambda said: None) -> FolderListing:
    """Classify the files of a folder for a build, sorted by path; links to folders are not followed.

    An image is a part of a mesh if the mesh references it and the reader finds it there. An image that no mesh references is an
    input, or by its name the mask of one (``masks_beside``). ``told`` receives progress messages.
    """
    found = _walk(folder, told)
    meshes = sorted(name for name in found.open if _suffix(name) in MESH_SUFFIXES)
    others = [name for name in found.open if _suffix(name) not in MESH_SUFFIXES]
    parts: dict[str, str] = {}
    elsewhere: set[str] = set()
    unknown: dict[str, str] = {}
    if any(_suffix(name) not in _NEVER_NAMED for name in (*others, *found.closed)):
        parts, elsewhere, unknown = _named_parts(folder, meshes, found, told)
    left = {name: reason for name, reason in found.closed.items() if name not in parts} | unknown
    inputs = [*found.assets, *(mesh for mesh in meshes if mesh not in unknown)]
    mesh_folders = {posixpath.dirname(name) for name in meshes}
    beside: list[str] = []
    others = [name for name in others if name not in parts]
    odd = [name for name in others if _suffix(name) not in IMAGE_SUFFIXES]
    no_image = dict(zip(odd, why_no_inputs([folder / name for name in odd]), strict=True))
    masks = match_masks([name for name in others if name not in no_image and not _has_mesh_above(name, mesh_folders)])
    parts |= masks
    for name in others:
        reason = no_image.get(name) or _why_texture(name, elsewhere, mesh_folders)
        if name in masks:
            continue
        if reason is None:
            inputs.append(name)
            beside += [name] if posixpath.dirname(name) in mesh_folders else []
        else:
            left[name] = reason
    _drop_duplicate_links(folder, found.links, inputs, left)
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


@dataclass(frozen=True)
class _Folder:
    """A folder below the root; ``closed``: why no file in it is an input; ``asset``: the imported asset that it belongs to."""

    name: str
    closed: str | None = None
    asset: str | None = None


def _walk(folder: Path, told: Told) -> _Found:
    """Find all files breadth-first, so that the records of one depth are inspected together."""
    found = _Found()
    level = [_Folder("")]
    while level:
        scanned = [(each, entries) for each in level if (entries := _scanned(folder, each, found)) is not None]
        level = []
        for below, entries in _mark_folder_kinds(folder, scanned, found):
            told(f"{len(found.open):,} files found in {folder.name}")
            for entry in entries:
                name = posixpath.join(below.name, entry.name)
                reason = "hidden" if below.closed is None and entry.name.startswith(".") else below.closed
                if entry.is_dir(follow_symlinks=False):
                    level.append(_Folder(name, reason, below.asset))
                else:
                    _sort_in(entry, name, reason, below.asset, found)
    return found


def _scanned(folder: Path, below: _Folder, found: _Found) -> list[os.DirEntry[str]] | None:
    try:
        with os.scandir(folder / below.name) as scan:
            return sorted(scan, key=lambda entry: entry.name)
    except OSError as error:
        found.closed[below.name] = f"a folder that cannot be read ({error.strerror or error})"
        return None


_Scanned = tuple[_Folder, list[os.DirEntry[str]]]


def _mark_folder_kinds(folder: Path, scanned: list[_Scanned], found: _Found) -> list[_Scanned]:
    """Return the folders, with those of twins marked as closed and those of imported assets marked as such."""
    names = {below.name: {entry.name for entry in entries} for below, entries in scanned}
    open_ = [below.name for below, _ in scanned if below.closed is None and below.asset is None]
    records = [name for name in open_ if TWIN_RECORD in names[name]]
    twins = dict(zip(records, are_twins(folder / name / TWIN_RECORD for name in records), strict=True))
    assets = [name for name in open_ if not twins.get(name) and {IMPORT_RECORD, IMPORTED_MESH} <= names[name]]
    wrong = dict(zip(assets, are_imported(folder / name / IMPORT_RECORD for name in assets), strict=True))
    found.assets += [name for name in assets if wrong[name] is None]
    told = []
    for below, entries in scanned:
        name = below.name
        if twins.get(name):
            below = _Folder(name, "part of a twin that manitwin built")
        elif name in wrong:
            reason = wrong[name]
            below = _Folder(name, asset=name) if reason is None else _Folder(name, f"an imported asset: {reason}")
        told.append((below, entries))
    return told


def _sort_in(entry: os.DirEntry[str], name: str, closed: str | None, asset: str | None, found: _Found) -> None:
    if asset is not None:
        if name != posixpath.join(asset, IMPORTED_MESH):
            found.asset_files[name] = asset
        return
    reason = closed or _irregular_file_reason(entry)
    if reason is not None:
        found.closed[name] = reason
        return
    found.open.append(name)
    if entry.is_symlink():
        found.links[name] = os.path.realpath(entry.path)


def _irregular_file_reason(entry: os.DirEntry[str]) -> str | None:
    """Return why an entry that is not a folder is not a regular file either; None if it is one."""
    try:
        mode = entry.stat().st_mode
    except OSError as error:
        return f"a broken link ({error.strerror or error})"
    if S_ISDIR(mode):
        return "a link to a folder, which is not followed; give the path of that folder"
    return None if S_ISREG(mode) else "not a regular file"


def _named_parts(
    folder: Path, meshes: list[str], found: _Found, told: Told
) -> tuple[dict[str, str], set[str], dict[str, str]]:
    """Return the files that meshes reference and the reader finds, with their mesh; the names of referenced files not found
    there; and the meshes that could not be inspected, with the reason.
    """
    root = folder.resolve()
    known = {*found.open, *found.closed} - set(meshes)
    plain = set(found.open) - found.links.keys()
    parts: dict[str, str] = {}
    elsewhere: set[str] = set()
    unknown: dict[str, str] = {}
    answers = zip(meshes, names_of(folder / mesh for mesh in meshes), strict=True)
    for number, (mesh, names) in enumerate(answers, 1):
        told(f"{number:,} of {len(meshes):,} meshes of {folder.name} searched for the files that they reference")
        if isinstance(names, NotInspected):
            unknown[mesh] = str(names)
            continue
        for name in names:
            below = _below(mesh, name)
            if below and below[0] in plain:  # without links no disk access is needed
                for path in known.intersection(below):
                    parts.setdefault(path, mesh)
                continue
            file = named_file((folder / mesh).parent, name)
            paths = [] if file is None else _listed(file, root, mesh, name)
            if file is None:
                elsewhere.add(posixpath.basename(spellings(name)[-1]).lower())
            for path in paths:
                if path in known:
                    parts.setdefault(path, mesh)
    return parts, elsewhere, unknown


def _below(mesh: str, name: str) -> list[str]:
    """Return the paths below the root that a reference in a mesh may mean, likeliest first; empty if it may lead outside."""
    spelled = spellings(name)
    if any(each.startswith(("/", "~")) or ":" in each or ".." in each.split("/") for each in spelled):
        return []
    return [posixpath.normpath(posixpath.join(posixpath.dirname(mesh), each)) for each in spelled]


def _listed(file: Path, root: Path, mesh: str, name: str) -> list[str]:
    """Return the paths below the root under which a referenced file is listed: as written, and with links resolved."""
    resolved = [file.relative_to(root).as_posix()] if file.is_relative_to(root) else []
    return [posixpath.normpath(posixpath.join(posixpath.dirname(mesh), s)) for s in spellings(name)] + resolved


def _why_texture(name: str, elsewhere: set[str], mesh_folders: set[str]) -> str | None:
    """Return why an image is ignored that no mesh references at its location; None if it is an input."""
    if posixpath.basename(name).lower() in elsewhere:
        return NOT_NAMED_HERE
    return TEXTURE_BY_NAME if is_texture_by_name(name) and _has_mesh_above(name, mesh_folders) else None


def _has_mesh_above(name: str, mesh_folders: set[str]) -> bool:
    while name:
        name = posixpath.dirname(name)
        if name in mesh_folders:
            return True
    return False


def _drop_duplicate_links(folder: Path, links: dict[str, str], inputs: list[str], left: dict[str, str]) -> None:
    """Remove links to files that are inputs already from the inputs."""
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


def is_texture_by_name(name: str) -> bool:
    """Return whether a name ends like those that exporters give texture maps (``mug_normal.png``, ``texture0.jpg``,
    ``base_color.png``).
    """
    stem = PurePosixPath(name).stem
    spaced = "".join(f" {c}" if c.isupper() and i and stem[i - 1].islower() else c for i, c in enumerate(stem))
    words = [w for w in "".join(c if c.isalpha() else " " for c in spaced.lower()).split() if w not in _NO_WORDS]
    return bool(words) and (words[-1] in _MAP_WORDS or "".join(words[-2:]) in _MAP_WORDS)
