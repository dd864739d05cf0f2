"""Read settings from TOML files and validate them.

An error message names the invalid key, the nearest valid key and all valid keys.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, TypeVar, cast, overload

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from manitwin.config.build import BuildConfig
from manitwin.config.section import LARGEST_SEED
from manitwin.errors import ConfigError, unknown_name_message
from manitwin.formats import toml_file
from manitwin.formats.printable import printable_line

_SHOWN_CHARACTERS = 200

Kind = TypeVar("Kind", bound=BaseModel)


@overload
def load_config(path: str | Path) -> BuildConfig: ...
@overload
def load_config(path: str | Path, kind: type[Kind]) -> Kind: ...
def load_config(path: str | Path, kind: Any = BuildConfig) -> Any:
    """Read a TOML file of settings: those of a build, or of another ``kind`` such as ``LayoutsConfig``.

    Raises ConfigError, which names the invalid key, the nearest valid one and all valid ones.
    """
    return validate_settings(kind, read_toml(Path(path)), str(path))


def read_toml(path: Path) -> dict[str, Any]:
    """Return the content of a TOML file of settings. Raises ConfigError if it does not exist or cannot be parsed."""
    if not os.path.exists(path):
        raise ConfigError(f"{path}: not found; give a TOML file of settings")
    return toml_file.read_toml(path, ConfigError, name=str(path))


def validate_settings(kind: type[Kind], data: dict[str, Any], where: str) -> Kind:
    """Return validated settings of one kind. Raises ConfigError like ``load_config``; ``where`` names the source in its
    message.
    """
    try:
        return kind(**data)
    except ValidationError as error:
        raise ConfigError(f"{where}: {_explain(error.errors()[0], kind)}") from error


def _cause(error: ErrorDetails) -> str:
    """Return the cause of a validation error: the message of our own validators, or pydantic's message with the value."""
    if error["type"] == "value_error":
        return printable_line(error["msg"].removeprefix("Value error, "), max_characters=_SHOWN_CHARACTERS)
    value = error["input"]
    # Python does not print integers of many thousand digits
    huge = isinstance(value, int) and abs(value) > LARGEST_SEED
    shown = "a larger integer" if huge else printable_line(repr(value), max_characters=_SHOWN_CHARACTERS)
    return f"{error['msg']} (it is {shown})"


def _explain(error: ErrorDetails, kind: type[BaseModel]) -> str:
    where = [printable_line(str(part), max_characters=_SHOWN_CHARACTERS) for part in error["loc"]]
    if error["type"] != "extra_forbidden":
        return f"{'.'.join(where)}: {_cause(error)}"
    section = kind
    for part in map(str, error["loc"][:-1]):
        section = cast(type[BaseModel], section.model_fields[part].annotation)
    return f"{'.'.join(where)}: {unknown_name_message('setting', where[-1], section.model_fields)}"
