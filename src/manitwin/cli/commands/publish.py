"""``manitwin publish``: a data set, or episodes, with a card and licences as others can download it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import options
from manitwin.cli.console import err_console, out_console, print_layout_notice
from manitwin.cli.option_values import LARGEST_COUNT

if TYPE_CHECKING:
    from manitwin.dataset.publish.publish import Published, ShardDone
    from manitwin.episodes.publication.publish import PublishedEpisodes

SHARD_SIZE_MB = 1000  # as in publish/publish.py, which is imported when it is needed


def publish(
    dataset: Annotated[
        str,
        options.existing_path_argument(
            "A data set (a folder or a URL), or a folder of episodes.",
            "DATASET|EPISODES",
            "the folder or URL of a data set",
        ),
    ],
    out: Annotated[str, options.output_folder("New folder or URL, or an earlier publication to update.")],
    license_allow: Annotated[
        str | None,
        typer.Option(help="Licences to publish, separated by commas (CC-BY-4.0,CC0-1.0); default: all but 'unknown'."),
    ] = None,
    with_rehearsals: Annotated[
        bool,
        typer.Option("--with-rehearsals", help="Also publish twins built with a rehearsal server (manitwin fake)."),
    ] = False,
    shard_size_mb: Annotated[
        int, typer.Option(help="Largest size of a shard, in MB (10^6 bytes).", min=1, max=1_000_000)
    ] = SHARD_SIZE_MB,
    twins_per_shard: Annotated[
        int | None, typer.Option(help="Largest number of twins per shard; default: no limit.", min=1, max=LARGEST_COUNT)
    ] = None,
    twins: options.Twins = None,
    name: Annotated[
        str | None, typer.Option(help="Name of the data set on the card; default: the name of OUT.")
    ] = None,
) -> None:
    """Write a data set as WebDataset shards, Parquet tables and a data card; or episodes as a LeRobot data set with a card."""
    from manitwin.dataset.publish.publish import publish_dataset
    from manitwin.episodes.attempts import ATTEMPTS
    from manitwin.errors import UsageError
    from manitwin.twin.dataset_root import DatasetRoot

    allowed = None if license_allow is None else license_allow.split(",")
    root = DatasetRoot(dataset)
    print_layout_notice(root)
    if root.local is not None and root.exists(ATTEMPTS):
        if twins_per_shard is not None or shard_size_mb != SHARD_SIZE_MB:
            raise UsageError(
                f"{dataset}: contains episodes, which are not written as shards; leave out the shard options"
            )
        _publish_episodes(root.local, out, allowed, twins, name, with_rehearsals)
        return
    if twins is not None:
        raise UsageError(f"{dataset}: contains no episodes; --twins applies to episodes only, leave it out")
    published = publish_dataset(
        dataset,
        out,
        license_allow=allowed,
        with_rehearsals=with_rehearsals,
        shard_size_mb=shard_size_mb,
        twins_per_shard=twins_per_shard,
        name=name,
        on_shard=_say_shard,
    )
    for line in outcome_lines(published):
        out_console.print(line)
    out_console.print(f"in {out}")


def _publish_episodes(
    episodes: Path, out: str, allowed: list[str] | None, twins: str | None, name: str | None, rehearsals: bool
) -> None:
    from manitwin.episodes.publication.publish import publish_episodes

    published = publish_episodes(
        episodes, out, license_allow=allowed, with_rehearsals=rehearsals, twins=twins, name=name
    )
    lines = [
        f"{published.episodes:,} episodes of {published.twins:,} twins, {published.frames:,} frames; "
        f"{published.files:,} files, {published.bytes / 1e6:,.1f} MB",
        *_unpublished_lines(published),
    ]
    for line in (*lines, f"in {out}"):
        out_console.print(line)


def _unpublished_lines(published: Published | PublishedEpisodes) -> list[str]:
    lines = []
    if published.left_out:
        by_licence = ", ".join(f"{name} {count:,}" for name, count in published.left_out.items())
        lines.append(f"{sum(published.left_out.values()):,} left out by licence: {by_licence}")
    if published.rehearsals:
        lines.append(f"{published.rehearsals:,} left out: made with a rehearsal server (manitwin fake)")
    if published.without_attribution:
        lines.append(f"{published.without_attribution:,} have a licence that requires attribution, but no attribution")
    return lines


def outcome_lines(published: Published) -> list[str]:
    """Return what to say of a publication: what went out, and what did not and why."""
    kept = f", {published.kept_shards:,} of them unchanged" if published.kept_shards else ""
    lines = [
        f"{published.twins:,} twins in {published.shards:,} shards{kept}; "
        f"{published.files:,} files, {published.bytes / 1e6:,.1f} MB"
    ]
    if published.rejected:
        lines.append(f"{published.rejected:,} rejected twins are not published")
    return lines + _unpublished_lines(published)


def _say_shard(done: ShardDone) -> None:
    what = "there already" if done.kept else "written"
    err_console.print(f"{done.number}/{done.total} {done.name} {what}")
