from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

from manitwin.assets.read import detect, find_assets, read_asset
from manitwin.errors import AssetError

URDF = '<robot name="r"><link name="l"><visual><geometry><box size="1 1 1"/></geometry></visual></link></robot>'


def write(path: Path, text: str = "{}") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


POINTER = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n"


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        (("twin.json",), "twin"),
        (("manipulation_annotations.json", "base_rescaled.glb"), "manitwin100k"),
        (("model_data0.json", "visual/base0.glb"), "robotwin"),
        (("model.config", "model.sdf", "metadata.pbtxt", "meshes/model.obj"), "gso"),
        (("model.config", "model.sdf", "meshes/model.obj"), "sdf"),
        (("scene.usda",), "usd"),
    ],
)
def test_folders_are_told_by_their_files(tmp_path: Path, files: tuple[str, ...], expected: str) -> None:
    for name in files:
        write(tmp_path / name)
    assert detect(tmp_path) == expected


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("a.urdf", URDF, "urdf"),
        ("a.xml", f"<?xml version='1.0'?><!-- <mujoco> -->\n{URDF}", "urdf"),
        ("a.xml", "<!-- a\ncomment --><mujoco model='m'/>", "mjcf"),
        ("a.urdf", '<robot name="r"><link name="l"><extra_info/></link></robot>', "embodiedgen"),
        ("a.usdc", "", "usd"),
    ],
)
def test_files_are_told_by_their_content(tmp_path: Path, name: str, text: str, expected: str) -> None:
    assert detect(write(tmp_path / name, text)) == expected


def test_what_is_no_asset_says_what_would_be(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="EmbodiedGen"):
        detect(write(tmp_path / "a.xml", "<html/>"))
    with pytest.raises(AssetError, match="no such file"):
        detect(tmp_path / "none")
    with pytest.raises(AssetError, match="no asset"):
        detect(tmp_path)


def test_two_of_a_kind_in_a_folder_are_named(tmp_path: Path) -> None:
    write(tmp_path / "a.urdf", URDF)
    write(tmp_path / "b.urdf", URDF)
    with pytest.raises(AssetError, match=r"a\.urdf, b\.urdf"):
        read_asset(tmp_path)


def test_all_assets_below_a_folder_are_found_in_order(tmp_path: Path) -> None:
    expected = [
        write(tmp_path / "one.urdf", URDF),
        write(tmp_path / "b" / "two.xml", "<mujoco/>"),
        write(tmp_path / "c" / "twin.json").parent,
        write(tmp_path / "d" / "model_data2.json"),
        write(tmp_path / "d" / "model_data10.json"),
    ]
    write(tmp_path / "c" / "inside.urdf", URDF)  # part of the twin
    write(tmp_path / ".work" / "x" / "twin.json")
    write(tmp_path / "b" / "notes.xml", "<html/>")
    (tmp_path / "b" / "loop").symlink_to(tmp_path)
    trimesh.creation.box([1, 1, 1]).export(tmp_path / "b" / "mesh.stl")
    assert list(find_assets(tmp_path)) == expected


def test_unknown_format_lists_the_valid_ones(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="did you mean 'urdf'"):
        read_asset(tmp_path, "urd")  # type: ignore[arg-type]


WORLD = '<sdf version="1.9"><world name="w">{}</world></sdf>'
BOX = "<geometry><box><size>1 1 1</size></box></geometry>"
MODEL = f"<model name='m'><link name='l'><visual name='v'>{BOX}</visual></link></model>"
LAYER = '#usda 1.0\n{} "thing"\n{{\n    {}\n}}\n'


@pytest.mark.parametrize(
    ("name", "text", "is_asset"),
    [
        ("world.sdf", WORLD.format(MODEL), True),
        ("world.sdf", WORLD.format("<include><uri>model://m</uri></include>"), False),
        ("world.sdf", WORLD.format("<include><uri>m</uri><plugin><visual>red</visual></plugin></include>"), False),
        ("model.sdf", "<sdf version='1.9'><include><uri>https://example.org/m</uri></include></sdf>", False),
        ("model.sdf", "<sdf version='1.9'><model name='m'><include><uri>m</uri></include></model></sdf>", True),
        ("a.usda", LAYER.format("def Xform", 'def Mesh "m" {}'), True),
        ("a.usda", LAYER.format("def Xform", 'def "m" (references = @b.usda@) {}'), True),
        ("a.usda", LAYER.format("def Scope", 'def Material "m" {}'), False),
        ("a.usda", LAYER.format("over", 'def "m" (references = @look.mtlx@) {}'), False),
        ("a.usd", LAYER.format("over", 'over "m" {}'), False),
    ],
)
def test_worlds_of_included_models_and_layers_without_a_shape_are_no_assets(
    tmp_path: Path, name: str, text: str, is_asset: bool
) -> None:
    file = write(tmp_path / name, text)
    aside: list[Path] = []
    assert (list(find_assets(tmp_path, aside)) == [file]) == is_asset
    assert aside == ([] if is_asset else [file])


MESH = 'def Xform "a" {\n def Mesh "m" {}\n}\n'
ROOTED = 'def Xform "a" (\n    kind = "component"\n    prepend payload = @./Payload/Contents.usda@\n)\n{\n}\n'
IN_SCENE = 'def Xform "w" {\n    def "cup" (\n        prepend payload = @./cup/cup.usda@\n    )\n    {\n    }\n}\n'


def usda(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return write(path, f"#usda 1.0\n{text}")


def test_layers_of_a_stage_are_no_assets(tmp_path: Path) -> None:
    """As converters write them: a payload of the root, its sublayers, and what these refer to."""
    root = usda(tmp_path / "box.usda", ROOTED)
    layers = {
        usda(
            tmp_path / "Payload" / "Contents.usda", f"(\n    subLayers = [\n        @./Geometry.usda@\n    ]\n)\n{MESH}"
        ),
        usda(
            tmp_path / "Payload" / "Geometry.usda",
            'def Xform "a" {\n def "m" (references = @./Library.usdc@</m>) {}\n}\n',
        ),
        usda(tmp_path / "Payload" / "Library.usdc", MESH),
    }
    aside: list[Path] = []
    assert list(find_assets(tmp_path, aside)) == [root] and set(aside) == layers
    assert list(find_assets(tmp_path / "Payload" / "Geometry.usda")) == [tmp_path / "Payload" / "Geometry.usda"]


def test_assets_that_a_scene_is_made_of_stay_assets(tmp_path: Path) -> None:
    scene = usda(tmp_path / "scene.usda", IN_SCENE)
    cup = usda(tmp_path / "cup" / "cup.usda", MESH)
    assert list(find_assets(tmp_path)) == [scene, cup]


@pytest.mark.parametrize("named", ["../secret.usda", "/etc/secret.usda", "loop.usda", "\udcff.usda", "box.usda"])
def test_layers_outside_of_the_folder_and_in_circles_are_not_followed(tmp_path: Path, named: str) -> None:
    usda(tmp_path / "secret.usda", MESH)
    folder = tmp_path / "asset"
    folder.mkdir()
    (folder / "loop.usda").symlink_to("loop.usda")
    text = f"#usda 1.0\n(\n    subLayers = [@{named}@]\n)\n{MESH}"
    (folder / "box.usda").write_bytes(text.encode("utf-8", "surrogateescape"))
    assert list(find_assets(folder)) == [folder / "box.usda"]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("house.world", "<sdf version='1.6'><world name='w'><include/></world></sdf>", "a world of Gazebo"),
        ("bowl.kinbody.xml", "<KinBody name='bowl'/>", "a body of OpenRAVE, which is not read; give its URDF"),
        ("notes.xml", "<notes/>", "no asset of a known format"),
        ("cup.urdf", POINTER, "a pointer of Git LFS, not the file; fetch it with git lfs pull"),
        ("cup.usd", POINTER, "cup.usd: holds a pointer of Git LFS, not the file; fetch it with git lfs pull"),
    ],
)
def test_what_is_known_and_no_asset_is_told_what_it_is(tmp_path: Path, name: str, text: str, said: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(AssetError, match=said):
        read_asset(tmp_path / name)
