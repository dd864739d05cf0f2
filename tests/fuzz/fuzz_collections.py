"""What people and other programs keep beside twins: lists of inputs, catalogues, verdicts, and networks that they name."""

from __future__ import annotations

import gzip
import json
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
from fuzz_datasets import command, dataset
from fuzz_target import Case, target
from PIL import Image

from manitwin.dataset.collect.intake import DefaultValues, add_inputs
from manitwin.dataset.collect.status import catalogue_status
from manitwin.dataset.review.store import ReviewStore, reviews_path
from manitwin.dataset.review.verdict_files import read_verdicts
from manitwin.dataset.review.verdicts import Corrections, Measure, Review
from manitwin.formats.onnx_graph import OnnxGraph
from manitwin.models.embedders.clip import ClipFolder
from manitwin.models.matting.learned import find_network, require_working
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import read_record
from tiny_clip import write_tiny_clip

LIST = """file,url,name,source,license,attribution,size_m
photos/mug.png,,mug,own,CC0-1.0,Ada,0.09
,https://example.org/a/hammer.glb,hammer,shop,CC-BY-4.0,"Bo, Cy",
photos/mug.png,,cup,own,,,0.1
"""
LINES = """{"file": "photos/mug.png", "category": "mug", "source": "own", "size_m": 0.1}
{"url": "https://example.org/b.glb", "name": "spoon", "source": "shop", "licence": "CC0-1.0"}
"""
VERDICTS = """twin_id,revision,annotator,dimension,answer,category,mass_kg,mass_low_kg,mass_high_kg,note
{0},,ada,category,no,cup,,,,"a ""cup"", I say"
{0},,ada,physical,no,,0.3,0.2,0.4,
{1},,bo,language,yes,,,,,
"""
LINES_OF_VERDICTS = """{{"twin_id": "{0}", "annotator": "cy", "dimension": "category", "answer": "yes", "seconds": 12.5}}
{{"twin_id": "{1}", "annotator": "cy", "dimension": "mesh", "answer": "unsure", "blind": "yes"}}
"""


def lists(folder: Path) -> None:
    (folder / "photos").mkdir()
    Image.new("RGB", (48, 40), (200, 20, 20)).save(folder / "photos" / "mug.png")
    (folder / "list.csv").write_text(LIST)
    (folder / "list.jsonl").write_text(LINES)


def catalogue(folder: Path) -> None:
    lists(folder)
    for name in ("list.csv", "list.jsonl"):
        add_inputs(folder / "catalogue.sqlite", folder / name, DefaultValues())


def listings(folder: Path) -> None:
    user = {"username": "ada", "displayName": "Ada"}
    objects = {uid: {"uid": uid, "name": "Mug", "license": "by", "user": user} for uid in ("a1" * 16, "b2" * 16)}
    models = [{"owner": "GoogleResearch", "name": "Claw_Hammer", "license_name": "Creative Commons - Attribution"}] * 2
    (folder / "000-001.json.gz").write_bytes(gzip.compress(json.dumps(objects).encode(), mtime=0))
    (folder / "000-002.json").write_text(json.dumps(objects))
    (folder / "models.json").write_text(json.dumps(models))


def take_in(case: Case) -> None:
    add_inputs(case.folder / "catalogue.sqlite", case.file, DefaultValues(source="own"))
    catalogue_status(case.folder / "catalogue.sqlite")


def use_catalogue(case: Case) -> None:
    path = case.folder / "catalogue.sqlite"
    for line in catalogue_status(path).lines():
        assert "\x1b" not in line
    command("collect", "plan", path, "-o", case.folder / "plan", "--items", 4)
    add_inputs(path, case.folder / "list.csv", DefaultValues())


def reviewed(folder: Path) -> None:
    """A data set of three twins, two of which have reviews in a store and in files."""
    dataset(folder)
    root = DatasetRoot(folder)
    first, second = [
        each for each in sorted(root.twin_ids()) if read_record(folder / root.twin_name(each)).status == "accepted"
    ][:2]
    (folder / "verdicts.csv").write_text(VERDICTS.format(first, second))
    (folder / "verdicts.jsonl").write_text(LINES_OF_VERDICTS.format(first, second))
    revision = read_record(folder / root.twin_name(first)).revision
    assert revision is not None
    said = Corrections(category="cup", mass_kg=Measure(value=0.3, low=0.2, high=0.4))
    answers = {"category": "no", "physical": "no", "grasp": "yes"}
    review = Review(annotator="ada", twin_id=first, revision=revision, answers=answers, corrections=said)  # type: ignore[arg-type]
    with ReviewStore(reviews_path(root)) as store:
        store.add([review], ["one"])
        store.put_draft("bo", second, {"answers": {"mesh": "yes"}})
        store._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    with closing(sqlite3.connect(reviews_path(root))) as closed:
        closed.execute("PRAGMA journal_mode = DELETE")


def import_verdicts(case: Case) -> None:
    read_verdicts(case.file, DatasetRoot(case.folder))


def report_reviews(case: Case) -> None:
    command("review", "report", case.folder, "--export", case.folder / "all.csv")
    command("review", "apply", case.folder, "--dry-run")
    command("review", "sample", case.folder, "--sample", 2)


def enough_to_plan(folder: Path) -> None:
    dataset(folder, accepted=5)


def plan_from_index(case: Case) -> None:
    command("plan", case.folder, "--items", 1000)


def matting_network(folder: Path) -> None:
    """A network of one convolution, whose answer is a mask."""
    graph = OnnxGraph((1, 3, 64, 64))
    weight = graph.weight("w", np.full((1, 3, 3, 3), 0.05, np.float32))
    graph.node("Conv", ["input", weight], "edges", kernel_shape=[3, 3], pads=[1, 1, 1, 1], strides=[1, 1])
    graph.node("Sigmoid", ["edges"], "mask")
    (folder / "net.onnx").write_bytes(graph.to_bytes("mask", (1, 1, 64, 64)))


def cut_out(case: Case) -> None:
    require_working(find_network(str(case.file)))


def clip(folder: Path) -> None:
    write_tiny_clip(folder)


def embed(case: Case) -> None:
    embedder = ClipFolder(case.folder)
    embedder.pictures([np.zeros((40, 50, 3), np.uint8)])
    embedder.texts(["a red mug"])


target("collect-listing", listings, take_in, files=("*.json*",), fresh=True, named=True)
target("collect-list", lists, take_in, files=("list.*",), fresh=True, named=True)
target("catalogue", catalogue, use_catalogue, files=("catalogue.sqlite",), fresh=True, weight=0.5)
target("verdicts", reviewed, import_verdicts, files=("verdicts.*",), named=True, weight=0.5)
target("reviews", reviewed, report_reviews, files=("reviews.sqlite",), fresh=True, weight=0.1)
target("plan", enough_to_plan, plan_from_index, files=("index/*", "index/*/*", "*.parquet", "index*.json"), weight=0.1)
target("matting-network", matting_network, cut_out, named=True, weight=0.02)
target("clip", clip, embed, named=True, weight=0.1)
