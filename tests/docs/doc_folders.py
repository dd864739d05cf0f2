"""What pages name and a reader has already: photos, meshes, a manifest, twins, a data set, scenes, episodes."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from functools import cached_property
from pathlib import Path

import numpy as np
import trimesh
from doc_pages import ROOT
from doc_shell import Shell
from PIL import Image

from foreign_assets import mug_urdf
from grasped_twins import write_bar, write_brick
from manitwin.formats.label_picture import label_picture
from manitwin.geometry.poses import inverse, transform
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD, write_twin_record
from posed_things import PLACES, pose_at, write_posed
from scene_twins import bowl, can, slab, write_thing
from seen_solids import seen_from
from tiny_clip import write_tiny_clip
from turned_things import turned_photo
from twin_folders import tried_as_built, twin_id

SMALL = """\
grasps.simulated = 20
grasps.unfiltered = 0
grasps.least_per_point = 2
grasps.tries_per_point = 4
second_opinion.enabled = false
robustness.enabled = false
"""
"""Settings under which a build shows all that a page is about in half of the time."""

GENERATOR = """\
import sys, trimesh
_, image, out, seed = sys.argv
trimesh.creation.cylinder(radius=0.12, height=1.0).export(out)
"""

DRAWING = """\
import sys
from PIL import Image, ImageDraw
_, text, out = sys.argv
picture = Image.new("RGB", (256, 256), "white")
ImageDraw.Draw(picture).ellipse((40, 60, 216, 200), fill=(180, 60 + len(text) % 100, 40))
picture.save(out)
"""

GROUPED = ("mug_front", "mug_side", "spoon")

COCO = {
    "images": [{"id": 7, "file_name": "photo.jpg"}],
    "categories": [{"id": 1, "name": "bottle"}],
    "annotations": [{"id": 1, "image_id": 7, "category_id": 1, "bbox": [193.0, 150.0, 94.0, 294.0]}],
}
"""The labels of a data set of one photo."""


class Folders:
    """Folders that take long to make, each made at its first use and copied to every page that names it."""

    def __init__(self, root: Path):
        self.root = root
        (root / "small.toml").write_text(SMALL)

    @cached_property
    def twins(self) -> Path:
        """Twins of the two samples, built by the command line."""
        self._manitwin(f"build {ROOT}/samples/samples.csv -o twins --config small.toml --jobs 1")
        return self.root / "twins"

    @cached_property
    def dataset(self) -> Path:
        """A data set with an index: bricks named as pages name objects, a bar, and things without grasps."""
        root = self.root / "DATASET"
        bricks, things = ("mug", "mug", "kettle"), (bowl(), slab("board", 0.24, 0.16, 0.015, 0.5), can())
        numbers = iter(sorted(range(len(bricks) + len(things) + 1), key=twin_id))  # few episodes go to the first ids
        for category in bricks:
            write_brick(root, next(numbers), category)
        for thing in things:
            write_thing(root, next(numbers), thing)
        write_bar(root, next(numbers), "rolling pin")  # what two hands can hold
        for folder in root.glob("twins/*/*"):
            _complete(folder)
        self._manitwin("index DATASET")
        return root

    @cached_property
    def scenes(self) -> Path:
        """Two layouts of the data set's twins."""
        assert self.dataset
        self._manitwin("layout DATASET -n 2 --objects 3..4 --seed 1 -o SCENES --jobs 1")
        return self.root / "SCENES"

    @cached_property
    def episodes(self) -> Path:
        """Two episodes, with films, with the data set's twins."""
        assert self.dataset
        self._manitwin("trajectories DATASET -n 2 -o EPISODES --jobs 1")
        self._manitwin("render EPISODES --cameras front --size 64 --jobs 1")
        return self.root / "EPISODES"

    @cached_property
    def assets(self) -> Path:
        """A mug of another tool, as URDF."""
        mug_urdf(self.root / "ASSETS" / "mug")
        return self.root / "ASSETS"

    def _manitwin(self, words: str) -> None:
        Shell(self.root).run(f"manitwin {words}")

    def prepare(self, page: Path, said: str) -> None:
        """Put into a page's folder what its steps name, but for what they write themselves first."""
        for name in ("samples", "docs", "benchmarks", "src", "scripts", "Makefile"):
            (page / name).symlink_to(ROOT / name)
        (page / "generator.py").write_text(GENERATOR)
        (page / "draw.py").write_text(DRAWING)
        (page / ".venv").symlink_to(ROOT / ".venv")
        (page / "small.toml").write_text(SMALL)
        (page / "run.toml").write_text(SMALL)
        for name in ("mug.jpg", "photo.jpg", "photos/bottle.jpg", *(f"photos/{name}.jpg" for name in GROUPED)):
            _copied(ROOT / "samples" / "bottle.jpg", page / name)
        if "photo_mask.png" in said:
            mask = np.zeros((640, 480), np.uint8)
            mask[150:444, 193:287] = 255
            Image.fromarray(mask).save(page / "photo_mask.png")
        if "annotations.json" in said:
            (page / "annotations.json").write_text(json.dumps(COCO))
        _copied(ROOT / "samples" / "mug.glb", page / "mug.glb")
        for name in ("front.png", "side.png", "back.png"):
            photo = np.zeros((300, 300, 4), np.uint8)
            # of a bottle that is 21 cm high: 59 mm wide; of a box: 66 mm of 20 cm
            left, right = (117, 183) if "--name box" in said else (122, 178)
            photo[60:260, left:right] = 200, 60, 50, 255
            if right < 183:  # with a neck: an upright rectangle is a picture with bars, of what is called a bottle
                photo[60:100, left:140] = photo[60:100, 160:right] = 0
            Image.fromarray(photo).save(page / name)
        if "--views 00.png" in said:
            for number in range(6):
                Image.fromarray(turned_photo(60.0 * number, 25.0)).save(page / f"{number:02d}.png")
        if "--poses shots/" in said:
            (page / "shots").mkdir()
            write_posed(page / "shots", [pose_at(*place) for place in PLACES])
        (page / "scans").mkdir()
        trimesh.load(ROOT / "samples" / "mug.glb", force="mesh").export(page / "scans" / "mug.obj")
        (page / "list.csv").write_text("file,name,license\nsamples/mug.glb,mug,CC0-1.0\n")
        if "--labels LABELS.csv" in said:
            record = next(iter(sorted(self.dataset.glob("twins/*/*")))).name
            (page / "LABELS.csv").write_text(
                f"twin_id,category,plausible_mass_low_kg,plausible_mass_high_kg\n{record},mug,0.1,1\n"
            )
        if "--clip CLIP" in said or "clip:CLIP" in said:
            write_tiny_clip(page / "CLIP")
        if "verdicts.csv" in said:
            ids = [record.name for record in sorted(self.dataset.glob("twins/*/*"))]
            rows = "".join(f"{twin_id},ada,category,yes\n{twin_id},ben,category,no\n" for twin_id in ids)
            (page / "verdicts.csv").write_text(f"twin_id,annotator,dimension,answer\n{rows}")
        if "--depth D.png" in said:
            self._view(page)
        kinds: dict[str, Callable[[], Path]] = {
            "twins": lambda: self.twins,
            "DATASET": lambda: self.dataset,
            "SCENES": lambda: self.scenes,
            "EPISODES": lambda: self.episodes,
            "ASSETS": lambda: self.assets,
        }
        for name, folder in kinds.items():
            first = re.search(rf"(-o )?\b{name}\b(?!\.)", said)
            if first and not first[1]:
                shutil.copytree(folder(), page / name)

    def _view(self, page: Path) -> None:
        """Show the first twin of the data set to a depth camera: D.png, C.png, M.png, K.json, B.json and CLOUD.npz."""
        model = PoseModel.of_twin(Twin(sorted(self.dataset.glob("twins/*/*"))[0]))
        seen = seen_from(model, 0.5, table=True)
        (page / "D.png").write_bytes(label_picture(np.rint(seen.view.depth_m * 1000)))
        (page / "M.png").write_bytes(label_picture(seen.mask * 255))
        Image.fromarray(np.full((*seen.mask.shape, 3), 120, np.uint8)).save(page / "C.png")
        height, width = seen.mask.shape
        camera = {"K": seen.view.intrinsics.tolist(), "pixel_centers_at": 0.5, "width": width, "height": height}
        (page / "K.json").write_text(json.dumps({**camera, "depth_unit_m": 0.001}))
        camera_to_base = transform(None, np.array([0.5, 0.0, 0.0])) @ inverse(seen.object_to_camera)
        (page / "B.json").write_text(json.dumps({"camera_to_base": camera_to_base.tolist()}))
        np.savez(page / "CLOUD.npz", points=seen.view.points(np.flatnonzero(seen.mask & (seen.view.depth_m > 0))))

    def twin_id(self, folder: Path) -> str:
        """Return the id of the mug's twin, if there is one in the folder."""
        records = sorted(folder.glob("twins/twins/*/*/twin.json"))
        return str(records[0].parent.relative_to(folder / "twins")) if records else ""


def _complete(twin: Path) -> None:
    """Give a twin a picture of one colour for its card, and as many verified grasps as pages ask for."""
    Image.new("RGB", (64, 64), (200, 20, 20)).save(twin / "card.png")
    record = json.loads((twin / RECORD).read_bytes())
    del record["revision"], record["files"]
    record["grasps"]["verified"] = 24
    record["grasps"]["trial"] = tried_as_built()
    write_twin_record(twin, record)


def _copied(source: Path, target: Path) -> None:
    target.parent.mkdir(exist_ok=True)
    shutil.copy(source, target)
