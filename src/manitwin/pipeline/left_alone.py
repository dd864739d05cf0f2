"""Reasons for which a file of a folder is no input, by its name, and by its first bytes where the name says nothing."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

from manitwin.formats.sniff import HEIC_NOT_READ, NOT_READ, image_format

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
