"""``manitwin doctor``: what is there and what is missing, and whether a served model answers."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import choices, options
from manitwin.cli.console import out_console

if TYPE_CHECKING:
    from manitwin.cli.machine_checks import Finding
    from manitwin.config import BuildConfig

KINDS = {"vlm": "annotator", "generator": "generator", "grasper": "grasper"}
"""What the command calls a kind of backend, and what the registry and the configuration do."""


def doctor(
    what: Annotated[
        str | None,
        choices.SERVED_KINDS.argument(
            help="vlm, generator or grasper: send it one small request; none: look at this machine."
        ),
    ] = None,
    vlm: Annotated[
        str | None, choices.ANNOTATORS.option(help="A VLM (openai:MODEL@URL); default: the configuration's.")
    ] = None,
    generator: Annotated[
        str | None, choices.GENERATORS.option(help="A generator (rodin); default: the configuration's.")
    ] = None,
    grasper: Annotated[
        str | None, choices.GRASPERS.option(help="A grasper (graspgen@tcp://HOST:5556); default: the configuration's.")
    ] = None,
    config: options.Config = None,
) -> None:
    """Say what is there and what is missing on this machine, or whether a served model answers."""
    from manitwin.errors import UsageError

    specs = {"vlm": vlm, "generator": generator, "grasper": grasper}
    if what is None:
        given = [f"--{name}" for name, spec in specs.items() if spec is not None]
        if given or config is not None:
            raise UsageError(f"doctor without {', '.join(KINDS)} looks at this machine and takes no options")
        from manitwin.cli.machine_checks import examine

        findings, wrong = examine(), "missing"
    else:
        from manitwin.config import BuildConfig, load_config

        settings = load_config(config) if config else BuildConfig()
        wrong = "failed "
        findings = [asked(KINDS[what], specs[what] or getattr(settings, KINDS[what]), settings)]
    for finding in findings:
        out_console.print(f"{'ok     ' if finding.ok else wrong} {finding.name}: {finding.detail}", markup=False)
    raise typer.Exit(0 if all(finding.ok for finding in findings) else 4)


def asked(kind: str, spec: str, settings: BuildConfig) -> Finding:
    """Send one small request to the backend of a spec: what works, what it cost and how long it took.

    No remembered answer is taken for one, and none is remembered. Raises ConfigError for a name that no backend has.
    """
    from manitwin.cli.machine_checks import Finding
    from manitwin.engine.charges import counted
    from manitwin.errors import ManiTwinError
    from manitwin.models.registry import create, target

    target(kind, spec)
    services = settings.services.model_copy(update={"cache": False, "record": None})
    settings = settings.model_copy(update={"services": services})
    started = time.perf_counter()
    with counted() as bill:
        try:
            backend = create(kind, spec, settings)
            if not hasattr(backend, "probe"):
                return Finding(spec, True, "built in, nothing to ask")
            works, ok = backend.probe(), True
        except ManiTwinError as error:
            works, ok = str(error), False
    seconds = time.perf_counter() - started
    works += "; it is a rehearsal server, not a model" if bill.rehearsed else ""
    return Finding(spec, ok, f"{' '.join(works.split())} ({bill.usd:.4f} USD, {seconds:.1f} s)")
