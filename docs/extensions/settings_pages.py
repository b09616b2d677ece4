"""The page of the system file: every key with type, unit, default and meaning, from the models that read it."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from quadfringe import _core
from quadfringe.config import SystemConfig, brief

UNITS = {"mm": "mm", "px": "px", "us": "µs", "ns": "ns", "s": "s", "hz": "Hz", "k": "K", "deg": "degrees", "rad": "rad"}
WORDS = {float: "number", int: "whole number", str: "text", bool: "true or false"}
# Settings that an absent key takes from the kernel, by the words of the kernel.
KERNEL = _core.Decoder((16, 16), (36, 35, 30), 912).settings()
BOUNDS = {"gt": "> {}", "ge": "≥ {}", "lt": "< {}", "le": "≤ {}", "min_length": "not empty", "pattern": ""}
LONG = 6  # choices that are listed in the table


def type_of(field: FieldInfo) -> str:
    """Give the type of a setting in words, with its limits."""
    bounds = [_bound(one) for one in field.metadata]
    return ", ".join([_words(field.annotation), *(bound for bound in bounds if bound)])


def _bound(metadata: Any) -> str:
    for name, words in BOUNDS.items():
        value = getattr(metadata, name, None)
        if value is not None:
            return words.format(brief(value))
    return ""


def _words(annotation: Any) -> str:
    """Write a type as somebody who writes TOML sees it."""
    origin, inside = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        limits = [_bound(one) for meta in inside[1:] for one in getattr(meta, "metadata", [meta])]
        return ", ".join([_words(inside[0]), *(limit for limit in limits if limit)])
    if origin is Literal:
        chosen = [f'"{one}"' if isinstance(one, str) else str(one) for one in inside]
        return " or ".join(chosen) if len(chosen) <= LONG else f"one of {len(chosen)} words, such as {chosen[0]}"
    if origin is tuple:
        if inside[-1] is Ellipsis:
            return f"list: {_words(inside[0])}"
        kinds = dict.fromkeys(_words(one) for one in inside)
        return f"list of {len(inside)}: {', '.join(kinds)}"
    if origin is dict:
        return "table"
    if inside:
        return " or ".join(dict.fromkeys(_words(one) for one in inside if one is not type(None)))
    if inspect.isclass(annotation) and issubclass(annotation, BaseModel):
        return "table"
    return WORDS.get(annotation, "file or folder")


def default_of(field: FieldInfo) -> str:
    """Give the default of a setting as it is written in a file."""
    value = field.default
    if field.is_required():
        return "required"
    if value is None or field.default_factory is not None:
        return "absent"
    if isinstance(value, BaseModel):
        kind = getattr(value, "kind", None)
        return f'"{kind}:"' if kind else "defaults"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    return brief(value).replace("(", "[").replace(")", "]")


def described(field: FieldInfo) -> str:
    """Give the meaning of a setting."""
    return " ".join((field.description or "").split())


def unit_of(name: str) -> str:
    """Give the unit that the name of a key ends with."""
    return UNITS.get(name.rpartition("_")[2], "") if "_" in name else ""


def models_in(annotation: Any) -> list[type[BaseModel]]:
    """Give the tables that a setting may be."""
    if inspect.isclass(annotation) and issubclass(annotation, BaseModel):
        return [annotation]
    return list(dict.fromkeys(model for one in get_args(annotation) for model in models_in(one)))


def page(link_to: Callable[[type[BaseModel]], str]) -> str:
    """Give the Markdown of the page: one section for each table of the file, in the order of the file."""
    return "\n\n".join([_table(SystemConfig, ""), *_sections(SystemConfig, "", set(), link_to)])


def _sections(
    model: type[BaseModel], path: str, seen: set[type[BaseModel]], link_to: Callable[[type[BaseModel]], str]
) -> list[str]:
    parts = []
    for name, field in model.model_fields.items():
        below = f"{path}{name}"
        for table in models_in(field.annotation):
            kind = table.model_fields.get("kind")
            several = len(models_in(field.annotation)) > 1 and kind is not None
            heading = f"[{below}], kind {kind.default}" if several and kind else f"[{below}]"
            if table in seen:
                parts.append(f"## {heading}\n\nThe keys are those of the first `{table.__name__}` on this page.")
                continue
            seen.add(table)
            parts.append(f"## {heading}\n\n{_summary(table)}\n\nIn Python: {link_to(table)}.\n\n{_table(table, below)}")
            parts += _sections(table, f"{below}.", seen, link_to)
    return parts


def _summary(model: type[BaseModel]) -> str:
    return (inspect.getdoc(model) or "").partition("\nFields\n")[0].strip()


def _table(model: type[BaseModel], path: str) -> str:
    rows = ["| key | type | unit | default | meaning |", "|---|---|---|---|---|"]
    for name, field in model.model_fields.items():
        default = default_of(field)
        kernel = KERNEL.get(name) if path == "decode" else None
        if default == "absent" and kernel is not None:
            default = f'"{kernel}"' if isinstance(kernel, str) else brief(kernel).lower()
        shown = default if default in {"required", "absent", "defaults"} else f"`{default}`"
        cells = (f"`{name}`", type_of(field), unit_of(name), shown, described(field))
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows)
