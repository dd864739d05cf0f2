"""``manitwin prompts``: what a vision-language model is asked about a twin, written out to be read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from manitwin.cli import option_values, options
from manitwin.cli.console import out_console

if TYPE_CHECKING:
    from manitwin.config import BuildConfig


def prompts(
    twin: Annotated[
        Path, options.existing_path_argument("A twin folder.", "TWIN", "a folder that manitwin build made")
    ],
    out: Annotated[Path, options.output_folder("The folder to write the questions into.")],
    config: options.Config = None,
    vlm: Annotated[
        str, option_values.ANNOTATORS.option(help="Model, as for build; nothing is sent to it.")
    ] = "openai:MODEL",
) -> None:
    """Write the prompts that a vision-language model would receive for a twin: text, pictures, schema and cost."""
    from manitwin.cli.annotator_questions import list_annotator_questions, write_questions
    from manitwin.config import BuildConfig, load_config

    settings: BuildConfig = load_config(config) if config else BuildConfig()
    asked = list_annotator_questions(twin, settings, vlm)
    write_questions(asked, out)
    out_console.print(f"{len(asked.questions)} questions in {out}: begin with README.md")
