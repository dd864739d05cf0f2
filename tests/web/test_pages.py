"""The pages as the server gives them, without a browser: what they say, what they refuse, and that nothing is read as HTML."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

import fsspec
import numpy as np
import pytest
from access_requests import asked, header
from starlette.applications import Starlette
from typer.testing import CliRunner
from viewed_twins import HOSTILE

from manitwin.cli.main import app as command
from manitwin.dataset.index.part_list import PARTS
from manitwin.errors import Unavailable, UsageError
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.web import served_files
from manitwin.web.application import application
from manitwin.web.gallery_page import gallery_page
from manitwin.web.gallery_query import PAGE_CARDS, Gallery, GalleryPage, View
from manitwin.web.gripper_shapes import gripper_shape
from manitwin.web.links import ServerLinks
from manitwin.web.package_files import classic_script, package_file
from manitwin.web.served_files import TwinFolders
from manitwin.web.static_pages import write_static_pages
from manitwin.web.twin_document import document_bytes, twin_document

Viewed = tuple[Path, list[str]]


@pytest.fixture(scope="module")
def app(viewed: Viewed) -> Starlette:
    return application(Gallery(DatasetRoot(viewed[0])), TwinFolders(str(viewed[0])), "set")


def get(app: Starlette, path: str) -> tuple[int, str, list[dict[str, Any]]]:
    messages = asked(app, path)
    return messages[0]["status"], b"".join(each.get("body", b"") for each in messages[1:]).decode("latin-1"), messages


def names(page: str) -> list[str]:
    return [unescape(each) for each in re.findall(r'class="name">(.*?)</span>', page)]


def test_the_gallery_shows_what_its_address_asks_for(app: Starlette) -> None:
    status, page, _ = get(app, "/")
    assert status == 200 and len(names(page)) == 3 and "accepted <b>3</b>" in page and "rejected <b>1</b>" in page
    for query, found in {
        "q=kettle": ["kettle"],
        "q=A+KETTLE": ["kettle"],
        "q=kettle+can": [],
        "category=can": ["can"],
        "longest_max=0.1&sort=-mass_kg&category=kettle": ["kettle"],
        "mass_min=0.34": ["can"],
        "verified_min=99": [],
        "where=category+in+('can','kettle')&sort=name": ["can", "kettle"],
        "status=rejected&reason=several_objects": ["thing"],
        "status=rejected&stage=input": [],
    }.items():
        status, page, _ = get(app, f"/?{query}")
        assert (status, names(page)) == (200, found), query


@pytest.mark.parametrize(
    ("query", "said"),
    [
        ("mass_min=heavy", "no number"),
        ("mass_min=nan", "no number"),
        ("colour=red", "filter 'colour'"),
        ("where=no_such_column+%3E+1", "no_such_column"),
        ("where=1%3B+drop+table+twins", "condition"),
        ("where=exists(from+read_text('/etc/passwd'))", "functions that make tables"),
        ("sort=secret", "order 'secret'"),
        ("status=both", "status 'both'"),
        ("page=0", "1 or more"),
        ("q=" + "x" * 3000, "at most"),
    ],
)
def test_what_cannot_be_asked_is_said_on_the_page(app: Starlette, query: str, said: str) -> None:
    status, page, _ = get(app, f"/?{query}")
    assert status == 400 and said in unescape(page) and 'role="alert"' in page and "/etc/passwd:" not in page


def test_of_a_twin_that_is_not_there_the_page_names_what_helps(app: Starlette) -> None:
    status, page, _ = get(app, "/twin/0123456789abcdef")
    assert status == 404 and "write the index again (manitwin index)" in page and "--twins" not in page


def test_a_condition_that_cannot_be_used_is_still_in_its_field_and_so_are_the_others(app: Starlette) -> None:
    status, page, _ = get(app, "/?q=kettle&category=can&mass_min=0.1234567&where=mass_kg+%3E+and")
    assert status == 400 and len(names(page)) == 3, "all twins"
    for field in ('name="where" spellcheck="false" autocomplete="off" value="mass_kg &gt; and"', 'name="q" value="kettle"',
                  '<option value="can" selected>', 'value="0.1234567"'):  # fmt: skip
        assert field in page, field


@pytest.mark.parametrize("mass_min", [0.25, 0.1234567, 1234567.5, 1e-7])
def test_an_address_written_from_a_view_reads_as_the_same_view(mass_min: float) -> None:
    view = View(q="a b&c", category="mug", mass_min=mass_min, where="mass_kg < 1", sort="-verified", page=3)
    assert View.from_url_fields(dict(parse_qsl(view.query()))) == view
    assert View().query() == "" and view.query(page=1).count("page") == 0


def test_pages_are_numbered_and_lead_to_each_other() -> None:
    row = dict.fromkeys(
        ("twin_id", "revision", "name", "category", "material", "caption"), "x"
    ) | {"longest_m": 0.1, "mass_kg": 1.0, "simulated": None, "robustness_median": None}  # fmt: skip
    counts = {"accepted": 100_000, "rejected": 0}
    found = GalleryPage(View(page=7, q="mug"), [row], 20 * PAGE_CARDS, counts, {"mug": 9}, {}, {})
    page = unescape(gallery_page(found, "set", ServerLinks()))
    numbers = re.findall(r'href="/\?q=mug(?:&page=(\d+))?"[^>]*>([\d,]+)<', page)
    assert numbers == [("", "1"), ("5", "5"), ("6", "6"), ("7", "7"), ("8", "8"), ("9", "9"), ("20", "20")]
    assert 'rel="prev" href="/?q=mug&page=6"' in page and "960 of 100,000 accepted twins, page 7 of 20" in page
    last = gallery_page(replace(found, view=View(page=20)), "set", ServerLinks())
    assert 'rel="next"' not in last


def test_no_text_of_a_twin_is_read_as_html(app: Starlette, viewed: Viewed) -> None:
    for path in ("/", f"/twin/{viewed[1][0]}"):
        _, page, _ = get(app, path)
        assert "<script>document" not in page and "<img src=x" not in page and "\u202e" not in page
        assert "&lt;script&gt;" in page
        assert not re.findall(r"<script(?![^>]* src=)|<[^>]*\s(?:on\w+|style)=", page), "nothing inline"


def test_a_twins_page_says_each_number_with_its_interval_and_source(app: Starlette, viewed: Viewed) -> None:
    _, page, _ = get(app, f"/twin/{viewed[1][1]}")
    record = Twin(viewed[0] / twin_name(viewed[1][1])).record
    assert record.physical is not None
    mass = record.physical.mass_kg
    row = re.search(r'<th scope="row">mass</th>(.*?)</tr>', page)
    assert row is not None and all(
        said in row[1] for said in (f"{mass.value:.3g}", f"{mass.low:.3g}", f"{mass.high:.3g}", mass.source)
    )
    for said in ("friction, static", "centre of mass", "Placements", "Quality checks", "Stages", "CC-BY-4.0", "Ada"):
        assert said in page
    assert page.count("views/rgb_00.webp") == 1 and page.count("views/marked_00.webp") == 1


def test_a_rejected_twin_says_why(app: Starlette, viewed: Viewed) -> None:
    status, page, _ = get(app, f"/twin/{viewed[1][3]}")
    assert status == 200 and "several objects" in page and "two objects" in page and "three.js" not in page


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/twin/ID/visual.glb", 200),
        ("/twin/ID/views/rgb_00.webp?r=0", 200),
        ("/twin/ID/twin.json", 200),
        ("/twin/ID/views/rgb_07.webp", 422),  # a name of the list that this twin has not
        ("/twin/ID/source.png", 422),
        ("/twin/ID/run.json", 404),
        ("/twin/ID/grasps.parquet", 404),
        ("/twin/ID/source.obj", 404),
        ("/twin/ID/../../../index/parts.json", 404),
        ("/twin/ID/views/../twin.json", 404),
        ("/twin/../ID/visual.glb", 404),
        ("/twin/..", 404),
        ("/twin/.", 404),
        ("/twin/index", 404),
        ("/twin/\x00", 404),
        ("/static/../access.py", 404),
        ("/static/access.py", 404),
        ("/static/twin_viewer.js", 200),
        ("/etc/passwd", 404),
    ],
)
def test_only_files_of_the_list_are_given(app: Starlette, viewed: Viewed, path: str, status: int) -> None:
    found, body, _ = get(app, path.replace("ID", viewed[1][1]))
    assert found == status and "root:" not in body


def test_links_pipes_and_huge_files_are_not_given(
    viewed: Viewed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "twin"
    shutil.copytree(viewed[0] / twin_name(viewed[1][1]), folder)
    app = application(None, TwinFolders(str(folder)), "one")
    (secret := tmp_path / "secret.webp").write_text("secret")
    (folder / "views" / "rgb_01.webp").symlink_to(secret)
    os.mkfifo(folder / "views" / "rgb_02.webp")
    page = f"/twin/{viewed[1][1]}"
    assert header(get(app, "/")[2], "location") == page and get(app, f"/twin/{viewed[1][0]}")[0] == 404
    for name in ("views/rgb_01.webp", "views/rgb_02.webp"):
        status, body, _ = get(app, f"{page}/{name}")
        assert status == 422 and "secret" not in body.replace("secret.webp", "")
    (folder / "visual.glb").write_bytes(b"glTF broken")
    status, body, _ = get(app, f"{page}/visual.glb")
    assert status == 200 and body == "glTF broken", "a broken file is the browser's to judge"
    monkeypatch.setattr(served_files, "MOST_BYTES", 5)
    status, body, _ = get(app, f"{page}/visual.glb")
    assert status == 422 and "5 at most" in body


def test_a_twin_that_is_damaged_ends_its_own_page_alone(viewed: Viewed, tmp_path: Path) -> None:
    folder = tmp_path / "twin"
    shutil.copytree(viewed[0] / twin_name(viewed[1][1]), folder)
    app = application(None, TwinFolders(str(folder)), "one")
    (folder / "collision" / "hull_00.obj").write_text("v 1 2 nonsense\nf 1 2 3\n")
    (folder / "grasps.parquet").write_bytes(b"PAR1")
    status, body, _ = get(app, f"/twin/{viewed[1][1]}/viewer.json")
    told = json.loads(body)
    assert (
        status == 200 and len(told["unreadable"]) == 2 and told["points"] and not told["hulls"] and not told["grasps"]
    )
    (folder / "twin.json").write_text("{")
    assert get(app, f"/twin/{viewed[1][1]}")[0] == 422


def test_the_document_has_the_poses_of_the_table(viewed: Viewed) -> None:
    twin = Twin(viewed[0] / twin_name(viewed[1][0]))
    document = json.loads(document_bytes(twin_document(twin)))
    grasps, table = document["grasps"]["panda"], twin.grasp_table().to_pydict()
    assert sorted(grasps["id"]) == sorted(table["grasp_id"]) and grasps["total"] == 6
    for place, name in enumerate(grasps["id"]):
        row = table["grasp_id"].index(name)
        np.testing.assert_allclose(grasps["position_m"][3 * place : 3 * place + 3], table["position_m"][row], atol=1e-5)
        np.testing.assert_allclose(
            grasps["quaternion_wxyz"][4 * place : 4 * place + 4], table["quaternion_wxyz"][row], atol=1e-5
        )
    vertices = np.reshape(document["hulls"][0]["vertices"], (-1, 3))
    np.testing.assert_allclose(np.ptp(vertices, axis=0), document["extents_m"], atol=1e-4)
    assert document_bytes(twin_document(twin)) == document_bytes(document)
    labels = [point["label"] for point in document["points"] if point["kind"] == "functional"]
    assert any(HOSTILE in label for label in labels), "it is shown as text"


@pytest.mark.parametrize("name", ["panda", "robotiq_2f85"])
def test_a_hand_opens_as_its_definition_says(name: str) -> None:
    width, shape = 0.05, gripper_shape(name, 0.002, 0.1)
    for box, (pose, half) in zip(shape["hand"], load_gripper(name).boxes(width), strict=True):
        center = np.add(box["center"], [box["shift"] * width, 0, 0])
        np.testing.assert_allclose(center, pose[:3, 3], atol=1e-9)
        np.testing.assert_allclose(rotation_from_quaternion_wxyz(np.array(box["quaternion"])), pose[:3, :3], atol=1e-9)
        assert box["half"] == pytest.approx(half)
    fingers = [box for box in shape["fork"] if box["shift"]]
    inner = [abs(box["center"][0] + box["shift"] * width) - box["half"][0] for box in fingers]
    assert inner == pytest.approx([width / 2] * 2), "the rods touch what the fingers touch"


def test_grippers_of_other_kinds_and_strangers_are_drawn_as_well() -> None:
    assert gripper_shape("suction", 0.002, 0.1)["fork"] and gripper_shape("allegro", 0.002, 0.1)["hand"]
    stranger = gripper_shape("somebody's", 0.002, 0.12)
    assert not stranger["known"] and max(b["center"][2] + b["half"][2] for b in stranger["fork"]) == pytest.approx(0.12)


def test_three_js_comes_out_of_nicegui_as_a_script_with_its_licence() -> None:
    script = package_file("three.js").decode()
    assert script.startswith("(()=>{") and "Three.js Authors" in script[:300] and "\nexport{" not in script[-3000:]
    assert re.search(r"globalThis\.threeBundle=\{THREE:\w+,GLTFLoader:\w+,OrbitControls:\w+\}", script[-300:])
    assert b"MIT License" in package_file("three.LICENSE.txt")
    with pytest.raises(Unavailable, match="packages of"):
        classic_script("const a=1;export{a as THREE};")
    with pytest.raises(KeyError):
        package_file("../access.py")


def test_a_data_set_without_an_index_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="not a data set"):
        Gallery(DatasetRoot(tmp_path))


def test_an_index_that_was_written_anew_is_read_anew(viewed: Viewed, tmp_path: Path) -> None:
    root = tmp_path / "set"
    shutil.copytree(viewed[0], root)
    gallery = Gallery(DatasetRoot(root))
    assert gallery.find(View()).total == 3
    parts = json.loads((root / PARTS).read_bytes())
    (root / PARTS).write_text(json.dumps({**parts, "parts": []}))
    found = gallery.find(View())
    assert found.total == 0 and found.counts == {"accepted": 0, "rejected": 0} and not found.categories


def test_plain_files_are_whole_and_the_same_again(viewed: Viewed, tmp_path: Path) -> None:
    root, (mug, kettle, can, rejected) = viewed
    done = write_static_pages(str(root), tmp_path / "out", where="category <> 'kettle'")
    assert (done.twins, done.left_out) == (2, {})
    index = (tmp_path / "out" / "index.html").read_text()
    assert mug in index and can in index and kettle not in index and rejected not in index
    for page in (tmp_path / "out").rglob("*.html"):
        assert "Shift T" not in page.read_text(), "no trial can be played, and no key says so"
        said = re.findall(r'(?:src|href)="([^"]*)"', page.read_text())
        assert said and not [
            place for place in said if not place.startswith("data:") and not (page.parent / place).exists()
        ]
        assert str(tmp_path) not in page.read_text() and str(root) not in page.read_text()
    folder = tmp_path / "out" / "twins" / mug
    said = (folder / "viewer.js").read_text()
    name, document = said.removeprefix("(globalThis.manitwinFiles??={})[").rstrip(";\n").split("]=", 1)
    assert json.loads(name) == f"twins/{mug}/viewer.json" and json.loads(document)["twin_id"] == mug
    name, model = (folder / "visual.glb.js").read_text().split('"')[1::2]
    assert name == f"twins/{mug}/visual.glb" and "Play trial" not in (folder / "index.html").read_text()
    assert base64.b64decode(model) == (root / twin_name(mug) / "visual.glb").read_bytes()
    write_static_pages(str(root), tmp_path / "again", where="category <> 'kettle'")
    for path in (tmp_path / "out").rglob("*.*"):
        if path.is_file():
            assert path.read_bytes() == (tmp_path / "again" / path.relative_to(tmp_path / "out")).read_bytes()


def test_trials_of_plain_files_are_those_of_the_first_grasps(viewed: Viewed, tmp_path: Path) -> None:
    root, (_, kettle, _, _) = viewed
    for out in ("out", "again"):
        write_static_pages(str(root / twin_name(kettle)), tmp_path / out, trials=2)
    folder = tmp_path / "out" / "twins" / kettle
    scripts = (folder / "trials.js").read_text().splitlines()
    page = (folder / "index.html").read_text()
    assert len(scripts) == 2 and "Play trial" in page and "Shift T" in page
    shown = json.loads((folder / "viewer.js").read_text().split("]=", 1)[1].rstrip(";\n"))["grasps"]["panda"]["id"]
    for script, grasp in zip(scripts, shown, strict=False):
        name, document = script.removeprefix("(globalThis.manitwinFiles??={})[").rstrip(";").split("]=", 1)
        assert json.loads(name) == f"twins/{kettle}/trial.json?gripper=panda&grasp={grasp}"
        assert json.loads(document)["outcome"] == "held"
    assert (tmp_path / "again" / "twins" / kettle / "trials.js").read_text().splitlines() == scripts


def test_plain_files_are_of_a_sample_and_leave_out_what_is_damaged(viewed: Viewed, tmp_path: Path) -> None:
    root = tmp_path / "set"
    shutil.copytree(viewed[0], root)
    (root / twin_name(viewed[1][0]) / "collision" / "hull_00.obj").write_text("v nonsense\n")
    done = write_static_pages(str(root), tmp_path / "out")
    assert done.twins == 2 and list(done.left_out) == [viewed[1][0]]
    model = root / twin_name(viewed[1][1]) / "visual.glb"
    model.write_bytes(model.read_bytes()[:-9])
    done = write_static_pages(str(root), tmp_path / "cut")
    assert done.twins == 1 and "visual.glb: altered or cut off" in done.left_out[viewed[1][1]]
    drawn = [write_static_pages(str(viewed[0]), tmp_path / f"s{n}", sample=1, seed=n % 2) for n in range(4)]
    assert {each.twins for each in drawn} == {1}
    kept = [sorted(path.name for path in (tmp_path / f"s{n}" / "twins").iterdir()) for n in range(4)]
    assert kept[:2] == kept[2:]
    one = write_static_pages(str(viewed[0] / twin_name(viewed[1][1])), tmp_path / "one")
    assert one.twins == 1 and "kettle" in (tmp_path / "one" / "index.html").read_text()
    for place, where, said in (
        (root, "category = 'shoe'", "no accepted twin"),
        (root / twin_name(viewed[1][3]), "", "no accepted twin"),
        (root, "1; drop table twins", "condition"),
        (root / twin_name(viewed[1][1]), "mass_kg < 1", "is one twin"),
    ):
        with pytest.raises(UsageError, match=said):
            write_static_pages(str(place), tmp_path / "none", where=where)
    assert not (tmp_path / "none").exists()


def test_a_data_set_at_a_url_is_shown_from_copies(viewed: Viewed, tmp_path: Path) -> None:
    place = "memory://viewed/set"
    fs = fsspec.filesystem("memory")
    fs.put(str(viewed[0]), "/viewed/set", recursive=True)
    try:
        app = application(Gallery(DatasetRoot(place)), TwinFolders(place, tmp_path / "cache"), "set")
        assert len(names(get(app, "/")[1])) == 3
        assert get(app, f"/twin/{viewed[1][1]}")[0] == 200
        assert get(app, f"/twin/{viewed[1][1]}/card.png")[0] == 200 and get(app, "/twin/..")[0] == 404
        done = write_static_pages(place, tmp_path / "out")
        assert (done.twins, done.left_out) == (3, {})
    finally:
        fs.rm("/viewed", recursive=True)


def test_the_command_writes_plain_files_and_says_so(viewed: Viewed, tmp_path: Path) -> None:
    runner = CliRunner()
    done = runner.invoke(command, ["view", str(viewed[0]), "--static", str(tmp_path / "out"), "--sample", "2"])
    assert done.exit_code == 0 and done.stdout.startswith("2 twins, "), done.output
    done = runner.invoke(command, ["view", str(viewed[0]), "--static", str(tmp_path / "no"), "--twins", str(viewed[0])])
    assert isinstance(done.exception, UsageError) and "there are none" in str(done.exception)
    done = runner.invoke(command, ["view", str(viewed[0]), "--sample", "2"])
    assert isinstance(done.exception, UsageError) and "--static" in str(done.exception)
