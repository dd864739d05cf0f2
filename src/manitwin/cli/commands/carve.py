"""``manitwin carve``: several photos of one object to one mesh, which ``manitwin build`` makes a twin of."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from manitwin.cli import options
from manitwin.cli.arguments import degrees_of
from manitwin.cli.console import err_console, out_console


def carve(
    paths: Annotated[
        list[Path],
        options.existing(
            "Photos of one object, or their folder: it is turned before the camera, or seen from its own height.",
            "PHOTO...",
            "two photos or more of one object, or their folder",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="The GLB file to write.", metavar="FILE.glb")],
    turns: Annotated[
        str | None,
        typer.Option(
            help="The camera's turn about the vertical in each photo: degrees, counter-clockwise from above, the first 0;"
            " 0,10,... goes on by equal steps.",
            metavar="0,90,180",
        ),
    ] = None,
    poses: options.Poses = None,
    units: options.Units = "auto",
    up: options.Up = "auto",
    name: Annotated[str | None, typer.Option(help="What it is: round and boxy things differ.", metavar="NAME")] = None,
) -> None:
    """Carve a textured mesh out of several photos of one object, for `manitwin build`."""
    from manitwin.errors import UsageError
    from manitwin.formats.glb import write_glb
    from manitwin.pipeline.carved_photos import carve_photos
    from manitwin.pipeline.manifest_item import unusable
    from manitwin.pipeline.view_inputs import listed_views
    from manitwin.twin.store import write_bytes_atomically

    if out.suffix.lower() != ".glb":
        raise UsageError(f"{out}: the mesh is a GLB file; give a name that ends in .glb")
    if not out.parent.is_dir():
        raise UsageError(f"{out.parent}: no folder there; make it, or give another place with -o")
    why = None if name is None else unusable("name", name)
    if why is not None:
        raise UsageError(f"--name: {why}")
    photos = listed_views(paths, poses)
    turns_deg = None if turns is None else degrees_of(turns, len(photos))
    made = carve_photos(photos, turns_deg, name, poses=poses, up=up, units=units)
    carved = made.carved
    for finding in made.findings:
        err_console.print(finding)
    write_bytes_atomically(out, write_glb([made.part]))
    filled = ", ".join(f"{o.name} {share:.0%}" for o, share in zip(carved.outlines, carved.covered, strict=True))
    said = f" --name {quote(name)}" if name else ""
    unit = " --units m" if made.metric else ""
    out_console.print(f"{out}: {len(carved.surface.faces)} faces; of each outline it fills {filled}")
    out_console.print(f"manitwin build {quote(str(out))} --up y{unit}{said} -o TWINS makes a twin of it")
