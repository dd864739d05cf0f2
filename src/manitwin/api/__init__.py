"""Public Python API: build, load, export and import twins; make scenes, tasks and episodes from them; compute statistics.

Each function imports its implementation when it is called: the dependencies of a build alone take 2 CPU-seconds to import.
"""

from manitwin.api.assets import import_assets
from manitwin.api.builds import build
from manitwin.api.datasets import statistics_connection, write_index, write_statistics
from manitwin.api.episodes import EpisodesReport, make_episodes, render_episodes
from manitwin.api.scenes import export_scene, find_scenes, load_scene, make_layouts
from manitwin.api.tasks import TasksReport, make_env, make_tasks
from manitwin.api.twins import export_twin, load, schema

__all__ = [
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
]
