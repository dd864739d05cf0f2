"""Turn a photo, a text or a mesh into a data-generation-ready digital twin.

All that programs use is here, imported when it is first asked for; the protocols behind which models of your own stand are
in ``manitwin.backends``. Other modules may change from one version to the next.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from manitwin.api import BuildReport, build, export_twin, load, load_scene, schema, statistics_connection
    from manitwin.apps.trajectories.hdf5_file import EpisodeFile
    from manitwin.apps.trajectories.lerobot.read import LeRobotSet, read_lerobot
    from manitwin.apps.trajectories.publication.publish import PublishedEpisodes, publish_episodes
    from manitwin.audit.run import Audited
    from manitwin.audit.run import audit as audit_assets
    from manitwin.config import BuildConfig, load_config
    from manitwin.errors import BackendError, ManiTwinError, Rejected, TwinError, UsageError
    from manitwin.index.dataset import Dataset
    from manitwin.index.near_duplicates import NearDuplicates, near_duplicates
    from manitwin.index.query import Index
    from manitwin.index.twins import Twins
    from manitwin.loaded_twin import Grasps, Twin
    from manitwin.publish.publish import Published
    from manitwin.publish.publish import publish as publish_dataset
    from manitwin.publish.unpack import unpack_shard
    from manitwin.robots.load import load_robot
    from manitwin.robots.robot import Robot
    from manitwin.robots.sapien_robot import SapienRobot
    from manitwin.scenes.loaded_scene import Scene
    from manitwin.twin import TwinRecord

    __version__: str

__all__ = [
    "Audited",
    "BackendError",
    "BuildConfig",
    "BuildReport",
    "Dataset",
    "EpisodeFile",
    "Grasps",
    "Index",
    "LeRobotSet",
    "ManiTwinError",
    "NearDuplicates",
    "Published",
    "PublishedEpisodes",
    "Rejected",
    "Robot",
    "SapienRobot",
    "Scene",
    "Twin",
    "TwinError",
    "TwinRecord",
    "Twins",
    "UsageError",
    "__version__",
    "audit_assets",
    "build",
    "export_twin",
    "load",
    "load_config",
    "load_robot",
    "load_scene",
    "near_duplicates",
    "publish_dataset",
    "publish_episodes",
    "read_lerobot",
    "schema",
    "statistics_connection",
    "unpack_shard",
]

_DEFINED_IN = {
    "manitwin.api": ("BuildReport", "build", "export_twin", "load", "load_scene", "schema", "statistics_connection"),
    "manitwin.apps.trajectories.hdf5_file": ("EpisodeFile",),
    "manitwin.apps.trajectories.lerobot.read": ("LeRobotSet", "read_lerobot"),
    "manitwin.apps.trajectories.publication.publish": ("PublishedEpisodes", "publish_episodes"),
    "manitwin.audit.run": ("Audited", "audit_assets"),
    "manitwin.config": ("BuildConfig", "load_config"),
    "manitwin.errors": ("BackendError", "ManiTwinError", "Rejected", "TwinError", "UsageError"),
    "manitwin.index.dataset": ("Dataset",),
    "manitwin.index.near_duplicates": ("NearDuplicates", "near_duplicates"),
    "manitwin.index.query": ("Index",),
    "manitwin.index.twins": ("Twins",),
    "manitwin.loaded_twin": ("Grasps", "Twin"),
    "manitwin.publish.publish": ("Published", "publish_dataset"),
    "manitwin.publish.unpack": ("unpack_shard",),
    "manitwin.robots.load": ("load_robot",),
    "manitwin.robots.robot": ("Robot",),
    "manitwin.robots.sapien_robot": ("SapienRobot",),
    "manitwin.scenes.loaded_scene": ("Scene",),
    "manitwin.twin": ("TwinRecord",),
}
_NAMED_THERE = {"audit_assets": "audit", "publish_dataset": "publish"}
"""``manitwin.audit`` and ``manitwin.publish`` are packages: an attribute of that name would be hidden by an import of them."""


def __getattr__(name: str) -> Any:
    """Import the public names when they are first used, so that `manitwin --help` answers at once."""
    if name == "__version__":
        from manitwin.version import installed_version

        return installed_version()
    if name not in __all__:
        raise AttributeError(f"module 'manitwin' has no attribute {name!r}; it has {', '.join(__all__)}")
    from importlib import import_module

    module = next(module for module, names in _DEFINED_IN.items() if name in names)
    return getattr(import_module(module), _NAMED_THERE.get(name, name))


def __dir__() -> list[str]:
    """Return the public names, asked for before or not, so that completion finds them and no others."""
    return sorted({*(name for name in globals() if name.startswith("__")), *__all__})
