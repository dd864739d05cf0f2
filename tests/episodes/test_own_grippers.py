"""Grasps of one's own gripper are taken for the gripper that they were verified with, not for one that has its name."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from grasped_twins import write_brick
from manitwin.episodes.target_grasps import usable_grasps
from manitwin.errors import UsageError
from manitwin.robots.grippers.gripper import Gripper, load_gripper
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD, seal

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
    seal(folder, record)
    return identity


@pytest.fixture
def twins(tmp_path: Path) -> tuple[Path, str]:
    (tmp_path / "arm").mkdir()
    return tmp_path / "twins", write_own(tmp_path / "twins", 1, own_jaws(tmp_path / "arm"))


def test_grasps_of_the_same_file_are_the_gripper_s_own(twins: tuple[Path, str], tmp_path: Path) -> None:
    root, identity = twins
    twin = Twin(root / twin_name(identity))
    found = usable_grasps(twin, load_gripper(tmp_path / "arm" / "my_jaws.toml"))
    assert found and not any(each.transferred for each in found)
    assert all(each.transferred for each in usable_grasps(twin, load_gripper("panda"))), "of another name, as before"


def test_grasps_of_another_file_of_its_name_are_refused(twins: tuple[Path, str], tmp_path: Path) -> None:
    root, identity = twins
    changed = own_jaws(tmp_path / "arm", friction=0.6)
    with pytest.raises(UsageError, match=f"twin {identity} has grasps of a gripper {NAME} whose file is another"):
        usable_grasps(Twin(root / twin_name(identity)), changed)
