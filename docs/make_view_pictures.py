"""Make the pictures of docs/view.md beside this file: pages of a data set in a Chromium browser (``make browser``).

    manitwin view DATASET --no-browser
    python docs/make_view_pictures.py LINK TWIN_ID
    manitwin view SCENES --no-browser
    python docs/make_view_pictures.py LINK SCENE_ID --scene
    manitwin view EPISODES --no-browser
    python docs/make_view_pictures.py LINK NUMBER --episode
    manitwin review DATASET --no-browser
    python docs/make_view_pictures.py LINK TWIN_ID --review
    manitwin review cutouts DATASET --draw --no-browser
    python docs/make_view_pictures.py LINK TWIN_ID --outline 60,29 83,32 81,48 77,71 66,68 --said "playing cards" 9

``LINK`` is the one-time link that the command prints.
"""

from __future__ import annotations

import argparse
import io
import shutil
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

FOLDER = Path(__file__).resolve().parent
BROWSERS = ("chromium", "chromium-browser", "google-chrome-stable", "google-chrome")
WIDE, NARROW, SCENE = {"width": 1280, "height": 900}, {"width": 390, "height": 844}, {"width": 1280, "height": 720}
EPISODE = {"width": 1280, "height": 965}
MOMENT_S, TRIAL_S = 4.2, 1.3
"""Times of an episode and of a trial at which the object is held or lifted."""
WITHOUT_GPU = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]


def shown(page: Any, address: str, size: dict[str, int], scheme: str) -> Image.Image:
    """Return a screenshot of a page."""
    page.set_viewport_size(size)
    page.emulate_media(color_scheme=scheme)
    page.goto("about:blank")
    page.goto(address, wait_until="networkidle")
    if any(kind in address for kind in ("/twin/", "/scene/", "/episode/")):
        page.wait_for_selector("#viewer[data-ready]")
    if "trial=" in address:
        page.wait_for_selector(f".trial output:has-text('{TRIAL_S:.2f} s')", timeout=60_000)
        page.wait_for_timeout(500)
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def judged(page: Any, address: str) -> Image.Image:
    """Return a screenshot of a review page while a functional point is moved to another candidate."""
    page.set_viewport_size(WIDE)
    page.goto(address, wait_until="networkidle")
    page.wait_for_selector("#viewer[data-ready]")
    page.keyboard.press("1")  # ignores drafts of earlier visits
    for key in ("y", "y", "n"):
        page.keyboard.press(key)
    page.wait_for_timeout(800)
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def drawn(page: Any, address: str, corners: list[str], said: list[str]) -> Image.Image:
    """Return a screenshot of an outline page while ``corners``, in percent of the photo, are drawn.

    ``said`` is typed first: a name, and a longest side in centimetres.
    """
    page.set_viewport_size(WIDE)
    page.goto(address, wait_until="networkidle")
    page.wait_for_selector("#outline[data-ready]")
    for field, typed in zip(("#name", "#longest_side_cm"), said, strict=True):
        page.fill(field, typed)
        page.locator(field).blur()
    page.wait_for_selector("#known:has-text('known as')")
    box = page.locator("#canvas").bounding_box()
    for corner in corners:
        x, y = (float(number) / 100 for number in corner.split(","))
        page.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def beside(pictures: list[Image.Image]) -> Image.Image:
    """Return pictures of equal height side by side."""
    together = Image.new(
        "RGB", (sum(each.width for each in pictures) + 12 * (len(pictures) - 1), pictures[0].height), "grey"
    )
    left = 0
    for each in pictures:
        together.paste(each, (left, 0))
        left += each.width + 12
    return together


def main() -> None:
    """Make the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("link")
    parser.add_argument("id", help="of a twin, or with --scene of a scene, with --episode of an episode")
    parser.add_argument("--scene", action="store_true", help="the picture of a scene's page alone")
    parser.add_argument(
        "--review", action="store_true", help="the picture of a review's page alone, of a twin of its sample"
    )
    parser.add_argument("--outline", nargs="+", metavar="X,Y", help="the page of an outline alone, with these corners")
    parser.add_argument("--said", nargs=2, metavar=("NAME", "CM"), help="what is typed into the fields of --outline")
    parser.add_argument("--episode", action="store_true", help="the picture of an episode's page alone, by its number")
    given = parser.parse_args()
    address = given.link.split("/enter")[0]
    twin = f"{address}/twin/{given.id}"
    closer = f"{twin}#layers=hulls candidate functional grasp grasps cube&count=30&grasp=0&placement=0"
    with sync_playwright() as playwright:
        path = next(found for name in BROWSERS if (found := shutil.which(name)))
        page = playwright.chromium.launch(executable_path=path, args=WITHOUT_GPU).new_page()
        page.goto(given.link)
        if given.scene:
            pictures = {"view_scene": shown(page, f"{address}/scene/{given.id}", SCENE, "light")}
        elif given.review:
            pictures = {"review": judged(page, f"{address}/review/{given.id}")}
        elif given.outline:
            pictures = {"outline": drawn(page, f"{address}/outline/{given.id}", given.outline, given.said)}
        elif given.episode:
            pictures = {"view_episode": shown(page, f"{address}/episode/{given.id}#t={MOMENT_S}", EPISODE, "light")}
        else:
            pictures = {
                "view_gallery": shown(page, f"{address}/", WIDE, "light"),
                "view_twin": shown(page, twin, WIDE, "light"),
                "view_trial": shown(page, f"{twin}#grasp=2&trial={TRIAL_S}", WIDE, "light"),
                "view_dark": shown(page, closer, WIDE, "dark"),
                "view_narrow": beside(
                    [
                        shown(page, f"{address}/", NARROW, "light"),
                        shown(page, twin, NARROW, "light"),
                        shown(page, twin, NARROW, "dark"),
                    ]
                ),
            }
    for name, picture in pictures.items():
        picture.save(FOLDER / f"{name}.webp", quality=82, method=6)


if __name__ == "__main__":
    main()
