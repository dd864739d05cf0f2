"""Several photos of one thing: rows of a group, or --views, as one item; its cut-outs, and what a generator gets of them."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from kept_opinions import kept_opinions
from manitwin.config import BuildConfig, GenerateConfig, MattingConfig
from manitwin.engine.stage import Draft
from manitwin.engine.stage_runner import run_stage, stage_key
from manitwin.errors import Rejected, UsageError
from manitwin.formats.glb import write_glb
from manitwin.models.generators.command import CommandGenerator
from manitwin.pipeline.generate import GenerateStage, read_views
from manitwin.pipeline.item import Item, twin_id
from manitwin.pipeline.manifest import Notes, iterate_items
from manitwin.pipeline.photo import PhotosStage
from manitwin.pipeline.photo_groups import distinct_names
from manitwin.pipeline.quality import photos_checks
from manitwin.pipeline.recipe import TwinRecipe


@pytest.fixture
def photos(tmp_path: Path) -> Path:
    """A folder with front.png, side.png and back.png: cut-outs of one rectangle, of three widths."""
    for number, name in enumerate(("front", "side", "back")):
        rgba = np.zeros((96, 96, 4), np.uint8)
        rgba[20:80, 30 - 5 * number : 66, :] = (200 - 40 * number, 90, 60, 255)
        Image.fromarray(rgba).save(tmp_path / f"{name}.png")
    return tmp_path


def _listed(folder: Path, text: str, **defaults: str) -> list[Item]:
    (folder / "things.csv").write_text(text)
    return list(iterate_items([folder / "things.csv"], dict(defaults), Notes(), strict=True))


@pytest.fixture(scope="module", autouse=True)
def rules_and_the_built_in_network_asked_once() -> Iterator[None]:
    """Keep what they say of a picture: the same photos are cut out alone and in groups."""
    with kept_opinions():
        yield


def test_rows_of_a_group_become_one_item_with_what_one_of_them_says(photos: Path) -> None:
    alone, thing = _listed(
        photos,
        "file,group,turn_deg,name\nfront.png,a,350,\nback.png,,,cup\nside.png,a,80,mug\n",
        name="unsaid",
    )
    assert (alone.title, alone.name, alone.views) == ("back.png", "cup", ())
    assert (thing.title, thing.name, thing.turns_deg) == ("front.png and 1 more", "mug", (0.0, 90.0))
    assert [Path(file).name for file in thing.files] == ["front.png", "side.png"]
    assert Item.from_json(json.loads(json.dumps(thing.to_json()))) == thing
    assert "views" not in alone.to_json()  # rows of ledgers that know no views stay equal


def test_group_of_one_is_a_photo(photos: Path) -> None:
    (item,) = _listed(photos, "file,group,turn_deg\nfront.png,a,30\n")
    assert item.views == () and item.turns_deg == ()


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        (
            "file,group,name\nfront.png,a,mug\nside.png,a,cup\n",
            r"group 'a' \(rows 2, 3\).*'mug' \(row 2\).*'cup' \(row 3\)",
        ),
        ("file,group,longest_side_m\nfront.png,a,0.1\nside.png,a,0.2\n", "the same longest_side_m"),
        ("file,group,units\nfront.png,a,cm\nside.png,a,mm\n", "the same units"),
        ("file,group\nfront.png,a\nmug.obj,a\n", "mug.obj is a mesh"),
        ("file,text,group\nfront.png,,a\n,a mug,a\n", "a text is not a photo"),
        ("file,group\nfront.png,a\nfront.png,a\n", "front.png is given twice"),
        ("file,group,turn_deg\nfront.png,a,0\nside.png,a,\n", "row 3 without a turn_deg"),
        ("file,group,turn_deg\nfront.png,a,0\nside.png,a,left\n", "turn_deg is 0, left; give degrees"),
        ("file,group,turn_deg\nfront.png,a,0\nside.png,a,inf\n", "give one turn per photo"),
        ("file,turn_deg\nfront.png,90\n", "give the row a group"),
    ],
)
def test_what_cannot_be_one_thing_is_told_with_its_rows(photos: Path, rows: str, told: str) -> None:
    (photos / "mug.obj").write_text("v 0 0 0\n")
    with pytest.raises(UsageError, match=told):
        _listed(photos, rows)


def test_views_make_one_item_of_photos_and_of_nothing_else(photos: Path) -> None:
    front, side, back = (photos / f"{name}.png" for name in ("front", "side", "back"))
    (item,) = iterate_items([front, side, back], {}, Notes(), views=True, turns_deg=[0, 90, 180])
    assert item.turns_deg == (0.0, 90.0, 180.0) and len(item.files) == 3
    for inputs, texts, turns, told in (
        ([photos / "things.csv"], [], None, "give the photos"),
        ([], [], None, "no photo; give the photos"),
        ([front, side], ["a mug"], None, "a text"),
        ([front, side], [], [0.0], "2 photos and the turns 0"),
    ):
        with pytest.raises(UsageError, match=told):
            list(iterate_items(inputs, {}, Notes(), texts, views=True, turns_deg=turns))
    with pytest.raises(UsageError, match="--views too"):
        list(iterate_items([front, side], {}, Notes(), turns_deg=[0, 90]))


def test_identity_covers_all_photos_their_order_and_turns(photos: Path) -> None:
    front, side, back = (str(photos / f"{name}.png") for name in ("front", "side", "back"))
    item = Item(front, views=(side, back))
    others = (
        Item(front, views=(back, side)),
        Item(front, views=(side,)),
        Item(front),
        Item(front, views=(side, back), turns_deg=(0.0, 90.0, 180.0)),
    )
    assert len({twin_id(item), *map(twin_id, others)}) == 5
    before = twin_id(item)
    Path(back).write_bytes(Path(side).read_bytes())
    assert twin_id(item) != before


def test_a_view_that_is_a_mesh_by_its_bytes_is_refused_by_its_name(photos: Path) -> None:
    (photos / "side.png").write_bytes(write_glb([]))
    identity = TwinRecipe(BuildConfig()).identify(Item(str(photos / "front.png"), views=(str(photos / "side.png"),)))
    assert identity.kind == "photos" and identity.rejected is not None and "side.png" in identity.rejected.detail


def _cut_out(photos: Path, work: Path, **item: object) -> Draft[Item]:
    files = [str(photos / f"{name}.png") for name in ("front", "side", "back")]
    draft = Draft("t", Item(files[0], views=tuple(files[1:]), name="box", **item), seed=0)  # type: ignore[arg-type]
    run_stage(PhotosStage(MattingConfig()), draft, work)
    return draft


def test_each_photo_is_cut_out_and_the_first_stays_photo_png(photos: Path, tmp_path: Path) -> None:
    draft = _cut_out(photos, tmp_path / "work", turns_deg=(0.0, 90.0, 180.0))
    views = read_views(draft)
    assert [(view.name, view.turn_deg) for view in views] == [("front.png", 0), ("side.png", 90), ("back.png", 180)]
    assert (np.asarray(Image.open(draft.path("photo.png"))) == views[0].rgba).all()
    assert draft.field("matte")["findings"] == [] and len(draft.field("matte")["photos"]) == 3


def test_a_photo_that_cannot_be_cut_out_is_left_out_and_told(photos: Path, tmp_path: Path) -> None:
    Image.new("RGB", (96, 96), (120, 130, 140)).save(photos / "side.png")
    draft = _cut_out(photos, tmp_path / "work", turns_deg=(0.0, 90.0, 180.0))
    assert [view.turn_deg for view in read_views(draft)] == [0, 180]
    (finding,) = draft.field("matte")["findings"]
    assert finding.startswith("left out: ") and "side.png" in finding
    Image.new("RGB", (96, 96), (120, 130, 140)).save(photos / "back.png")
    draft = _cut_out(photos, tmp_path / "again")
    assert read_views(draft) == () and "front.png is the only photo" in draft.field("matte")["findings"][-1]
    Image.new("RGB", (96, 96), (120, 130, 140)).save(photos / "front.png")
    with pytest.raises(Rejected, match=r"front\.png.*side\.png.*back\.png"):
        _cut_out(photos, tmp_path / "none")


def test_photos_of_one_name_are_told_apart_by_their_folders() -> None:
    files = ["/a/left/0.png", "/a/right/0.png", "/b/right/0.png", "/a/1.png"]
    assert distinct_names(files) == ["left/0.png", "a/right/0.png", "b/right/0.png", "1.png"]


def test_a_copy_of_a_photo_is_told(photos: Path, tmp_path: Path) -> None:
    (photos / "side.png").write_bytes((photos / "front.png").read_bytes())
    folder = tmp_path / "out"
    folder.mkdir()
    files = [str(photos / f"{name}.png") for name in ("front", "side", "back")]
    draft = Draft("t", Item(files[0], name="box", views=tuple(files[1:]), turns_deg=(0.0, 90.0, 180.0)), seed=0)
    matte = PhotosStage(MattingConfig()).run(draft, folder)["matte"]
    assert "side.png: the same picture as front.png" in matte["findings"]


def test_a_generator_of_one_photo_gets_the_first_and_the_twin_says_so(photos: Path, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "import sys, trimesh\ntrimesh.creation.box().export(sys.argv[2])\n"
        "assert open(sys.argv[1], 'rb').read(4) == b'\\x89PNG'\n"
    )
    generator = CommandGenerator.from_spec(f"{sys.executable} {program} {{image}} {{out}}", BuildConfig())
    draft = _cut_out(photos, tmp_path / "work")
    stage = GenerateStage(GenerateConfig(), generator)
    one = stage_key(stage, Draft("t", draft.payload, 0, paths={"photo.png": draft.path("photo.png")}))
    assert stage_key(stage, draft) != one
    run_stage(stage, draft, tmp_path / "work")
    assert draft.field("generation")["notes"]["photos"] == {"cut_out": 3, "used": 1}
    (check,) = photos_checks(draft)
    assert (check.passed, check.value, check.limit) == (False, 1.0, 3.0) and "command takes one photo" in check.message


def test_the_twin_says_which_turns_were_estimated_and_where_the_camera_stood(photos: Path, tmp_path: Path) -> None:
    draft = _cut_out(photos, tmp_path / "work")
    used = {"photos": {"cut_out": 3, "used": 3}}
    fitted = [
        {"name": "front.png", "turn_deg": 0.0, "turn_stated": False, "colours": True, "confidence": 0.98},
        {"name": "side.png", "turn_deg": 91.6, "turn_stated": False, "colours": True, "confidence": 0.91},
        {"name": "back.png", "turn_deg": None, "turn_stated": False, "colours": False, "confidence": 0.87},
    ]
    carved = [{"name": each["name"], "turn_deg": 0.0, "turn_stated": True, "colours": True} for each in fitted]
    camera = {"elevation_deg": 27.2, "focal_of_longer_side": 4.1, "axis_share": 0.5}
    for notes, said in (
        (
            {"views": fitted},
            "turns estimated, degrees: front.png 0 (confidence 0.98), side.png 92 (confidence 0.91), back.png not told, its"
            " colours not used (confidence 0.87)",
        ),
        (
            {"views": carved, "camera": camera},
            "the camera stayed 27 degrees above the thing, its lens 4.1 longer sides",
        ),
        ({"views": carved, "camera": None}, ""),
    ):
        draft.fields["generation"] = {"generator": "lift", "notes": notes | used}
        (check,) = photos_checks(draft)
        assert check.passed and (said in check.message if said else check.message == "")


def test_a_photo_whose_outline_does_not_go_with_the_others_fails_the_check(photos: Path, tmp_path: Path) -> None:
    draft = _cut_out(photos, tmp_path / "work")
    notes = {"views": [], "left_out": ["side.png"], "photos": {"cut_out": 3, "used": 2}}
    draft.fields["generation"] = {"generator": "lift", "notes": notes}
    (check,) = photos_checks(draft)
    assert (check.passed, check.value) == (False, 2.0) and check.message.startswith("side.png: left out")
