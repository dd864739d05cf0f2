"""The functions of ``manitwin`` on scenes, assets and data sets; ``docs/python.md`` calls those on episodes too."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

import manitwin
from foreign_assets import mug_urdf
from scene_twins import slab, write_things
from small_hand import write_hand


@pytest.fixture(scope="module")
def twins(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("twins")
    write_things(root, (slab("dice", 0.03, 0.03, 0.03), slab("box", 0.08, 0.06, 0.05)))
    return root


@pytest.fixture(scope="module")
def scenes(twins: Path) -> Path:
    settings = manitwin.LayoutsConfig(seed=3, layout={"objects": (2, 3)})  # type: ignore[arg-type]
    report = manitwin.make_layouts(twins, twins / "scenes", 2, config=settings, executor="inline")
    assert report.counts["accepted"] == 2
    return twins / "scenes"


def test_scenes_are_found_by_run_folder_and_file(scenes: Path) -> None:
    found = manitwin.find_scenes(scenes)
    assert [path.parent.name for path in found] == ["layout_3_000000", "layout_3_000001"]
    assert manitwin.find_scenes(found[1].parent) == manitwin.find_scenes(found[1]) == [found[1]]


def test_place_without_a_scene_is_a_usage_error(tmp_path: Path) -> None:
    with pytest.raises(manitwin.UsageError, match="no scene found; create scenes with `manitwin layout DATASET"):
        manitwin.find_scenes(tmp_path)


def test_exported_scene_loads_with_its_objects(scenes: Path, tmp_path: Path) -> None:
    file = manitwin.find_scenes(scenes)[0]
    written = manitwin.export_scene(file, "all", tmp_path)
    assert list(written) == ["mjcf", "sdf", "usd"] and all(path.is_file() for path in written.values())
    model = mujoco.MjModel.from_xml_path(str(written["mjcf"]))
    assert model.njnt == len(manitwin.load_scene(file).record.objects)


def test_unknown_format_of_a_scene_writes_nothing(scenes: Path, tmp_path: Path) -> None:
    with pytest.raises(manitwin.UsageError, match="unknown format of a scene 'urdf'"):
        manitwin.export_scene(manitwin.find_scenes(scenes)[0], ["mjcf", "urdf"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_settings_are_given_or_read_from_a_file(twins: Path, tmp_path: Path) -> None:
    (tmp_path / "wrong.toml").write_text("[layout]\nsurfaces = 'tray'\n")
    with pytest.raises(manitwin.ConfigError, match=r"wrong\.toml: layout\.surfaces: unknown setting 'surfaces'"):
        manitwin.make_layouts(twins, tmp_path / "out", 1, config=tmp_path / "wrong.toml")
    (tmp_path / "tray.toml").write_text("seed = 5\n[layout]\nobjects = [1, 1]\nsurface = 'tray'\n")
    manitwin.make_layouts(twins, tmp_path / "out", 1, config=tmp_path / "tray.toml", executor="inline")
    (scene,) = map(manitwin.load_scene, manitwin.find_scenes(tmp_path / "out"))
    assert scene.record.furniture.kind == "tray" and scene.record.scene_id == "layout_5_000000"


def test_no_process_is_a_usage_error(twins: Path, tmp_path: Path) -> None:
    with pytest.raises(manitwin.UsageError, match="jobs is 0"):
        manitwin.make_episodes(twins, tmp_path / "out", 1, jobs=0)


def test_unknown_format_of_episodes_is_said_before_any_is_made(twins: Path, tmp_path: Path) -> None:
    with pytest.raises(manitwin.UsageError, match="unknown format 'lerobots'"):
        manitwin.make_episodes(twins, tmp_path / "out", 1, formats=["lerobots"])
    assert not (tmp_path / "out").exists()


def test_assets_are_imported_whether_or_not_somebody_reads_the_answer(tmp_path: Path) -> None:
    mug_urdf(tmp_path / "assets" / "mug")
    (tmp_path / "assets" / "broken.urdf").write_text("<robot>")
    by_error = {each.error is None: each for each in manitwin.import_assets(tmp_path / "assets", tmp_path / "out")}
    assert (tmp_path / "out" / "mug" / "asset.glb").is_file()
    assert by_error[True].folder == tmp_path / "out" / "mug" and by_error[False].folder is None


def test_gripper_is_loaded_by_name_and_by_file(tmp_path: Path) -> None:
    shipped = manitwin.load_gripper("panda")
    file = Path(write_hand(tmp_path))
    assert (shipped.name, shipped.opening_m) == ("panda", 0.08)
    assert manitwin.load_gripper(file).sha256 == manitwin.load_gripper(str(file)).sha256 != shipped.sha256


def test_gripper_that_is_not_there_is_a_usage_error(tmp_path: Path) -> None:
    with pytest.raises(manitwin.UsageError, match=r"pandas.*panda"):
        manitwin.load_gripper("pandas")
    with pytest.raises(manitwin.UsageError, match=r"none\.toml does not exist"):
        manitwin.load_gripper(tmp_path / "none.toml")


def test_index_is_made_of_the_twins_folders(twins: Path) -> None:
    written = manitwin.write_index(twins, jobs=1)
    assert written.rows("twins") == 2 == len(manitwin.Dataset(twins)) and not written.unreadable


def test_folder_without_twins_gets_no_index(tmp_path: Path) -> None:
    with pytest.raises(manitwin.UsageError, match="not a data set"):
        manitwin.write_index(tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_statistics_are_written_beside_the_data_unless_said_otherwise(twins: Path, tmp_path: Path) -> None:
    manitwin.write_index(twins, jobs=1)
    written = manitwin.write_statistics(twins)
    assert (
        Path(written.page) == twins / "statistics" / "report.html" and written.summary in Path(written.page).read_text()
    )
    assert Path(manitwin.write_statistics(twins, tmp_path).page).read_bytes() == Path(written.page).read_bytes()
