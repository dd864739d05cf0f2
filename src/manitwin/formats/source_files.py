"""Files that make up an input: a mesh file and the materials, buffers and textures that it names.

Files are scanned by str methods in one pass, without patterns that could backtrack on untrusted bytes.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import BinaryIO
from urllib.parse import unquote
from xml.sax.saxutils import unescape

from manitwin.formats.bounded_file import open_regular, read_bytes
from manitwin.formats.fbx_names import fbx_file_names
from manitwin.formats.json_file import parse_json

MESH_SUFFIXES = frozenset(
    {".glb", ".gltf", ".obj", ".ply", ".stl", ".dae", ".usdz", ".3mf", ".step", ".stp", ".fbx", ".msh", ".off"}
)
IMAGE_SUFFIXES = frozenset(
    {".png", ".jpg", ".jpeg", ".webp", ".gif", ".bmp", ".tif", ".tiff", ".avif", ".ppm", ".pgm", ".pbm", ".pnm"}
)
MAX_TEXT_BYTES = 512 * 1024 * 1024
_MAP_KEYWORDS = frozenset({"bump", "norm", "disp", "decal", "refl"})
# options of texture maps with their numbers of words (MTL specification, "Options for texture map statements")
_MAP_OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-mm": 2,
    "-o": 3, "-s": 3, "-t": 3, "-texres": 1, "-type": 1,
}  # fmt: skip
_MAX_HEADER_BYTES = 1 << 20
_MAX_LINE_BYTES = 1 << 13
_BLOCK_BYTES = 1 << 20
_MAX_NAMES = 10_000  # a mesh has fewer textures; each is looked up on disk
_LONGEST_NAME, _LONGEST_PATH = 255, 4096  # bytes: NAME_MAX and PATH_MAX of Linux
_PLY_TEXTURE = "comment TextureFile "


def side_files(path: Path) -> list[Path]:
    """Return the existing files that a mesh file names, sorted; only those inside its own folder, with links resolved.

    Missing files and files outside the folder are ignored; the mesh reader reports them.
    """
    found = {named_file(path.parent, name) for name in named_files(path)}
    return sorted({file for file in found if file is not None} - {path.resolve()})


def named_file(folder: Path, name: str) -> Path | None:
    """Return the file that a name in a mesh denotes, with links resolved; None if it is missing or outside the folder."""
    for spelling in spellings(name):
        path = inside_folder(folder, spelling)
        if path is None or is_regular(path):
            return path
    return None


def is_regular(path: Path) -> bool:
    """Return whether a path leads to a regular file, rather than a folder, pipe, socket or device."""
    try:
        return stat.S_ISREG(os.stat(path).st_mode)
    except (OSError, ValueError):  # missing, or a name that no file system can hold
        return False


def spellings(name: str) -> list[str]:
    """Return the paths, relative to a mesh's folder, that a name in the mesh may denote, most likely first."""
    clean = name.strip().strip('"').replace("\\", "/")
    return [clean] if unquote(clean) == clean else [clean, unquote(clean)]


def inside_folder(folder: Path, name: str, *, root: Path | None = None) -> Path | None:
    """Return the path that a name denotes in a folder, with links resolved; None if it leaves the folder, or ``root``."""
    # a drive letter and a scheme both have a colon; neither is a file in this folder
    if not name or "\0" in name or name.startswith(("/", "~")) or re.match(r"[A-Za-z][A-Za-z0-9+.-]*:", name):
        return None
    if len(name) > _LONGEST_PATH or any(len(part) > _LONGEST_NAME for part in name.split("/")):
        return None
    try:
        here = folder.resolve()
        target = (here / name).resolve()
        root = here if root is None else root.resolve()
    except (OSError, ValueError, RuntimeError):  # a name that no file system can hold, or a loop of links
        return None
    return target if target.is_relative_to(root) else None


def named_files(path: Path) -> Iterator[str]:
    """Yield the names of other files in a mesh file (textures, materials, buffers), as the mesh writes them.

    For binary formats only the header is read, and in OBJ only material statements are decoded. A file that is unreadable or
    not regular yields nothing; the mesh reader reports it.
    """
    names = {".obj": _named_by_obj, ".gltf": _named_by_gltf, ".glb": _named_by_glb, ".dae": _named_by_dae,
             ".ply": _named_by_ply, ".fbx": _named_by_fbx}.get(path.suffix.lower())  # fmt: skip
    if names is not None and is_regular(path):
        try:
            yield from islice(names(path), _MAX_NAMES)
        except _Unread:
            return


class _Unread(Exception):
    """An unreadable file, which yields no names."""


def map_file_name(statement: str) -> str:
    """Return the file name of an MTL map statement: options come first, and the name may contain spaces."""
    words = statement.split()
    skip = 0
    while skip < len(words) and words[skip].lower() in _MAP_OPTIONS:
        option = words[skip].lower()
        skip += 1
        taken = 0
        # -o, -s and -t may have fewer than three numbers
        while taken < _MAP_OPTIONS[option] and skip < len(words) - 1 and (taken == 0 or _is_number(words[skip])):
            skip, taken = skip + 1, taken + 1
    return statement if skip == 0 else " ".join(words[skip:])


def ply_texture(header: bytes) -> str | None:
    """Return the texture that a PLY header names in MeshLab's form ``comment TextureFile NAME``; the last one counts."""
    lines = header.decode("utf-8", errors="replace").splitlines()
    names = [line.removeprefix(_PLY_TEXTURE).strip() for line in lines if line.startswith(_PLY_TEXTURE)]
    return names[-1] if names else None


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _named_by_obj(path: Path) -> Iterator[str]:
    seen: set[Path] = set()
    with open_regular(path, _Unread) as stream:
        if os.fstat(stream.fileno()).st_size > MAX_TEXT_BYTES:
            return
        libraries = dict.fromkeys(islice(_material_libraries(stream), _MAX_NAMES))
    for library in libraries:
        yield library
        material = named_file(path.parent, library)
        if material is not None and material not in seen:
            seen.add(material)
            try:
                text = read_bytes(material, MAX_TEXT_BYTES, _Unread, inside=path.parent).decode(errors="replace")
            except _Unread:
                continue
            yield from dict.fromkeys(_named_by_mtl(text))


def _material_libraries(stream: BinaryIO) -> Iterator[str]:
    """Yield what follows ``mtllib`` at the start of a line, block by block; lines longer than 8 KiB are ignored."""
    rest = b""
    while block := stream.read(_BLOCK_BYTES):
        lines, _, rest = (rest + block).rpartition(b"\n")
        if b"mtllib" in lines:
            yield from _libraries_in(lines)
        # for a long line it suffices to know that the statement does not begin here
        rest = rest if len(rest) <= _MAX_LINE_BYTES else b"." * _MAX_LINE_BYTES
    yield from _libraries_in(rest)


def _libraries_in(text: bytes) -> Iterator[str]:
    at = text.find(b"mtllib")
    while at >= 0:
        # the statement starts a line; names that contain "mtllib" are skipped
        start = text.rfind(b"\n", 0, at) + 1
        end = text.find(b"\n", at)
        end = len(text) if end < 0 else end
        if at - start < _MAX_LINE_BYTES and end - at < _MAX_LINE_BYTES:
            words = text[start:end].decode("utf-8", errors="replace").split(None, 1)
            if words[0] == "mtllib" and len(words) > 1:
                yield words[1].strip()
        at = text.find(b"mtllib", end)


def _named_by_mtl(text: str) -> Iterator[str]:
    for line in text.splitlines():
        keyword, _, statement = line.strip().replace("\t", " ").partition(" ")
        if statement and (keyword.lower() in _MAP_KEYWORDS or keyword.lower().startswith("map_")):
            yield map_file_name(statement.strip())


def _named_by_gltf(path: Path) -> Iterator[str]:
    yield from _named_by_gltf_json(read_bytes(path, MAX_TEXT_BYTES, _Unread))


def _named_by_glb(path: Path) -> Iterator[str]:
    with open_regular(path, _Unread) as stream:
        header = stream.read(20)  # magic, version, length; then length and type of the JSON chunk
        size = int.from_bytes(header[12:16], "little")
        if header[:4] == b"glTF" and header[16:20] == b"JSON" and size <= MAX_TEXT_BYTES:
            yield from _named_by_gltf_json(stream.read(size))


def _named_by_gltf_json(text: bytes) -> Iterator[str]:
    if b'"uri"' not in text:
        return
    document = parse_json(text.decode("utf-8-sig", errors="replace").rstrip("\0 "), "glTF", _Unread)
    if not isinstance(document, dict):
        return
    for key in ("buffers", "images"):
        entries = document.get(key)
        for entry in entries if isinstance(entries, list) else []:
            uri = entry.get("uri") if isinstance(entry, dict) else None
            if isinstance(uri, str) and not uri.startswith("data:"):
                yield uri


def _named_by_dae(path: Path) -> Iterator[str]:
    data = read_bytes(path, MAX_TEXT_BYTES, _Unread)
    at = data.find(b"<init_from")
    while at >= 0:
        start = data.find(b">", at) + 1
        if start == 0:
            return
        name, start = _text_at(data, start)
        if not name and data.startswith(b"<ref>", start):  # COLLADA 1.5
            name, start = _text_at(data, start + len(b"<ref>"))
        if name:
            yield unescape(name)
        at = data.find(b"<init_from", start)


def _text_at(data: bytes, start: int) -> tuple[str, int]:
    """Return the stripped text of an element that begins at ``start``, and its end; empty if longer than any path."""
    end = data.find(b"<", start)
    end = len(data) if end < 0 else end
    text = data[start:end].strip() if end - start <= _MAX_LINE_BYTES else b""
    return text.decode(errors="replace").strip(), end


def _named_by_fbx(path: Path) -> Iterator[str]:
    yield from dict.fromkeys(fbx_file_names(read_bytes(path, MAX_TEXT_BYTES, _Unread)))


def _named_by_ply(path: Path) -> Iterator[str]:
    with open_regular(path, _Unread) as stream:
        head = stream.read(_MAX_HEADER_BYTES)
    name = ply_texture(head[: head.find(b"end_header")])
    if name:
        yield name
