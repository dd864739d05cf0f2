"""MTL material libraries of Wavefront OBJ files."""

from __future__ import annotations

from PIL import Image
from trimesh.visual.material import PBRMaterial

from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import decode_texture, pbr_material
from manitwin.formats.source_files import map_file_name


def read_mtl(text: str, source: MeshSource) -> dict[str, PBRMaterial]:
    """Return the materials of an MTL file by name.

    Kd (unless there is a map_Kd), d, Ns, Pr, Pm, map_Kd and norm are used. ``Tr`` is not: MeshLab
    writes 1 there for opaque.
    """
    materials: dict[str, PBRMaterial] = {}
    entries: list[tuple[str, dict[str, str]]] = []
    for line in text.splitlines():
        keyword, _, rest = line.strip().replace("\t", " ").partition(" ")
        if keyword.lower() == "newmtl":
            entries.append((rest.strip(), {}))
        elif entries and rest and not keyword.startswith("#"):
            entries[-1][1].setdefault(keyword.lower(), rest.strip())
    for name, values in entries:
        materials.setdefault(name, _material(name, values, source))
    return materials


def _material(name: str, values: dict[str, str], source: MeshSource) -> PBRMaterial:
    texture = _map(values.get("map_kd"), source)
    color = _numbers(values.get("kd")) or [0.8, 0.8, 0.8]
    # exporters leave Kd black or grey beside a map and viewers ignore it there
    base = [1.0, 1.0, 1.0] if texture is not None else (color * 3)[:3]
    opacity = (_numbers(values.get("d")) or [1.0])[0]
    opacity = opacity if 0 < opacity < 1 else 1.0  # d 0 is an invisible object: a known mix-up with Tr
    shininess = max((_numbers(values.get("ns")) or [0.0])[0], 0.0)
    roughness = (_numbers(values.get("pr")) or [(2 / (shininess + 2)) ** 0.25])[0]
    return pbr_material(
        name,
        base_color=(*base, opacity),
        metallic=(_numbers(values.get("pm")) or [0.0])[0],
        roughness=roughness,
        base_color_texture=texture,
        normal_texture=_map(values.get("norm"), source),
        alpha_mode="BLEND" if opacity < 1 else None,
    )


def _map(statement: str | None, source: MeshSource) -> Image.Image | None:
    if statement is None:
        return None
    name = map_file_name(statement)
    data = source.sibling(name, "texture")
    return None if data is None else decode_texture(data, name, source)


def _numbers(text: str | None) -> list[float]:
    numbers: list[float] = []
    for word in (text or "").split():
        try:
            numbers.append(float(word))
        except ValueError:
            break
    return numbers
