"""Measure the classifier that names photos, on pictures with known truth: templates rendered over generated backgrounds.

    python benchmarks/naming.py [--seeds N] [--limits FILE] [--photos MANIFEST.csv FOLDER] [--meshes] [--twins FOLDER]

Every template is rendered from three elevations over a plain, wooden, cloudy or two-part ground with a soft shadow. The
categories are split in halves; the temperature and the limits of one half are tested on the other. ``--limits`` writes those of
all categories in the format of ``models/classifiers/name_limits.csv``: for each name the highest probability that any picture of
another object gave it. ``--photos`` prints the names given to photos, with the truth in a manifest's column ``category``; no
parameter is set with them. ``--meshes`` names the templates' meshes as a build names unnamed objects, from six views, with and
without their size. ``--twins`` does the same with finished twins, whose names are the truth.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from manitwin.config import NamingConfig, ViewsConfig
from manitwin.errors import Rejected
from manitwin.formats.image_file import read_image
from manitwin.models.annotators.likely_names import usual_values
from manitwin.models.annotators.prior_names import named
from manitwin.models.annotators.rules import RulesAnnotator
from manitwin.models.classifiers.classifier import LIKELIEST, TEMPERATURE, classify, softmax
from manitwin.models.classifiers.efficientnet_lite import SIDE_PX, logits
from manitwin.models.classifiers.imagenet import load_names
from manitwin.models.classifiers.object_pictures import object_pictures
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.template_object import visual_parts
from manitwin.models.matting import matte_photo
from manitwin.pipeline.naming import VIEWS_FROM_ABOVE, cut_view
from manitwin.pipeline.object_state import pictures
from manitwin.pipeline.views import draw_views
from manitwin.render.cameras import framing_camera
from manitwin.render.renderer import BACKDROP, shared_renderer
from manitwin.twin.loaded_twin import Twin

ELEVATIONS_DEG = (12.0, 35.0, 62.0)
SEEN_IN_PHOTOS = {
    "can opener": 0.907, "compact": 0.760, "envelope": 0.820, "mobile phone": 0.866, "remote control": 0.845,
}  # fmt: skip
"""Probability of these names in real photos of other objects, such as pliers or a calculator; above that in any render."""
LIMITS = (0.5, 0.6, 0.7, 0.8, 0.9)
LIMIT = NamingConfig().min_probability
WITHIN = 1.6
TEMPERATURES = (0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5)
ALSO_RIGHT = {
    "bottle": ("glass bottle", "water bottle", "soda bottle"),
    "glass bottle": ("bottle",), "water bottle": ("bottle",), "pump bottle": ("bottle",), "shampoo bottle": ("bottle",),
    "spray bottle": ("bottle",), "pill bottle": ("bottle",), "thermos": ("bottle", "water bottle"), "mug": ("cup",),
    "cup": ("mug",), "glass": ("cup",), "wine glass": ("glass",), "bowl": ("mixing bowl",), "mixing bowl": ("bowl",),
    "pet bowl": ("bowl",), "saucer": ("plate",), "cooking spoon": ("wooden spoon",), "putty knife": ("spatula",),
    "notebook": ("book",), "saucepan": ("pot",), "tissue box": ("box",), "pitcher": ("jug",), "trash can": ("bucket",),
    "tennis ball": ("ball",),
}  # fmt: skip
"""Names that a person would accept for a template's object besides its category."""


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--limits", type=Path)
    parser.add_argument("--photos", nargs=2, type=Path)
    parser.add_argument("--meshes", action="store_true")
    parser.add_argument("--twins", type=Path)
    arguments = parser.parse_args()
    if arguments.meshes:
        print_sized("templates", template_meshes(arguments.seeds))
        return
    if arguments.twins:
        print_sized("twins", finished_twins(arguments.twins))
        return
    if arguments.photos:
        print_photos(*arguments.photos)
        return
    started = time.process_time()
    rows = looks(arguments.seeds)
    print(f"{len(rows)} pictures, {(time.process_time() - started) / len(rows):.2f} CPU-s each, rendering included")
    categories = sorted({category for category, _ in rows})
    halves = [[row for row in rows if categories.index(row[0]) % 2 == half] for half in (0, 1)]
    for half, part in enumerate(halves):
        losses = " ".join(f"{t}: {log_loss(part, t):.3f}" for t in TEMPERATURES)
        print(f"half {half}: log loss by temperature: {losses}")
    for limit in LIMITS:
        for half, part in enumerate(halves):
            highest = highest_wrong(halves[1 - half])
            verdicts = [verdict(category, seen, limit, highest) for category, seen in part]
            given = [v for v in verdicts if v is not None]
            print(f"limit {limit}, half {half} by the other's: {len(given)} of {len(part)} named, {sum(given)} right")
    for half, part in enumerate(halves):
        print_sizes(f"half {half}", part, highest_wrong(halves[1 - half]))
    if arguments.limits:
        highest = highest_wrong(rows)
        highest |= {name: max(value, highest[name]) for name, value in SEEN_IN_PHOTOS.items()}
        with arguments.limits.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["name", "highest_wrong"])
            writer.writerows([name, f"{value:.3f}"] for name, value in sorted(highest.items()))


def right_names(category: str) -> set[str]:
    """Return the accepted names of a template's object."""
    return {category, *ALSO_RIGHT.get(category, ())}


def looks(seeds: int) -> list[tuple[str, np.ndarray]]:
    """Return the template's category and the logits of its crops ``(3, 1000)`` for each picture."""
    templates, rows = load_templates(), []
    for number, category in enumerate(sorted(templates)):
        for seed in range(seeds):
            made = make_object(templates[category], read_text(category, templates), np.random.default_rng(1000 + seed))
            rng = np.random.default_rng([number, seed])
            parts = visual_parts(made)
            points = np.concatenate([part.vertices for part in parts])
            cameras = [
                framing_camera(
                    points, azimuth_deg=float(rng.uniform(-140, -40)), elevation_deg=elevation, fov_y_deg=30.0,
                    width_px=288, height_px=288,
                )
                for elevation in ELEVATIONS_DEG
            ]  # fmt: skip
            for frame in shared_renderer().render(parts, cameras):
                photo = composite(frame.rgb, frame.coverage, rng)
                rows.append((category, logits(object_pictures(photo, SIDE_PX))))
    return rows


def composite(rgb: np.ndarray, coverage: np.ndarray, rng: np.random.Generator, side_px: int = 384) -> np.ndarray:
    """Return a render ``(H, W, 3)`` over a ground with light and shadow, with its matte ``(side, side, 4) uint8``."""
    alpha = coverage[..., None]
    own = rgb.astype(np.float32) - (1 - alpha) * np.array(BACKDROP, np.float32)
    rows, columns = np.nonzero(coverage > 0.5)
    window = np.s_[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    factor = side_px * rng.uniform(0.35, 0.8) / max(np.ptp(rows) + 1, np.ptp(columns) + 1)
    own, alpha = (cv2.resize(x[window], None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA) for x in (own, alpha))
    height, width = alpha.shape
    top, left = rng.integers(0, side_px - height), rng.integers(0, side_px - width)
    place = np.s_[top : top + height, left : left + width]
    matte = np.zeros((side_px, side_px), np.float32)
    matte[place] = alpha
    shade = cv2.GaussianBlur(np.roll(matte, (height // 30, width // 25), (0, 1)), (0, 0), 0.04 * max(height, width))
    photo = ground(rng, side_px) * (1 - 0.45 * shade)[..., None]
    light = np.clip(rng.normal(1, 0.1, 3) * rng.uniform(0.75, 1.15), 0.5, 1.3)
    photo[place] = photo[place] * (1 - alpha[..., None]) + np.clip(own, 0, 255) * light
    return np.dstack([np.clip(photo, 0, 255), 255 * matte]).round().astype(np.uint8)


def ground(rng: np.random.Generator, side_px: int) -> np.ndarray:
    """Return a generated background ``(side, side, 3) float32``: plain with a gradient, wood, clouds, or wall and table."""
    kind = rng.integers(4)
    base = rng.uniform(30, 245, 3) if rng.random() < 0.4 else rng.uniform(40, 250) + rng.normal(0, 10, 3)
    y, x = np.mgrid[:side_px, :side_px] / side_px
    angle = rng.uniform(0, 2 * np.pi)
    image = ((x * np.cos(angle) + y * np.sin(angle)) * rng.uniform(0, 40))[..., None] + base
    if kind == 1:
        image = np.array([200, 160, 110]) * rng.uniform(0.5, 1.1)
        image = image + _noise(rng, side_px, side_px // 3, 8)[..., None] * np.array([18, 16, 12])
    if kind == 2:
        image = image + sum(_noise(rng, side_px, k, k) / k**0.5 for k in (4, 8, 16, 64))[..., None] * 18
    if kind == 3:
        image[: int(side_px * rng.uniform(0.2, 0.5))] = rng.uniform(60, 240, 3)
    return np.clip(image + rng.normal(0, 3, image.shape), 0, 255).astype(np.float32)


def _noise(rng: np.random.Generator, side_px: int, rows: int, columns: int) -> np.ndarray:
    small = rng.normal(0, 1, (rows, columns)).astype(np.float32)
    return cv2.resize(small, (side_px, side_px), interpolation=cv2.INTER_CUBIC)


def probabilities(seen: np.ndarray, temperature: float = TEMPERATURE) -> dict[str, float]:
    """Return the mean probability of each name, including more general names."""
    table, shares = load_names(), softmax(seen / temperature).mean(axis=0)
    single = dict(zip(table.names, (table.members @ shares).tolist(), strict=True))
    return dict(zip(table.general, (table.general_members @ shares).tolist(), strict=True)) | single


def log_loss(rows: list[tuple[str, np.ndarray]], temperature: float) -> float:
    """Return the mean log loss of the right names, over the objects that have an ImageNet class."""
    table, losses = load_names(), []
    for category, seen in rows:
        right = [table.members[table.names.index(n)] for n in right_names(category) if n in table.names]
        if right:
            shares = softmax(seen / temperature).mean(axis=0)
            losses.append(-np.log(shares[np.any(right, axis=0)].sum() + 1e-9))
    return float(np.mean(losses))


def highest_wrong(rows: list[tuple[str, np.ndarray]]) -> dict[str, float]:
    """Return the highest probability of each name in a picture of another object."""
    table = load_names()
    highest = dict.fromkeys((*table.general, *table.names), 0.0)
    for category, seen in rows:
        for name, value in probabilities(seen).items():
            if name not in right_names(category):
                highest[name] = max(highest[name], value)
    return highest


def verdict(category: str, seen: np.ndarray, limit: float, highest: dict[str, float]) -> bool | None:
    """Tell whether the name that the classifier would give is right; None where it gives none."""
    table, shares = load_names(), probabilities(seen)
    for names in (table.names, table.general):
        name = max(names, key=lambda each: shares[each])
        if shares[name] >= max(limit, highest[name]):
            return name in right_names(category)
    return None


def print_sizes(part_of: str, rows: list[tuple[str, np.ndarray]], highest: dict[str, float]) -> None:
    """Print the error of the usual size and bulk density of all and of likely categories for unnamed objects."""
    names, off = load_names().names, []
    for category, seen in rows:
        truth = named(category)
        if truth is None or truth.bulk_density_kg_m3 is None or verdict(category, seen, LIMIT, highest) is not None:
            continue
        shares = probabilities(seen)
        likely = [(name, shares[name]) for name in sorted(names, key=lambda name: -shares[name])[:LIKELIEST]]
        off.append(
            [
                abs(np.log(said.value / true.typical))
                for guess in (usual_values(()), usual_values(likely))
                for said, true in (
                    (guess.longest_axis_m, truth.longest_axis_m),
                    (guess.bulk_density_kg_m3, truth.bulk_density_kg_m3),
                )
            ]
        )
    apart, within = np.exp(np.mean(off, axis=0)), np.mean(np.array(off) < np.log(WITHIN), axis=0)
    for what, anything in (("size", 0), ("bulk density", 1)):
        of_names = anything + 2
        print(
            f"{part_of}, {len(off)} unnamed, {what}: a factor {apart[anything]:.2f} off by anything, {apart[of_names]:.2f} by"
            f" names; within {WITHIN:g}: {within[anything]:.0%} and {within[of_names]:.0%}"
        )


def print_photos(manifest: Path, folder: Path) -> None:
    """Print the names given to photos; a photo whose object cannot be cut out is named by the whole picture."""
    with manifest.open(newline="", encoding="utf-8") as file:
        truth = {Path(row["file"]).name: row["category"] for row in csv.DictReader(file)}
    for path in sorted(folder.glob("*.jpg")):
        image, whole = read_image(path, frame=None, max_side_px=2048).pixels[..., :3], ""
        try:
            rgba = matte_photo(image, path.name).rgba
        except Rejected:
            rgba, whole = np.dstack([image, np.full(image.shape[:2], 255, np.uint8)]), " (whole picture)"
        found = classify([rgba], 0.7)
        category = named(found.name).category if found.name and named(found.name) else None
        likeliest = ", ".join(f"{guess.name} {guess.probability.value:.2f}" for guess in found.likeliest)
        print(f"{path.name:28s} {truth[path.name]:12s} -> {found.name or 'unknown'} [{category}] ({likeliest}){whole}")


def template_meshes(seeds: int) -> Iterator[tuple[str, float, list[np.ndarray]]]:
    """Yield for each built object its category, its length (m) and the views by which it is named."""
    templates = load_templates()
    for category in sorted(templates):
        for seed in range(seeds):
            made = make_object(templates[category], read_text(category, templates), np.random.default_rng(5000 + seed))
            parts = visual_parts(made)
            longest_m = float(np.ptp(np.concatenate([part.vertices for part in parts]), axis=0).max())
            seen = draw_views(parts, ViewsConfig(), RulesAnnotator.picture_px)[1]
            yield category, longest_m, [cut_view(seen[i]) for i in VIEWS_FROM_ABOVE]


def finished_twins(folder: Path) -> Iterator[tuple[str, float, list[np.ndarray]]]:
    """Yield for each finished twin its name or category, its length (m) and the views by which it is named."""
    for path in sorted(folder.glob("twins/*/*/twin.json")):
        twin = Twin(path.parent)
        seen = [np.asarray(Image.open(picture).convert("RGB")) for picture in pictures(path.parent / "views", "rgb")]
        said = twin.record.name or twin.record.language.category
        yield said, max(twin.record.physical.extents_m), [cut_view(seen[i]) for i in VIEWS_FROM_ABOVE]


def print_sized(what: str, things: Iterator[tuple[str, float, list[np.ndarray]]]) -> None:
    """Print how many objects are named, and how many correctly, with and without their size, by half of the categories."""
    counts: dict[tuple[bool, int], list[int]] = {}
    categories: dict[str, int] = {}
    for category, longest_m, views in things:
        half = categories.setdefault(category, len(categories)) % 2
        for sized in (False, True):
            found = classify(views, LIMIT, longest_m if sized else None)
            row = counts.setdefault((sized, half), [0, 0, 0])
            right = found.name is not None and found.name in right_names(category)
            row[0], row[1], row[2] = row[0] + 1, row[1] + (found.name is not None), row[2] + right
            if found.name is not None and not right:
                print(f"  {'with' if sized else 'without'} size: {category} of {longest_m:.3f} m is named {found.name}")
    for (sized, half), (tried, given, right) in sorted(counts.items()):
        print(f"{what}, half {half}, {'with' if sized else 'without'} size: {tried}, {given} named, {right} right")


if __name__ == "__main__":
    main()
