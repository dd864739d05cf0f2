"""``manitwin audit``: is this asset true?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import err_console, write_json, write_text
from manitwin.cli.output_file import write_output
from manitwin.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from manitwin.assets.audit.finding import Audited, RuleText


def audit(
    paths: Annotated[
        list[Path] | None,
        options.existing_path_argument("Assets, or folders of assets.", "PATH...", "an asset, or a folder of them"),
    ] = None,
    select: Annotated[
        str | None, typer.Option(help="Check only these rules: codes or prefixes of codes.", metavar="A,B")
    ] = None,
    ignore: Annotated[str | None, typer.Option(help="Skip these rules.", metavar="A,B")] = None,
    format: Annotated[
        str,
        option_values.AUDIT_FORMATS.option(
            "--format", "-f", help="Output format: text, json or sarif.", metavar="FORMAT"
        ),
    ] = "text",
    engines: Annotated[
        str | None,
        option_values.AUDIT_ENGINES.option(
            help="Also drop each asset in these engines: mujoco, sapien, pybullet.", metavar="A,B"
        ),
    ] = None,
    engine: Annotated[
        str | None,
        option_values.AUDIT_ENGINE.option(
            help="Judge collision geometry as this engine loads it: mujoco, pybullet, sapien, physx or gazebo.",
            metavar="ENGINE",
        ),
    ] = None,
    fix: Annotated[bool, typer.Option("--fix", help="Apply safe fixes; the original files are kept as .orig.")] = False,
    jobs: Annotated[int, typer.Option("--jobs", "-j", min=1, max=options.MOST_JOBS, help="Number of processes.")] = 1,
    baseline: Annotated[
        Path | None,
        typer.Option(help="Baseline of known findings, which are not reported and cause no error.", metavar="FILE"),
    ] = None,
    write_baseline: Annotated[
        Path | None, typer.Option(help="Write all findings as a baseline, and exit with status 0.", metavar="FILE")
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(help="Also write an HTML page of all findings, with pictures of the worst.", metavar="FILE"),
    ] = None,
    explain: Annotated[str | None, typer.Option(help="Explain a rule and exit.", metavar="CODE")] = None,
) -> None:
    """Find errors in assets of any tool: mass, inertia, collision, scale, frames, grasps. Exit status 1 on errors."""
    if explain is not None:
        _explain(explain)
        return
    if not paths:
        raise UsageError("no PATH given; name assets or folders of them, or --explain CODE")
    from manitwin.assets.audit.baseline import read_baseline
    from manitwin.assets.audit.run import audit_all, check_engines, find_all, rules_selected
    from manitwin.assets.read import VALID_ASSETS

    known = None if baseline is None else read_baseline(baseline)
    rules = rules_selected((select or "").split(","), (ignore or "").split(","))
    if not rules:
        raise UsageError("--select and --ignore exclude all rules; leave one of them out")
    run_in = check_engines((engines or "").split(",") if engines else ())
    fragments: list[Path] = []
    templates: list[Path] = []
    assets = find_all(paths, fragments, templates)
    if not assets:
        raise UsageError(f"{', '.join(map(str, paths))}: no asset of a known format; {VALID_ASSETS}")
    audited = []
    for each in audit_all(assets, rules, jobs=jobs, fix=fix, named=paths, engines=run_in, engine=engine):
        each = each if known is None else known.without_known(each)
        audited.append(each)
        if format == "text":
            _write_text(each, len(assets) > 1)
    _print_skipped_files(fragments, templates)
    _write_summary(audited, rules, format)
    if html is not None:
        _write_page(audited, rules, html, paths)
    if write_baseline is not None:
        _write_baseline(audited, write_baseline)
        return
    raise typer.Exit(1 if any(f.severity == "error" for each in audited for f in each.findings) else 0)


def _explain(code: str) -> None:
    from manitwin.assets.audit.report import explanation
    from manitwin.assets.audit.selection import rule_of

    write_text(explanation(rule_of(code)) + "\n")


def _print_skipped_files(fragments: Sequence[Path], templates: Sequence[Path]) -> None:
    if fragments:
        err_console.print(
            f"{len(fragments)} descriptions without a shape, or layers of others, are no assets and were left alone"
        )
    if templates:
        err_console.print(
            f"{len(templates)} templates, whose numbers are words for a program to fill in, are no assets and were left alone:"
            f" {', '.join(file.name for file in templates[:3])}{' ...' if len(templates) > 3 else ''}"
        )


def _write_text(each: Audited, one_of_several: bool) -> None:
    from manitwin.assets.audit.report import SAID_ONCE, text_of

    text = text_of(each, leave=SAID_ONCE if one_of_several else ())
    if text:
        write_text(text + "\n")


def _write_baseline(audited: Sequence[Audited], file: Path) -> None:
    from manitwin.assets.audit.baseline import baseline_text

    write_output(file, baseline_text(audited, file))
    err_console.print(f"{file}: baseline of the findings; pass it with --baseline")


def _write_page(audited: Sequence[Audited], rules: Sequence[RuleText], file: Path, named: Sequence[Path]) -> None:
    from manitwin.assets.audit.picture import audited_picture
    from manitwin.assets.root import root_of
    from manitwin.web.audit_page import audit_page, shown_assets

    pictures = {}
    for each in shown_assets(audited):
        picture = audited_picture(Path(each.asset), root_of(Path(each.asset), named))
        if picture is not None:
            pictures[each.asset] = picture
    write_output(file, audit_page(audited, rules, pictures))
    err_console.print(f"{file}: page of all findings")


def _write_summary(audited: Sequence[Audited], rules: Sequence[RuleText], format: str) -> None:
    from manitwin.assets.audit.report import MANY, digest, json_of, sarif_of, shared_text, summary

    if format == "text":
        shared = shared_text(audited) if len(audited) > 1 else ""
        if shared:
            write_text(shared + "\n")
        if len(audited) >= MANY:
            write_text(digest(audited, rules) + "\n")
        write_text(summary(audited) + "\n")
        return
    write_json(json_of(audited) if format == "json" else sarif_of(audited, rules))
    err_console.print(summary(audited))
