"""Generate docs/configuration.md from the settings models.

python docs/make_configuration.py            writes the page
python docs/make_configuration.py --check    exits with status 1 if the page is out of date
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import cast

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from manitwin.config import BuildConfig
from manitwin.episodes.settings import PicturesConfig, TasksConfig, TrajectoriesConfig
from manitwin.scenes.settings import LayoutsConfig

PAGE = Path(__file__).parent / "configuration.md"
APPLICATIONS: dict[str, type[BaseModel]] = {
    "layout": LayoutsConfig, "trajectories": TrajectoriesConfig, "tasks": TasksConfig, "render": PicturesConfig
}  # fmt: skip
INTRODUCTION = """# Settings

A TOML file given with `--config run.toml`. What it does not say keeps its default; an unknown key is an error that names the
nearest one. A changed section re-runs its stage and what follows, and nothing else.

```toml
seed = 1

[verify]
force_n = 40.0
```

This page is written by `python docs/make_configuration.py`.
"""


def rows(model: type[BaseModel], prefix: str = "") -> list[str]:
    """Return a table row for every plain setting of a section; nested settings are shown with their path."""
    found = []
    for name, field in model.model_fields.items():
        annotation = field.annotation
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            found += rows(annotation, f"{prefix}{name}.")
        else:
            found.append(f"| `{prefix}{name}` | {_default(field)} | {_range(field)} |")
    return found


def _default(field: FieldInfo) -> str:
    """Return the default in TOML notation; ``not set`` for None, which TOML cannot express."""
    value = field.get_default(call_default_factory=True)
    if value is None:
        return "not set"
    if isinstance(value, float):
        return f"`{value:.4g}`"
    return f"`{json.dumps(value, default=str)}`"


def _range(field: FieldInfo) -> str:
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    limits = [
        f"{sign} {getattr(rule, name):g}"
        for rule in field.metadata
        for name, sign in signs.items()
        if hasattr(rule, name)
    ]
    return ", ".join(limits)


def page() -> str:
    """Return the whole page."""
    text = [INTRODUCTION, *_settings(BuildConfig, "## General\n", told={})]
    told: dict[object, str] = {}
    for command, model in APPLICATIONS.items():
        words = " ".join((model.__doc__ or "").split()).replace("``", "`")
        text += _settings(model, f"## Settings of `manitwin {command}`\n\n{words}\n", told)
        told |= {field.annotation: command for field in model.model_fields.values()}
    return "\n".join(text)


def _settings(kind: type[BaseModel], title: str, told: dict[object, str]) -> list[str]:
    """Return the sections of a configuration; a section documented for another command refers to that command (``told``)."""
    sections = {
        n: f.annotation
        for n, f in kind.model_fields.items()
        if isinstance(f.annotation, type)
        and issubclass(f.annotation, BaseModel)
        and (kind is BuildConfig or n != "run")
    }
    plain = [
        f"| `{n}` | {_default(f)} | {_range(f)} |"
        for n, f in kind.model_fields.items()
        if n not in sections and n != "run"
    ]
    text = [title, "| setting | default | range |", "|---|---|---|", *plain, ""]
    for name, section in sections.items():
        if section in told:
            text += [f"`[{name}]` is that of `manitwin {told[section]}`.", ""]
            continue
        model = cast(type[BaseModel], section)
        table = rows(model)
        level = "##" if kind is BuildConfig else "###"
        text += [f"{level} [{name}]\n", " ".join((model.__doc__ or "").split()).replace("``", "`"), ""]
        if table:
            text += ["| setting | default | range |", "|---|---|---|", *table, ""]
    return text


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        sys.exit(
            0
            if PAGE.is_file() and PAGE.read_text() == page()
            else "docs/configuration.md is out of date: python docs/make_configuration.py"
        )
    PAGE.write_text(page())
