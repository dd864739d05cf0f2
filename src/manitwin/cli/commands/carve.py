"""``manitwin carve``: several photos of one object to one mesh, which ``manitwin build`` makes a twin of."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from manitwin.cli import options
from manitwin.cli.arguments import parse_azimuths_deg
from manitwin.cli.console import err_console, out_console


def carve(
    paths: Annotated[
        list[Path],
        options.existing_path_argument(
            "Photos of one object, or their folder: of a turntable, or taken from the height of the object.",
            "PHOTO...",
            "two photos or more of one object, or their folder",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="The GLB file to write.", metavar="FILE.glb")],
    turns: Annotated[
        str | None,
        typer.Option(
            help="Azimuth of the camera in each photo, in degrees, counter-clockwise from above, the first 0;"
            " 0,10,... continues in equal steps.",
            metavar="0,90,180",
        ),
    ] = None,
    poses: options.Poses = None,
    units: options.Units = "auto",
    up: options.Up = "auto",
    name: Annotated[
        str | None,
        typer.Option(help="Name of the object; round and boxy objects are reconstructed differently.", metavar="NAME"),
    ] = None,
) -> None:
    """Reconstruct a textured mesh from several photos of one object by space carving, for `manitwin build`."""
    from manitwin.errors import UsageError
    from manitwin.formats.glb import write_glb
    from manitwin.pipeline.carved_photos import carve_photos
    from manitwin.pipeline.manifest_item import unusable
    from manitwin.pipeline.view_inputs import listed_views
    from manitwin.twin.store import write_bytes_atomically

    if out.suffix.lower() != ".glb":
        raise UsageError(f"{out}: the mesh is written as GLB; give a name that ends in .glb")
    if not out.parent.is_dir():
        raise UsageError(f"{out.parent}: this folder does not exist; create it, or give another path with -o")
    why = None if name is None else unusable("name", name)
    if why is not None:
        raise UsageError(f"--name: {why}")
    photos = listed_views(paths, poses)
    turns_deg = None if turns is None else parse_azimuths_deg(turns, len(photos))
    made = carve_photos(photos, turns_deg, name, poses=poses, up=up, units=units)
    carved = made.carved
    for finding in made.findings:
        err_console.print(finding)
    write_bytes_atomically(out, write_glb([made.part]))
    filled = ", ".join(f"{o.name} {share:.0%}" for o, share in zip(carved.photos, carved.covered_shares, strict=True))
    said = f" --name {quote(name)}" if name else ""
    unit = " --units m" if made.metric else ""
    out_console.print(f"{out}: {len(carved.surface.faces)} faces; of each outline it fills {filled}")
    out_console.print(f"manitwin build {quote(str(out))} --up y{unit}{said} -o TWINS builds a twin of it")
