"""``manitwin locate``: the pose of a twin in a new view, or which twins of a data set are in it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import print_embedded_twin
from manitwin.cli.documents import Json, print_document
from manitwin.cli.location_lines import print_frames, print_grasps, print_layout, print_size, print_thing
from manitwin.cli.view_files import ViewFiles
from manitwin.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from manitwin.scenes.locate.recognition import ViewedObject


def _file(help: str, remedy: str) -> Any:
    return typer.Option(help=help, metavar="FILE", callback=option_values.existing_path_callback(remedy))


def locate(
    source: Annotated[
        Path,
        options.existing_path_argument(
            "The twin to look for, or a data set of twins.", "TWIN|DATASET", "a twin's folder or a data set"
        ),
    ],
    seen: Annotated[
        Path | None,
        typer.Option(
            "--view",
            help="Folder written by manitwin capture, in place of --depth, --camera, --rgb and --base.",
            metavar="FOLDER",
            callback=option_values.existing_path_callback("a folder that manitwin capture wrote"),
        ),
    ] = None,
    depth: Annotated[
        Path | None, _file("Depth image: PNG with one channel; 0 means unknown.", "a depth picture")
    ] = None,
    camera: Annotated[
        Path | None, _file("Camera intrinsics, JSON: fx, fy, cx, cy, width, height, depth_unit_m.", "a camera's JSON")
    ] = None,
    mask: Annotated[
        Path | None,
        _file(
            "Mask of the object: PNG with one channel, 0 elsewhere; default: everything on the table.",
            "a mask of the object",
        ),
    ] = None,
    rgb: Annotated[Path | None, _file("Colour image, aligned with the depth image.", "a picture")] = None,
    cloud: Annotated[
        Path | None,
        _file(
            "Point cloud of the object in the camera frame (.ply or .npz), instead of images.",
            "a point cloud of the object",
        ),
    ] = None,
    tried: Annotated[
        int,
        typer.Option(
            help="With a data set: number of most similar twins to try for each object.",
            callback=option_values.count_callback("--tried"),
        ),
    ] = 5,
    estimator: Annotated[
        str | None,
        typer.Option(
            help="Pose estimator instead of the built-in search: 'command:PROGRAM {request} {out}', or http://HOST:PORT.",
            metavar="SPEC",
        ),
    ] = None,
    grasps: Annotated[
        bool,
        typer.Option(
            "--grasps", help="Also print the verified grasps that are collision-free in the view, best first."
        ),
    ] = False,
    fit_size: Annotated[
        bool,
        typer.Option(
            "--fit-size",
            help="Also estimate the size, from half to twice that of the twin; a twin from one photo has a guessed size.",
        ),
    ] = False,
    base: Annotated[
        Path | None,
        _file(
            "Calibration, JSON: the camera pose in the frame of the robot base, camera_to_base.",
            "the JSON file of a calibration",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        option_values.ROBOTS.option(
            help="Also print the free grasps that this robot reaches; needs --base, implies --grasps."
        ),
    ] = None,
    out: Annotated[
        Path | None, options.new_folder("New folder for location.json, overlays, and the scene as a layout.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Random seed.", min=0, max=options.LARGEST_SEED)] = 0,
    gripper: options.OwnGrippers = None,
    json_: Json = False,
) -> None:
    """Estimate the pose of a twin in a depth image; report ambiguous poses, and objects that are not the twin."""
    files = ViewFiles(depth, camera, mask, rgb, cloud, base)
    if seen is not None:
        files = files.with_captured(seen)
    grasps = grasps or robot is not None
    files.check(grasps=grasps, robot=robot)
    from manitwin.cli.twin_location import find_twin, find_twin_of_any_size, find_twins, located_scene_or_reason
    from manitwin.config import ServicesConfig
    from manitwin.episodes.located_view import LocatedView
    from manitwin.models.pose_estimators.from_spec import pose_estimator
    from manitwin.robots.grippers.gripper import load_gripper
    from manitwin.scenes.locate.hand_eye_file import read_camera_to_base
    from manitwin.scenes.locate.layout_files import dataset_of_twin, layout_document
    from manitwin.scenes.locate.located_scene import LocatedScene
    from manitwin.scenes.locate.report import location_document, things_document, write_location
    from manitwin.twin.dataset_root import DatasetRoot
    from manitwin.twin.loaded_twin import Twin
    from manitwin.twin.store import RECORD

    model = None if estimator is None else pose_estimator(estimator, ServicesConfig())
    camera_to_base = None if files.base is None else read_camera_to_base(files.base)
    one = Twin(source) if (source / RECORD).exists() else None
    dataset = DatasetRoot(source).absolute() if one is None else dataset_of_twin(source)
    if fit_size and (one is None or estimator is not None):
        raise UsageError(
            "--fit-size: works with one twin and the built-in search; give a twin, and leave out --estimator"
        )
    grippers = [load_gripper(name) for name in gripper or ()]
    view, masks = files.read(seed)
    if one is None:
        found = find_twins(DatasetRoot(source), view, masks, model, tried=tried, seed=seed, on_twin=print_embedded_twin)
    elif fit_size:
        found = find_twin_of_any_size(one, view, masks, seed)
    else:
        found = find_twin(one, view, masks, model, seed)
    things = found.things
    place = LocatedView(view, list(zip(things, found.twins, strict=True)), camera_to_base, robot, seed, grippers)
    usable = grasps and found.has_true_size
    carried = [place.grasps(number) if usable else None for number in range(len(things))]
    rests = [place.placements(number) if usable else () for number in range(len(things))]
    if one is not None:
        document = location_document(things[0], one, carried[0], found.estimator, rests[0], found.size)
    else:
        document = things_document(str(source), place.things, carried, found.estimator, rests)
    layout, written = None, None
    if out is not None and any(thing.location.poses for thing in things):
        scene = located_scene_or_reason(place, found, dataset, of_cloud=cloud is not None)
        layout = layout_document(scene)
        if isinstance(scene, LocatedScene) and dataset is not None:
            written = scene, dataset
    document["layout"] = layout
    if out is not None:
        write_location(out, document, view, things, written)
    if json_:
        print_document(document)
    else:
        _print_located_objects(
            things, [document] if one is not None else document["things"], one is None, grasps, usable
        )
        print_layout(layout, out)
    raise typer.Exit(0 if any(thing.location.status != "none" for thing in things) else 3)


def _print_located_objects(
    things: Sequence[ViewedObject], told: Sequence[dict[str, Any]], of_many: bool, grasps: bool, usable: bool
) -> None:
    """Say what was found of each thing; ``usable``: grasps and placements were asked for, and hold at the size that it has."""
    for thing, said in zip(things, told, strict=True):
        print_thing(thing, said["name"] or said["twin_id"], of_many)
        print_size(said.get("size"), grasps)
        print_grasps(said["grasps"])
        print_frames(said["functional"], said["placements"] if usable else None)
