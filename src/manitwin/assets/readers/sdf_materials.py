"""Materials of SDF visuals that refer to scripts of OGRE, the renderer of Gazebo: colours, and textures of the asset."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]
from trimesh.visual.material import PBRMaterial

from manitwin.assets.asset_files import MOST_NAMED, AssetFiles
from manitwin.assets.readers.ogre_script import OgreMaterial, ogre_materials
from manitwin.errors import AssetError, InputError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import (
    color_of_lost_texture,
    decode_texture,
    make_part,
    normals_of,
    pbr_material,
    srgb_to_linear,
    uv_of,
)
from manitwin.formats.xml_file import text_of

_SUFFIX = ".material"
_MAX_BYTES, _MOST_FILES = 1 << 20, 64
_GREY, _DARK = (0.7,) * 3, (0.175,) * 3
_OF_GAZEBO = {
    "Grey": _GREY, "Gray": _GREY, "DarkGrey": _DARK, "DarkGray": _DARK, "White": (1, 1, 1), "FlatBlack": (0.1, 0.1, 0.1),
    "Black": (0, 0, 0), "Red": (1, 0, 0), "RedBright": (0.87, 0.26, 0.07), "Green": (0, 1, 0), "Blue": (0, 0, 1),
    "SkyBlue": (0.13, 0.44, 0.7), "Yellow": (1, 1, 0), "ZincYellow": (0.9725, 0.9529, 0.2078), "DarkYellow": (0.7, 0.7, 0),
    "Purple": (1, 0, 1), "Turquoise": (0, 1, 1), "Orange": (1, 0.5088, 0.0468), "Indigo": (0.33, 0, 0.5),
    "Gold": (0.8, 0.64869, 0.120759),
}  # fmt: skip
"""Plain colours of Gazebo's own script (media/materials/scripts/gazebo.material), sRGB."""

Candidates = Callable[[str], Iterator[Path]]
"""Yields candidate paths of a file or folder that a URI names."""


@dataclass(frozen=True)
class ScriptedMaterial:
    """A material, and the size of its texture in texture coordinates."""

    material: PBRMaterial
    scale: tuple[float, float]

    @property
    def has_texture(self) -> bool:
        """Whether it has a texture, for which a surface needs texture coordinates."""
        return self.material.baseColorTexture is not None


class ScriptedMaterials:
    """Lookup of scripted materials of visuals; missing ones, or ones outside the asset's root, are remarked."""

    def __init__(self, files: AssetFiles, candidates: Candidates):
        self._files, self._candidates = files, candidates
        self._found: dict[tuple[str, ...], ScriptedMaterial | None] = {}
        self._scripts: dict[Path, dict[str, OgreMaterial]] = {}
        self._absent: list[str] = []

    def find_material(self, element: etree._Element) -> ScriptedMaterial | None:
        """Return the material of a visual's material script; None if it names none or the script is missing."""
        script = element.find("material/script")
        if script is None:
            return None
        uris = [(each.text or "").strip() for each in script.findall("uri")]
        name = text_of(script, "name") or text_of(script, ".") or ""
        key = (name, *uris)
        if key not in self._found:
            self._found[key] = self._find_named(name, [uri for uri in uris if uri])
            if self._found[key] is None:
                self._absent.append(name or next(iter(uris), ""))
        return self._found[key]

    def remark_absent(self) -> None:
        """Remark on the requested materials that are missing."""
        names = [repr(name[:60]) for name in dict.fromkeys(self._absent) if name]
        if names:
            more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
            said = f"{', '.join(names[:MOST_NAMED])}{more}"
            self._files.remark(
                f"material scripts are not there, and colours and textures of theirs are missing: {said}"
            )

    def apply_material(self, part: trimesh.Trimesh, look: ScriptedMaterial, shape: str) -> trimesh.Trimesh:
        """Return a part with a scripted material in place of its own, as in Gazebo.

        If the part has no texture coordinates, a texture is left out with a remark that names the ``shape``.
        """
        material, uv = look.material, uv_of(part)
        if uv is None and look.has_texture:
            self._files.remark(f"{shape} has no texture coordinates: the texture of {material.name!r} is not shown")
            factor = np.asarray(material.baseColorFactor, float) / 255
            material = pbr_material(material.name, base_color=color_of_lost_texture(factor.tolist()))
        return make_part(
            part.vertices,
            part.faces,
            material=material,
            name=part.metadata["name"],
            uv=None if uv is None else 0.5 + (uv - 0.5) / look.scale,
            normals=normals_of(part),
        )

    def _find_named(self, name: str, uris: list[str]) -> ScriptedMaterial | None:
        folders: list[Path] = []
        said: OgreMaterial | None = None
        for uri in uris:
            place = next((each for each in self._candidates(uri) if self._is_below(each)), None)
            if place is None:
                continue
            folders.append(place if place.is_dir() else place.parent)
            for file in _scripts_at(place):
                said = said or self._script(file).get(name)
        if said is None:
            owner, _, own = name.partition("/")
            color = _OF_GAZEBO.get(own) if owner == "Gazebo" else None
            said = None if color is None else OgreMaterial(diffuse=(*color, 1.0))
        return None if said is None else ScriptedMaterial(self._material(name, said, folders), said.scale)

    def _is_below(self, place: Path) -> bool:
        try:
            return place.exists() and place.resolve().is_relative_to(self._files.root.resolve())
        except (OSError, ValueError, RuntimeError):  # a name that no file system can hold, or a loop of links
            return False

    def _script(self, file: Path) -> dict[str, OgreMaterial]:
        if file not in self._scripts:
            found = self._files.find(file.name, [file])
            text = b"" if found is None else read_bytes(found, _MAX_BYTES, AssetError, inside=self._files.root)
            self._scripts[file] = ogre_materials(text.decode("utf-8", errors="replace"))
        return self._scripts[file]

    def _material(self, name: str, said: OgreMaterial, folders: list[Path]) -> PBRMaterial:
        texture = None
        if said.texture is not None:
            beside = [folder.parent / "textures" for folder in folders]
            path = self._files.find(said.texture, [folder / said.texture for folder in (*folders, *beside)])
            if path is not None:
                notes = MeshSource(path, self._files.limits, root=self._files.root)
                try:
                    texture = decode_texture(notes.data(), path.name, notes)
                except InputError as error:
                    raise AssetError(error.detail) from error
                for sentence in notes.findings:
                    self._files.remark(sentence)
        rgba = np.array(said.diffuse or (1.0, 1.0, 1.0, 1.0))
        color = (*srgb_to_linear(rgba[:3]).tolist(), float(rgba[3]))
        if said.texture is not None and texture is None:
            color = color_of_lost_texture(color)
        mode = "BLEND" if said.blended else "MASK" if said.cut_at is not None and texture is not None else None
        return pbr_material(
            name,
            base_color=color,
            base_color_texture=texture,
            alpha_mode=mode,
            alpha_cutoff=said.cut_at if mode == "MASK" else None,
        )


def _scripts_at(place: Path) -> list[Path]:
    """Return the scripts that a path denotes: the file itself, or all scripts in a folder, sorted by name."""
    if place.is_file():
        return [place] if place.suffix == _SUFFIX else []
    return sorted(each for each in place.glob(f"*{_SUFFIX}") if each.is_file())[:_MOST_FILES]
