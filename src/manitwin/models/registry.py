"""Backends by kind and name: the built-in ones and those of installed packages, registered in the same way.

A package adds backends by an entry point of the group ``manitwin.backends`` whose module has a dictionary ``BACKENDS``:
``{kind: {name: "module:attribute"}}``. A backend is chosen by ``name``, ``name:argument``, ``name@URL`` or
``name:argument@URL``. An attribute with a method ``from_spec(argument, config)`` is created by it; any other is called without
arguments.
"""

from __future__ import annotations

import re
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from manitwin.config import BuildConfig
from manitwin.errors import ConfigError, Unavailable, choose_from

GROUP = "manitwin.backends"
URL_OF_SERVER = re.compile(r"^(?!command:)(.*)@[A-Za-z][A-Za-z0-9+.-]*://\S+$")


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


def target(kind: str, spec: str) -> str:
    """Return where the backend of a spec is defined; raises ConfigError listing the valid names."""
    name, names = _parts(spec)[0], backends().get(kind, {})
    if name not in names:
        raise ConfigError(choose_from(kind, name, names))
    return names[name]


def factory(kind: str, spec: str) -> Any:
    """Return the class or function that makes a backend; raises ConfigError, or Unavailable where it cannot be imported."""
    module, _, attribute = target(kind, spec).partition(":")
    try:
        return getattr(import_module(module), attribute)
    except ImportError as error:
        raise Unavailable(
            f"{kind} {_parts(spec)[0]!r} cannot be loaded: {error}; install what is missing, or choose another"
        ) from error


def create(kind: str, spec: str, config: BuildConfig) -> Any:
    """Create a backend; raises ConfigError for a spec that cannot be, Unavailable where it cannot be imported."""
    name, argument = _parts(spec)
    made_by = factory(kind, spec)
    if hasattr(made_by, "from_spec"):
        return made_by.from_spec(argument, config)
    if argument:
        raise ConfigError(f"{kind} {spec!r}: {name} takes no arguments after its name")
    return made_by()


def _parts(spec: str) -> tuple[str, str]:
    """Return the name and the argument, which begins with the ``@`` of an address where there is nothing before it."""
    end = next((at for at, letter in enumerate(spec) if letter in ":@"), len(spec))
    return spec[:end], spec[end:].removeprefix(":")


def without_url(spec: str) -> str:
    """Return a spec without the address of its server: where a model is served does not decide what it answers."""
    return URL_OF_SERVER.sub(r"\1", spec)
