"""The pages in a real Chromium, driven as a person would, from a server in a process of its own."""

from __future__ import annotations

import http.server
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from served_view import Served, serving

from manitwin.twin.dataset_root import twin_name
from manitwin.web.serve import BETWEEN_LINKS_S
from manitwin.web.static_pages import write_static_pages

pytestmark = [pytest.mark.slow, pytest.mark.browser]
Visitor = Callable[..., Any]
Viewed = tuple[Path, list[str]]


@pytest.fixture(scope="module")
def served(viewed: Viewed) -> Iterator[Served]:
    with serving(viewed[0]) as server:
        yield server


@pytest.fixture
def inside(served: Served, visitor: Visitor) -> Visitor:
    """Return a visitor who is in, by a call."""

    def come(**how: Any) -> Any:
        page = visitor(**how)
        time.sleep(BETWEEN_LINKS_S + 0.1)  # for one that comes again sooner there is no new link
        served.link = served.link if page.goto(served.link).status == 200 else served.next_link()
        if page.url.rstrip("/") != served.address:
            assert page.goto(served.link).status == 200
        page.errors.clear()  # a link that was used before
        return page

    return come


def ready(page: Any) -> Any:
    page.wait_for_selector("#viewer[data-ready]", timeout=30_000)
    return page


def left_the_machine(page: Any, address: str) -> list[str]:
    return [url for url in page.requests if not url.startswith((address, "blob:", "data:"))]


def test_a_person_finds_a_twin_looks_at_it_and_hands_on_the_view(
    served: Served, inside: Visitor, viewed: Viewed
) -> None:
    page = inside()
    page.get_by_label("Words").fill("kettle")
    page.keyboard.press("Enter")
    page.wait_for_url("**/?q=kettle*")
    assert page.locator(".card").count() == 1
    page.locator(".card a").click()
    ready(page)
    assert "Drag to turn" in page.inner_text(".said") and page.inner_text(".controls output") == "6 of 6"
    stage = page.locator(".stage")
    stage.focus()
    for key in ("h", "g", "ArrowLeft", "ArrowUp", "l", "n"):
        page.keyboard.press(key)
    assert page.is_checked("[data-layer=hulls]") and not page.is_checked("[data-layer=grasps]")
    assert page.locator("[data-control=placement]").input_value() == "0"
    page.keyboard.press("g")
    page.keyboard.press("n")
    assert "held" in page.inner_text(".said")
    link = page.url
    again = page.context.new_page()
    again.goto(link)
    ready(again)
    assert again.is_checked("[data-layer=hulls]") and again.url.split("from=")[1] == link.split("from=")[1]
    assert again.locator("[data-control=placement]").input_value() == "0"
    assert left_the_machine(page, served.address) == [] and page.errors == []


def test_pointing_at_a_point_tells_its_name(inside: Visitor, served: Served, viewed: Viewed) -> None:
    page = inside()
    page.goto(f"{served.address}/twin/{viewed[1][1]}#layers=mass&from=0.001 -0.5 0.05 0 0 0.05")
    ready(page)
    box = page.locator(".stage").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.wait_for_selector(".tip:not([hidden])")
    assert page.inner_text(".tip") == "centre of mass"
    page.keyboard.press("Escape")
    page.locator("[data-layer=cube]").check()
    page.mouse.move(box["x"] + box["width"] / 2 + 1, box["y"] + box["height"] / 2)
    assert page.inner_text(".tip") == "centre of mass"
    page.mouse.move(box["x"] + 20, box["y"] + 20)
    assert page.locator(".tip").is_hidden(), "the cube is told where it is, and nowhere else"


def test_a_small_point_is_met_from_nearby_and_the_end_of_a_drag_is_no_click(
    inside: Visitor, served: Served, viewed: Viewed
) -> None:
    page = inside()
    points = page.request.get(f"{served.address}/twin/{viewed[1][1]}/viewer.json").json()["points"]
    point = next(each for each in points if each["kind"] == "functional")
    at = point["position_m"]
    for away, name in ((0.4, point["id"]), (-0.4, None)):  # from outside, and from behind the object
        eye = [a + away * (0.8 * n + s) for a, n, s in zip(at, point["normal"], (0.6, 0, 0), strict=True)]
        page.goto("about:blank")
        page.goto(f"{served.address}/twin/{viewed[1][1]}#layers=mesh+functional&from={'+'.join(map(str, [*eye, *at]))}")
        ready(page)
        page.evaluate("document.addEventListener('twin:picked', ({ detail }) => (window.picked = detail))")
        box = page.locator(".stage").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.click(x + 5, y + 3)
        assert page.evaluate("window.picked") == name
    page.evaluate("delete window.picked")
    page.mouse.move(x - 60, y)
    page.mouse.down()
    page.mouse.move(x, y, steps=4)
    page.mouse.up()
    assert page.evaluate("window.picked ?? null") is None


def test_a_caption_with_a_script_stays_a_text(inside: Visitor, served: Served, viewed: Viewed) -> None:
    page = inside()
    page.goto(f"{served.address}/twin/{viewed[1][0]}")
    ready(page)
    page.wait_for_timeout(300)
    assert "<script>document.title='owned'" in page.title() and page.title() != "owned"
    assert page.locator("main script, header script, img[src=x]").count() == 0 and page.errors == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280])
def test_no_page_is_wider_than_the_screen(
    inside: Visitor, served: Served, viewed: Viewed, width: int, scheme: str
) -> None:
    page = inside(viewport={"width": width, "height": 844}, color_scheme=scheme)
    for path in ("/", "/?status=rejected", f"/twin/{viewed[1][0]}", f"/twin/{viewed[1][3]}"):
        page.goto(served.address + path)
        assert page.evaluate("document.documentElement.scrollWidth") <= width, path
        dark = page.evaluate("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)"
        assert dark == (scheme == "dark")


def test_who_has_no_cookie_and_other_names_of_the_server_get_nothing(
    served: Served, inside: Visitor, visitor: Visitor, viewed: Viewed
) -> None:
    inside()
    stranger = visitor()
    for path in ("/", f"/twin/{viewed[1][0]}", f"/twin/{viewed[1][0]}/visual.glb", "/static/three.js"):
        assert stranger.goto(served.address + path).status == 403
    rebound = visitor()
    assert rebound.goto(served.address.replace("127.0.0.1", "evil.example")).status == 403


def test_a_page_of_another_origin_reads_nothing_with_the_cookie_of_who_is_in(
    served: Served, inside: Visitor, viewed: Viewed, tmp_path: Path
) -> None:
    (tmp_path / "index.html").write_text("<p>elsewhere</p>")

    def folder(*arguments: Any) -> http.server.SimpleHTTPRequestHandler:
        return http.server.SimpleHTTPRequestHandler(*arguments, directory=str(tmp_path))

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), folder) as other:
        threading.Thread(target=other.serve_forever, daemon=True).start()
        page = inside()
        page.goto(f"http://localhost:{other.server_port}/index.html")
        tried = page.evaluate(
            """async (address) => {
                const asked = (how) => fetch(address + "/", how).then((a) => a.text(), () => "refused");
                const image = new Promise((done) => {
                    const img = new Image();
                    img.onload = () => done("shown");
                    img.onerror = () => done("refused");
                    img.src = address + "/twin/ID/card.png";
                });
                const socket = new Promise((done) => {
                    const ws = new WebSocket(address.replace("http", "ws") + "/");
                    ws.onopen = () => done("open");
                    ws.onerror = () => done("refused");
                });
                return [await asked({ credentials: "include" }), await asked({ credentials: "include", mode: "no-cors" }),
                        await image, await socket];
            }""".replace("ID", viewed[1][1]),
            served.address,
        )
        assert tried == ["refused"] * 4
        other.shutdown()


def test_a_broken_and_a_huge_model_end_neither_the_page_nor_the_server(
    visitor: Visitor, viewed: Viewed, tmp_path: Path
) -> None:
    root = tmp_path / "set"
    shutil.copytree(viewed[0], root)
    broken, huge = (root / twin_name(identity) / "visual.glb" for identity in viewed[1][:2])
    broken.write_bytes(b"glTF" + bytes(2000))
    with huge.open("wb") as stream:
        stream.truncate(3 << 30)
    with serving(root) as server:
        page = visitor()
        page.goto(server.link)
        page.goto(f"{server.address}/twin/{viewed[1][0]}")
        ready(page)
        assert "visual.glb cannot be shown" in page.inner_text(".said")
        page.goto(f"{server.address}/twin/{viewed[1][1]}")
        ready(page)
        assert "3,221,225,472 bytes" in page.inner_text(".said") and page.inner_text(".controls output") == "6 of 6"
        page.goto(f"{server.address}/twin/{viewed[1][2]}")
        ready(page)
        assert "Drag to turn" in page.inner_text(".said")


def test_one_twin_is_shown_by_itself(visitor: Visitor, viewed: Viewed) -> None:
    with serving(viewed[0] / twin_name(viewed[1][2])) as server:
        page = visitor()
        page.goto(server.link)
        assert page.url.endswith(f"/twin/{viewed[1][2]}")
        ready(page)
        assert page.locator("text=All twins").count() == 0


def test_plain_files_open_from_the_disk(visitor: Visitor, viewed: Viewed, tmp_path: Path) -> None:
    write_static_pages(str(viewed[0]), tmp_path / "out")
    page = visitor()
    page.goto((tmp_path / "out" / "index.html").as_uri())
    for words, count in (("a kettle.", 1), ("hold", 0), ("cm", 0), ("no such words", 0)):  # captions, and no headings
        page.fill("#find", words)
        assert page.inner_text("#count") == f"{count} of 3 with these words", words
    page.fill("#find", "kettle")
    assert page.locator(".card:visible").count() == 1 and page.inner_text("#count") == "1 of 3 with these words"
    page.locator(".card a:visible").click()
    ready(page)
    assert "Drag to turn" in page.inner_text(".said") and page.inner_text(".controls output") == "6 of 6"
    page.goto((tmp_path / "out" / "twins" / viewed[1][0] / "index.html").as_uri())
    ready(page)
    assert page.title() != "owned" and page.errors == []
    assert left_the_machine(page, "file://") == []


def test_the_trial_of_a_chosen_grasp_is_played_back_and_its_moment_is_a_link(
    inside: Visitor, served: Served, viewed: Viewed
) -> None:
    page = inside()
    page.goto(f"{served.address}/twin/{viewed[1][1]}")
    ready(page)
    page.locator(".stage").focus()
    page.keyboard.press("n")
    page.keyboard.press("t")
    page.wait_for_selector(".trial output:text-matches('slide: held')", timeout=60_000)
    assert page.is_disabled("[data-control=placement]") and "by sapien: held" in page.inner_text(".said")
    told = page.request.get(f"{served.address}/twin/{viewed[1][1]}/trial.json?gripper=panda&grasp=panda-0000").json()
    first = {each["label"]: told["time_s"][each["first"]] for each in told["phases"]}
    assert list(first) == ["open", "close", "lift", "hold", "slide"] and told["time_s"][-1] > first["slide"]
    lifted = f"{(first['lift'] + first['hold']) / 2:.2f}"  # a trial that is brief lasts as long as it needs
    page.locator("[data-trial=time]").fill(lifted)
    assert page.inner_text(".trial output") == f"{lifted} s, lift" and f"trial={lifted}" in page.url
    again = page.context.new_page()
    again.goto(page.url)
    ready(again)
    again.wait_for_selector(f".trial output:text-is('{lifted} s, lift')", timeout=60_000)
    page.keyboard.press("Shift+T")
    page.locator(".stage").focus()
    page.keyboard.press("Shift+T")
    assert page.is_enabled("[data-control=placement]") and "trial=" not in page.url
    assert left_the_machine(page, served.address) == [] and page.errors == []
