"""Sphinx directives that generate reference pages from the code: ``public-api``, ``commands`` and ``records``.

The pages are generated at build time and are not committed.
"""

from __future__ import annotations

import html
import inspect
import textwrap
from importlib import import_module
from typing import Any

import typer
from docutils import nodes
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.nodes import make_refnode

import manitwin
from manitwin.errors import ManiTwinError


def public_api_markdown(names: list[str]) -> str:
    """Return a section for every public name: functions, classes with members, values, and references to the other pages."""
    functions, classes, values, elsewhere = [], [], [], []
    for name in names:
        found = getattr(manitwin, name)
        if inspect.isclass(found) and issubclass(found, (BaseModel, ManiTwinError)):
            elsewhere.append(f"- {{py:class}}`manitwin.{name} <{found.__module__}.{found.__name__}>`")
        elif inspect.isclass(found):
            classes.append(_documented("autoclass", f"manitwin.{name}", ":members:\n:show-inheritance:"))
        elif callable(found):
            functions.append(_documented("autofunction", f"manitwin.{name}"))
        else:
            values.append(_documented("autodata", f"manitwin.{name}"))
    sections = {"Functions": functions, "Classes": classes, "Values": values, "Records, settings and errors": elsewhere}
    return "\n\n".join("\n\n".join([f"## {title}", *texts]) for title, texts in sections.items() if texts)


def _documented(directive: str, target: str, options: str = "") -> str:
    lines = "\n".join(f"   {line}" for line in options.splitlines())
    return f"```{{eval-rst}}\n.. {directive}:: {target}\n{lines}\n```"


def commands_markdown() -> str:
    """Return the options of every visible command, as written by typer's `utils docs`."""
    from typer.cli import get_docs_for_click

    from manitwin.cli.main import app

    command: Any = typer.main.get_command(app)
    command.commands = {name: each for name, each in command.commands.items() if not each.hidden}
    text = get_docs_for_click(obj=command, ctx=typer.Context(command), name="manitwin")
    text = html.unescape(text).replace("```console\n$ ", "```text\n")
    return text.split("\n", 1)[1]  # without its title, which the page already has


def records_markdown(module_name: str) -> str:
    """Return the records of a module: descriptions, and fields with their types as written in the source."""
    module = import_module(module_name)
    kinds = [
        kind
        for kind in vars(module).values()
        if inspect.isclass(kind) and issubclass(kind, BaseModel) and kind.__module__ == module_name
    ]
    return "\n\n".join(_record(kind) for kind in kinds if kind.model_fields)


def _record(kind: type[BaseModel]) -> str:
    rows = "\n".join(
        f"   * - ``{name}``\n     - ``{kind.__annotations__[name]}``\n     - {_default(field)}"
        for name, field in kind.model_fields.items()
        if name in kind.__annotations__
    )
    table = f".. list-table::\n   :header-rows: 1\n\n   * - field\n     - type\n     - default\n{rows}"
    body = textwrap.indent(f"{inspect.getdoc(kind)}\n\n{table}", "   ")
    return f"```{{eval-rst}}\n.. py:class:: {kind.__module__}.{kind.__name__}\n\n{body}\n```"


def _default(field: FieldInfo) -> str:
    return "" if field.is_required() else f"``{field.get_default(call_default_factory=True)!r}``"


class PublicApi(SphinxDirective):
    """``public-api``: reference of all names in ``manitwin.__all__``."""

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(public_api_markdown(sorted(manitwin.__all__)), allow_section_headings=True)


class Commands(SphinxDirective):
    """``commands``: reference of the command line."""

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(commands_markdown(), allow_section_headings=True)


class Records(SphinxDirective):
    """``records MODULE``: the pydantic records of a module."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(records_markdown(self.arguments[0]), allow_section_headings=True)


def resolve_short_name(app: Sphinx, env: Any, node: Any, contnode: Any) -> Any:
    """Return the reference to a documented object by its unique last name.

    Annotations name a class by its defining or importing module, while its page documents it under the public name.
    """
    if node.get("refdomain") != "py":
        return None
    domain = env.get_domain("py")
    last = node["reftarget"].rpartition(".")[2]
    full_names = {name for name in domain.objects if name.rpartition(".")[2] == last}
    if len(full_names) != 1:
        return None
    found = domain.find_obj(env, "", "", full_names.pop(), None)
    ((full_name, entry),) = found
    return make_refnode(app.builder, node["refdoc"], entry.docname, entry.node_id, contnode, full_name)


def skip_generated_constructors(app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Skip generated constructors (of dataclasses and protocols), whose arguments are documented as fields."""
    inherited = ("Initialize self.", "Create and return a new object.", "Create a new model", "Create new instance")
    words = getattr(obj, "__doc__", None) or ""
    return True if name in ("__init__", "__new__") and (not words or words.startswith(inherited)) else None


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("public-api", PublicApi)
    app.add_directive("commands", Commands)
    app.add_directive("records", Records)
    app.connect("autodoc-skip-member", skip_generated_constructors)
    app.connect("missing-reference", resolve_short_name)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
