"""The pages of docs/reference/api: for each module what it exports, with the text and the examples of the sources.

A page says `<!-- generated: api quadfringe.data -->`. A name stands on the first page of `MODULES` that exports it, and
the others lead there. Docstrings are plain text with names in backticks; here they become what Sphinx reads.
"""

from __future__ import annotations

import inspect
import re
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from settings_pages import default_of, described, models_in, type_of

MODULES = (
    "quadfringe",
    "quadfringe.scanner",
    "quadfringe.data",
    "quadfringe.decoding",
    "quadfringe.decoding.stages",
    "quadfringe.decoding.compare",
    "quadfringe.config",
    "quadfringe.devices",
    "quadfringe.devices.virtual",
    "quadfringe.devices.files",
    "quadfringe.devices.uvc",
    "quadfringe.devices.aravis",
    "quadfringe.devices.emulator",
    "quadfringe.devices.light",
    "quadfringe.devices.hdmi",
    "quadfringe.devices.lightcrafter",
    "quadfringe.recording",
    "quadfringe.recording.batch",
    "quadfringe.recording.series",
    "quadfringe.calibration",
    "quadfringe.calibration.session",
    "quadfringe.calibration.response",
    "quadfringe.calibration.acceptance",
    "quadfringe.calibration.surfaces",
    "quadfringe.calibration.printing",
    "quadfringe.view.report",
    "quadfringe.view.page",
    "quadfringe.view.viewer",
    "quadfringe.view.saved",
    "quadfringe.view.measuring",
    "quadfringe.view.colours",
    "quadfringe.view.movie",
    "quadfringe.doctor",
    "quadfringe.io",
    "quadfringe.errors",
)
KINDS = ("Classes", "Functions", "Errors and warnings", "Values and types")
SCRIPT = re.compile(r"sphx_glr_generated_gallery_\w+\.py")
MOST_PICTURES = 4  # links from one name
EXAMPLE = re.compile(r"^\s*(?:>>>|\.\.\. )")
ARRAY = re.compile(r"~?(?:numpy\.)?ndarray\[tuple\[~?(?:typing\.)?Any, \.\.\.\], ~?(?:numpy\.)?dtype\[([^\[\]]*)\]\]")
SPAN = re.compile(r"(`+[^`]*`+)")
SPECIAL = re.compile(r"[*|]|(?<=\w)_(?!\w)")


@cache
def owners() -> dict[str, tuple[str, str]]:
    """Give for the identity of every class and function the module and the name under which it is described."""
    found: dict[str, tuple[str, str]] = {}
    for module in MODULES:
        for name in exported(module):
            found.setdefault(identity(module, name), (module, name))
    return found


def exported(module: str) -> list[str]:
    """Give the names of a module that are described: its `__all__` without modules."""
    home = import_module(module)
    return [name for name in home.__all__ if not inspect.ismodule(getattr(home, name))]


def identity(module: str, name: str) -> str:
    """Give the place where something is defined, which is the same under all its names."""
    thing = getattr(import_module(module), name)
    if inspect.isclass(thing) or inspect.isfunction(thing):
        return f"{thing.__module__}.{thing.__qualname__}"
    return f"{name} = {thing!r}"


def link_to(thing: type) -> str:
    """Give a link to the place where a class is described."""
    return f"{{py:obj}}`~{'.'.join(owners()[f'{thing.__module__}.{thing.__qualname__}'])}`"


@cache
def places() -> dict[str, str]:
    """Give the full name of everything that is described, by the name that docstrings use."""
    return {name: f"{module}.{name}" for module, name in reversed(owners().values())}


def find(app: Any, env: Any, node: Any, content: Any) -> Any:
    """Resolve a name in backticks that stands on the page of another module, such as `Shape.save`."""
    if node.get("refdomain") != "py" or node.get("reftype") != "obj":
        return None
    words = node["reftarget"].removeprefix("quadfringe.").removeprefix("qf.")
    first, _, rest = words.partition(".")
    if first not in places() or not (rest or first[0].isupper()):  # a word in small letters may be an argument
        return None
    target = f"{places()[first]}.{rest}" if rest else places()[first]
    domain = env.domains.python_domain
    return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", target, node, content)


def kind_of(thing: Any) -> str:
    """Give the heading under which something stands."""
    if inspect.isclass(thing):
        return "Errors and warnings" if issubclass(thing, BaseException) else "Classes"
    return "Functions" if inspect.isroutine(thing) else "Values and types"


def page(module: str) -> str:
    """Give the Markdown of the page of a module."""
    home, names = import_module(module), exported(module)
    own = [name for name in names if owners()[identity(module, name)] == (module, name)]
    parts = [_rst(f".. automodule:: {module}")]
    if elsewhere := [name for name in names if name not in own]:
        places = [".".join(owners()[identity(module, name)]) for name in elsewhere]
        parts.append("Described elsewhere: " + ", ".join(f"{{py:obj}}`~{place}`" for place in places) + ".")
    for heading in KINDS:
        members = [name for name in own if kind_of(getattr(home, name)) == heading]
        if members:
            parts.append(f"## {heading}")
            parts += [f"### {name}\n\n{_rst(_entry(module, name))}{_pictures(module, name)}" for name in members]
    return "\n\n".join(parts)


def _pictures(module: str, name: str) -> str:
    """Give links to the first scripts of the gallery that use a name; sphinx-gallery has listed them."""
    uses = Path(__file__).parents[1] / "generated" / "uses" / f"{module}.{name}.examples"
    found = dict.fromkeys(SCRIPT.findall(uses.read_text())) if uses.is_file() else {}
    links = [f"{{ref}}`{label}`" for label in found][:MOST_PICTURES]
    return f"\n\nIn the gallery: {', '.join(links)}." if links else ""


def _rst(text: str) -> str:
    return f"```{{eval-rst}}\n{text}\n```"


def _entry(module: str, name: str) -> str:
    thing = getattr(import_module(module), name)
    if inspect.isclass(thing):
        kind = "autoexception" if issubclass(thing, BaseException) else "autoclass"
        return f".. {kind}:: {module}.{name}\n   :members:"
    if inspect.isroutine(thing):
        return f".. autofunction:: {module}.{name}"
    lines = [f".. py:data:: {module}.{name}", f"   :value: {_shown(thing)}", ""]
    return "\n".join([*lines, *(f"   {line}" for line in _comment(module, name))])


def _shown(thing: Any) -> str:
    words = re.sub(r"(?:typing|pathlib|pydantic\.\w+|quadfringe(?:\.\w+)+)\.", "", repr(thing))
    words = " ".join(words.split())
    return words if len(words) < 120 else f"{words[:110]} ..."


def _comment(module: str, name: str) -> list[str]:
    """Give the comment of a constant, above it or behind it, in the module that defines it."""
    pattern = re.compile(rf"((?:^# .*\n)*)^{name}(?:: [^=\n]+)? = [^\n]*?(?:  # (.*))?$", re.MULTILINE)
    for place in _sources(module):
        if found := pattern.search(place):
            above = [line.removeprefix("# ") for line in found[1].splitlines()]
            return [_plain(line) for line in [*above, *([found[2]] if found[2] else [])]]
    return []


@cache
def _sources(module: str) -> list[str]:
    home = Path(inspect.getfile(import_module(module)))
    beside = sorted(home.parent.glob("*.py")) if home.name == "__init__.py" else []
    return [one.read_text() for one in (home, *beside)]


def _plain(line: str) -> str:
    """Escape what Sphinx would take for markup, outside of backticks."""
    parts = SPAN.split(line)
    return "".join(part if part.startswith("`") else SPECIAL.sub(r"\\\g<0>", part) for part in parts)


def docstring(_app: Any, _what: str, _name: str, thing: Any, _options: Any, lines: list[str]) -> None:
    """Turn the text of a docstring into markup: names become links, fields of settings a list."""
    fields = inspect.isclass(thing) and issubclass(thing, BaseModel)
    end = lines.index("Fields") if fields and "Fields" in lines else len(lines)
    text = [line if EXAMPLE.match(line) else _plain(line) for line in _prose(lines[:end])]
    if fields:
        text += ["", *_fields(thing)]
    lines[:] = text


def _prose(lines: list[str]) -> list[str]:
    """Set lists of names with a text, one in each line, apart from the text around them."""
    result: list[str] = []
    for line in lines:
        named = re.match(r"[a-z_]+(?:, [a-z_]+)*: \S", line)
        result += ["", line] if named and result and result[-1] else [line]
    return result


def _fields(model: type[BaseModel]) -> list[str]:
    lines = []
    for name, field in model.model_fields.items():
        default = default_of(field)
        default = {"required": " Required.", "absent": "", "defaults": ""}.get(default, f" Default: ``{default}``.")
        tables = " or ".join(f"`{table.__name__}`" for table in models_in(field.annotation))
        kind = type_of(field).replace("table", tables) if tables else type_of(field)
        lines += [f"``{name}`` : {kind}", f"    {_plain(described(field))}{default}", ""]
    return lines


def signature(_app: Any, _what: str, _name: str, _thing: Any, _options: Any, given: str, returned: str) -> Any:
    """Write arrays by the type of their values alone; their shape stands in the text."""
    return tuple(None if one is None else ARRAY.sub(r"ndarray[\1]", one) for one in (given, returned))


def skip(_app: Any, _what: str, name: str, _thing: Any, _skipped: bool, _options: Any) -> bool | None:
    """Leave out what pydantic adds to a model, and its fields, which the docstring lists."""
    return True if name in {"model_config", "model_fields", "model_computed_fields", "model_post_init"} else None


def setup(app: Any) -> dict[str, bool]:
    """Connect to autodoc; before numpydoc, which reads sections."""
    app.connect("autodoc-process-docstring", docstring, priority=400)
    app.connect("autodoc-process-signature", signature)
    app.connect("autodoc-skip-member", skip)
    app.connect("missing-reference", find)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
