"""The material of meshes that are coloured by photos."""

from __future__ import annotations

import numpy as np
from PIL import Image
from trimesh.visual.material import PBRMaterial

ROUGHNESS = 0.6
"""Between a glossy and a matt surface: a photo does not tell, and its own highlights are in the texture already."""


def photo_material(texture: np.ndarray) -> PBRMaterial:
    """Return the glTF material whose base colour is ``texture (H, W, 3) uint8`` sRGB; not metallic."""
    return PBRMaterial(
        name="photo",
        baseColorFactor=[255, 255, 255, 255],
        baseColorTexture=Image.fromarray(texture),
        metallicFactor=0.0,
        roughnessFactor=ROUGHNESS,
    )
