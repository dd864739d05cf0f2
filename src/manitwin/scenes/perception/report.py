"""Report page of segmentation: samples with their labels drawn over them, class counts, and visible shares."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

import cv2
import numpy as np

from manitwin.dataset.report_page import Picture, Section, Table, page
from manitwin.formats.image_file import png_of
from manitwin.render.false_colors import ids_in_colors
from manitwin.scenes.perception.classes import Classes
from manitwin.scenes.perception.scene_truth import PictureTruth, SceneTruth
from manitwin.scenes.perception.splits import split_of

SAMPLE_PX, MOST_SAMPLES = 256, 12
LABEL_SHARE = 0.5
"""The weight of the label's colour in a sample's pixel; the rest is the picture's colour."""
BINS, BAR = 10, 40
"""Number of bins of the histogram of visible shares, and characters of its longest bar."""


@dataclass
class _Counts:
    """Counts accumulated over the scenes; an instance is an object in one picture that shows some of it."""

    scenes: Counter[str] = field(default_factory=Counter)
    pictures: int = 0
    instances: Counter[str] = field(default_factory=Counter)
    pixels: Counter[str] = field(default_factory=Counter)
    parts: Counter[str] = field(default_factory=Counter)
    shares: list[float] = field(default_factory=list)
    unseen: int = 0


def segmentation_page(scenes: Iterable[SceneTruth], classes: Classes, form: str, validation_share: float) -> bytes:
    """Return the page of all scenes; samples take the cameras of the scenes in turn. Raises UsageError."""
    counts, samples = _Counts(), list[Picture]()
    for number, scene in enumerate(scenes):
        counts.scenes[split_of(scene.record.scene_id, validation_share)] += 1
        for picture in scene.pictures:
            _count(counts, scene, picture)
        if scene.pictures and len(samples) < MOST_SAMPLES:
            samples.append(_sample(scene, scene.pictures[number % len(scene.pictures)]))
    splits = ", ".join(f"{count:,} {name}" for name, count in sorted(counts.scenes.items()))
    lead = [
        f"{counts.pictures:,} pictures of {counts.scenes.total():,} scenes as {form}; {len(counts.shares):,} instances of"
        f" {len(classes.categories):,} categories, {len(classes.parts):,} kinds of parts."
        f" Scenes by split: {splits}."
    ]
    balance = [_categories(counts, classes), _visible(counts)]
    if classes.parts:
        rows = [(name, counts.parts[name]) for name in classes.parts]
        balance.append(Table("Kinds of parts.", ("part", "pictures that show it, by object"), rows))
    return page("Segmentation", lead, [Section("Samples", samples), Section("Balance", balance)])


def _count(counts: _Counts, scene: SceneTruth, picture: PictureTruth) -> None:
    counts.pictures += 1
    for thing in scene.record.objects:
        view = picture.views[thing.name]
        if not view.visible_px:
            counts.unseen += 1
            continue
        counts.instances[thing.category] += 1
        counts.pixels[thing.category] += view.visible_px
        counts.shares.append(view.visible_share)
    if scene.parts:
        shown = np.unique(picture.parts)
        counts.parts.update(f"{part.category}/{part.name}" for number, part in scene.parts.items() if number in shown)


def _sample(scene: SceneTruth, picture: PictureTruth) -> Picture:
    """Blend the colours of the instances into a picture, with a white outline around each."""
    numbers = [scene.ids[thing.name] for thing in scene.record.objects]
    drawn = picture.rgb.copy()
    on_object = np.isin(picture.ids, numbers)
    mixed = (1 - LABEL_SHARE) * drawn[on_object] + LABEL_SHARE * ids_in_colors(picture.ids)[on_object]
    drawn[on_object] = np.rint(mixed).astype(np.uint8)
    for number in numbers:
        outlines, _ = cv2.findContours(
            (picture.ids == number).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
        )
        cv2.drawContours(drawn, outlines, -1, (255, 255, 255), 1)
    height = SAMPLE_PX * drawn.shape[0] // drawn.shape[1]
    small = cv2.resize(drawn, (SAMPLE_PX, height), interpolation=cv2.INTER_AREA)
    seen = [(thing.category, picture.views[thing.name]) for thing in scene.record.objects]
    said = ", ".join(f"{category} {100 * view.visible_share:.0f} %" for category, view in seen if view.visible_px)
    return Picture(png_of(small), f"{scene.record.scene_id}, {picture.name}; seen: {said or 'nothing'}")


def _categories(counts: _Counts, classes: Classes) -> Table:
    all_instances, all_pixels = counts.instances.total(), counts.pixels.total()
    rows = [
        (
            name, counts.instances[name], round(counts.instances[name] / max(all_instances, 1), 3), counts.pixels[name],
            round(counts.pixels[name] / max(all_pixels, 1), 3),
        )
        for name in classes.categories
    ]  # fmt: skip
    most = max(counts.instances.values(), default=0) / max(all_instances, 1)
    caption = f"Instances by category. Without looking, the commonest category names {100 * most:.1f} % of them."
    return Table(caption, ("category", "instances", "share", "pixels", "share of objects' pixels"), rows)


def _visible(counts: _Counts) -> Table:
    bins, _ = np.histogram(counts.shares, bins=BINS, range=(0, 1))
    longest = max(int(bins.max()), 1)
    rows = [
        (
            f"{100 * place // BINS} to {100 * (place + 1) // BINS} %", int(count),
            "\u2588" * max(round(BAR * count / longest), int(count > 0)),
        )
        for place, count in enumerate(bins)
    ]  # fmt: skip
    caption = (
        "How much of an instance is seen (visible pixels by those of its whole silhouette);"
        f" {counts.unseen:,} times a picture shows nothing of an object of its scene."
    )
    return Table(caption, ("seen", "instances", ""), rows)
