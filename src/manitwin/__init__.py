"""Turn a photo, a text or a mesh into a data-generation-ready digital twin.

All that programs use is here, imported when it is first asked for; the protocols behind which models of your own stand are
in ``manitwin.backends``. Other modules may change from one version to the next.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from manitwin.api import (
        EpisodesReport,
        TasksReport,
        build,
        export_scene,
        export_twin,
        find_scenes,
        import_assets,
        load,
        load_scene,
        make_env,
        make_episodes,
        make_layouts,
        make_tasks,
        render_episodes,
        schema,
        statistics_connection,
        write_index,
        write_statistics,
    )
    from manitwin.assets.audit.finding import Audited
    from manitwin.assets.audit.run import audit_assets
    from manitwin.assets.importers.importer import Imported
    from manitwin.config import BuildConfig, load_config
    from manitwin.dataset.index.dataset import Dataset
    from manitwin.dataset.index.near_duplicates import NearDuplicates, near_duplicates
    from manitwin.dataset.index.query import Index
    from manitwin.dataset.index.twins import Twins
    from manitwin.dataset.publish.publish import Published, publish_dataset
    from manitwin.dataset.publish.shards import unpack_shard
    from manitwin.episodes.environment.start_noise import StartNoise
    from manitwin.episodes.hdf5_file import EpisodeFile
    from manitwin.episodes.lerobot.read import LeRobotSet, read_lerobot
    from manitwin.episodes.publication.publish import PublishedEpisodes, publish_episodes
    from manitwin.episodes.settings import PicturesConfig, TasksConfig, TrajectoriesConfig
    from manitwin.errors import (
        AssetError,
        BackendError,
        ConfigError,
        EpisodesError,
        ExportError,
        ManiTwinError,
        Rejected,
        TwinError,
        UsageError,
    )
    from manitwin.physics.sapien.robot import SapienRobot
    from manitwin.pipeline.build_report import BuildReport
    from manitwin.robots.grippers.gripper import load_gripper
    from manitwin.robots.load import load_robot
    from manitwin.robots.robot import Robot
    from manitwin.scenes.loaded_scene import Scene
    from manitwin.scenes.settings import LayoutsConfig
    from manitwin.twin.loaded_twin import Grasps, Twin
    from manitwin.twin.record import TwinRecord

    __version__: str

__all__ = [
    "AssetError",
    "Audited",
    "BackendError",
    "BuildConfig",
    "BuildReport",
    "ConfigError",
    "Dataset",
    "EpisodeFile",
    "EpisodesError",
    "EpisodesReport",
    "ExportError",
    "Grasps",
    "Imported",
    "Index",
    "LayoutsConfig",
    "LeRobotSet",
    "ManiTwinError",
    "NearDuplicates",
    "PicturesConfig",
    "Published",
    "PublishedEpisodes",
    "Rejected",
    "Robot",
    "SapienRobot",
    "Scene",
    "StartNoise",
    "TasksConfig",
    "TasksReport",
    "TrajectoriesConfig",
    "Twin",
    "TwinError",
    "TwinRecord",
    "Twins",
    "UsageError",
    "__version__",
    "audit_assets",
    "build",
    "export_scene",
    "export_twin",
    "find_scenes",
    "import_assets",
    "load",
    "load_config",
    "load_gripper",
    "load_robot",
    "load_scene",
    "make_env",
    "make_episodes",
    "make_layouts",
    "make_tasks",
    "near_duplicates",
    "publish_dataset",
    "publish_episodes",
    "read_lerobot",
    "render_episodes",
    "schema",
    "statistics_connection",
    "unpack_shard",
    "write_index",
    "write_statistics",
]

logging.getLogger("manitwin").addHandler(logging.NullHandler())  # else Python prints warnings where nobody listens

_DEFINED_IN = {
    "manitwin.api": (
        "EpisodesReport",
        "TasksReport",
        "build",
        "export_scene",
        "export_twin",
        "find_scenes",
        "import_assets",
        "load",
        "load_scene",
        "make_env",
        "make_episodes",
        "make_layouts",
        "make_tasks",
        "render_episodes",
        "schema",
        "statistics_connection",
        "write_index",
        "write_statistics",
    ),
    "manitwin.assets.audit.finding": ("Audited",),
    "manitwin.assets.audit.run": ("audit_assets",),
    "manitwin.assets.importers.importer": ("Imported",),
    "manitwin.config": (
        "BuildConfig",
        "load_config",
    ),
    "manitwin.dataset.index.dataset": ("Dataset",),
    "manitwin.dataset.index.near_duplicates": (
        "NearDuplicates",
        "near_duplicates",
    ),
    "manitwin.dataset.index.query": ("Index",),
    "manitwin.dataset.index.twins": ("Twins",),
    "manitwin.dataset.publish.publish": (
        "Published",
        "publish_dataset",
    ),
    "manitwin.dataset.publish.shards": ("unpack_shard",),
    "manitwin.episodes.environment.start_noise": ("StartNoise",),
    "manitwin.episodes.hdf5_file": ("EpisodeFile",),
    "manitwin.episodes.lerobot.read": (
        "LeRobotSet",
        "read_lerobot",
    ),
    "manitwin.episodes.publication.publish": (
        "PublishedEpisodes",
        "publish_episodes",
    ),
    "manitwin.episodes.settings": (
        "PicturesConfig",
        "TasksConfig",
        "TrajectoriesConfig",
    ),
    "manitwin.errors": (
        "AssetError",
        "BackendError",
        "ConfigError",
        "EpisodesError",
        "ExportError",
        "ManiTwinError",
        "Rejected",
        "TwinError",
        "UsageError",
    ),
    "manitwin.physics.sapien.robot": ("SapienRobot",),
    "manitwin.pipeline.build_report": ("BuildReport",),
    "manitwin.robots.grippers.gripper": ("load_gripper",),
    "manitwin.robots.load": ("load_robot",),
    "manitwin.robots.robot": ("Robot",),
    "manitwin.scenes.settings": ("LayoutsConfig",),
    "manitwin.scenes.loaded_scene": ("Scene",),
    "manitwin.twin.loaded_twin": (
        "Grasps",
        "Twin",
    ),
    "manitwin.twin.record": ("TwinRecord",),
}


def __getattr__(name: str) -> Any:
    """Import the public names when they are first used, so that `manitwin --help` answers at once."""
    if name == "__version__":
        from manitwin.formats.installation import installed_version

        return installed_version()
    if name not in __all__:
        raise AttributeError(f"module 'manitwin' has no attribute {name!r}; it has {', '.join(__all__)}")
    from importlib import import_module

    module = next(module for module, names in _DEFINED_IN.items() if name in names)
    return getattr(import_module(module), name)


def __dir__() -> list[str]:
    """Return the public names, asked for before or not, so that completion finds them and no others."""
    return sorted({*(name for name in globals() if name.startswith("__")), *__all__})
