"""Make vqa.png beside this file: sample questions of ``manitwin vqa`` with their answers.

    manitwin layout DATASET -n 8 --objects 6..10 --pictures --seed 11 -o DRAWN
    manitwin vqa DRAWN -o QUESTIONS --per-scene 60
    python docs/make_vqa_picture.py QUESTIONS

For each family named below, the first question with a picture not yet shown is used.
"""

from __future__ import annotations

import argparse
import io
import json
import re
import textwrap
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw, ImageFont

PICTURE = Path(__file__).resolve().parent / "vqa.png"
FAMILIES = ("object_at_point", "interaction_point_occluded", "gap", "occluder", "slide_two_legs", "box_of_object")
TILE_PX, TEXT_PX, LINE_PX, ACROSS, LETTERS = 340, 132, 16, 3, 50
MARK, INK, QUIET, COLORS = (222, 32, 60), (20, 20, 20), (110, 110, 110), 192


def numbered(text: str) -> str:
    """Return a text with point references replaced by the drawn numbers: ``<p0>`` becomes #1."""
    return re.sub(r"<[pb](\d+)>", lambda found: f"#{int(found[1]) + 1}", text)


def tile(question: dict[str, Any], picture: Image.Image) -> Image.Image:
    """Draw a question's picture with its points, and its text and answer below."""
    made = Image.new("RGB", (TILE_PX, TILE_PX + TEXT_PX), "white")
    made.paste(picture.resize((TILE_PX, TILE_PX), Image.Resampling.LANCZOS))
    draw, font = ImageDraw.Draw(made), ImageFont.load_default(13)
    for number, (x, y) in enumerate(question["points"], 1):
        at = x * TILE_PX, y * TILE_PX
        draw.circle(at, 6, outline="white", width=4)
        draw.circle(at, 6, outline=MARK, width=2)
        draw.text((at[0] + 9, at[1] - 9), f"#{number}", fill=MARK, font=font, stroke_width=2, stroke_fill="white")
    for x, y, width, height in question["boxes"]:
        draw.rectangle([v * TILE_PX for v in (x, y, x + width, y + height)], outline=MARK, width=2)
        draw.text((x * TILE_PX, y * TILE_PX - 18), "#1", fill=MARK, font=font, stroke_width=2, stroke_fill="white")
    options = f" ({numbered('; '.join(question['options']))})" if question["kind"] == "choice" else ""
    said = [(f"{question['category']}, {question['family']}", QUIET)]
    said += [(line, INK) for line in textwrap.wrap(numbered(question["question"]) + options, LETTERS)]
    said += [(line, MARK) for line in textwrap.wrap(numbered(question["response"]), LETTERS)]
    for place, (line, color) in enumerate(said):
        draw.text((3, TILE_PX + 4 + place * LINE_PX), line, fill=color, font=font)
    return made


def main() -> None:
    """Draw the samples of the given folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("questions", type=Path)
    folder = parser.parse_args().questions
    lines = (folder / "questions.jsonl").read_text(encoding="utf-8").splitlines()
    asked, shown, tiles = [json.loads(line) for line in lines], set(), []
    for family in FAMILIES:
        question = next(each for each in asked if each["family"] == family and each["picture"] not in shown)
        shown.add(question["picture"])
        with Image.open(folder / "images" / question["picture"]) as picture:
            tiles.append(tile(question, picture))
    width, height = TILE_PX + 8, TILE_PX + TEXT_PX + 4
    page = Image.new("RGB", (ACROSS * width - 8, len(tiles) // ACROSS * height), "white")
    for place, each in enumerate(tiles):
        page.paste(each, (place % ACROSS * width, place // ACROSS * height))
    held = io.BytesIO()
    page.quantize(COLORS).save(held, "PNG", optimize=True)
    PICTURE.write_bytes(held.getvalue())


if __name__ == "__main__":
    main()
