"""Objects of PartNet-Mobility: a URDF named by a digest, and its category beside it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from articulated_assets import LIDDED_BOX
from manitwin.assets.importers.importer import import_assets
from manitwin.assets.read import read_asset


def object_of(folder: Path, metadata: str | None, file: str = "mobility.urdf") -> Path:
    folder.mkdir(parents=True)
    box = '<visual><geometry><box size="0.1 0.1 0.2"/></geometry></visual>'
    (folder / file).write_text(f'<robot name="partnet_13961f08fe5b4c549ef60e92"><link name="l">{box}</link></robot>')
    if metadata is not None:
        (folder / "meta.json").write_text(metadata)
    return folder


@pytest.mark.parametrize(
    ("said", "category"), [("Kettle", "kettle"), ("StorageFurniture", "storage furniture"), (" USB ", "usb")]
)
def test_the_category_beside_it_is_its_category_and_name(tmp_path: Path, said: str, category: str) -> None:
    asset = read_asset(object_of(tmp_path / "100454", json.dumps({"model_cat": said, "anno_id": "1305"})))
    assert (asset.category, asset.name) == (category, category)
    assert [file.name for file in asset.files] == ["meta.json", "mobility.urdf"]


@pytest.mark.parametrize("metadata", [None, "{}", '{"model_cat": 7}', '{"model_cat": " "}', "[]", "{"])
def test_without_a_category_it_is_read_as_any_urdf(tmp_path: Path, metadata: str | None) -> None:
    asset = read_asset(object_of(tmp_path / "100454", metadata))
    assert asset.category is None and asset.name.startswith("partnet") and len(asset.visual) == 1
    assert any("meta.json" in remark for remark in asset.remarks) == (metadata in ("[]", "{"))


def test_a_file_of_another_name_has_another_meta_json(tmp_path: Path) -> None:
    assert read_asset(object_of(tmp_path / "a", '{"model_cat": "Kettle"}', "thing.urdf")).category is None


def test_metadata_from_outside_of_the_root_is_not_read(tmp_path: Path) -> None:
    folder = object_of(tmp_path / "in", None)
    (tmp_path / "secret.json").write_text('{"model_cat": "Kettle"}')
    (folder / "meta.json").symlink_to(tmp_path / "secret.json")
    assert read_asset(folder).category is None


def test_joints_and_category_are_imported(tmp_path: Path) -> None:
    folder = object_of(tmp_path / "100454", '{"model_cat": "Box"}')
    (folder / "mobility.urdf").write_text(LIDDED_BOX)
    (one,) = import_assets([folder], tmp_path / "out")
    assert one.record is not None and one.record.prior_key == "box" and one.record.articulation is not None
    assert one.folder is not None and one.folder.name == "box"
