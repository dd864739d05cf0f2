"""Backends by kind and name: the built-in ones and those of installed packages, registered in the same way.

A package adds backends by an entry point of the group ``manitwin.backends`` whose module has a dictionary ``BACKENDS``:
``{kind: {name: "module:attribute"}}``. The attribute is called without arguments and returns the backend.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from manitwin.errors import ConfigError, Unavailable, choose_from

GROUP = "manitwin.backends"


@cache
def backends() -> dict[str, dict[str, str]]:
    """Return ``{kind: {name: target}}`` of all installed backends; two packages may not claim one name."""
    found: dict[str, dict[str, str]] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda e: e.name):
        for kind, targets in entry.load().BACKENDS.items():
            names = found.setdefault(kind, {})
            for name, place in targets.items():
                if names.get(name, place) != place:
                    raise ConfigError(
                        f"two packages register the {kind} {name!r}: {names[name]} and {place}; uninstall one"
                    )
                names[name] = place
    return found


def target(kind: str, name: str) -> str:
    """Return where a backend is defined; raises ConfigError listing the valid names."""
    names = backends().get(kind, {})
    if name not in names:
        raise ConfigError(choose_from(kind, name, names))
    return names[name]


def create(kind: str, name: str) -> Any:
    """Create a backend; raises ConfigError listing the valid names, Unavailable where it cannot be imported."""
    module, _, attribute = target(kind, name).partition(":")
    try:
        factory = getattr(import_module(module), attribute)
    except ImportError as error:
        raise Unavailable(
            f"{kind} {name!r} cannot be loaded: {error}; install what it names, or choose another"
        ) from error
    return factory()
