"""Layouts and episodes on a cluster: the bytes that one process makes."""

from __future__ import annotations

from pathlib import Path

import pytest

from grasped_twins import write_brick
from manitwin.engine.drive import ExecutorName
from manitwin.episodes.episodes_run import make_episodes
from manitwin.episodes.settings import TrajectoriesConfig
from manitwin.scenes.layouts.layouts_run import make_layouts
from manitwin.scenes.settings import LayoutsConfig, LayoutSettings


def files(root: Path) -> dict[str, bytes]:
    """What scenes or batches hold, but for what says when and how they were made."""
    names = ("scene.json", "episodes.h5", "attempts.parquet", "batch.json")
    return {str(path.relative_to(root)): path.read_bytes() for path in root.rglob("*") if path.name in names}


@pytest.mark.slow
def test_a_cluster_makes_the_layouts_and_episodes_of_one_process(connected: str, tmp_path: Path) -> None:
    twins = tmp_path / "twins"
    for number in range(3):
        write_brick(twins, number, ("brick", "block", "tea box")[number])
    layouts = LayoutsConfig(seed=2, layout=LayoutSettings(objects=(2, 3), robot="panda"))
    episodes = TrajectoriesConfig(seed=5, batch=1)
    made: list[dict[str, bytes]] = []
    executors: tuple[tuple[ExecutorName, str | None], ...] = (("inline", None), ("ray", connected))
    for executor, address in executors:
        scenes, out = tmp_path / executor / "scenes", tmp_path / executor / "episodes"
        assert make_layouts(twins, scenes, 2, layouts, executor=executor, address=address).exit_code == 0
        assert make_episodes(scenes, out, 2, episodes, executor=executor, address=address).exit_code == 0
        made.append(files(scenes) | files(out))
    assert len(made[0]) == 2 + 2 * 3
    assert made[0].keys() == made[1].keys()
    assert [name for name in made[0] if made[0][name] != made[1][name]] == []
