"""Robots' looks on disk: the same as without, made again where anything that decides them is another, never trusted blindly."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.episodes import robot_appearance
from manitwin.episodes.robot_appearance import link_drawables, looks_folder
from manitwin.render.drawable import Drawable
from manitwin.render.drawable_file import ARRAYS, drawables_from_bytes, drawables_to_bytes

TOLERANCE_M, FINE_M = 0.002, 0.0008


@pytest.fixture
def arm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The URDF of an arm of two links: a mesh file and a plain shape."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    trimesh.creation.icosphere(subdivisions=4, radius=0.1).export(tmp_path / "link.stl")
    link_drawables.cache_clear()
    return urdf_of(tmp_path / "link.stl")


def urdf_of(mesh: Path) -> str:
    return f"""<robot name="arm">
<link name="base"><visual><geometry><mesh filename="{mesh}"/></geometry></visual></link>
<link name="finger"><visual><geometry><box size="0.02 0.02 0.1"/></geometry></visual></link>
<joint name="j" type="fixed"><parent link="base"/><child link="finger"/></joint>
</robot>"""


def looks(urdf: str, tolerance_m: float = TOLERANCE_M) -> dict[str, Drawable]:
    """Return what a new process would get."""
    link_drawables.cache_clear()
    return link_drawables(urdf, tolerance_m, FINE_M, frozenset({"finger"}))


def kept() -> list[Path]:
    return sorted(looks_folder().glob("*"))


def same(one: dict[str, Drawable], other: dict[str, Drawable]) -> bool:
    assert list(one) == list(other)
    for a, b in zip(one.values(), other.values(), strict=True):
        for s, t in zip((*a.surfaces, a.shadow), (*b.surfaces, b.shadow), strict=True):
            numbers = [(each.color, each.metallic, each.roughness) for each in (s, t)]
            if numbers[0] != numbers[1] or any(
                getattr(s, kind).tobytes() != getattr(t, kind).tobytes() for kind in ARRAYS
            ):
                return False
    return True


def test_what_is_read_again_is_what_was_made(arm: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made = looks(arm)
    assert len(kept()) == 1
    monkeypatch.setattr(robot_appearance, "link_visuals", lambda urdf: pytest.fail("the meshes were read again"))
    assert same(looks(arm), made)


def test_another_mesh_tolerance_or_version_is_made_anew(
    arm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = looks(arm)
    assert not same(looks(arm, 2 * TOLERANCE_M), first) and len(kept()) == 2
    trimesh.creation.icosphere(subdivisions=4, radius=0.2).export(tmp_path / "link.stl")
    robot_appearance.link_visuals.cache_clear()  # of this process, which reads a file once
    assert np.ptp(looks(arm)["base"].shadow.vertices[:, 0]) == pytest.approx(0.4, abs=0.01)
    monkeypatch.setattr(robot_appearance, "LOOKS_VERSION", "another")
    looks(arm)
    assert len(kept()) == 4


@pytest.mark.parametrize("damage", ["cut", "empty", "foreign", "faces", "header", "pickle"])
def test_a_damaged_file_is_made_again(arm: str, damage: str) -> None:
    made = looks(arm)
    (file,) = kept()
    whole = file.read_bytes()
    if damage == "header":  # of an array: it cannot be parsed, which is none of zipfile's errors
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr("names.npy", np.lib.format.magic(1, 0) + b"\x08\x00{'a': (\n")
    elif damage == "pickle":
        np.savez(file, names=np.array([{}], object))
    elif damage == "faces":
        with np.load(file) as arrays:
            changed = {name: array.copy() for name, array in arrays.items()}
        changed["0.0.faces"][0, 0] = 1 << 20
        np.savez(file, **changed)
    else:
        file.write_bytes({"cut": whole[: len(whole) // 2], "empty": b"", "foreign": b"PK\x03\x04 no archive"}[damage])
    assert same(looks(arm), made)
    assert file.read_bytes() == whole and kept() == [file]


def test_without_a_folder_to_write_to_nothing_is_kept_and_that_is_said(
    arm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with caplog.at_level("WARNING", "manitwin.run"):
        assert set(looks(arm)) == {"base", "finger"}
    assert "robot's looks are not kept" in caplog.text


def test_formats_that_take_colours_from_files_beside_them_are_not_kept(arm: str, tmp_path: Path) -> None:
    trimesh.creation.icosphere(subdivisions=2, radius=0.1).export(tmp_path / "link.obj")
    assert set(looks(urdf_of(tmp_path / "link.obj"))) == {"base", "finger"}
    assert not kept()


def test_things_with_textures_are_not_written_and_arrays_have_to_fit(arm: str) -> None:
    made = looks(arm)
    content = drawables_to_bytes(made)
    assert content is not None and same(drawables_from_bytes(content), made)
    surface = made["base"].surfaces[0]
    textured = Drawable((surface.__class__(**{**vars(surface), "color_map": np.zeros((2, 2, 4), np.uint8)}),), surface)
    assert drawables_to_bytes({"base": textured}) is None
    with pytest.raises(ValueError, match=r"no \.npz"):
        drawables_from_bytes(b"nothing")
