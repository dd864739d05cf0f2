"""``manitwin search``: the twins that words describe, or that a picture shows."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import error_console, out_console, print_embedded_twin, print_layout_notice
from manitwin.cli.documents import Json, print_document

CAPTION_CHARACTERS = 60


def search(
    dataset: Annotated[
        str,
        options.existing_path_argument(
            "A data set: a folder, or, for words, a URL.", "DATASET", "the folder or URL of a data set"
        ),
    ],
    words: Annotated[str | None, typer.Argument(help='What to look for: "a blue mug".', metavar="[WORDS]")] = None,
    image: Annotated[
        Path | None,
        typer.Option(
            help="Photo or crop of one object to search for instead; transparent pixels are background.",
            metavar="FILE",
            callback=option_values.existing_path_callback("a picture of one object"),
        ),
    ] = None,
    embedder: Annotated[
        str | None,
        typer.Option(
            help="Also rank by a text embedding model: clip:FOLDER, openai:MODEL, or openai:MODEL@URL.",
            metavar="SPEC",
        ),
    ] = None,
    limit: Annotated[
        int, typer.Option(help="Maximum number of twins to print.", callback=option_values.count_callback("--limit"))
    ] = 10,
    json_: Json = False,
) -> None:
    """Print the twins that match a description, or that look like the object in a picture, best match first."""
    from manitwin.errors import UsageError
    from manitwin.twin.dataset_root import DatasetRoot

    if (words is None) == (image is None):
        raise UsageError('give either a description such as "a blue mug" or --image FILE')
    if image is not None and embedder is not None:
        raise UsageError("--embedder applies to words only; leave it out with --image")
    root = DatasetRoot(dataset)
    print_layout_notice(root)
    background: str | None = None
    if image is not None:
        from manitwin.dataset.search.search import search_picture
        from manitwin.formats.image_file import read_image

        hits, background = search_picture(root, read_image(image).pixels, limit=limit, on_twin=print_embedded_twin)
    else:
        from manitwin.config import ServicesConfig
        from manitwin.dataset.search.search import find_unknown_words, search_words
        from manitwin.models.embedders.texts import text_embedder

        model = None if embedder is None else text_embedder(embedder, ServicesConfig())
        hits = search_words(root, words or "", limit=limit, embedder=model)
        if embedder is None:
            for word, near in find_unknown_words(root, words or "").items():
                spelt = f"; spelt nearly so: {', '.join(near)}" if near else ""
                error_console.print(f"no twin has the word {word!r}{spelt}", markup=False)
    if json_:
        asked = {"words": words, "image": None if image is None else str(image)}
        print_document({**asked, "background": background, "hits": [asdict(hit) for hit in hits]})
        return
    if background == "none":
        error_console.print(
            "the object could not be separated from its background: the whole picture is compared", markup=False
        )
    for hit in hits:
        out_console.print(f"{hit.score:8.3f}  {hit.twin_id}  {hit.category}: {_cut(hit.caption)}")
    if not hits:
        out_console.print("no twin matches these words")


def _cut(text: str) -> str:
    return text if len(text) <= CAPTION_CHARACTERS else f"{text[: CAPTION_CHARACTERS - 1]}…"
