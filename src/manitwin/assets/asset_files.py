"""File lookup of an asset: reads each file once, only below a root folder, and records missing and misplaced files."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import trimesh

from manitwin.assets.root import private_folders, upward, with_the_path
from manitwin.errors import AssetError, InputError
from manitwin.formats.meshes.read import MeshFile, read_mesh
from manitwin.formats.meshes.source import MeshLimits

MESH_LIMITS = MeshLimits(max_bytes=1 << 29, max_faces=2_000_000)
SHAPE_LIMITS = replace(MESH_LIMITS, decode_textures=False, shading=False)
"""Limits for measuring only: textures keep their size but no pixels, and parts without normals get none."""
MAX_SHAPES = 4096
MAX_FACES = 8_000_000  # of all shapes together: many of them may name one mesh
UNREAD_FORMATS = frozenset({".vtk", ".vtu", ".wrl", ".iv", ".x3d", ".3ds", ".fbx", ".off", ".ac", ".bin", ".mesh"})
"""Mesh formats that descriptions name and that are not read: they serve certain engines, or only the tool that wrote them."""
MESHES = frozenset({".obj", ".stl", ".dae", ".msh", ".glb", ".gltf", ".ply", ".usd", ".usda", ".usdc", ".usdz"})
OUTSIDE = " lies outside the folder above which nothing is read"
MOST_NAMED = 3
"""Largest number of left-out parts or locked joints to name; for a robot or a building, a count is more readable."""
_MOST_VAIN_SEARCHES, _MOST_TRIED = 8, 8
_NOT_THERE = re.compile(r"^(?:texture|material library) '(.+)' (is not there|lies outside )")


@dataclass
class AssetFiles:
    """The files that an asset names, looked up only below ``root`` with symbolic links resolved.

    ``own`` is the folder of the asset; files read from above it cause a remark. ``used`` holds the files that were found,
    ``missing`` the names that were not. ``remarks`` has one line each; ``lenient`` is the subset added by ``remark_leniency``.
    ``partial`` is set when bodies were left out. ``limits`` apply to each mesh and say whether textures and normals are needed.
    """

    root: Path
    own: Path | None = None
    limits: MeshLimits = MESH_LIMITS
    used: set[Path] = field(default_factory=set)
    missing: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    lenient: list[str] = field(default_factory=list)
    partial: bool = False
    _meshes: dict[Path, MeshFile] = field(default_factory=dict)
    _strayed: dict[str, Path] = field(default_factory=dict)
    _vain_searches: int = 0
    _shapes: int = 0
    _faces: int = 0

    def remark(self, sentence: str) -> None:
        """Add a remark about the asset, unless it was added before."""
        if sentence not in self.remarks:
            self.remarks.append(sentence)

    def remark_leniency(self, sentence: str) -> None:
        """Remark on something that is read here but that a strict loader would refuse or not find."""
        self.remark(sentence)
        if sentence not in self.lenient:
            self.lenient.append(sentence)

    @property
    def has_missing_mesh(self) -> bool:
        """Whether a missing file is a mesh."""
        return any(Path(name).suffix.lower() in MESHES for name in self.missing)

    def remark_left_out(self, parts: Sequence[str], what: str) -> None:
        """Remark on parts that do not belong to the rigid object being read: each separately, or their count where there are
        many.
        """
        self.partial = self.partial or bool(parts)
        for sentence in left_out_remarks(parts, what):
            self.remark(sentence)

    def remark_locked(self, joints: Sequence[str]) -> None:
        """Remark on movable joints that were locked in the pose of the file."""
        for sentence in locked_joint_remarks(joints):
            self.remark(sentence)

    def find(self, name: str, candidates: Iterable[Path], below: str | None = None) -> Path | None:
        """Return the first candidate that is a file below the root, or None after adding ``name`` to ``missing``.

        ``name`` is the file's name in the asset, ``below`` a longer path for it where the asset states one elsewhere. If no
        candidate exists, the file is also sought under a different letter case, below a renamed root and elsewhere below the
        root (``with_the_path``); a file found so is remarked as lenient.
        """
        outside: Path | None = None
        tried: list[Path] = []
        for candidate in candidates:
            tried.append(candidate)
            found, inside = self._resolve_below_root(candidate)
            if found is not None:
                self._remark_if_above(found)
                self.used.add(found)
                return found
            outside = candidate if outside is None and not inside else outside
        elsewhere = (
            self._find_ignoring_case(name, tried)
            or self._find_in_renamed_root(name, tried)
            or self._find_elsewhere(below or name)
        )
        if elsewhere is not None:
            return elsewhere
        self.missing.append(_short(name))
        if outside is not None:
            self.remark(f"{_short(name)}{OUTSIDE}{self._common_folder_hint(outside)}")
        return None

    def _common_folder_hint(self, candidate: Path) -> str:
        """Describe where a file outside the root may be: in the common folder of both, unless that is a home folder or above
        it.
        """
        root, place = self.root.resolve(), candidate.resolve()
        both = Path(os.path.commonpath([root, place]))
        if both in private_folders():
            return f", {root}; put it there, and its path into the asset's file"
        return f", {root}; where it is there, import with --root {both}"

    def _resolve_below_root(self, candidate: Path) -> tuple[Path | None, bool]:
        """Return the resolved file if it exists below the root, else None; and whether its path lies below the root."""
        try:
            resolved = candidate.resolve()
            inside = resolved.is_relative_to(self.root.resolve())
            return (resolved if inside and resolved.is_file() else None), inside
        except (OSError, ValueError, RuntimeError):  # a name that no file system can hold; a loop of links
            return None, True

    def _find_ignoring_case(self, name: str, tried: Sequence[Path]) -> Path | None:
        """Return the file whose name differs only in letter case, with a remark; None if there is none."""
        if self._vain_searches >= _MOST_VAIN_SEARCHES:
            return None
        for candidate in tried[:_MOST_TRIED]:
            try:
                folder = candidate.parent.resolve()
                inside = folder.is_relative_to(self.root.resolve())
                alike = (
                    [each for each in folder.iterdir() if each.name.lower() == candidate.name.lower()] if inside else []
                )
            except (OSError, ValueError, RuntimeError):  # as in _below
                continue
            found = self._resolve_below_root(alike[0])[0] if len(alike) == 1 else None
            if found is not None:
                if not any("the case of letters" in each for each in self.lenient):  # once, even if many meshes differ
                    self.remark_leniency(
                        f"the case of letters in {_short(name)} is not that of the file {_short(found.name)}"
                    )
                self.used.add(found)
                self._strayed[name] = found
                return found
        return None

    def _find_elsewhere(self, name: str) -> Path | None:
        """Return a file that is elsewhere below the root than the asset says, with a remark; None if there is none."""
        if name in self._strayed:
            return self._strayed[name]
        if self.own is None or self._vain_searches >= _MOST_VAIN_SEARCHES:
            return None
        for candidate in with_the_path(name.replace("\\", "/"), self.own, self.root):
            found, _ = self._resolve_below_root(candidate)
            if found is not None:
                return self._record_misplaced(name, found)
        self._vain_searches += 1
        return None

    def _find_in_renamed_root(self, name: str, tried: Sequence[Path]) -> Path | None:
        """Return the file of a path that leaves the root and returns to it by its former name; None if there is none.

        The former name is one that no folder beside the root has: the root folder was renamed.
        """
        root = self.root.resolve()
        for candidate in tried[:_MOST_TRIED]:
            try:
                place = candidate.resolve()
                outside = place.is_relative_to(root.parent) and not place.is_relative_to(root)
                old, *inside = place.relative_to(root.parent).parts if outside else ("",)
                if not inside or os.path.lexists(root.parent / old):
                    continue
            except (OSError, ValueError, RuntimeError):  # as in _below
                continue
            found, _ = self._resolve_below_root(root.joinpath(*inside))
            if found is not None:
                return self._record_misplaced(name, found)
        return None

    def _record_misplaced(self, name: str, found: Path) -> Path:
        """Remark on a file that is elsewhere below the root than the asset says, and return it."""
        if not any("were read from elsewhere" in each for each in self.lenient):
            place = _short(str(found.relative_to(self.root.resolve())))
            self.remark_leniency(
                f"files are not where it says, and were read from elsewhere below the root: {_short(name)} from {place}"
            )
        self.used.add(found)
        self._strayed[name] = found
        return found

    def find_used(self, name: str, candidates: Iterable[Path]) -> Path | None:
        """Return the file that ``find`` returned for a name before, or None."""
        if name in self._strayed:
            return self._strayed[name]
        for candidate in candidates:
            try:
                resolved = candidate.resolve()
            except (OSError, ValueError, RuntimeError):  # as in find
                continue
            if resolved in self.used:
                return resolved
        return None

    def is_unsupported(self, path: Path) -> bool:
        """Return whether a mesh has a format of ``UNREAD_FORMATS``; if so, add a remark."""
        unread = path.suffix.lower() in UNREAD_FORMATS
        if unread:
            self.remark(f"{path.name} is a {path.suffix.lower()} file, which is not read: its shape was left out")
        return unread

    def _remark_if_above(self, file: Path) -> None:
        if self.own is not None and not file.is_relative_to(self.own.resolve()):
            self.remark(f"files were read from above its own folder, below the root {self.root.resolve().name!r}")

    def mesh(self, path: Path, *, hull_of_points: bool = False) -> MeshFile:
        """Read a mesh that ``find`` returned; ``hull_of_points`` is passed to ``read_mesh``.

        Raises AssetError, naming the mesh, if it cannot be read or the asset is too large.
        """
        if path not in self._meshes:
            try:
                folders = self._texture_folders(path)
                mesh = read_mesh(
                    path, limits=self.limits, root=self.root, texture_folders=folders, hull_of_points=hull_of_points
                )
            except InputError as error:
                raise AssetError(error.detail) from error
            self.used.update(mesh.files)
            for file in mesh.files:
                self._remark_if_above(file)
            for sentence in mesh.findings:
                absent = _NOT_THERE.match(sentence)
                if absent:
                    self.missing.append(absent.group(1))
                if not (absent and absent.group(2) == "is not there"):
                    self.remark(f"{path.name}: {sentence}")
            self._meshes[path] = mesh
        self.count_shape(sum(len(part.faces) for part in self._meshes[path].parts))
        return self._meshes[path]

    def _texture_folders(self, mesh: Path) -> tuple[Path, ...]:
        """Return the texture folders of Gazebo models: ``materials/textures`` in the mesh's folder or in one above it."""
        folders = (folder / "materials" / "textures" for folder in upward(mesh.parent, self.root))
        return tuple(folder for folder in folders if folder.is_dir())

    def count_shape(self, faces: int) -> None:
        """Count a shape with this many faces; raise AssetError where the asset exceeds ``MAX_SHAPES`` or ``MAX_FACES``."""
        self._shapes += 1
        self._faces += faces
        if self._shapes > MAX_SHAPES or self._faces > MAX_FACES:
            raise AssetError(
                f"{self.root.name}: more than {MAX_SHAPES} shapes or {MAX_FACES} triangles; it is no single object"
            )

    def sorted_files(self) -> tuple[Path, ...]:
        """Return the files that were used, sorted."""
        return tuple(sorted(self.used))

    def missing_names(self) -> tuple[str, ...]:
        """Return the names of missing files, without duplicates."""
        return tuple(dict.fromkeys(self.missing))


def left_out_remarks(parts: Sequence[str], what: str) -> list[str]:
    """Return the remarks on parts that were left out: one for each part, or one with their count where there are many."""
    if len(parts) > MOST_NAMED:
        return [f"{parts[0]}, and with it {len(parts) - 1} more {what} were left out: one rigid object is read"]
    return [f"{part} and was left out: one rigid object is read" for part in parts]


def locked_joint_remarks(joints: Sequence[str]) -> list[str]:
    """Return the remark on movable joints that were locked in the pose of the file; an empty list if there are none."""
    if not joints:
        return []
    more = f" and {len(joints) - MOST_NAMED} more" if len(joints) > MOST_NAMED else ""
    named = ", ".join(_short(name) for name in joints[:MOST_NAMED])
    return [f"joints were locked as the file stands, so that it is one rigid body: {named}{more}"]


def concatenate_meshes(parts: Iterable[trimesh.Trimesh]) -> tuple[np.ndarray, np.ndarray]:
    """Concatenate parts into one array of vertices ``(V, 3)`` and one of faces ``(F, 3)``."""
    parts = list(parts)
    vertices, faces = trimesh.util.append_faces([p.vertices for p in parts], [p.faces for p in parts])
    return np.asarray(vertices, float).reshape(-1, 3), np.asarray(faces, np.int64).reshape(-1, 3)


def _short(name: str) -> str:
    line = " ".join(name.split())
    return line if len(line) <= 120 else line[:117] + "..."
