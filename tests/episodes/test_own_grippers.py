"""Grasps of one's own gripper are taken for the gripper that they were verified with, not for one that has its name."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from boxy_robot import TOML, boxy_robot
from grasped_twins import write_brick
from manitwin.episodes.episodes_run import make_episodes
from manitwin.episodes.settings import TasksConfig, TrajectoriesConfig
from manitwin.episodes.target_grasps import usable_grasps
from manitwin.episodes.tasks.tasks_run import make_tasks
from manitwin.errors import UsageError
from manitwin.robots.grippers.gripper import Gripper, load_gripper
from manitwin.scenes.layouts.layouts_run import make_layouts
from manitwin.scenes.layouts.pool import cached_pool
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD, write_twin_record

NAME = "my_jaws"


def own_jaws(folder: Path, friction: float = 1.0) -> Gripper:
    """The Panda's hand under a name of its own."""
    shipped = (resources.files("manitwin.robots.grippers") / "definitions" / "panda.toml").read_text()
    text = shipped.replace('name = "panda"', f'name = "{NAME}"').replace(
        "finger_friction = 1.0", f"finger_friction = {friction}"
    )
    assert NAME in text and str(friction) in text
    (folder / "my_jaws.toml").write_text(text)
    return load_gripper(folder / "my_jaws.toml")


def write_own(root: Path, number: int, gripper: Gripper) -> str:
    """Write a brick with grasps of a gripper of one's own; returns its id."""
    identity = write_brick(root, number)
    folder = root / twin_name(identity)
    table = pq.read_table(folder / "grasps.parquet")
    at = table.schema.get_field_index("gripper")
    names = pa.array([gripper.name] * len(table), table.schema.field(at).type)
    pq.write_table(table.set_column(at, table.schema.field(at), names), folder / "grasps.parquet")
    record = json.loads((folder / RECORD).read_bytes())
    record["grasps"] |= {"gripper": gripper.name, "gripper_sha256": gripper.sha256}
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    return identity


@pytest.fixture
def twins(tmp_path: Path) -> tuple[Path, str]:
    (tmp_path / "arm").mkdir()
    return tmp_path / "twins", write_own(tmp_path / "twins", 1, own_jaws(tmp_path / "arm"))


def arm(tmp_path: Path) -> str:
    """An arm with the jaws that lie beside its file."""
    boxy_robot(tmp_path / "arm")
    file = tmp_path / "arm" / "own.toml"
    file.write_text(
        TOML.replace('gripper = "panda"', 'gripper = "my_jaws.toml"').replace('name = "boxy"', 'name = "own"')
    )
    return str(file)


def test_grasps_of_the_same_file_are_the_gripper_s_own(twins: tuple[Path, str], tmp_path: Path) -> None:
    root, identity = twins
    twin = Twin(root / twin_name(identity))
    found = usable_grasps(twin, load_gripper(tmp_path / "arm" / "my_jaws.toml"))
    assert found and not any(each.transferred for each in found)
    assert all(each.transferred for each in usable_grasps(twin, load_gripper("panda"))), "of another name, as before"


def test_grasps_of_another_file_of_its_name_are_refused(twins: tuple[Path, str], tmp_path: Path) -> None:
    root, identity = twins
    changed = own_jaws(tmp_path / "arm", friction=0.6)
    with pytest.raises(UsageError, match=f"twin {identity} has grasps of a gripper {NAME} whose file differs"):
        usable_grasps(Twin(root / twin_name(identity)), changed)


def test_runs_refuse_them_before_they_begin(twins: tuple[Path, str], tmp_path: Path) -> None:
    root, identity = twins
    layouts = LayoutsConfig(seed=2, layout=LayoutSettings(objects=(1, 1)))
    assert make_layouts(root, tmp_path / "scenes", 1, layouts, executor="inline").counts["accepted"] == 1
    own_jaws(tmp_path / "arm", friction=0.6)
    robot = arm(tmp_path)
    refused = f"twin {identity} has grasps of a gripper {NAME} whose file differs from that of the {NAME} of own; build"
    for place in (root, tmp_path / "scenes"):
        with pytest.raises(UsageError, match=refused):
            make_episodes(place, tmp_path / "out", 1, TrajectoriesConfig(robot=robot), executor="inline")
    with pytest.raises(UsageError, match=refused):
        make_tasks(tmp_path / "scenes", tmp_path / "out", TasksConfig(robot=robot), executor="inline")
    assert not (tmp_path / "out").exists()


def test_runs_refuse_scenes_whose_twins_stand_otherwise_now(twins: tuple[Path, str], tmp_path: Path) -> None:
    root, identity = twins
    layouts = LayoutsConfig(seed=2, layout=LayoutSettings(objects=(1, 1)))
    make_layouts(root, tmp_path / "scenes", 1, layouts, executor="inline")
    folder = root / twin_name(identity)
    record = json.loads((folder / RECORD).read_bytes())
    record["physical"]["mass_kg"] |= dict.fromkeys(("value", "low", "high"), 0.5)
    del record["revision"], record["files"]
    write_twin_record(folder, record)
    cached_pool.cache_clear()
    refused = (
        rf"{identity} \(brick\) changed in shape, mass, contact or placements .* in 1 of 1 scene; sample the layouts"
    )
    with pytest.raises(UsageError, match=refused):
        make_episodes(tmp_path / "scenes", tmp_path / "out", 1, TrajectoriesConfig(), executor="inline")
    with pytest.raises(UsageError, match=refused):
        make_tasks(tmp_path / "scenes", tmp_path / "out", TasksConfig(), executor="inline")
    assert not (tmp_path / "out").exists()
