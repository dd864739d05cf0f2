"""Do of a command line what it asks for alone: the parameters of its own command, and help without what no help of ours uses."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Sequence
from copy import copy
from types import ModuleType
from typing import Any

import typer

PUT_OFF = {"rich.markdown": "Markdown", "rich.traceback": "Traceback"}
"""Modules that take a third of the time of ``manitwin --help``, and the classes of them that ``typer.rich_utils`` has for other
markup, and for errors that it is not asked to print."""


class _DeferredClass:
    """Stands for a class until it is called, or asked for an attribute."""

    module: str

    def __new__(cls, *arguments: Any, **options: Any) -> Any:
        """Return an instance of the class that is meant."""
        return getattr(importlib.import_module(cls.module), cls.__name__)(*arguments, **options)


class _DeferredClassType(type):
    module: str

    def __getattr__(cls, name: str) -> Any:
        return getattr(getattr(importlib.import_module(cls.module), cls.__name__), name)


def import_quick_help() -> None:
    """Import ``typer.rich_utils``, once; its Markdown and Traceback are imported when they are called."""
    if "typer.rich_utils" in sys.modules:
        return
    stand_ins = {}
    for module, name in PUT_OFF.items():
        if module not in sys.modules:
            stand_in = ModuleType(module)
            setattr(stand_in, name, _DeferredClassType(name, (_DeferredClass,), {"module": module}))
            stand_ins[module] = stand_in
    sys.modules.update(stand_ins)
    try:
        importlib.import_module("typer.rich_utils")
    except ImportError:  # a release that wants more of them: it gets them when it is imported in earnest
        sys.modules.pop("typer.rich_utils", None)
    finally:
        for module in stand_ins:
            del sys.modules[module]


def only_asked_for(app: typer.Typer, words: Sequence[str]) -> typer.Typer:
    """Return an application in which the commands that no word names have a name and a line of help, and no parameters.

    Reading the parameters of every command takes a quarter of the time of ``manitwin --help``.
    """
    alone = copy(app)
    alone.registered_commands = []
    for known in app.registered_commands:
        info, function = copy(known), known.callback
        if function is not None:
            info.name = known.name or function.__name__.replace("_", "-")
            if info.name.split()[0] not in words:
                info.callback = _help_only_callback(function)
        alone.registered_commands.append(info)
    return alone


def _help_only_callback(function: Callable[..., Any]) -> Callable[[], None]:
    def described() -> None:
        raise AssertionError(f"{function.__name__} was called by a name that its command line does not have")

    described.__doc__ = function.__doc__
    return described
