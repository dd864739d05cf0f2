"""Photos of a multi-photo object that were not segmented, as recorded in the stored result of the photo stage."""

from __future__ import annotations

from functools import cached_property

from manitwin.config import BuildConfig
from manitwin.engine.amendments import read_amendments
from manitwin.engine.stage import Draft
from manitwin.engine.stage_runner import is_complete_result, stage_key
from manitwin.models.matting.learned import find_networks
from manitwin.pipeline.item import Item
from manitwin.pipeline.photo import PhotosStage
from manitwin.pipeline.settings import stored_config
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import WORK


class PhotosLeftOut:
    """The photos that a data set's configuration leaves out of its multi-photo items."""

    def __init__(self, root: DatasetRoot):
        self._root = root

    def of(self, twin_id: str, item: Item) -> list[int]:
        """Return the indices, from 0, of an object's photos that were left out while others were segmented.

        Empty if all or none were segmented, and if the stage's result is not stored here or is of another version. Raises
        UsageError if the data set's networks cannot be found.
        """
        if self._root.local is None:
            return []
        draft = Draft(twin_id, item, self._config.seed, amendments=read_amendments(self._root, twin_id))
        place = self._root.local / WORK / twin_id / self._stage.name / stage_key(self._stage, draft)
        if not is_complete_result(place, digests=False):
            return []
        cut_out = {int(picture.stem) for picture in (place / "photos").glob("*.png")}
        return [number for number in range(len(item.files)) if number not in cut_out]

    @cached_property
    def _config(self) -> BuildConfig:
        return stored_config(self._root)

    @cached_property
    def _stage(self) -> PhotosStage:
        named = self._config.matting.network
        return PhotosStage(self._config.matting, () if named is None else find_networks(named))
