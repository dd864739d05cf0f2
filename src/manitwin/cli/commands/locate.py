"""``manitwin locate``: the pose of a twin in a new view."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import choices, options
from manitwin.cli.console import out_console
from manitwin.cli.documents import Json, print_document

if TYPE_CHECKING:
    from manitwin.scenes.locate.estimate import Location


def _file(help: str, remedy: str) -> object:
    return typer.Option(help=help, metavar="FILE", callback=choices.must_exist(remedy))


def locate(
    twin: Annotated[Path, options.existing("The twin to look for.", "TWIN", "a folder that manitwin build made")],
    depth: Annotated[
        Path | None, _file("A depth picture: PNG of one channel; 0 is unknown.", "a depth picture")
    ] = None,
    camera: Annotated[
        Path | None, _file("JSON of its camera: fx, fy, cx, cy, width, height, depth_unit_m.", "a camera's JSON")
    ] = None,
    mask: Annotated[
        Path | None, _file("Where the thing is: PNG of one channel, 0 where it is not.", "a mask of the thing")
    ] = None,
    rgb: Annotated[Path | None, _file("The colours, aligned with the depths.", "a picture")] = None,
    cloud: Annotated[
        Path | None,
        _file("Instead: the points of the thing in the camera's frame, .ply or .npz.", "a cloud of the thing's points"),
    ] = None,
    out: Annotated[Path | None, options.output_folder("A new folder for location.json and overlay.png.")] = None,
    seed: Annotated[int, typer.Option(help="The seed of what is sampled.", min=0, max=options.LARGEST_SEED)] = 0,
    json_: Json = False,
) -> None:
    """Find where a twin is in a depth picture: its pose, several that look the same, or that it is not what is seen."""
    from manitwin.errors import UsageError

    pictures = {"--depth": depth, "--camera": camera, "--mask": mask}
    if cloud is not None and any(each is not None for each in (*pictures.values(), rgb)):
        raise UsageError("--cloud: is a view by itself; leave out --depth, --camera, --mask and --rgb")
    if cloud is None and (missing := [name for name, each in pictures.items() if each is None]):
        raise UsageError(f"{', '.join(missing)}: missing; give --depth, --camera and --mask, or --cloud")
    from manitwin.scenes.locate.estimate import locate_in_view
    from manitwin.scenes.locate.input_files import read_cloud, read_view
    from manitwin.scenes.locate.pose_model import PoseModel
    from manitwin.scenes.locate.report import location_document, write_location
    from manitwin.twin.loaded_twin import Twin

    loaded = Twin(twin)
    if cloud is not None:
        view, shown = read_cloud(cloud)
    else:
        assert depth is not None and camera is not None
        view, told = read_view(depth, camera, rgb, mask)
        assert told is not None
        shown = told
        if not shown.any():
            raise UsageError(f"{mask}: is empty: it shows no pixel of a thing; give a mask of the thing to locate")
    model = PoseModel.of_twin(loaded)
    location = locate_in_view(view, shown, model, seed=seed)
    document = location_document(location, loaded, model)
    if out is not None:
        write_location(out, document, view, shown, model, location)
    if json_:
        print_document(document)
    else:
        _print(location, loaded.record.name or loaded.record.twin_id)
    raise typer.Exit(3 if location.status == "none" else 0)


def _print(location: Location, name: str) -> None:
    if location.status == "none":
        out_console.print(f"not {name}: {location.reason}")
        return
    out_console.print(f"{name}: {location.status}; {location.reason}")
    for pose in location.poses:
        x, y, z = pose.object_to_camera[:3, 3]
        out_console.print(
            f"  score {pose.score:.3f}, {pose.visible_share:.0%} of it seen, at {x:.4f} {y:.4f} {z:.4f} m in the camera's frame"
        )
