"""Score the colours read from a photo, on photos of templates whose colours are known.

    python benchmarks/photo_colors.py [--seeds N] [--every K] [--held-out] [--metals]

Each object is a template in a drawn colour word (``WORDS`` of ``colors.py``), rendered on one of the grounds of
``template_photos.py`` with light, shadow and reflections of its surroundings. A simulated camera chooses the exposure by the
picture's mean (``MEANS``, independent of the ground), has a small error of white balance, and spreads up to 3 % of the picture's
light over the whole picture (veiling glare). The names of the pixels inside the true mask are scored, unchanged and after
discounting the illuminant. The questions, the halves and the accepted names are those of ``colors.py``, except that black must be
called black.

``--metals`` takes objects of gold-coloured steel, brass, steel and copper, and of enamel in other colours, once each, and prints
which are called gold, as any object and as metal in a photo.
"""

from __future__ import annotations

import argparse
import zlib
from collections import Counter

import cv2
import numpy as np
from colors import COLORS, WORDS, is_called, questions, true_shares
from points import held_out
from template_photos import photograph

from manitwin.errors import UsageError
from manitwin.formats.meshes.textures import linear_to_srgb, srgb_to_linear
from manitwin.models.annotators.photo_light import estimate_photo_light
from manitwin.models.annotators.surface_color import lab_from_srgb, name_colors
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.look_phrases import LookRequest
from manitwin.models.generators.templates.looks import MATERIALS, color_of

MEANS = (0.15, 0.55)
"""Range of the mean linear luminance of a picture, from a meter's 18 % grey to the corrected exposure of pale grounds."""
WHITE_PAPER_AT_MOST = 1.1  # relative to the picture's white: photos with fully clipped paper are not kept
GLARE = (0.0, 0.03)
BALANCE = 0.05
NOISE = 1.5
SAMPLES = 3000
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def main() -> None:
    """Print the shares of correct names with and without discounting the light, and the errors with it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--every", type=int, default=1, help="every Kth category")
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--metals", action="store_true")
    arguments = parser.parse_args()
    if arguments.metals:
        print_metals(arguments.held_out)
        return
    half = [name for name in sorted(load_templates()) if held_out(name) == arguments.held_out]
    right: dict[str, Counter[str]] = {"as it is": Counter(), "light discounted": Counter()}
    total = 0
    for category in half[:: arguments.every]:
        for seed in range(arguments.seeds):
            case = zlib.crc32(f"photo {category} {seed} {arguments.held_out}".encode())
            drawn = draw(category, WORDS[case % len(WORDS)], case)
            if drawn is None:
                continue
            rgba, truths = drawn
            total += 1
            for way, said in names_of(rgba, np.random.default_rng(case)).items():
                outcome = questions(said, truths, is_said)
                right[way].update(outcome)
                if way == "light discounted" and len(outcome) < 3:
                    words = ", ".join(f"{name} {share:.0%}" for name, share in truths.items())
                    print(
                        f"{category:18s} {words} -> {', '.join(said)}   ({', '.join(sorted(ALL - outcome))})",
                        flush=True,
                    )
    for way, counts in right.items():
        print(
            f"{way}: "
            + ", ".join(f"{name} {counts[name]} of {total} ({counts[name] / total:.1%})" for name in sorted(ALL))
        )


METAL_THINGS = (
    "bell", "bottle", "bowl", "bracelet", "can", "cup", "flashlight", "fork", "frying pan", "key", "measuring cup", "mug",
    "padlock", "screwdriver", "spoon", "thermos", "vase",
)  # fmt: skip
ENAMELS = ("olive", "brown", "tan", "beige", "cream", "yellow", "orange", "khaki", "maroon", "green")


def print_metals(only_held_out: bool) -> None:
    """Print how many objects of each material and colour are called gold."""
    wishes = {
        "gold steel": LookRequest(rgb=color_of("gold"), material=MATERIALS["steel"]),
        "brass": LookRequest(material=MATERIALS["brass"]),
        "steel": LookRequest(material=MATERIALS["stainless steel"]),
        "copper": LookRequest(material=MATERIALS["copper"]),
        **{f"{word} enamel": LookRequest(rgb=color_of(word), material=MATERIALS["enamel"]) for word in ENAMELS},
    }
    for matter, wish in wishes.items():
        gold, total = Counter[bool](), 0
        for category in (each for each in METAL_THINGS if held_out(each) == only_held_out):
            case = zlib.crc32(f"metal {category} {matter}".encode())
            rng = np.random.default_rng([case, 1])
            photo = photograph(category, case, (float(rng.choice([10.0, 30.0, 55.0])),), wish=wish)[0]
            rgba = np.dstack([as_a_camera_has_it(photo.rgb, rng), np.where(photo.mask, 255, 0).astype(np.uint8)])
            lab = lab_from_srgb(own_pixels(rgba, rng)["light discounted"])
            for metal in (False, True):
                gold[metal] += name_colors(lab, False, metal_in_a_photo=metal)[0].name == "gold"
            total += 1
        print(f"{matter:14s} called gold: {gold[False]:2d} of {total}, as metal in a photo {gold[True]:2d}", flush=True)


ALL = {"first", "no false", "all"}


def is_said(said: str, truth: str) -> bool:
    """Tell whether ``said`` is an accepted name of ``truth``; dark grey is not accepted for black."""
    return said == "black" if truth == "black" else is_called(said, truth)


def draw(category: str, word: str, case: int) -> tuple[np.ndarray, dict[str, float]] | None:
    """Return a photo ``(H, W, 4) uint8`` with the true mask as alpha, and the shares of the object's colours.

    Returns None for bare metal, and where the template cannot be made in that colour.
    """
    rgb = tuple(int(COLORS[word][i : i + 2], 16) / 255 for i in (0, 2, 4))
    rng = np.random.default_rng([case, 1])
    elevation = float(rng.choice([10.0, 30.0, 55.0]))
    try:
        photo = photograph(category, case, (elevation,), wish=LookRequest(rgb=rgb))[0]  # type: ignore[arg-type]
    except UsageError:
        return None
    looks = [photo.made.looks[photo.made.mesh.names[part]] for part in photo.made.mesh.part]
    if np.average([look.metallic for look in looks], weights=photo.truth.area_faces) > 0.5:
        return None  # a mirror shows the colour of its surroundings
    alpha = np.where(photo.mask, 255, 0).astype(np.uint8)
    return np.dstack([as_a_camera_has_it(photo.rgb, rng), alpha]), true_shares(photo.made, photo.truth)


def as_a_camera_has_it(rgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return a rendered picture ``(H, W, 3) uint8`` with a camera's exposure, white balance, glare and noise."""
    light = srgb_to_linear(rgb / 255)
    mean = float((light @ LUMINANCE).mean())
    exposure = min(np.exp(rng.uniform(*np.log(MEANS))) / mean, WHITE_PAPER_AT_MOST / 0.86)
    light = light * exposure * np.exp(rng.normal(0, BALANCE, 3))
    glare = rng.uniform(*GLARE)
    light = (1 - glare) * light + glare * light.mean((0, 1))
    noisy = 255 * linear_to_srgb(np.clip(light, 0, 1)) + rng.normal(0, NOISE, rgb.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def names_of(rgba: np.ndarray, rng: np.random.Generator) -> dict[str, list[str]]:
    """Return the colour names of the object's pixels, by method of reading them."""
    pixels = own_pixels(rgba, rng)
    return {way: [color.name for color in name_colors(lab_from_srgb(each), False)] for way, each in pixels.items()}


def own_pixels(rgba: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Return samples of the object's pixels ``(N, 3)`` as sRGB in 0..1, by method of reading them."""
    inside = cv2.erode((rgba[..., 3] > 127).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    pixels = rgba[inside][:, :3] / 255
    some = pixels[rng.choice(len(pixels), min(SAMPLES, len(pixels)), replace=False)]
    light = estimate_photo_light(rgba)
    own = some if light is None else light.object_colors(some)
    return {"as it is": some, "light discounted": own}


if __name__ == "__main__":
    main()
