"""TEX rules: texture sizes that load everywhere."""

from __future__ import annotations

from collections.abc import Iterator

from PIL import Image

from manitwin.assets.asset import Asset
from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset

LARGEST_PIXELS = 4096
_MAPS = (
    "image",
    "baseColorTexture",
    "metallicRoughnessTexture",
    "normalTexture",
    "emissiveTexture",
    "occlusionTexture",
)


def texture_sizes(asset: Asset) -> list[tuple[int, int]]:
    """Return width and height of every texture image of the visual parts, without duplicates."""
    images: dict[int, tuple[int, int]] = {}
    for part in asset.visual:
        material = getattr(part.visual, "material", None)
        for name in _MAPS:
            image = getattr(material, name, None)
            if isinstance(image, Image.Image):
                images[id(image)] = image.size
    return list(images.values())


def too_large(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report textures that simulators scale down or refuse."""
    large = sorted({size for size in texture_sizes(measured.asset) if max(size) > LARGEST_PIXELS}, reverse=True)
    if large:
        sizes = ", ".join(f"{width} x {height}" for width, height in large[:4])
        yield Complaint(
            f"textures of {sizes} pixels, more than {LARGEST_PIXELS} on a side", values={"pixels": large[:4]}
        )


def not_power_of_two(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report textures whose sides are not powers of two."""
    odd = sorted({size for size in texture_sizes(measured.asset) if any(side & (side - 1) for side in size)})
    if odd:
        sizes = ", ".join(f"{width} x {height}" for width, height in odd[:4])
        yield Complaint(f"textures of {sizes} pixels: sides are no powers of two", values={"pixels": odd[:4]})


RULES = (
    Rule(
        "TEX001",
        "texture-too-large",
        "warning",
        why="A texture of 8192 pixels takes 350 MB of a GPU with its mipmaps; scenes of many objects then fail, or load for"
        " minutes (robocasa #213 on the size of downloads). Few simulated cameras see more than 2048.",
        remedy="Scale textures to 2048 or 4096 pixels.",
        check=too_large,
    ),
    Rule(
        "TEX002",
        "texture-not-power-of-two",
        "note",
        why="Older renderers scale such textures up or leave their mipmaps out.",
        remedy="Scale the sides to powers of two where you need such a renderer.",
        check=not_power_of_two,
    ),
)
