"""The pages of scenes as the server gives them, without a browser: list, scene, its document, and what they refuse."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from access_requests import asked, header
from starlette.types import ASGIApp

from drawn_scenes import PLACES, write_scenes
from manitwin.errors import UsageError
from manitwin.robots.load import load_robot
from manitwin.scenes.scene import SCENE
from manitwin.scenes.scene_files import CONFIG, read_scene, scene_files, scene_name, write_scene
from manitwin.twin.dataset_root import twin_name
from manitwin.web.scene_document import DOCUMENT
from manitwin.web.scene_folders import SceneFolders, has_scenes
from manitwin.web.serve import application_for_place
from manitwin.web.static_pages import write_static_pages


@pytest.fixture
def scenes(tmp_path: Path) -> Path:
    return write_scenes(tmp_path)


@pytest.fixture
def app(scenes: Path, tmp_path: Path) -> ASGIApp:
    return application_for_place(str(scenes), tmp_path / "cache")


def get(app: ASGIApp, path: str) -> tuple[int, bytes]:
    messages = asked(app, path)
    return messages[0]["status"], b"".join(each.get("body", b"") for each in messages[1:])


def document(app: ASGIApp, scene_id: str) -> dict[str, Any]:
    status, body = get(app, f"/scene/{scene_id}/{DOCUMENT}")
    assert status == 200
    return dict(json.loads(body))


def rewritten(scenes: Path, **fields: Any) -> str:
    """Change fields of the first scene; returns its id."""
    file = scene_files(scenes)[0]
    write_scene(read_scene(file).model_copy(update=fields), file.parent)
    return file.parent.name


def test_the_list_leads_to_each_scene_and_from_one_to_the_next(app: ASGIApp, scenes: Path) -> None:
    first, second = (file.parent.name for file in scene_files(scenes))
    status, page = get(app, "/")
    assert status == 200 and all(f'href="/scene/{name}"'.encode() in page for name in (first, second))
    assert b"box, can, mixing bowl" in page and b"2 scenes" in page
    status, page = get(app, f"/scene/{first}")
    assert status == 200 and f'rel="next" href="/scene/{second}"'.encode() in page and b'rel="prev"' not in page
    assert f'rel="prev" href="/scene/{first}"'.encode() in get(app, f"/scene/{second}")[1]


def test_the_document_has_every_object_where_the_scene_says_and_gives_its_mesh(app: ASGIApp, scenes: Path) -> None:
    record = read_scene(scene_files(scenes)[0])
    told = document(app, record.scene_id)
    assert told["unreadable"] == [] and told["scene_id"] == record.scene_id
    assert {
        each["label"].split(": ")[1].split(",")[0]: tuple(each["position_m"]) for each in told["objects"]
    } == PLACES[0]
    for each, placed in zip(told["objects"], record.objects, strict=True):
        assert each["quaternion_wxyz"] == list(placed.quaternion_wxyz)
        assert len(told["hulls"][each["twin_id"]]) == (13 if placed.category == "mixing bowl" else 1)
        status, body = get(app, each["model"])
        assert status == 200 and body[:4] == b"glTF"
        assert get(app, f"/twin/{each['twin_id']}")[0] == 200
    assert told["furniture"] == [
        {"name": "board", "center_m": [0.5, 0.0, -0.02], "half_extents_m": [0.4, 0.5, 0.02], "color": "#b58b5a"}
    ]


def test_the_workspace_is_that_of_the_robot_or_it_is_said_that_it_is_not_known(app: ASGIApp, scenes: Path) -> None:
    space = load_robot("panda").workspace
    told = document(app, rewritten(scenes, robot="panda"))
    assert told["robot"] == {
        "name": "panda",
        "min_radius_m": space.min_radius_m,
        "max_radius_m": space.max_radius_m,
        "half_angle_rad": space.half_angle_rad,
    }
    told = document(app, rewritten(scenes, robot="nobody"))
    assert told["robot"] is None and "nobody" in told["unreadable"][0]
    assert document(app, rewritten(scenes, robot=None))["robot"] is None


def test_a_twin_that_is_gone_leaves_the_rest_of_its_scene(app: ASGIApp, scenes: Path) -> None:
    record = read_scene(scene_files(scenes)[0])
    gone = record.objects[0].twin_id
    shutil.rmtree(scenes.parent / "set" / twin_name(gone))
    told = document(app, record.scene_id)
    assert [each["model"] is None for each in told["objects"]] == [each.twin_id == gone for each in record.objects]
    assert len(told["unreadable"]) == 1 and gone in told["unreadable"][0] and gone not in told["hulls"]


def test_a_broken_scene_ends_its_own_line_and_page_only(app: ASGIApp, scenes: Path) -> None:
    broken, whole = scene_files(scenes)
    broken.write_text("{")
    status, page = get(app, "/")
    assert status == 200 and b'class="error"' in page and whole.parent.name.encode() in page
    assert get(app, f"/scene/{broken.parent.name}")[0] == 404
    assert get(app, f"/scene/{whole.parent.name}")[0] == 200


def test_nothing_beside_the_scenes_is_given(app: ASGIApp, scenes: Path) -> None:
    for path in (
        f"/scene/..%2f{CONFIG}",
        f"/scene/{CONFIG}",
        "/scene/nobody",
        f"/scene/nobody/{DOCUMENT}",
        f"/{SCENE}",
    ):
        assert get(app, path)[0] == 404, path


def test_names_of_a_scene_are_never_read_as_html(app: ASGIApp, scenes: Path) -> None:
    record = read_scene(scene_files(scenes)[0])
    hostile = "<script>alert(1)<\u200bscript>"
    objects = tuple(each.model_copy(update={"category": hostile}) for each in record.objects)
    furniture = record.furniture.model_copy(update={"kind": "<b onclick=x>"})
    scene_id = rewritten(scenes, objects=objects, furniture=furniture)
    for path in ("/", f"/scene/{scene_id}"):
        page = get(app, path)[1]
        assert b"<script>alert" not in page and b"<b onclick" not in page and b"&lt;script&gt;" in page


@pytest.mark.parametrize("start", ["-1", "99999999999999999999", "x", "1e3", "5"])
def test_a_page_that_is_not_there_is_the_first(app: ASGIApp, start: str) -> None:
    messages = asked(app, f"/?from={start}")
    assert messages[0]["status"] == 200 and header(messages, "cache-control") == "no-store"


def test_one_scene_is_shown_by_itself_and_what_is_no_scene_is_told(scenes: Path, tmp_path: Path) -> None:
    file = scene_files(scenes)[0]
    assert has_scenes(str(scenes)) and has_scenes(str(file)) and has_scenes(str(file.parent))
    assert not has_scenes(str(tmp_path)) and not has_scenes("s3://bucket/scenes")
    alone = asked(application_for_place(str(file.parent), tmp_path / "cache"), "/")
    assert alone[0]["status"] == 303 and header(alone, "location") == f"/scene/{file.parent.name}"
    with pytest.raises(UsageError, match="no scene there"):
        SceneFolders(str(tmp_path), tmp_path / "cache")
    moved = tmp_path / "moved" / scene_name(file.parent.name)
    shutil.copytree(file.parent, moved)
    with pytest.raises(UsageError, match="which data set"):
        SceneFolders(str(moved), tmp_path / "cache")


def test_plain_files_have_list_scenes_and_their_twins(scenes: Path, tmp_path: Path) -> None:
    done = write_static_pages(str(scenes), tmp_path / "pages")
    pages = sorted((tmp_path / "pages" / "scenes").glob("*/index.html"))
    assert done.scenes == len(pages) > 1 and done.left_out == {} and done.twins >= 1
    assert (tmp_path / "pages" / "index.html").read_text().count('href="scenes/') == len(pages)
    for page in (*pages, tmp_path / "pages" / "index.html"):
        for named in re.findall(r'(?:src|href)="([^"#:]+)"', page.read_text()):
            assert (page.parent / named).is_file(), named
    script = (pages[0].parent / "scene_view.js").read_text()
    name, told = script.split("??={})[", 1)[1].split("]=", 1)
    assert json.loads(name) == f"scenes/{pages[0].parent.name}/scene_view.json"
    models = {each["model"] for each in json.loads(told.rstrip(";\n"))["objects"]}
    assert all((tmp_path / "pages" / f"{model.removeprefix('../../')}.js").is_file() for model in models)
    assert str(scenes) not in script
    for path in (tmp_path / "pages").rglob("*.html"):
        assert "All twins" not in path.read_text(), "there is no gallery"


def test_plain_files_leave_out_a_scene_without_its_twins_and_no_page_leads_to_it(scenes: Path, tmp_path: Path) -> None:
    folders = SceneFolders(str(scenes), tmp_path / "cache")
    first, others = folders.scene(folders.ids[0]), [folders.scene(each) for each in folders.ids[1:]]
    gone = {each.twin_id for each in first.objects}
    stay = [each.scene_id for each in others if not gone & {thing.twin_id for thing in each.objects}]
    for twin_id in gone:
        shutil.rmtree(folders.twins.folder(twin_id))
    done = write_static_pages(str(scenes), tmp_path / "pages")
    assert done.scenes == len(stay) and set(done.left_out) == set(folders.ids) - set(stay)
    assert first.scene_id not in "".join(path.read_text() for path in (tmp_path / "pages").rglob("*.html"))
