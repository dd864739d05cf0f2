"""The page of segmentation counts what the pictures of ids show."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np

from manitwin.scenes.perception.classes import Classes
from manitwin.scenes.perception.report import BINS, segmentation_page
from manitwin.scenes.perception.scene_truth import SceneTruth


def rows_of(text: str, caption: str) -> dict[str, list[str]]:
    table = text[text.index(f"<caption>{caption}") :].partition("</table>")[0]
    rows = re.findall(r'<tr><th scope="row"[^>]*>(.*?)</th>(.*?)</tr>', table)
    return {name: re.findall(r"<td[^>]*>(.*?)</td>", cells) for name, cells in rows}


def test_the_page_counts_instances_pixels_and_parts_as_the_pictures_show_them(truths: list[SceneTruth]) -> None:
    instances, pixels, parts = Counter[str](), Counter[str](), Counter[str]()
    for truth in truths:
        for picture in truth.pictures:
            for thing in truth.record.objects:
                count = int((picture.ids == truth.ids[thing.name]).sum())
                instances[thing.category] += count > 0
                pixels[thing.category] += count
            for number, part in truth.parts.items():
                parts[f"{part.category}/{part.name}"] += bool((picture.parts == number).any())
    text = segmentation_page(truths, Classes.from_scenes(truths), "coco", 0.0).decode()
    categories = rows_of(text, "Instances by category")
    assert {name: (int(row[0]), int(row[2].replace(",", ""))) for name, row in categories.items()} == {
        name: (instances[name], pixels[name]) for name in categories
    }
    assert set(categories) == set(instances)
    assert {name: int(row[0]) for name, row in rows_of(text, "Kinds of parts").items()} == dict(parts)
    shares = [view.visible_share for truth in truths for each in truth.pictures for view in each.views.values()]
    wanted = np.histogram([share for share in shares if share], bins=BINS, range=(0, 1))[0]
    assert [int(row[0]) for row in rows_of(text, "How much of an instance").values()] == wanted.tolist()
    assert text.count("data:image/png;base64,") == len(truths) and "2 train" in text
