"""The files that make up an input: a mesh file and the materials, buffers and textures that it names."""

from __future__ import annotations

import io
import json
import mmap
import re
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from urllib.parse import unquote
from xml.sax.saxutils import unescape

MESH_SUFFIXES = frozenset({".glb", ".gltf", ".obj", ".ply", ".stl", ".dae", ".usdz"})
IMAGE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".webp", ".gif", ".bmp", ".tif", ".tiff", ".avif"})
MAX_TEXT_BYTES = 512 * 1024 * 1024
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest date of a ZIP entry: equal inputs give equal archives
_MAP_KEYWORDS = frozenset({"bump", "norm", "disp", "decal", "refl"})
# options of texture maps and how many words each takes (MTL specification, "Options for texture map statements")
_MAP_OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-mm": 2,
    "-o": 3, "-s": 3, "-t": 3, "-texres": 1, "-type": 1,
}  # fmt: skip
_MAX_HEADER_BYTES = 1 << 20
_MAX_LINE_BYTES = 1 << 13
_PLY_TEXTURE = "comment TextureFile "


def side_files(path: Path) -> list[Path]:
    """Return the existing files that a mesh file names, sorted; only those inside its own folder, links resolved.

    Nothing is said of files that are missing or outside: that is for the reader to report.
    """
    found = {named_file(path.parent, name) for name in named_files(path)}
    return sorted({file for file in found if file is not None} - {path.resolve()})


def named_file(folder: Path, name: str) -> Path | None:
    """Return the file that a mesh in a folder means by a name, links resolved; None where it is missing or outside."""
    for spelling in spellings(name):
        path = inside_folder(folder, spelling)
        if path is None or path.is_file():
            return path
    return None


def spellings(name: str) -> list[str]:
    """Return the paths, relative to a mesh's folder, that a name in the mesh may mean, the likelier first."""
    clean = name.strip().strip('"').replace("\\", "/")
    return [clean] if unquote(clean) == clean else [clean, unquote(clean)]


def inside_folder(folder: Path, name: str) -> Path | None:
    """Return the path that a name means below a folder, links resolved; None where it leads out of it."""
    # a drive letter and a scheme both have a colon; neither is a file beside this one
    if not name or "\0" in name or name.startswith(("/", "~")) or re.match(r"[A-Za-z][A-Za-z0-9+.-]*:", name):
        return None
    try:
        root = folder.resolve()
        target = (root / name).resolve()
    except OSError:  # a name that no file system can hold
        return None
    return target if target.is_relative_to(root) else None


def named_files(path: Path) -> Iterator[str]:
    """Yield the names of other files in a mesh file (textures, materials, buffers), as the mesh writes them.

    Of binary formats only the header is read, of OBJ no more than its material statements are decoded.
    """
    names = {".obj": _named_by_obj, ".gltf": _named_by_gltf, ".glb": _named_by_glb, ".dae": _named_by_dae,
             ".ply": _named_by_ply}.get(path.suffix.lower())  # fmt: skip
    if names is not None and path.is_file() and path.stat().st_size > 0:
        yield from names(path)


def map_file_name(statement: str) -> str:
    """Return the file name of an MTL map statement: options come first, and a name may hold spaces."""
    words = statement.split()
    skip = 0
    while skip < len(words) and words[skip].lower() in _MAP_OPTIONS:
        option = words[skip].lower()
        skip += 1
        taken = 0
        # -o, -s and -t may give fewer numbers than three
        while taken < _MAP_OPTIONS[option] and skip < len(words) - 1 and (taken == 0 or _is_number(words[skip])):
            skip, taken = skip + 1, taken + 1
    return statement if skip == 0 else " ".join(words[skip:])


def ply_texture(header: bytes) -> str | None:
    """Return the texture that a PLY header names in MeshLab's way: ``comment TextureFile NAME``; the last one counts."""
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
    if path.stat().st_size > MAX_TEXT_BYTES:
        return
    seen: set[Path] = set()
    for library in dict.fromkeys(_material_libraries(path)):
        yield library
        material = named_file(path.parent, library)
        if material is not None and material not in seen and material.stat().st_size <= MAX_TEXT_BYTES:
            seen.add(material)
            yield from dict.fromkeys(_named_by_mtl(material.read_text(errors="replace")))


def _material_libraries(path: Path) -> Iterator[str]:
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as text:
        at = text.find(b"mtllib")
        while at >= 0:
            # the statement is a line of its own; names with "mtllib" in them are none
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
    if path.stat().st_size <= MAX_TEXT_BYTES:
        yield from _named_by_gltf_json(path.read_bytes())


def _named_by_glb(path: Path) -> Iterator[str]:
    with path.open("rb") as stream:
        header = stream.read(20)  # magic, version, length; then the length and kind of the JSON chunk
        size = int.from_bytes(header[12:16], "little")
        if header[:4] == b"glTF" and header[16:20] == b"JSON" and size <= MAX_TEXT_BYTES:
            yield from _named_by_gltf_json(stream.read(size))


def _named_by_gltf_json(text: bytes) -> Iterator[str]:
    if b'"uri"' not in text:
        return
    try:
        document = json.loads(text.decode("utf-8-sig", errors="replace").rstrip("\0 "))
    except (ValueError, RecursionError):
        return
    if not isinstance(document, dict):
        return
    for key in ("buffers", "images"):
        entries = document.get(key)
        for entry in entries if isinstance(entries, list) else []:
            uri = entry.get("uri") if isinstance(entry, dict) else None
            if isinstance(uri, str) and not uri.startswith("data:"):
                yield uri


def _named_by_dae(path: Path) -> Iterator[str]:
    if path.stat().st_size > MAX_TEXT_BYTES:
        return
    text = path.read_text(errors="replace")
    at = text.find("<init_from")
    while at >= 0:
        start = text.find(">", at) + 1
        if start == 0:
            return
        name = text[start : text.find("<", start)]
        if not name.strip() and text.startswith("<ref>", start + len(name)):  # COLLADA 1.5
            start += len(name) + len("<ref>")
            name = text[start : text.find("<", start)]
        if name.strip():
            yield unescape(name.strip())
        at = text.find("<init_from", start)


def _named_by_ply(path: Path) -> Iterator[str]:
    with path.open("rb") as stream:
        head = stream.read(_MAX_HEADER_BYTES)
    name = ply_texture(head[: head.find(b"end_header")])
    if name:
        yield name


def pack_source(path: Path, beside: Iterable[Path] = ()) -> tuple[str, bytes]:
    """Return the name and bytes under which a twin keeps its input.

    A single file is kept byte for byte; a mesh with side files, or with others ``beside`` it in its folder, as an archive of
    all of them, uncompressed, undated.
    """
    others = sorted({*side_files(path), *(other.resolve() for other in beside)})
    suffix = path.suffix.lower()
    if not others:
        return f"source{suffix}", path.read_bytes()
    buffer = io.BytesIO()
    root = path.parent.resolve()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for file in [path.resolve(), *others]:
            archive.writestr(zipfile.ZipInfo(file.relative_to(root).as_posix(), _EPOCH), file.read_bytes())
    return "source.zip", buffer.getvalue()
