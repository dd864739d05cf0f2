"""``manitwin collect``: a catalogue of what could be made into twins, and what it has."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import err_console, error_console, out_console
from manitwin.cli.documents import Json, print_document

_CAUSES_SHOWN = 20


def collect_add(
    catalogue: Annotated[
        Path, typer.Argument(help="The catalogue, an SQLite file; created if missing.", metavar="CATALOGUE")
    ],
    inputs: Annotated[
        list[Path],
        options.existing_path_argument(
            "Folders of photos and meshes, and lists of files and URLs.",
            "FOLDER|LIST.csv|LIST.jsonl...",
            "a folder, or a .csv or .jsonl list",
        ),
    ],
    source: Annotated[
        str | None, typer.Option(help="Source of the inputs, such as the name of their data set.", metavar="NAME")
    ] = None,
    licence: Annotated[
        str | None,
        typer.Option("--licence", "--license", help="Licence (SPDX identifier) of inputs without one in their list."),
    ] = None,
    attribution: Annotated[str | None, typer.Option(help="Credit for inputs without one in their list.")] = None,
    category: Annotated[str | None, typer.Option(help="Name of objects without one in their list.")] = None,
    root: Annotated[
        Path | None,
        typer.Option(
            help="Folder that the paths in a list are relative to; default: the folder of the list.", metavar="FOLDER"
        ),
    ] = None,
    alike: Annotated[
        bool,
        typer.Option(
            "--alike", help="Also compare the appearance of all files, and mark near-duplicates of earlier files."
        ),
    ] = False,
) -> None:
    """Add photos, meshes and URLs to a catalogue, each once; report unreadable files by cause and count."""
    from manitwin.dataset.collect.place_check import require_place

    for place in inputs:
        require_place(place, source, root)
    from manitwin.dataset.collect.intake import DefaultValues, add_inputs

    given = DefaultValues(source=source, licence=licence, attribution=attribution, name=category)
    for place in inputs:
        done = add_inputs(catalogue, place, given, root)
        told = f"{place}: {done.entries:,} entries: {done.new:,} new, {done.changed:,} changed, {done.unchanged:,} unchanged"
        told += f", {done.repeated:,} listed twice" if done.repeated else ""
        told += f"; {done.parts:,} files are parts of meshes" if done.parts else ""
        out_console.print(told, markup=False, soft_wrap=True)
        lines = [f"{count:,} cannot be read: {cause}" for cause, count in sorted(done.unreadable.items())]
        lines += [f"{each.count:,} not added: {each.cause} (the first: {each.example})" for each in done.refused]
        for line in lines[:_CAUSES_SHOWN]:
            error_console.print(f"  {line}", markup=False, soft_wrap=True, style="yellow")
        if len(lines) > _CAUSES_SHOWN:
            error_console.print(
                f"  and {len(lines) - _CAUSES_SHOWN} more causes: `manitwin collect status {catalogue}`"
            )
    if alike:
        from manitwin.dataset.collect.near_duplicates import mark_near_duplicates

        found = mark_near_duplicates(catalogue)
        counted = ", ".join(f"{count:,} by {by}" for by, count in found.items())
        out_console.print(f"{sum(found.values()):,} look like an earlier input: {counted}")


def collect_status(
    catalogue: Annotated[
        Path, options.existing_path_argument("A catalogue.", "CATALOGUE", "a catalogue that collect add made")
    ],
    json_: Json = False,
) -> None:
    """Summarise a catalogue: rows by group, status, licence, source and size, and unreadable files."""
    from manitwin.dataset.collect.status import catalogue_status

    status = catalogue_status(catalogue)
    if json_:
        print_document(status.document())
        return
    for line in status.lines():
        out_console.print(line, markup=False, soft_wrap=True)


def collect_plan(
    catalogue: Annotated[
        Path, options.existing_path_argument("A catalogue.", "CATALOGUE", "a catalogue that collect add made")
    ],
    out: Annotated[Path, options.output_folder("The folder to write the plan into.")],
    items: Annotated[
        int,
        typer.Option(
            help="Number of twins to build.", callback=option_values.count_callback("--items", 10_000_000), metavar="N"
        ),
    ] = 1000,
    seed: Annotated[int, typer.Option(help="Random seed of the choice.", min=0, max=options.LARGEST_SEED)] = 1,
    license: Annotated[
        list[str] | None,
        typer.Option(
            "--licence", "--license", help="Choose only inputs with this licence; may be repeated.", metavar="SPDX"
        ),
    ] = None,
    json_: Json = False,
) -> None:
    """Choose inputs evenly over groups, sizes and categories, as manifests for build, with prompts to fill shortages."""
    from manitwin.dataset.collect.store import Catalogue

    with Catalogue(catalogue) as opened:
        from manitwin.dataset.collect.plan_files import MANIFEST, PROMPTS, write_plan
        from manitwin.dataset.collect.planning import plan_inputs

        plan = plan_inputs(opened.ready(), items, seed=seed, licenses=license)
    write_plan(plan, out)
    if json_:
        print_document(
            {
                "items": plan.items,
                "chosen": len(plan.chosen),
                "prompts": len(plan.prompts),
                "groups": {name: {"wanted": plan.wanted[name], "there": plan.there[name]} for name in plan.wanted},
                "left_out": plan.left_out,
            }
        )
        return
    for name, wanted in plan.wanted.items():
        out_console.print(f"{name}: {plan.there[name]} of {wanted}")
    for cause, count in plan.left_out.items():
        out_console.print(f"left out, {cause}: {count}")
    out_console.print(f"{out / MANIFEST}: {len(plan.chosen)} inputs; {out / PROMPTS}: {len(plan.prompts)} texts")


def collect_draw(
    prompts: Annotated[
        Path,
        options.existing_path_argument(
            "A plan's folder, or a CSV of texts and names.", "PLAN|PROMPTS.csv", "a plan that collect plan made"
        ),
    ],
    images: Annotated[
        str,
        typer.Option(
            "--images",
            help="Text-to-image model: command:PROGRAM {text} {out}, fal:ENDPOINT or openai:MODEL@URL.",
            metavar="SPEC",
        ),
    ],
    out: Annotated[Path, options.output_folder("The folder to write pictures and their manifest into.")],
    config: options.Config = None,
    max_cost_usd: options.MaxCost = None,
    json_: Json = False,
) -> None:
    """Generate a picture for each prompt of a plan with a text-to-image model; rerun the command to resume."""
    from manitwin.config import BuildConfig, load_config
    from manitwin.dataset.collect.text_to_image import ANSWERS, MANIFEST, draw_pictures, read_prompts

    settings = BuildConfig() if config is None else load_config(config)
    if max_cost_usd is not None:
        limited = settings.services.model_copy(update={"max_cost_usd": max_cost_usd})
        settings = settings.model_copy(update={"services": limited})
    wanted = read_prompts(prompts)
    from manitwin.models.text_to_image.choose import choose_text_to_image

    painter = choose_text_to_image(images, settings, out / ANSWERS)
    done = draw_pictures(
        wanted, out, painter, settings, said=lambda line: err_console.print(line, markup=False, soft_wrap=True)
    )
    if json_:
        print_document(
            {
                "prompts": len(wanted),
                "made": done.made,
                "there": done.there,
                "refused": done.refused,
                "usd": done.usd,
                "stopped": done.stopped,
            }
        )
        return
    told = f"{out / MANIFEST}: {done.made} drawn, {done.there} there before, {done.refused} refused, {done.usd:.4f} USD"
    out_console.print(told, markup=False, soft_wrap=True)
    if done.stopped is not None:
        error_console.print(done.stopped, markup=False, soft_wrap=True, style="yellow")
