"""Settings read from TOML files and validated: an error names the key, the nearest valid one and all of them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, TypeVar, cast, overload

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from manitwin.config.build import BuildConfig
from manitwin.config.section import LARGEST_SEED
from manitwin.errors import ConfigError, choose_from
from manitwin.formats import toml_file
from manitwin.formats.printable import printable_line

_SHOWN_CHARACTERS = 200

Kind = TypeVar("Kind", bound=BaseModel)


@overload
def load_config(path: str | Path) -> BuildConfig: ...
@overload
def load_config(path: str | Path, kind: type[Kind]) -> Kind: ...
def load_config(path: str | Path, kind: Any = BuildConfig) -> Any:
    """Read a TOML file of settings: of a build, or of another ``kind``, such as ``LayoutsConfig``.

    Raises ConfigError naming the key, the nearest valid one and all of them.
    """
    return validated(kind, read_toml(Path(path)), str(path))


def read_toml(path: Path) -> dict[str, Any]:
    """Return the content of a TOML file of settings; raises ConfigError."""
    if not os.path.exists(path):
        raise ConfigError(f"{path}: not found; give a TOML file of settings")
    return toml_file.read_toml(path, ConfigError, name=str(path))


def validated(kind: type[Kind], data: dict[str, Any], where: str) -> Kind:
    """Return the settings of one kind; raises ConfigError as ``load_config``, which says ``where`` they are from."""
    try:
        return kind(**data)
    except ValidationError as error:
        raise ConfigError(f"{where}: {_explain(error.errors()[0], kind)}") from error


def _cause(error: ErrorDetails) -> str:
    """Return what is wrong with a value: the words of our own validators, or pydantic's with the value."""
    if error["type"] == "value_error":
        return printable_line(error["msg"].removeprefix("Value error, "), max_characters=_SHOWN_CHARACTERS)
    value = error["input"]
    huge = isinstance(value, int) and abs(value) > LARGEST_SEED  # Python writes no integer of many thousand digits
    shown = "a larger integer" if huge else printable_line(repr(value), max_characters=_SHOWN_CHARACTERS)
    return f"{error['msg']} (it is {shown})"


def _explain(error: ErrorDetails, kind: type[BaseModel]) -> str:
    where = [printable_line(str(part), max_characters=_SHOWN_CHARACTERS) for part in error["loc"]]
    if error["type"] != "extra_forbidden":
        return f"{'.'.join(where)}: {_cause(error)}"
    section = kind
    for part in map(str, error["loc"][:-1]):
        section = cast(type[BaseModel], section.model_fields[part].annotation)
    return f"{'.'.join(where)}: {choose_from('setting', where[-1], section.model_fields)}"
