"""The base of all settings: frozen data, one report of all problems, and a docstring that lists every field."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Annotated, Any, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from quadfringe.config._brief import brief, shortened
from quadfringe.config._report import report
from quadfringe.errors import ConfigError

__all__ = ["SIZE_MAX", "Finite", "Model", "NotNegative", "Positive", "checked", "kernel_takes"]

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
DOC_WIDTH = 100
# Pixels along one side of an image, columns of a projector: no device has as many, larger images would not fit into
# memory, and up to 2^16 a float32 column is exact to 1/256.
SIZE_MAX = 65536

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)


class _ReportingMeta(ModelMetaclass):
    """Reports wrong arguments of a model in the form that wrong entries of a file have.

    Only calls of the class come through here. Pydantic makes nested models itself, so that their problems arrive in
    one report, with their paths.
    """

    if not TYPE_CHECKING:  # type checkers still read the fields as arguments

        def __call__(cls, *args, **values):  # noqa: N805 - the first argument is a class
            if args:
                first = next(iter(cls.model_fields), "field")
                raise ConfigError(f"{cls.__name__}: expected fields by name, such as {first}=..., got {brief(args[0])}")
            try:
                return super().__call__(**values)
            except ValidationError as error:
                raise ConfigError(report(cls, error, cls.__name__)) from error


class Model(BaseModel, metaclass=_ReportingMeta):
    """Frozen data. Unknown keys and wrong values raise `ConfigError` with one line for each, from Python as from files.

    The docstring of a model lists every field with its description and default; `help` shows it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Add the fields to the docstring of the class, and give it a signature that can be read."""
        super().__pydantic_init_subclass__(**kwargs)
        cls.__doc__ = _with_fields(cls)
        defaults = {n: Parameter.empty if f.is_required() else f.default for n, f in cls.model_fields.items()}
        fields = [Parameter(name, Parameter.KEYWORD_ONLY, default=value) for name, value in defaults.items()]
        cls.__signature__ = Signature(fields)

    @classmethod
    def model_validate(cls, obj: Any, **kwargs: Any) -> Self:
        """Make a model of a mapping; raises `ConfigError` as the class does."""
        try:
            return super().model_validate(obj, **kwargs)
        except ValidationError as error:
            raise ConfigError(report(cls, error, cls.__name__)) from error

    def __repr__(self) -> str:
        fields = type(self).model_fields.items()
        given = [(name, getattr(self, name)) for name, field in fields if getattr(self, name) != field.default]
        return shortened(f"{type(self).__name__}({', '.join(f'{name}={brief(value)}' for name, value in given)})")

    __str__ = __repr__


AnyModel = TypeVar("AnyModel", bound=Model)


def checked(model: type[AnyModel], values: Mapping[str, Any], source: str) -> AnyModel:
    """Validate `values`; raise `ConfigError` that lists the problems of `source` with their paths."""
    try:
        made: AnyModel = model.__pydantic_validator__.validate_python(values)
    except ValidationError as error:
        raise ConfigError(report(model, error, source)) from error
    return made


def kernel_takes(name: str, call: Callable[[], object]) -> None:
    """Make something in the kernel of a setting; raise ValueError with what it expected if it refuses the setting."""
    try:
        call()
    except ValueError as error:
        raise ValueError(str(error).removeprefix(f"{name}: ").partition(", got ")[0]) from None


def _with_fields(model: type[BaseModel]) -> str:
    """Give the docstring of a model with one paragraph for each field."""
    head = textwrap.dedent(f"{' ' * 4}{(model.__doc__ or '').lstrip()}").split("\n\nFields\n")[0].rstrip()
    lines = []
    for name, field in model.model_fields.items():
        default = "" if field.default is None or field.default_factory else f" Default: {brief(field.default)}."
        default = " Required." if field.is_required() else default
        text = f"{name}: {field.description or ''}{default}"
        lines += textwrap.wrap(text, DOC_WIDTH, initial_indent="    ", subsequent_indent="        ")
    return "\n".join([head, "", "Fields", *lines, ""])
