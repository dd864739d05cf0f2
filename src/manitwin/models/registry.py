"""Registry of backends by kind and name; built-in backends and those of installed packages are registered in the same way.

A package adds backends with an entry point in the group ``manitwin.backends`` whose module defines a dictionary ``BACKENDS``:
``{kind: {name: "module:attribute"}}``. A backend specification (spec) has the form ``name``, ``name:argument``, ``name@URL``
or ``name:argument@URL``. If the attribute has a method ``from_spec(argument, config)``, that method creates the backend;
otherwise the attribute is called without arguments.
"""

from __future__ import annotations

import re
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from manitwin.config import BuildConfig
from manitwin.errors import ConfigError, Unavailable, unknown_name_message

GROUP = "manitwin.backends"
URL_OF_SERVER = re.compile(r"^(?!command:)(.*)@[A-Za-z][A-Za-z0-9+.-]*://\S+$")


@cache
def backends() -> dict[str, dict[str, str]]:
    """Return ``{kind: {name: target}}`` of all installed backends.

    Raises ConfigError if two packages register the same name for different targets.
    """
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
    """Return the ``module:attribute`` of the backend that a spec names; raises ConfigError, which lists the valid names."""
    name, names = _parts(spec)[0], backends().get(kind, {})
    if name not in names:
        raise ConfigError(unknown_name_message(kind, name, names))
    return names[name]


def factory(kind: str, spec: str) -> Any:
    """Return the class or function that creates a backend.

    Raises ConfigError for an unknown name, Unavailable if the import fails.
    """
    module, _, attribute = target(kind, spec).partition(":")
    try:
        return getattr(import_module(module), attribute)
    except ImportError as error:
        raise Unavailable(
            f"{kind} {_parts(spec)[0]!r} cannot be loaded: {error}; install what is missing, or choose another"
        ) from error


def create(kind: str, spec: str, config: BuildConfig) -> Any:
    """Create the backend that a spec describes.

    Raises ConfigError for an unknown name or an argument that the backend does not take, Unavailable if it cannot be
    imported.
    """
    name, argument = _parts(spec)
    made_by = factory(kind, spec)
    if hasattr(made_by, "from_spec"):
        return made_by.from_spec(argument, config)
    if argument:
        raise ConfigError(f"{kind} {spec!r}: {name} takes no arguments after its name")
    return made_by()


def _parts(spec: str) -> tuple[str, str]:
    """Split a spec into name and argument; the argument starts with ``@`` if it is only an address."""
    end = next((at for at, letter in enumerate(spec) if letter in ":@"), len(spec))
    return spec[:end], spec[end:].removeprefix(":")


def without_url(spec: str) -> str:
    """Return a spec without its server address, because the address does not affect the results of the model."""
    return URL_OF_SERVER.sub(r"\1", spec)
