"""Turn problems that pydantic finds into messages: place, expected value, given value."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from quadfringe.config._brief import brief

__all__ = ["reason", "report"]

LISTED = 10  # problems of a message; a file of another kind has thousands
# What is expected, by pydantic's name of the problem. The words in braces are its names of the limits.
EXPECTED = {
    "greater_than": "a number above {gt}",
    "greater_than_equal": "a number of at least {ge}",
    "less_than": "a number below {lt}",
    "less_than_equal": "a number of at most {le}",
    "finite_number": "a finite number",
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_parsing_size": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "a text",
    "string_too_short": "a text with {min_length} or more characters",
    "string_pattern_mismatch": "a text of the form {pattern}",
    "literal_error": "{expected}",
    "enum": "{expected}",
    "path_type": "a path",
    "tuple_type": "a list",
    "list_type": "a list",
    "too_long": "at most {max_length} entries",
    "dict_type": "a table",
    "model_type": "a table of the keys of {class_name}",
    "model_attributes_type": "a table",
    "union_tag_invalid": "one of {expected_tags} as {discriminator}",
    "union_tag_not_found": "a table with the key {discriminator}",
}


def report(model: type[BaseModel], error: ValidationError, source: str) -> str:
    """List the first problems of `source`, each with its path in the model."""
    count = error.error_count()
    problems = [f"  {_path(p['loc'])}{_in_model(model, p)}" for p in error.errors(include_url=False)[:LISTED]]
    more = [f"  and {count - LISTED} more"] if count > LISTED else []
    return "\n".join([f"{source}: {count} problem{'s' if count > 1 else ''}", *problems, *more])


def reason(problem: Any) -> str:
    """Say what was expected and what was given."""
    given = problem["input"]
    if problem["type"] == "missing":
        return f"this {'key' if isinstance(problem['loc'][-1], str) else 'entry'} is required and missing"
    if problem["type"] in EXPECTED:
        limits = {name: int(v) if v in (0.0, 1.0) else v for name, v in problem.get("ctx", {}).items()}
        expected = EXPECTED[problem["type"]].format_map(limits)
        return f"expected {expected}, got {brief(given)}"
    words: str = problem["msg"].removeprefix("Value error, ")
    # A conflict of keys names them; the table that holds them would only be repeated.
    if ", got " in words or isinstance(given, Mapping):
        return words
    return f"{words}, got {brief(given)}"


def _path(location: tuple[int | str, ...]) -> str:
    """Join a path, with a colon if it is not empty; words in parentheses are pydantic's names of alternatives."""
    path = ".".join(str(part) for part in location if not str(part).startswith("("))
    return f"{path}: " if path else ""


def _in_model(model: type[BaseModel], problem: Any) -> str:
    if problem["type"] != "extra_forbidden":
        return reason(problem)
    *parents, key = problem["loc"]
    return f"this key is not known{_suggestion(model, parents, str(key))}"


def _suggestion(model: type[BaseModel], parents: list[int | str], key: str) -> str:
    """Name the key that was probably meant: the most similar one of this table, or the same one of an inner table."""
    models = [model]
    for part in parents:
        fields = [m.model_fields[part] for m in models if part in m.model_fields]
        models = [found for field in fields for found in _models_in(field.annotation)] or models
    known = {name: field for m in models for name, field in m.model_fields.items()}
    if nearest := get_close_matches(key, known, 1):
        return f"; did you mean {nearest[0]}?"
    tables = [name for name, field in known.items() for m in _models_in(field.annotation) if key in m.model_fields]
    return f"; it belongs to {' or '.join(dict.fromkeys(tables))}" if tables else ""


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    """Find the models that a type is made of: itself, or the alternatives of a union."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]
