"""What every settings model is made of: frozen data with units in names, and one report of all that is wrong."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from quadfringe.errors import ConfigError

__all__ = ["Finite", "Model", "NotNegative", "Positive", "checked"]

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Model(BaseModel):
    """Frozen data; an unknown key is refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


AnyModel = TypeVar("AnyModel", bound=Model)


def checked(model: type[AnyModel], values: Mapping[str, Any], source: str) -> AnyModel:
    """Validate `values`; raise `ConfigError` that lists every problem of `source` with its path."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        problems = [f"  {_path(p['loc'])}: {_reason(p)}" for p in error.errors(include_url=False)]
        count = f"{len(problems)} problem{'s' if len(problems) > 1 else ''}"
        raise ConfigError("\n".join([f"{source}: {count}", *problems])) from error


def _path(location: tuple[int | str, ...]) -> str:
    return ".".join(str(part) for part in location) or "(top level)"


def _reason(problem: Any) -> str:
    if problem["type"] == "extra_forbidden":
        return "this key is not known"
    if problem["type"] == "missing":
        return "this key is required and missing"
    return f"{problem['msg']}, got {problem['input']!r}"
