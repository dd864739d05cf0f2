"""Segmentation data sets of a run's scenes, in common training formats."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from manitwin.errors import UsageError, unknown_name_message
from manitwin.formats.output_folder import new_folder
from manitwin.scenes.perception.bop import write_bop
from manitwin.scenes.perception.cityscapes import write_cityscapes
from manitwin.scenes.perception.classes import Classes
from manitwin.scenes.perception.coco import write_coco, write_panoptic
from manitwin.scenes.perception.output import Output
from manitwin.scenes.perception.point_clouds import POINTS, write_point_clouds
from manitwin.scenes.perception.report import segmentation_page
from manitwin.scenes.perception.scene_truth import SceneTruth, read_scene_truth
from manitwin.scenes.scene_files import dataset_of, scene_files
from manitwin.twin.loaded_twin import TwinSource

VALIDATION_SHARE = 0.1
REPORT = "report.html"


@dataclass(frozen=True)
class SegmentationCounts:
    """The counts of an export."""

    scenes: int
    pictures: int
    categories: int
    part_kinds: int
    files: int


@dataclass(frozen=True)
class _ExportOptions:
    """The options of an export."""

    validation_share: float
    points: int
    twin_folder: Callable[[str], Path]


_Write = Callable[[Iterable[SceneTruth], Classes, Output, _ExportOptions], None]

FORMATS: Mapping[str, _Write] = {
    "coco": lambda scenes, classes, out, asked: write_coco(
        scenes, classes, out, validation_share=asked.validation_share
    ),
    "coco-panoptic": lambda scenes, classes, out, asked: write_panoptic(
        scenes, classes, out, validation_share=asked.validation_share
    ),
    "cityscapes": lambda scenes, classes, out, asked: write_cityscapes(
        scenes, classes, out, validation_share=asked.validation_share
    ),
    "bop": lambda scenes, classes, out, asked: write_bop(
        scenes, classes, out, twin_folder=asked.twin_folder, validation_share=asked.validation_share
    ),
    "pointcloud": lambda scenes, classes, out, asked: write_point_clouds(
        scenes, classes, out, validation_share=asked.validation_share, points=asked.points
    ),
}
"""The writers by the name of their format."""


def write_segmentation(
    scenes: str | Path,
    out: str | Path,
    form: str,
    *,
    dataset: str | Path | None = None,
    validation_share: float = VALIDATION_SHARE,
    points: int = POINTS,
) -> SegmentationCounts:
    """Write the segmentation data set of rendered scenes in one format, atomically.

    ``scenes`` is the output of ``manitwin layout --pictures``, or one scene of it. ``dataset`` is the folder of its twins, by
    default the one that the run names. ``validation_share`` of the scenes, selected by their ids, form the split ``val``.
    ``points`` limits the size of a scene's point cloud. Raises UsageError for an unknown format, scenes without pictures, or an
    ``out`` that is not empty.
    """
    if form not in FORMATS:
        raise UsageError(unknown_name_message("format", form, FORMATS))
    if not 0 <= validation_share <= 1:
        raise UsageError(f"a validation share of {validation_share:g}; give 0 to 1")
    files = scene_files(Path(scenes))
    if not files:
        raise UsageError(f"{scenes}: no scene found; create some with `manitwin layout DATASET -o {scenes} --pictures`")
    read = _Scenes(files)
    classes = Classes.from_scenes(read)
    source = TwinSource(dataset if dataset is not None else dataset_of(files[0]))
    with new_folder(Path(out)) as folder:
        written = Output(folder)
        FORMATS[form](read, classes, written, _ExportOptions(validation_share, points, source.folder))
        written.write_bytes(REPORT, segmentation_page(read, classes, form, validation_share))
        count = written.written
    pictures = sum(len(scene.pictures) for scene in read)
    return SegmentationCounts(len(files), pictures, len(classes.categories), len(classes.parts), count)


@dataclass(frozen=True)
class _Scenes:
    """The ground truth of scenes, read again in each iteration: the pictures of only one scene are in memory at a time."""

    files: Sequence[Path]

    def __iter__(self) -> Iterator[SceneTruth]:
        return map(read_scene_truth, self.files)
