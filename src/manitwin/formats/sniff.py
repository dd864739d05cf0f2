"""Detection of file formats by content rather than by name."""

from __future__ import annotations

import os
import re
import struct
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import BinaryIO, Literal

from manitwin.errors import InputError
from manitwin.formats.bounded_file import open_regular
from manitwin.formats.json_file import MAX_JSON_BYTES, parse_json
from manitwin.formats.printable import printable_line

IMAGE_FORMATS = ("png", "jpeg", "gif", "webp", "tiff", "bmp", "avif", "pnm")
MESH_FORMATS = ("glb", "gltf", "obj", "ply", "stl", "dae", "usdz", "3mf", "step", "fbx", "msh", "off")

_HEAD_BYTES = 65536
MSH_HEADER_BYTES = 16
OFF_KEYWORD = re.compile(r"(ST)?(C)?(N)?(4)?(n)?OFF(?=[\d\s])")
"""Start of OFF; its vertices may have texture coordinates, colours, normals, a fourth coordinate, any number of coordinates."""
_PNM = re.compile(rb"P[1-6]\s+[0-9#]|P[1-6]#")
"""Netpbm's bitmaps, greymaps and pixmaps, as text and binary (ppm(5)); the magic is followed by the width or a comment."""
_STEP_BEGINS = "ISO-10303-21"
FBX_BINARY, FBX_TEXT = b"Kaydara FBX Binary  ", re.compile(r"; *FBX (\d{1,2})\.(\d)\.\d+ project file")
"""Start of an FBX file, in binary form, and in text form with its version."""
_NAME_CHARACTERS = 200
_OBJ_KEYWORDS = frozenset(
    {"v", "vt", "vn", "vp", "f", "l", "p", "o", "g", "s", "mg", "usemtl", "mtllib", "usemap", "maplib", "cstype", "deg"}
)
_LONGEST_NUMBER = 64
HEIC_NOT_READ = "HEIC is not read; convert it to PNG or JPEG"
"""Its only free decoder comes in wheels that bundle an encoder under the GPL."""
ASSET_DESCRIPTION = "an asset description; manitwin import reads it with its meshes"
"""For URDF, SDF and USD, which name meshes."""
_CAMERA_RAW = "camera raw is not read; develop it to PNG or JPEG"
_EXPORT = "this mesh format is not read; export it as glTF 2.0 or OBJ"
_VIDEO = "a video; give a photo"
_IMAGE = "this image format is not read as a photo; convert it to PNG or JPEG"
_ARCHIVE = "an archive; unpack it"
_NO_FILE_ITSELF = (
    (re.compile(rb"version https://git-lfs\."), "holds a pointer of Git LFS, not the file; fetch it with git lfs pull"),
    (
        re.compile(rb"(\xef\xbb\xbf)?\s*<(!doctype )?html[\s>]", re.IGNORECASE),
        "holds a web page (HTML), not the file; download the file itself",
    ),
    (
        re.compile(rb"(\xef\xbb\xbf)?\s*(<(\?xml|!--|!doctype).{0,4096}?)?<svg[\s>]", re.IGNORECASE | re.DOTALL),
        f"holds an SVG drawing: {_IMAGE}",
    ),
)
"""Content often found under the name of an image or mesh, by its start, with a remedy."""
NOT_READ = {
    **dict.fromkeys((".heic", ".heif"), HEIC_NOT_READ),
    **dict.fromkeys((".urdf", ".sdf", ".xacro", ".usd", ".usda", ".usdc"), ASSET_DESCRIPTION),
    **dict.fromkeys((".dng", ".nef", ".cr2", ".cr3", ".arw", ".orf", ".rw2", ".raf", ".pef"), _CAMERA_RAW),
    **dict.fromkeys((".blend", ".3ds", ".max", ".iges", ".igs", ".x3d"), _EXPORT),
    **dict.fromkeys((".abc", ".wrl", ".ma", ".mb", ".c4d", ".skp", ".drc", ".vrm", ".fcstd", ".sldprt"), _EXPORT),
    **dict.fromkeys((".mp4", ".mov", ".avi", ".mkv", ".webm", ".m4v"), _VIDEO),
    **dict.fromkeys((".tga", ".dds", ".exr", ".hdr", ".psd", ".svg", ".jxl", ".jp2", ".ktx", ".ktx2", ".ico"), _IMAGE),
    **dict.fromkeys((".pam", ".pfm", ".pcx", ".xcf", ".psb", ".jxr", ".icns", ".eps", ".ai"), _IMAGE),
    ".pdf": "a document; save its picture as PNG or JPEG",
    **dict.fromkeys((".zip", ".tar", ".gz", ".tgz", ".7z", ".rar", ".bz2", ".xz", ".zst"), _ARCHIVE),
}  # fmt: skip


@dataclass(frozen=True)
class Sniffed:
    """A file's kind, and its format by content (of IMAGE_FORMATS or MESH_FORMATS, or ``heif``)."""

    kind: Literal["image", "mesh"]
    format: str


def sniff(path: Path) -> Sniffed:
    """Detect the format of a file from its bytes; its name only serves to describe a file that is neither image nor mesh.

    Raises InputError: ``unreadable`` (no such file, or no permission), ``empty`` (zero bytes), ``wrong_type`` (neither an image
    nor a mesh).
    """
    called = printable_line(path.name, max_characters=_NAME_CHARACTERS)
    with open_regular(path, partial(InputError, "unreadable")) as stream:
        size = os.fstat(stream.fileno()).st_size
        head = stream.read(_HEAD_BYTES)
        not_read = NOT_READ.get(path.suffix.lower())
        if size == 0 and not_read is None:
            raise InputError("empty", f"{called}: the file has zero bytes; export or download it again")
        image = image_format(head)
        if image is not None:
            return Sniffed("image", image)
        mesh = _mesh_format(head, size, path.suffix.lower(), stream)
    if mesh is not None:
        return Sniffed("mesh", mesh)
    if not_read is not None:
        raise InputError("wrong_type", f"{called}: {not_read}")
    if told := placeholder_description(head):
        raise InputError("wrong_type", f"{called}: {told}")
    raise InputError(
        "wrong_type",
        f"{called}: holds {_describe(head)}, neither an image ({', '.join(IMAGE_FORMATS)})"
        f" nor a mesh ({', '.join(MESH_FORMATS)})",
    )


def placeholder_description(head: bytes) -> str | None:
    """Return what a placeholder (a Git LFS pointer, a web page) with these first bytes is, and a remedy; else None."""
    return next((told for begin, told in _NO_FILE_ITSELF if begin.match(head)), None)


def image_format(head: bytes) -> str | None:
    """Return the image format of a file by its first 64 bytes, one of IMAGE_FORMATS or ``heif``, or None."""
    if head.startswith(b"\x89PNG\r\n\x1a\n"):
        return "png"
    if head.startswith(b"\xff\xd8\xff"):
        return "jpeg"
    if head[:6] in (b"GIF87a", b"GIF89a"):
        return "gif"
    if _PNM.match(head):
        return "pnm"
    if head[:4] == b"RIFF" and head[8:12] == b"WEBP":
        return "webp"
    if head[:4] in (b"II*\0", b"MM\0*"):
        return "tiff"
    # BITMAPFILEHEADER: the two reserved words at 6 are zero
    if head[:2] == b"BM" and head[6:10] == b"\0\0\0\0":
        return "bmp"
    if head[4:8] == b"ftyp":
        # ISO/IEC 23008-12: mif1 is any image of the family, and the compatible brands specify it
        brands = {head[8:12], *(head[at : at + 4] for at in range(16, min(int.from_bytes(head[:4], "big"), 64), 4))}
        if brands & {b"avif", b"avis"}:
            return "avif"
        if brands & {b"heic", b"heix", b"hevc", b"heim", b"heis", b"mif1", b"msf1"}:
            return "heif"
    return None


def _mesh_format(head: bytes, size: int, suffix: str, stream: BinaryIO) -> str | None:
    if head.startswith(b"glTF"):
        return "glb"
    if head.startswith((b"ply\n", b"ply\r\n")):
        return "ply"
    if head.startswith(b"PK\x03\x04") and _is_usdz(head):
        return "usdz"
    if head.startswith(b"PK\x03\x04") and (suffix == ".3mf" or _holds_model(size, stream)):
        return "3mf"
    if head.startswith(FBX_BINARY):
        return "fbx"
    # a binary STL has no magic: 80 arbitrary bytes, which may even begin with "solid", a count, 50 bytes for each triangle
    if size >= 84 and size == 84 + 50 * int.from_bytes(head[80:84], "little"):
        return "stl"
    if msh_bytes(head) == size:  # nor has this format: its counts determine the size of the file
        return "msh"
    text = _text(head)
    if text is None:
        # a truncated binary STL still has zero padding or "STL" in its 80 arbitrary bytes
        return "stl" if size >= 84 and suffix == ".stl" else None
    start = text.lstrip("\ufeff \t\r\n")
    if re.match(r"solid\b", start, re.IGNORECASE) and re.search(r"\bfacet\b|\bendsolid\b", start, re.IGNORECASE):
        return "stl"
    if start.startswith("<") and re.search(r"<(\w+:)?COLLADA[\s>]", start):
        return "dae"
    if FBX_TEXT.match(start):
        return "fbx"
    if start.startswith(_STEP_BEGINS):
        return "step"
    if OFF_KEYWORD.match(start):
        return "off"
    if start.startswith("{") and _is_gltf(start, size, stream):
        return "gltf"
    return "obj" if _is_obj(start, complete=size <= _HEAD_BYTES) else None


def msh_bytes(head: bytes) -> int | None:
    """Return the size of a file of MuJoCo's binary mesh format with this head, None if the head is invalid.

    The head is four 32-bit integers: the numbers of positions, normals, texture coordinates and triangles. The second and third
    equal the first or are zero, and the last may be zero. Source: MuJoCo's XML reference, ``mesh``, "MSH file format".
    """
    if len(head) < MSH_HEADER_BYTES:
        return None
    vertices, normals, coordinates, faces = struct.unpack_from("<4i", head)
    if vertices < 3 or faces < 0 or normals not in (0, vertices) or coordinates not in (0, vertices):
        return None
    return MSH_HEADER_BYTES + 4 * (3 * vertices + 3 * normals + 2 * coordinates + 3 * faces)


def _is_usdz(head: bytes) -> bool:
    # a package's first member is its default layer (USDZ specification); its name is in the local header (APPNOTE 4.3.7)
    length = int.from_bytes(head[26:28], "little")
    name = head[30 : 30 + length].decode("latin-1").lower()
    return name.endswith((".usd", ".usda", ".usdc"))


def _holds_model(size: int, stream: BinaryIO) -> bool:
    # an archive ends in its central directory (APPNOTE 4.3.6); Open Packaging Conventions require the first of these names
    stream.seek(max(0, size - _HEAD_BYTES))
    tail = stream.read(_HEAD_BYTES)
    return b"[Content_Types].xml" in tail and b".model" in tail


def _is_gltf(start: str, size: int, stream: BinaryIO) -> bool:
    # "asset" may come last in a long file; the whole file is parsed only if the head is not conclusive
    if _names_gltf(start):
        return True
    if size > MAX_JSON_BYTES:
        stream.seek(size - _HEAD_BYTES)
        return _names_gltf(start + stream.read(_HEAD_BYTES).decode("latin-1"))
    stream.seek(0)
    try:
        tree = parse_json(stream.read(MAX_JSON_BYTES), "", ValueError)
    except ValueError:
        # truncated: only glTF has this key
        return re.search(r'"bufferViews?"\s*:', start) is not None
    return isinstance(tree, dict) and isinstance(tree.get("asset"), dict) and "version" in tree["asset"]


def _names_gltf(text: str) -> bool:
    tables = r'"(accessors|meshes|nodes|buffers|scenes)"\s*:'
    return re.search(r'"asset"\s*:', text) is not None and re.search(tables, text) is not None


def _is_obj(text: str, complete: bool) -> bool:
    lines = text.splitlines() if complete else text.splitlines()[:-1]
    words = [line.split() for line in lines if line.strip() and not line.lstrip().startswith("#")]
    known = [w for w in words if w[0] in _OBJ_KEYWORDS]
    if len(known) < 0.9 * len(words):
        return False
    return any(w[0] == "v" and len(w) >= 4 and all(_is_number(n) for n in w[1:4]) for w in known)


def _is_number(word: str) -> bool:
    if len(word) > _LONGEST_NUMBER or "_" in word:
        return False
    if word.lstrip("+-").lower().startswith(("nan", "inf")):  # some programs write nan(ind)
        return True
    try:
        float(word)
    except ValueError:
        return False
    return word.isascii()


def _text(head: bytes) -> str | None:
    for encoding in ("utf-16", "utf-8") if head[:2] in (b"\xff\xfe", b"\xfe\xff") else ("utf-8",):
        try:
            return head.decode(encoding)
        except UnicodeDecodeError as error:
            # a character cut at the end of the head does not make the file binary
            if error.start >= len(head) - 4 and len(head) == _HEAD_BYTES:
                return head[: error.start].decode(encoding)
    printable = sum(byte >= 32 or byte in (9, 10, 13) for byte in head)
    return head.decode("latin-1") if printable > 0.99 * len(head) else None


def _describe(head: bytes) -> str:
    text = _text(head)
    if text is not None and "\0" not in text:
        return "plain text"
    if head.startswith(b"PK"):
        return "a ZIP archive"
    if head.startswith(b"%PDF"):
        return "a PDF document"
    if head.startswith((b"PXR-USDC", b"#usda")):
        return "a bare USD layer (pack it as .usdz)"
    return "unknown binary data"
