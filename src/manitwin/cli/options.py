"""The options that commands share: each is written once."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from manitwin.cli import option_values

if TYPE_CHECKING:
    from manitwin.config import Section

MOST_JOBS = 1024
LARGEST_SEED = 2**63 - 1
"""As in ``config``, which takes a while to import; a test keeps them the same."""

Text = Annotated[
    list[str] | None,
    typer.Option("--text", help="An object to make from a description alone; may be repeated.", metavar="WORDS"),
]
Units = Annotated[
    str, option_values.UNITS.option(help="Units of meshes, or of --poses: m, cm, mm, none (unknown scale) or auto.")
]
Up = Annotated[str, option_values.UP.option(help="Up axis of meshes, or of --poses: y, z or auto.")]
LongestSide = Annotated[
    float | None,
    typer.Option(
        "--longest-side",
        help="Longest of length, width and height of the object as it stands, in metres. Default for photos: the usual size.",
        metavar="METRES",
        callback=option_values.amount_callback("--longest-side", option_values.LARGEST_SIDE_M),
    ),
]
Mask = Annotated[
    Path | None,
    typer.Option(
        "--mask",
        help="Mask of the object, as large as the photo: white on the object, black elsewhere.",
        metavar="FILE",
    ),
]
Box = Annotated[
    str | None,
    typer.Option(
        "--box",
        help="Box around the object: left,top,right,bottom in pixels of the upright photo.",
        metavar="120,80,410,395",
    ),
]
License = Annotated[str | None, typer.Option(help="Licence of the inputs (SPDX identifier).")]
Attribution = Annotated[str | None, typer.Option(help="Whom to credit for the inputs.")]
Strict = Annotated[bool, typer.Option("--strict", help="Treat an unknown manifest column as an error.")]
Jobs = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        "-j",
        help="Number of processes; default: one per core, as memory allows.",
        callback=option_values.count_callback("jobs", MOST_JOBS),
    ),
]
Seed = Annotated[
    int | None,
    typer.Option(help="Random seed; default: the one in the configuration.", min=0, max=LARGEST_SEED),
]
Executor = Annotated[
    str,
    option_values.EXECUTORS.option(
        help="Where to run: local (processes), ray (a cluster) or inline (this process, for a debugger)."
    ),
]
Address = Annotated[
    str | None, typer.Option(help="Address of the Ray cluster ('auto'); default: start one on this machine.")
]
Config = Annotated[Path | None, typer.Option(help="A TOML file of settings.", callback=option_values.settings_file)]
Grippers = Annotated[
    list[str] | None,
    option_values.GRIPPERS.option(
        "--gripper", help="Gripper to verify grasps for; may be repeated. The first is the main gripper of the twin."
    ),
]
OwnGrippers = Annotated[
    list[str] | None,
    option_values.GRIPPERS.option(
        "--gripper", help="File of a custom gripper that the twins were built with; may be repeated."
    ),
]
Vlm = Annotated[
    str | None,
    option_values.ANNOTATORS.option(
        help="Annotator: openai:MODEL@URL, anthropic:MODEL, replay:FILE, or rules (built in).", metavar="SPEC"
    ),
]
Generator = Annotated[
    str | None,
    option_values.GENERATORS.option(
        help="Mesh generator: rodin, tripo, meshy, hunyuan3d@URL, fal:ENDPOINT, 'command:...', or lift (built in).",
        metavar="SPEC",
    ),
]
Grasper = Annotated[
    str | None,
    option_values.GRASPERS.option(
        help="Grasp proposer: graspgen@tcp://HOST:PORT, graspgenx@..., or antipodal (built in).", metavar="SPEC"
    ),
]
Matting = Annotated[
    str | None,
    option_values.MATTING.option(
        help="Matting networks: isnet, u2net (manitwin models add), a .onnx file, two separated by a comma; or none.",
        metavar="NETWORKS",
    ),
]
MaxCost = Annotated[
    float | None,
    typer.Option(
        "--max-cost",
        help="Limit on the total charges of services in USD; the run then stops and can be resumed.",
        callback=option_values.amount_callback("--max-cost", option_values.LARGEST_COST_USD),
    ),
]
RequireAgreement = Annotated[
    bool, typer.Option("--require-agreement", help="Verify only grasps that hold in both physics engines.")
]
SecondOpinion = Annotated[
    str | None,
    option_values.SECOND_OPINIONS.option(
        "--second-opinion", help="Grasps that the second engine tries: all that held, or a sample of 20."
    ),
]
Quick = Annotated[bool, typer.Option("--quick", help="One trial per grasp: no second opinion, no robustness trials.")]
Link = Annotated[
    str | None,
    typer.Option(
        "--link", help="Articulated objects: verify grasps on this link only, with the joints locked.", metavar="NAME"
    ),
]
Twins = Annotated[
    str | None,
    typer.Option(help="Where the twins are now, if they were moved.", metavar="DATASET"),
]
Record = Annotated[
    Path | None,
    typer.Option(help="Append every answer of the model to this file, for --vlm replay:FILE.", metavar="FILE"),
]
Count = Annotated[
    int,
    typer.Option(
        min=1,
        max=100_000,
        help="Variations of each text to make: of the measures, colours and materials that it leaves open.",
    ),
]
Views = Annotated[
    bool,
    typer.Option(
        "--views", help="The inputs are photos of one object, or their folder: build one twin from all of them."
    ),
]
Turns = Annotated[
    str | None,
    typer.Option(
        help="Azimuth of the camera in each photo of --views, in degrees, counter-clockwise from above; 0,10,... continues in"
        " equal steps.",
        metavar="0,90,180",
    ),
]
Poses = Annotated[
    Path | None,
    typer.Option(
        help="Camera poses of several photos of one object: a transforms.json (NeRF, instant-ngp) or the folder of a COLMAP"
        " model.",
        metavar="FILE",
    ),
]
Name = Annotated[str | None, typer.Option(help="Name of the object ('mug'); it selects the priors.")]
DryRun = Annotated[
    bool, typer.Option("--dry-run", help="Print what would be done and the estimated cost; write nothing.")
]

OF_INPUTS: dict[str, tuple[Any, Any]] = {
    "name": (Name, None), "units": (Units, "auto"), "up": (Up, "auto"), "longest_side_m": (LongestSide, None),
    "mask": (Mask, None), "box_px": (Box, None),
    "license": (License, None), "attribution": (Attribution, None),
}  # fmt: skip
"""What holds for all inputs of a build, by the names of ``manitwin.build``: annotation and default."""

FLAGS: dict[str, tuple[Any, Any]] = {
    "seed": (Seed, None), "grippers": (Grippers, None), "vlm": (Vlm, None), "generator": (Generator, None),
    "grasper": (Grasper, None), "matting": (Matting, None), "max_cost_usd": (MaxCost, None), "record": (Record, None),
    "require_agreement": (RequireAgreement, False), "second_opinion": (SecondOpinion, None), "quick": (Quick, False),
    "link": (Link, None),
}  # fmt: skip
"""What is said on top of the configuration: the options of ``pipeline.settings.Flags``, by its names."""

RUN: dict[str, tuple[Any, Any]] = {
    "seed": (Seed, None), "config": (Config, None), "jobs": (Jobs, None), "executor": (Executor, "local"),
    "address": (Address, None),
}  # fmt: skip
"""Options of a run that makes scenes, episodes or pictures: ``read_settings`` and ``placed`` take them."""

Settings = TypeVar("Settings", bound="Section")


def existing_path_argument(help: str, metavar: str, remedy: str) -> Any:
    """Return the argument of places that must be there; ``remedy`` says what to give."""
    return typer.Argument(help=help, metavar=metavar, callback=option_values.existing_path_callback(remedy))


def output_folder(help: str) -> Any:
    """Return the option ``--out`` of a folder that can be written."""
    return typer.Option("--out", "-o", help=help, callback=option_values.check_output_folder)


def new_folder(help: str) -> Any:
    """Return the option ``--out`` of a folder that can be written and is empty or not there: asked before any work."""
    return typer.Option("--out", "-o", help=help, callback=option_values.check_new_folder)


def with_options(
    options: Mapping[str, tuple[Any, Any]], before: str = ""
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that gives a command ``options`` as well, for typer, which reads a signature.

    They come behind the command's own, or ``before`` the one of that name, or in place of one of their own name; a parameter
    that collects keywords gets them.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @wraps(command)
        def call(**given: Any) -> None:
            command(**given)

        own = inspect.signature(command, eval_str=True)
        kept = [each for each in own.parameters.values() if each.kind is not inspect.Parameter.VAR_KEYWORD]
        added = {
            name: inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
            for name, (annotation, default) in options.items()
        }
        parameters: dict[str, inspect.Parameter] = {}
        for each in kept:
            parameters |= added if each.name == before else {}
            parameters[each.name] = each.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        parameters |= added
        call.__signature__ = own.replace(parameters=list(parameters.values()))  # type: ignore[attr-defined]
        call.__annotations__ = {each.name: each.annotation for each in parameters.values()}
        return call

    return decorate


def read_settings(kind: type[Settings], run: dict[str, Any], given: dict[str, Any]) -> Settings:
    """Return an application's settings: those of the options ``RUN`` and its own, ``given`` ones, above its TOML file's."""
    from manitwin.scenes.run_settings import load_settings

    jobs = {} if run["jobs"] is None else {"cpu": run["jobs"]}
    own = {"seed": run.get("seed"), "run": {"index_every": 0, "keep_work": False, **jobs}}
    return load_settings(kind, run["config"], {**own, **given})


def executor_settings(run: dict[str, Any]) -> dict[str, Any]:
    """Return where the options ``RUN`` say that a run is: its executor and address."""
    return {"executor": run["executor"], "address": run["address"]}
