"""Registry of export formats: exporters are backends of the kind ``exporter``, imported when first used.

A package registers one like any backend (``models.registry``):
``BACKENDS = {"exporter": {"my_format": "my_package.export:export"}}``.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module

from manitwin.assets.writers.exporter import Exporter
from manitwin.errors import UsageError, unknown_name_message
from manitwin.models.registry import backends, target


def formats() -> tuple[str, ...]:
    """Return the names of all formats: the built-in ones in their order, then those of other packages, sorted."""
    from manitwin.models.builtin import BACKENDS

    built_in = BACKENDS["exporter"]
    return (*built_in, *sorted(set(backends()["exporter"]) - set(built_in)))


def exporter(name: str) -> Exporter:
    """Return the exporter of a format. Raises UsageError if it is unknown or its package cannot be imported."""
    if name not in formats():
        raise UsageError(unknown_name_message("format", name, formats()))
    module, _, function = target("exporter", name).partition(":")
    try:
        found: Exporter = getattr(import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise UsageError(
            f"format {name!r} cannot be loaded: {error}; mend the package that registers it, or choose another format"
        ) from error
    return found


def chosen_formats(names: Iterable[str] | None) -> tuple[str, ...]:
    """Return the selected formats without duplicates, in the order of ``formats()``; all of them for None or ``all``.

    Raises UsageError for an unknown format or an empty selection.
    """
    wanted = {name.strip().lower() for name in names if name.strip()} if names is not None else {"all"}
    for name in sorted(wanted - {"all"}):
        if name not in formats():
            raise UsageError(unknown_name_message("format", name, {*formats(), "all"}))
    if not wanted:
        raise UsageError(f"no format is named; valid: all, {', '.join(formats())}")
    return formats() if "all" in wanted else tuple(name for name in formats() if name in wanted)
