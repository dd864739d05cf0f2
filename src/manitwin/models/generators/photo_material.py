"""Material of meshes that are textured from photos."""

from __future__ import annotations

import numpy as np
from PIL import Image
from trimesh.visual.material import PBRMaterial

ROUGHNESS = 0.6
"""Between glossy and matt: a photo does not tell the roughness, and its highlights are already in the texture."""


def photo_material(texture: np.ndarray) -> PBRMaterial:
    """Return the non-metallic glTF material whose base colour is ``texture (H, W, 3) uint8`` sRGB."""
    return PBRMaterial(
        name="photo",
        baseColorFactor=[255, 255, 255, 255],
        baseColorTexture=Image.fromarray(texture),
        metallicFactor=0.0,
        roughnessFactor=ROUGHNESS,
    )
