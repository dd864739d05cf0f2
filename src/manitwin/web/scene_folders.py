"""Access to the scenes of a run by id, and to their twins."""

from __future__ import annotations

from pathlib import Path

from manitwin.errors import UsageError
from manitwin.scenes.scene import SceneRecord
from manitwin.scenes.scene_files import dataset_of, read_scene, scene_files
from manitwin.web.served_files import TwinFolders


def has_scenes(place: str) -> bool:
    """Return whether a place holds scenes: a run of ``manitwin layout``, a scene's folder or its file."""
    return "://" not in place and bool(scene_files(Path(place)))


class SceneFolders:
    """The scenes at a place in id order, and ``twins`` of the data set that they were sampled from.

    ``cache`` stores the twins of a data set at a URL. Raises UsageError if there are no scenes, or their data set is missing.
    """

    def __init__(self, place: str, cache: Path):
        files = scene_files(Path(place))
        if not files:
            raise UsageError(f"{place}: no scene there; `manitwin layout DATASET -o {place}` makes some")
        self._files = {file.parent.name: file for file in files}
        self.ids = sorted(self._files)
        dataset = dataset_of(files[0])
        self.twins = TwinFolders(dataset, cache if "://" in dataset else None, "put it back, or make the scenes again")

    def scene(self, scene_id: str) -> SceneRecord:
        """Return a scene; raises UsageError if the id is unknown or it cannot be read."""
        if scene_id not in self._files:
            raise UsageError("there is no scene of this name")
        return read_scene(self._files[scene_id])

    def neighbours(self, scene_id: str) -> tuple[str | None, str | None]:
        """Return the ids of the previous and the next scene; None at the ends."""
        at = self.ids.index(scene_id)
        return (self.ids[at - 1] if at else None), (self.ids[at + 1] if at + 1 < len(self.ids) else None)
