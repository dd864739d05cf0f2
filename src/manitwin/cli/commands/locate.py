"""``manitwin locate``: the pose of a twin in a new view, or which twins of a data set are in it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli import choices, options
from manitwin.cli.console import error_console, out_console
from manitwin.cli.documents import Json, print_document

if TYPE_CHECKING:
    import numpy as np

    from manitwin.scenes.locate.carried_grasps import CarriedGrasps
    from manitwin.scenes.locate.depth_view import DepthView
    from manitwin.scenes.locate.recognition import Thing
    from manitwin.twin.loaded_twin import Twin


def _file(help: str, remedy: str) -> Any:
    return typer.Option(help=help, metavar="FILE", callback=choices.must_exist(remedy))


def locate(
    source: Annotated[
        Path,
        options.existing(
            "The twin to look for, or a data set of twins.", "TWIN|DATASET", "a twin's folder or a data set"
        ),
    ],
    depth: Annotated[
        Path | None, _file("A depth picture: PNG of one channel; 0 is unknown.", "a depth picture")
    ] = None,
    camera: Annotated[
        Path | None, _file("JSON of its camera: fx, fy, cx, cy, width, height, depth_unit_m.", "a camera's JSON")
    ] = None,
    mask: Annotated[
        Path | None,
        _file(
            "Where the thing is: PNG of one channel, 0 where it is not; default: all on the table.", "a thing's mask"
        ),
    ] = None,
    rgb: Annotated[Path | None, _file("The colours, aligned with the depths.", "a picture")] = None,
    cloud: Annotated[
        Path | None,
        _file("Instead: the points of the thing in the camera's frame, .ply or .npz.", "a cloud of the thing's points"),
    ] = None,
    tried: Annotated[
        int,
        typer.Option(
            help="Twins of a data set to try of a thing, the most alike.", callback=choices.count_of("--tried")
        ),
    ] = 5,
    grasps: Annotated[
        bool, typer.Option("--grasps", help="Also which verified grasps are free of all that is seen, the best first.")
    ] = False,
    out: Annotated[Path | None, options.output_folder("A new folder for location.json and overlays.")] = None,
    seed: Annotated[int, typer.Option(help="The seed of what is sampled.", min=0, max=options.LARGEST_SEED)] = 0,
    json_: Json = False,
) -> None:
    """Find where a twin is in a depth picture: its pose, several that look the same, or that it is not what is seen."""
    from manitwin.errors import UsageError

    if cloud is not None and any(each is not None for each in (depth, camera, mask, rgb)):
        raise UsageError("--cloud: is a view by itself; leave out --depth, --camera, --mask and --rgb")
    if cloud is not None and grasps:
        raise UsageError(
            "--grasps: a cloud of the thing alone does not show what is beside it; give --depth and --camera"
        )
    needed = {"--depth": depth, "--camera": camera}
    if cloud is None and (missing := [name for name, each in needed.items() if each is None]):
        raise UsageError(f"{', '.join(missing)}: missing; give --depth and --camera, or --cloud")
    from manitwin.scenes.locate.pose_model import PoseModel
    from manitwin.scenes.locate.recognition import DatasetTwins, where_is, which_twin
    from manitwin.scenes.locate.report import location_document, things_document, write_location
    from manitwin.twin.dataset_root import DatasetRoot
    from manitwin.twin.loaded_twin import Twin
    from manitwin.twin.store import RECORD

    one = Twin(source) if (source / RECORD).exists() else None
    view, masks = _view(depth, camera, mask, rgb, cloud, seed)
    carried = _carrier(view, seed) if grasps else lambda thing, twin: None
    if one is not None:
        things = [where_is(view, masks, PoseModel.of_twin(one), seed=seed)]
        document = location_document(things[0], one, carried(things[0], one))
    else:
        twins = DatasetTwins(DatasetRoot(source), on_twin=_drawn)
        things = [which_twin(view, each, twins, tried=tried, seed=seed) for each in masks]
        document = things_document(str(source), things, twins.twin, carried)
    if out is not None:
        write_location(out, document, view, things)
    if json_:
        print_document(document)
    else:
        for thing, told in zip(things, [document] if one is not None else document["things"], strict=True):
            _print(thing, told["name"] or told["twin_id"], one is None)
            _print_grasps(told["grasps"])
    raise typer.Exit(0 if any(thing.location.status != "none" for thing in things) else 3)


def _view(
    depth: Path | None, camera: Path | None, mask: Path | None, rgb: Path | None, cloud: Path | None, seed: int
) -> tuple[DepthView, list[np.ndarray]]:
    """Return what is seen, and the masks of the things in it."""
    import numpy as np

    from manitwin.errors import UsageError
    from manitwin.scenes.locate.input_files import read_cloud, read_view
    from manitwin.scenes.locate.proposals import proposals, table_plane

    if cloud is not None:
        view, shown = read_cloud(cloud)
        return view, [shown]
    assert depth is not None and camera is not None
    view, told = read_view(depth, camera, rgb, mask)
    if told is None:
        return view, proposals(view, table_plane(view, np.random.default_rng(seed)))
    if not told.any():
        raise UsageError(f"{mask}: is empty: it shows no pixel of a thing; give a mask of the thing to locate")
    return view, [told]


def _carrier(view: DepthView, seed: int) -> Callable[[Thing, Twin], CarriedGrasps | None]:
    """Return what carries a twin's grasps to where it was found in a view, whose table is looked for once."""
    import numpy as np

    from manitwin.errors import UsageError
    from manitwin.scenes.locate.carried_grasps import carry_grasps
    from manitwin.scenes.locate.depth_view import measured_noise_m
    from manitwin.scenes.locate.proposals import table_plane

    try:
        plane = table_plane(view, np.random.default_rng(seed))
    except UsageError as error:
        raise UsageError(f"--grasps: {error}, for the hand is to keep clear of the table") from error
    noise_m = measured_noise_m(view, np.ones(view.depth_m.shape, bool))
    return lambda thing, twin: carry_grasps(thing, twin, view, plane, noise_m)


def _print_grasps(told: dict[str, Any] | None) -> None:
    if told is None:
        return
    left = f"{told['obstructed']} are obstructed, {told['uncertain']} not in every pose"
    out_console.print(
        f"  {len(told['free'])} of {told['verified']} verified grasps of {told['gripper']} are free; {left}"
    )
    for grasp in told["free"][:1]:
        x, y, z = grasp["position_m"]
        out_console.print(
            f"  the best, {grasp['grasp_id']}: at {x:.4f} {y:.4f} {z:.4f} m, {grasp['width_m'] * 1e3:.0f} mm wide"
        )


def _print(thing: Thing, name: str, is_one_of_many: bool) -> None:
    location = thing.location
    if location.status == "none":
        alike = f" (and no other of {len(thing.tried)})" if is_one_of_many else ""
        out_console.print(f"not {name}{alike}: {location.reason}")
        return
    out_console.print(f"{name}: {location.status}; {location.reason}")
    for pose in location.poses:
        x, y, z = pose.object_to_camera[:3, 3]
        out_console.print(
            f"  score {pose.score:.3f}, {pose.visible_share:.0%} of it seen, at {x:.4f} {y:.4f} {z:.4f} m in the camera's frame"
        )


def _drawn(twin_id: str) -> None:
    error_console.print(f"{twin_id}: drawn and embedded, which is kept", markup=False)
