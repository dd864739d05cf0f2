"""Textures and materials of meshes in the metallic-roughness model of glTF 2.0."""

from __future__ import annotations

import hashlib
import io
import warnings
from collections.abc import Sequence

import numpy as np
import trimesh
from PIL import Image, UnidentifiedImageError
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from manitwin.errors import InputError
from manitwin.formats.meshes.ktx2 import KTX2, register_ktx2
from manitwin.formats.meshes.source import Buffer, MeshSource
from manitwin.formats.sniff import placeholder_description

# formats used by real asset packs; untrusted files never reach Pillow's other decoders
TEXTURE_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TGA", "TIFF", "GIF", KTX2)
register_ktx2()
DEFAULT_COLOR = (0.8, 0.8, 0.8)
"""The colour of parts without one: the default Kd of OBJ material libraries and of Blender."""
_MAX_UV = 1e6  # textures may repeat, but not more often than this
_MAX_NORMAL = 1e6
_MAX_ATLAS = 4096
_HEAD_BYTES = 4096
_CELL_SIZES = (8, 4)
"""8 pixels are a JPEG block, so that colours do not leak between cells; 4 are the fewest for two triangles."""


def decode_texture(data: Buffer, name: str, source: MeshSource) -> Image.Image | None:
    """Decode a texture to mode RGB or RGBA, or return None with a finding if it is unreadable or too large.

    Equal bytes are decoded once. Raises InputError ``too_large`` if all textures together have too many pixels.
    """
    digest = hashlib.sha256(data).hexdigest()
    if digest not in source.textures:
        source.textures[digest] = _decoded(data, name if len(name) <= 80 else f"{name[:77]}...", source)
    return source.textures[digest]


def _decoded(data: Buffer, name: str, source: MeshSource) -> Image.Image | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            image: Image.Image = Image.open(io.BytesIO(data), formats=TEXTURE_FORMATS)
            if image.width * image.height > source.limits.max_texture_pixels:
                source.add_finding(
                    f"texture {name!r} of {image.width} x {image.height} pixels is over the limit and was left out"
                )
                return None
            source.count_texture(image.width * image.height)
            if not source.limits.decode_textures:
                return image
            image.load()
    except (InputError, MemoryError):
        raise
    except UnidentifiedImageError:  # its message contains a memory address
        told = placeholder_description(bytes(memoryview(data)[:_HEAD_BYTES]))
        source.add_finding(f"texture {name!r} {told or 'is no picture that is read, and was left out'}")
        return None
    except Exception as error:  # a decoder may raise anything on damaged bytes
        source.add_finding(
            f"texture {name!r} cannot be decoded and was left out ({' '.join(str(error).split())[:100]})"
        )
        return None
    if image.mode in ("I", "I;16", "I;16B", "I;16L"):
        # 16-bit grey: Pillow's own conversion clips
        image = Image.fromarray((np.asarray(image).astype(np.uint32) >> 8).astype(np.uint8))
    has_alpha = image.mode in ("RGBA", "LA", "PA") or "transparency" in image.info
    mode = "RGBA" if has_alpha else "RGB"
    return image if image.mode == mode else image.convert(mode)  # avoids a copy: a scan's texture has 17 MB


def color_of_lost_texture(color: Sequence[float]) -> tuple[float, ...]:
    """Return the base colour of a material with an unreadable texture: the default grey, or its tint if it has one.

    A factor of white, grey or black beside a texture says nothing about the texture's colours.
    """
    red, green, blue = color[:3]
    return (*DEFAULT_COLOR, *color[3:]) if red == green == blue else tuple(color)


def pbr_material(
    name: str | None = None,
    *,
    base_color: Sequence[float] = (1.0, 1.0, 1.0, 1.0),
    metallic: float = 0.0,
    roughness: float = 0.8,
    base_color_texture: Image.Image | None = None,
    metallic_roughness_texture: Image.Image | None = None,
    normal_texture: Image.Image | None = None,
    alpha_mode: str | None = None,
    alpha_cutoff: float | None = None,
    double_sided: bool = False,
) -> PBRMaterial:
    """Build a material with explicit factors; ``base_color`` is linear RGB or RGBA in 0..1 (stored in steps of 1/255)."""
    rgba = np.ones(4)
    rgba[: len(base_color)] = base_color
    if alpha_mode is None:
        rgba[3] = 1.0  # glTF 2.0, section 3.9.4: opaque materials ignore alpha, but not every engine does
    return PBRMaterial(
        name=name,
        baseColorFactor=np.round(np.clip(np.nan_to_num(rgba, nan=1.0), 0, 1) * 255).astype(np.uint8),
        metallicFactor=float(np.clip(np.nan_to_num(metallic), 0, 1)),
        roughnessFactor=float(np.clip(np.nan_to_num(roughness, nan=0.8), 0, 1)),
        baseColorTexture=base_color_texture,
        metallicRoughnessTexture=metallic_roughness_texture,
        normalTexture=normal_texture,
        alphaMode=alpha_mode,
        alphaCutoff=alpha_cutoff if alpha_cutoff is None or np.isfinite(alpha_cutoff) else 0.5,
        doubleSided=double_sided,
    )


def make_part(
    vertices: np.ndarray,
    faces: np.ndarray,
    *,
    material: PBRMaterial,
    name: str,
    uv: np.ndarray | None = None,
    normals: np.ndarray | None = None,
) -> trimesh.Trimesh:
    """Build one visual part.

    ``vertices`` (V, 3), ``faces`` (F, 3), ``uv`` (V, 2) with the origin at the lower left as in trimesh, ``normals`` (V, 3) or
    None. Normals are dropped if any is far from unit length; texture coordinates that are NaN or very large become 0.
    """
    with np.errstate(invalid="ignore"):  # signalling NaNs, which the caller's checks of vertices find
        vertices = np.asarray(vertices, dtype=np.float64)
    part = trimesh.Trimesh(vertices=vertices, faces=np.asarray(faces, dtype=np.int64), process=False)
    if normals is not None and len(normals) == len(vertices) and (np.abs(normals) <= _MAX_NORMAL).all():
        lengths = np.linalg.norm(normals, axis=1)
        if len(lengths) and lengths.min() > 0.5:
            unit = np.asarray(normals, dtype=np.float64) / lengths[:, None]
            part.vertex_normals = unit  # type: ignore[method-assign]
    part.visual = TextureVisuals(uv=None if uv is None else _usable_uv(uv), material=material)
    part.metadata["name"] = name
    return part


def _usable_uv(uv: np.ndarray) -> np.ndarray:
    uv = np.asarray(uv, dtype=np.float64)
    usable = np.abs(uv) <= _MAX_UV  # false for NaN
    return uv if usable.all() else np.where(usable, uv, 0.0)


def without_unused_vertices(part: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the part with only the vertices that its faces use, in their order."""
    used, inverse = np.unique(part.faces, return_inverse=True)
    normals, uv = normals_of(part), uv_of(part)
    return make_part(
        part.vertices[used],
        inverse.reshape(-1, 3),
        material=material_of(part),
        name=part.metadata["name"],
        uv=None if uv is None else uv[used],
        normals=None if normals is None else normals[used],
    )


def material_of(part: trimesh.Trimesh) -> PBRMaterial:
    """Return a part's material; raises TypeError for a mesh that is not a visual part."""
    material = getattr(part.visual, "material", None)
    if not isinstance(material, PBRMaterial):
        raise TypeError(f"a visual part has a PBRMaterial, not {type(material).__name__}")
    return material


def uv_of(part: trimesh.Trimesh) -> np.ndarray | None:
    """Return a part's texture coordinates ``(V, 2)``, origin at the lower left, or None."""
    uv = getattr(part.visual, "uv", None)
    return None if uv is None else np.asarray(uv)


def normals_of(part: trimesh.Trimesh) -> np.ndarray | None:
    """Return the vertex normals ``(V, 3)`` that a part was created with, or None if trimesh would compute them."""
    return np.asarray(part.vertex_normals) if "vertex_normals" in part._cache else None


def bake_transform(part: trimesh.Trimesh, matrix: np.ndarray) -> trimesh.Trimesh:
    """Return the part under an affine transform ``(4, 4)``; a reflection reverses the winding."""
    if np.allclose(matrix, np.eye(4), rtol=0, atol=0):
        return part
    linear = matrix[:3, :3]
    normals = normals_of(part)
    with np.errstate(all="ignore"):  # overflows are found when vertices are checked
        determinant = float(np.linalg.det(linear))
        if normals is not None and determinant != 0:
            # normals transform by the inverse transpose, whose sign does not change under reflection, so they are not flipped
            normals = normals @ np.linalg.inv(linear)
            normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        vertices = part.vertices @ linear.T + matrix[:3, 3]
    return make_part(
        vertices,
        part.faces[:, ::-1] if determinant < 0 else part.faces,
        material=material_of(part),
        name=part.metadata["name"],
        uv=uv_of(part),
        normals=normals,
    )


def srgb_to_linear(values: np.ndarray) -> np.ndarray:
    """Convert sRGB values in 0..1 to linear ones (IEC 61966-2-1)."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(values: np.ndarray) -> np.ndarray:
    """Convert linear values in 0..1 to sRGB ones (IEC 61966-2-1)."""
    return np.where(values <= 0.0031308, values * 12.92, 1.055 * np.maximum(values, 0.0031308) ** (1 / 2.4) - 0.055)


def color_by_corner(
    part: trimesh.Trimesh, corner_colors: np.ndarray, source: MeshSource | None = None
) -> trimesh.Trimesh:
    """Return the part with corner colours ``(F, 3, 3) uint8`` sRGB painted into its own base colour texture.

    Two triangles share a square cell of the atlas, separated by its diagonal; the corners lie on texel centres, so that
    bilinear sampling yields the linear blend of the three colours. Faces no longer share vertices. If there are more faces than
    an atlas of 4096 pixels holds, the part gets the mean colour, with a finding.
    """
    count = len(part.faces)
    across = max(int(np.ceil(np.sqrt((count + 1) // 2))), 1)
    cell = next((size for size in _CELL_SIZES if across * size <= _MAX_ATLAS), None)
    material = material_of(part).copy()
    if cell is None or count == 0:
        if count and source is not None:
            source.add_finding(
                f"the colours of {count} vertices and faces were replaced by their mean: too many for a texture"
            )
        mean = corner_colors.reshape(-1, 3).mean(0) if count else np.full(3, 255)
        factor = np.append(srgb_to_linear(mean / 255) * 255, 255)
        material.baseColorFactor = np.round(factor * (material.baseColorFactor / 255)).astype(np.uint8)
        return make_part(part.vertices, part.faces, material=material, name=part.metadata["name"])
    material.baseColorTexture = Image.fromarray(_paint(corner_colors, across, cell))
    corners, normals = part.faces.reshape(-1), normals_of(part)
    return make_part(
        part.vertices[corners],
        np.arange(3 * count).reshape(-1, 3),
        material=material,
        name=part.metadata["name"],
        uv=_corner_uv(count, across, cell),
        normals=None if normals is None else normals[corners],
    )


def _paint(corner_colors: np.ndarray, across: int, cell: int) -> np.ndarray:
    """Return the atlas ``(across * cell, across * cell, 3) uint8``, row 0 at the top."""
    colors = np.zeros((2 * across * across, 3, 3))
    colors[: len(corner_colors)] = corner_colors
    column, row = np.meshgrid(np.arange(cell), np.arange(cell))
    span = cell - 3
    upper = _blend(column / span, row / span)
    lower = _blend((cell - 1 - column) / span, (cell - 1 - row) / span)
    diagonal = column + row
    share = np.select([diagonal < cell - 1, diagonal == cell - 1], [1.0, 0.5], 0.0)[..., None]
    tiles = np.einsum("yxk,nkc->nyxc", upper * share, colors[0::2]) + np.einsum(
        "yxk,nkc->nyxc", lower * (1 - share), colors[1::2]
    )
    pixels = (
        tiles.reshape(across, across, cell, cell, 3).transpose(0, 2, 1, 3, 4).reshape(across * cell, across * cell, 3)
    )
    return np.clip(np.round(pixels), 0, 255).astype(np.uint8)


def _blend(second: np.ndarray, third: np.ndarray) -> np.ndarray:
    """Return barycentric weights ``(..., 3)``, extrapolated linearly beyond the edges."""
    return np.stack([1 - second - third, second, third], axis=-1)


def _corner_uv(count: int, across: int, cell: int) -> np.ndarray:
    """Return the texture coordinates ``(3 * count, 2)`` of all corners, origin at the lower left."""
    far = cell - 1
    places = np.array([[(0, 0), (cell - 3, 0), (0, cell - 3)], [(far, far), (2, far), (far, 2)]], dtype=float)
    face = np.arange(count)
    origin = np.stack([face // 2 % across, face // 2 // across], axis=1) * cell
    pixels = (places[face % 2] + origin[:, None] + 0.5) / (across * cell)
    return np.stack([pixels[..., 0], 1 - pixels[..., 1]], axis=-1).reshape(-1, 2)
