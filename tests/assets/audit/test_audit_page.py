"""The page of an audit: what it says, what it shows of the worst, and that it is the same at every call."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh
from made_mug import clean, shape, textured, write_urdf
from PIL import Image
from typer.testing import CliRunner

from manitwin.assets.asset import Asset
from manitwin.assets.audit.finding import Audited, Finding
from manitwin.assets.audit.picture import PANEL_PX, asset_picture, audited_picture
from manitwin.assets.audit.rules import RULES
from manitwin.cli.main import app
from manitwin.formats.meshes.textures import make_part, pbr_material
from manitwin.web.audit_page import MOST_SHOWN, audit_page, shown_assets

PLACEHOLDER = '<mass value="0.3"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'


def panels(png: bytes | None) -> tuple[np.ndarray, np.ndarray]:
    """Where anything is drawn in the two panels: ``(P, P) bool`` each."""
    assert png is not None
    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)
    assert pixels.shape == (PANEL_PX, 2 * PANEL_PX, 3)
    drawn = np.abs(pixels - pixels[0, 0]).max(-1) > 8
    return drawn[:, :PANEL_PX], drawn[:, PANEL_PX:]


def box(extents: tuple[float, float, float]) -> trimesh.Trimesh:
    return trimesh.creation.box(extents)


def of_boxes(seen: tuple[float, float, float] | None, felt: tuple[float, float, float] | None, up: str = "z") -> Asset:
    visual = () if seen is None else (textured(box(seen)),)
    collision = () if felt is None else (shape("box", np.asarray(box(felt).vertices)),)
    return replace(clean(), visual=visual, collision=collision, up=up)  # type: ignore[arg-type]


def test_picture_shows_what_is_seen_beside_what_collides_at_one_scale() -> None:
    seen, felt = panels(asset_picture(of_boxes((0.2, 0.2, 0.2), (0.1, 0.1, 0.1))))
    assert 0.2 < felt.sum() / seen.sum() < 0.3  # half as long, a quarter of the area
    seen, felt = panels(asset_picture(of_boxes((0.2, 0.2, 0.2), None)))
    assert seen.any() and not felt.any()


def test_picture_stands_upright_for_both_up_axes() -> None:
    tall, _ = panels(asset_picture(of_boxes((0.05, 0.05, 0.3), None)))
    turned, _ = panels(asset_picture(of_boxes((0.05, 0.3, 0.05), None, up="y")))
    for drawn in (tall, turned):
        rows, columns = np.flatnonzero(drawn.any(1)), np.flatnonzero(drawn.any(0))
        assert len(rows) > 2 * len(columns)


def test_nothing_is_drawn_of_what_has_no_finite_face(tmp_path: Path) -> None:
    assert asset_picture(of_boxes(None, None)) is None
    broken = box((1, 1, 1))
    broken.vertices[0, 0] = np.nan
    assert asset_picture(replace(clean(), visual=(textured(broken),))) is None
    (tmp_path / "cut.urdf").write_text('<robot name="cut"><link')
    assert audited_picture(tmp_path / "cut.urdf") is None


def test_same_asset_same_bytes() -> None:
    assert asset_picture(clean()) == asset_picture(clean())


def audited(name: str, *severities: str) -> Audited:
    codes = {"error": "MAS002", "warning": "MAS001", "note": "FIL007"}
    return Audited(
        name,
        "urdf",
        tuple(Finding(codes[each], each, name, f"{each} of <{name}>") for each in severities),  # type: ignore[arg-type]
    )


def test_page_shows_the_worst_first_and_no_more_than_a_person_looks_at() -> None:
    many = [audited(f"set/{i:03d}.urdf", "error") for i in range(60)]
    worst = audited("set/worst.urdf", "error", "error", "warning")
    shown = shown_assets([*many, audited("set/fine.urdf"), audited("set/noted.urdf", "note"), worst])
    assert len(shown) == MOST_SHOWN and shown[0] is worst


def test_page_tells_rules_causes_and_assets_and_reads_nothing_as_html() -> None:
    unread = Audited("b.urdf", None, (Finding("FIL001", "error", "b.urdf", "b.urdf: cut off at line 3"),))
    png = asset_picture(clean())
    assert png is not None
    found = [audited("<a>.urdf", "error", "note"), unread, audited("c.urdf")]
    text = audit_page(found, RULES, {"<a>.urdf": png}).decode()
    assert "<a>" not in text and "&lt;a&gt;.urdf" in text
    assert "3 assets, 1 without findings: 2 errors, 0 warnings, 1 note" in text
    assert "MAS002 mass-not-positive" in text and "cut off at line N" in text
    (data,) = re.findall(r'src="data:image/png;base64,([^"]+)"', text)
    assert base64.b64decode(data) == png
    assert "http" not in re.sub(r"<style>.*?</style>", "", text, flags=re.S)  # it asks nothing of anybody
    assert audit_page(found, RULES, {"<a>.urdf": png}).decode() == text


def test_command_writes_the_page_with_a_picture_of_the_broken_one(tmp_path: Path) -> None:
    write_urdf(tmp_path / "set" / "fine")
    write_urdf(tmp_path / "set" / "broken", inertial=PLACEHOLDER)
    done = CliRunner().invoke(app, ["audit", str(tmp_path / "set"), "--html", str(tmp_path / "audit.html")])
    assert done.exit_code == 1, done.output
    text = (tmp_path / "audit.html").read_text()
    assert "INE004 inertia-placeholder" in text and text.count("data:image/png") == 1


def test_command_refuses_a_page_that_cannot_be_written(tmp_path: Path) -> None:
    write_urdf(tmp_path / "set")
    done = CliRunner().invoke(app, ["audit", str(tmp_path / "set"), "--html", str(tmp_path / "no" / "audit.html")])
    assert "cannot be written" in str(done.exception)


def test_a_texture_is_seen_where_its_coordinates_put_it() -> None:
    sheet = Image.new("RGB", (64, 64), (220, 30, 30))
    sheet.paste((30, 30, 220), (0, 0, 64, 32))  # the upper half
    wall = trimesh.creation.box((0.2, 0.01, 0.2))
    uv = np.column_stack([(wall.vertices[:, 0] + 0.1) / 0.2, (wall.vertices[:, 2] + 0.1) / 0.2])
    part = make_part(
        wall.vertices, wall.faces, name="wall", uv=uv, material=pbr_material(None, base_color_texture=sheet)
    )
    png = asset_picture(replace(clean(), visual=(part,), collision=()))
    assert png is not None
    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)[:, :PANEL_PX]
    blue, red = pixels[..., 2] - pixels[..., 0] > 40, pixels[..., 0] - pixels[..., 2] > 40
    assert blue.sum() > 2000 and red.sum() > 2000
    assert np.flatnonzero(blue.any(1)).mean() < np.flatnonzero(red.any(1)).mean(), "blue is above red"
