"""Score the colour names given to surfaces, on objects of known colours that carry baked-in lighting of a capture.

    python benchmarks/colors.py [--seeds N] [--every K] [--held-out] [--flat]

Scans and photo textures hold what a camera recorded, not the albedo of the material. Each object is a template whose text states
its colour. The recorded surface colour is simulated by Lambert's law under one to four lights with shadows, ambient light reduced
by occlusion, a small error of exposure and white balance, and Blinn-Phong highlights on glossy materials; ``--flat`` leaves all
of this out. Surface points that can hardly be seen from outside do not count.

``first``: the first name is that of a colour with at least a quarter of the surface. ``no false``: no name is that of a colour
that the object does not have. ``all``: each colour with at least a third of the surface is named. Colours that people call by
several names accept each of these names (``SAID``). Objects mostly of bare metal are left out, because they reflect their
surroundings. The categories are split into the halves of ``points.py``. The held-out half has its own seeds and therefore its own
lights; no parameter is set with it.
"""

from __future__ import annotations

import argparse
import time
import zlib
from collections import Counter
from collections.abc import Callable

import numpy as np
import trimesh
from points import held_out

from manitwin.errors import UsageError
from manitwin.formats.meshes.textures import linear_to_srgb, srgb_to_linear
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import sample_surface
from manitwin.models.annotators.surface_color import is_visible_outside, lab_from_srgb, name_colors
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.looks import COLORS
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.template_object import TemplateObject

SAMPLES = 3000
AROUND = 24
"""Number of rays by which the visible share of the sky is estimated at a surface point."""
WORDS = (
    "white",
    "black",
    "grey",
    "charcoal",
    "silver",
    "red",
    "blue",
    "yellow",
    "green",
    "brown",
    "beige",
    "pink",
    "orange",
    "purple",
)
SAID = {
    "white": {"white", "light grey", "cream"},
    "black": {"black", "dark grey"},
    "charcoal": {"dark grey", "black"},
    "grey": {"grey", "light grey", "dark grey"},
    "silver": {"light grey", "white", "grey"},
    "beige": {"beige", "tan", "cream"},
    "brown": {"brown", "dark brown"},
    "purple": {"purple", "dark purple", "lavender"},
    "orange": {"orange", "dark orange"},
    "bronze": {"tan", "brown", "beige"},
    "copper": {"tan", "brown", "orange", "dark orange"},
}
"""Accepted names of each colour. Any other colour accepts its own name, alone or after 'dark' or 'light'."""


def main() -> None:
    """Print the shares of correct names, and the wrong ones."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--every", type=int, default=1, help="every Kth category")
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--flat", action="store_true", help="the matter's own colours, without light")
    arguments = parser.parse_args()
    half = [name for name in sorted(load_templates()) if held_out(name) == arguments.held_out]
    right: Counter[str] = Counter()
    total, started = 0, time.process_time()
    for category in half[:: arguments.every]:
        for seed in range(arguments.seeds):
            case = zlib.crc32(f"{category} {seed} {arguments.held_out}".encode())
            scored = score(category, WORDS[case % len(WORDS)], np.random.default_rng(case), flat=arguments.flat)
            if scored is None:
                continue
            told, outcome = scored
            total += 1
            right.update(outcome)
            if len(outcome) < 3:
                print(f"{told}   ({', '.join(sorted({'first', 'no false', 'all'} - outcome))})", flush=True)
    seconds = (time.process_time() - started) / max(total, 1)
    shares = ", ".join(
        f"{name} {right[name]} of {total} ({right[name] / total:.1%})" for name in ("first", "no false", "all")
    )
    print(f"{shares}; {seconds:.2f} CPU-s each")


def score(category: str, word: str, rng: np.random.Generator, *, flat: bool) -> tuple[str, set[str]] | None:
    """Return the names found and which of the three questions are answered correctly.

    Returns None where the template cannot be made in that colour.
    """
    templates = load_templates()
    try:
        made = make_object(templates[category], read_text(f"a {word} {category}", templates), rng)
    except UsageError:
        return None
    mesh = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    points, normals, faces = sample_surface(mesh, SAMPLES, rng)
    looks = [made.looks[made.mesh.names[part]] for part in made.mesh.part[faces]]
    own = srgb_to_linear(np.array([look.rgb for look in looks]))
    gloss = 1 - np.array([look.roughness for look in looks])
    metal = np.array([look.metallic for look in looks]) > 0.5
    if metal.mean() > 0.5:
        return None  # a mirror shows the colour of its surroundings
    seen = own if flat else captured(mesh, points, normals, own, gloss, rng)
    outside = is_visible_outside(mesh, points, normals)
    names = name_colors(lab_from_srgb(np.clip(linear_to_srgb(seen), 0, 1))[outside], bool(metal.any()))
    truths = true_shares(made, mesh)
    said = [color.name for color in names]
    truth_words = ", ".join(f"{name} {share:.0%}" for name, share in truths.items())
    text = f"{category:18s} {truth_words} -> {', '.join(f'{color.name} {color.share:.0%}' for color in names)}"
    return text, questions(said, truths, is_called)


def questions(said: list[str], truths: dict[str, float], is_right: Callable[[str, str], bool]) -> set[str]:
    """Return which of the three questions are answered correctly; ``is_right(said, truth)`` compares two colour words."""
    outcome = set()
    if any(is_right(said[0], truth) for truth, share in truths.items() if share >= 0.25):
        outcome.add("first")
    if all(any(is_right(name, truth) for truth in truths) for name in said):
        outcome.add("no false")
    if all(any(is_right(name, truth) for name in said) for truth, share in truths.items() if share >= 1 / 3):
        outcome.add("all")
    return outcome


def true_shares(made: TemplateObject, mesh: trimesh.Trimesh) -> dict[str, float]:
    """Return the share of the surface for each colour word, by the nearest word to each part's colour."""
    shares: dict[str, float] = {}
    for number, part in enumerate(made.mesh.names):
        name = nearest_word(made.looks[part].rgb)
        shares[name] = shares.get(name, 0.0) + float(mesh.area_faces[made.mesh.part == number].sum() / mesh.area)
    return {name: share for name, share in sorted(shares.items(), key=lambda each: -each[1]) if share > 0.01}


def nearest_word(rgb: tuple[float, float, float]) -> str:
    """Return the colour word whose colour is nearest in CIELAB to an sRGB colour."""
    own = {name: [int(code[i : i + 2], 16) / 255 for i in (0, 2, 4)] for name, code in COLORS.items()}
    lab = lab_from_srgb(np.array(list(own.values())))
    return list(own)[int(np.linalg.norm(lab - lab_from_srgb(np.array(rgb)), axis=1).argmin())]


def is_called(said: str, truth: str) -> bool:
    """Tell whether ``said`` is an accepted name of the colour ``truth``."""
    return said.removeprefix("dark ").removeprefix("light ") == truth or said in SAID.get(truth, {truth})


def captured(
    mesh: trimesh.Trimesh,
    points: np.ndarray,
    normals: np.ndarray,
    own: np.ndarray,
    gloss: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return the linear colours ``(N, 3)`` in 0..1 that a camera records of a surface of albedo ``own (N, 3)``."""
    caster = RayCaster(mesh)
    start = points + 1e-4 * mesh.scale * normals
    directions = rng.normal(size=(AROUND, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    open_sky, facing = np.zeros(len(points)), np.zeros(len(points))
    for direction in directions:
        cosine = np.maximum(normals @ direction, 0)
        open_sky += cosine * is_free(caster, start, direction)
        facing += cosine
    ambient = rng.uniform(0.35, 0.8)
    light = np.repeat((ambient * open_sky / np.maximum(facing, 1e-9))[:, None], 3, axis=1)
    shine = np.zeros((len(points), 3))
    count = int(rng.integers(1, 5))
    for _ in range(count):
        toward = rng.normal(size=3) + np.array([0.0, 0.0, 1.0])
        toward /= np.linalg.norm(toward)
        reached = is_free(caster, start, toward)
        strength = (1 - ambient) / count * rng.uniform(1.0, 2.0)
        light += (strength * np.maximum(normals @ toward, 0) * reached)[:, None]
        halfway = toward + np.array([0.0, -0.8, 0.6])
        halfway /= np.linalg.norm(halfway)
        shine += (0.5 * gloss * np.maximum(normals @ halfway, 0) ** (2 + 60 * gloss**2) * reached)[:, None]
    exposure = rng.uniform(0.75, 1.1) * rng.normal(1.0, 0.04, 3)  # white balance
    noise = rng.normal(1.0, 0.05, own.shape)
    return np.clip((own * light * noise + 0.6 * shine) * exposure + 0.003, 0, 1)


def is_free(caster: RayCaster, start: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return 1.0 for each point from which a distant light in the given direction is unobstructed, else 0.0."""
    distance, _ = caster.first_hits(start, np.broadcast_to(direction, start.shape))
    return np.isinf(distance).astype(float)


if __name__ == "__main__":
    main()
