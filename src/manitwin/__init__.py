"""Turn a photo, a text or a mesh into a data-generation-ready digital twin."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from manitwin.api import BuildReport, build, export_twin, load, load_scene, schema
    from manitwin.index.dataset import Dataset
    from manitwin.loaded_twin import Twin
    from manitwin.scenes.loaded_scene import Scene

__all__ = ["BuildReport", "Dataset", "Scene", "Twin", "build", "export_twin", "load", "load_scene", "schema"]
_ELSEWHERE = {
    "Dataset": "manitwin.index.dataset",
    "Scene": "manitwin.scenes.loaded_scene",
    "Twin": "manitwin.loaded_twin",
}


def __getattr__(name: str) -> Any:
    """Import the public names when they are first used, so that `manitwin --help` answers at once."""
    if name not in __all__:
        raise AttributeError(f"module 'manitwin' has no attribute {name!r}; it has {', '.join(__all__)}")
    from importlib import import_module

    return getattr(import_module(_ELSEWHERE.get(name, "manitwin.api")), name)
