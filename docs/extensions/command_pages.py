"""The page of the command line: every command, argument and option with its default, from the program itself."""

from __future__ import annotations

import inspect
from enum import Enum
from pathlib import Path
from typing import Any, get_args, get_type_hints

from typer.main import get_command

from quadfringe.cli import app

VALUES = {int: "N", float: "X", Path: "FILE", str: "TEXT", bool: ""}


def page() -> str:
    """Give the Markdown of the page: a table of all commands, then each of them in the order of `--help`."""
    commands = list(_commands(get_command(app), "quadfringe"))
    rows = ["| command | purpose |", "|---|---|"]
    rows += [f"| [`{name}`](#{name.replace(' ', '-')}) | {_first(command)} |" for name, command in commands]
    return "\n\n".join(["\n".join(rows), *(_section(name, command) for name, command in commands)])


def _commands(command: Any, name: str) -> Any:
    for short, child in command.commands.items():
        if hasattr(child, "commands"):
            yield from _commands(child, f"{name} {short}")
        else:
            yield f"{name} {short}", child


def _text(command: Any) -> str:
    return inspect.cleandoc(command.help or "")


def _first(command: Any) -> str:
    return _text(command).partition("\n\n")[0].replace("\n", " ")


def _section(name: str, command: Any) -> str:
    shown = [one for one in command.params if not getattr(one, "hidden", False) and one.name != "help"]
    arguments = [one for one in shown if one.param_type_name == "argument"]
    options = [one for one in shown if one.param_type_name == "option"]
    usage = " ".join([name, *(["[OPTIONS]"] if options else []), *(_metavar(one) for one in arguments)])
    parts = [f"## {name}", _text(command), f"```text\n{usage}\n```"]
    hints = get_type_hints(inspect.unwrap(command.callback))
    if arguments:
        parts.append(_table("argument", arguments, hints))
    if options:
        parts.append(_table("option", options, hints))
    return "\n\n".join(parts)


def _table(heading: str, parameters: list[Any], hints: dict[str, Any]) -> str:
    rows = [f"| {heading} | value | default | meaning |", "|---|---|---|---|"]
    for one in parameters:
        names = _metavar(one) if heading == "argument" else ", ".join([*one.opts, *one.secondary_opts])
        value = "" if heading == "argument" else _value(one, hints[one.name])
        cells = (f"`{names}`", f"`{value}`" if value else "", _default(one), " ".join((one.help or "").split()))
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows)


def _metavar(argument: Any) -> str:
    name = argument.metavar or argument.name.upper()
    return name if argument.required or name.startswith("[") else f"[{name}]"


def _value(option: Any, annotation: Any) -> str:
    """Give what stands after an option: the word of the help, the choices, or the kind of the value."""
    if option.metavar:
        return str(option.metavar)
    kind = annotation
    while inside := [one for one in get_args(kind) if one is not type(None)]:
        kind = inside[0]
    if issubclass(kind, Enum):
        return "|".join(str(choice.value) for choice in kind)
    return VALUES[kind]


def _default(parameter: Any) -> str:
    """Give the default that is in force; an option without one says in its help what is done."""
    if parameter.required:
        return "required"
    value = parameter.default
    if value is None or value in ((), []) or (getattr(parameter, "is_flag", False) and value is False):
        return ""
    if isinstance(value, (list, tuple)):
        return f"`{' '.join(str(one) for one in value)}`"
    return f"`{getattr(value, 'value', value)}`"
