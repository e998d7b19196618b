"""One clear sentence for everything that can be wrong in robot.toml."""

from __future__ import annotations

import difflib
import re
import tomllib
import types
from collections.abc import Mapping
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, PydanticCustomError

from polepilot.core.vision.addresses import without_password

_WORDS: dict[Any, str] = {
    int: "a whole number",
    float: "a number",
    str: "text in quotes",
    bool: "true or false",
}
_HEADER = re.compile(r"^\s*\[{1,2}\s*([^\[\]#]+?)\s*\]{1,2}\s*(#.*)?$")
_KEY = re.compile(
    r"^\s*((?:[\w-]+|\"[^\"]*\"|'[^']*')(?:\s*\.\s*(?:[\w-]+|\"[^\"]*\"|'[^']*'))*)\s*="
)


def refusal(key: str, read: Any, expected: str) -> PydanticCustomError:
    """For a validator: ``key`` (within the section, or section.key) does not fit the others."""
    return PydanticCustomError("refused", "refused", {"key": key, "read": read, "words": expected})


def explain_syntax(error: tomllib.TOMLDecodeError, source: str, text: str) -> str:
    """``FILE: line 3, column 7: no TOML: ...``."""
    match = re.match(r"(.*?)\s*\(at (.*)\)$", str(error), re.DOTALL)
    what, where = match.groups() if match else (str(error), "an unknown place")
    if where == "end of document":
        where = f"line {max(1, len(text.splitlines()))}, at the end"
    return f"{source}: {where}: this is no TOML: {' '.join(what.split())}."


def explain_validation(
    error: ValidationError, source: str, text: str, model: type[BaseModel]
) -> str:
    """The problem that comes first in the file, in one line, and how many more there are.

    Args:
        source: the file's name, or an option such as ``--board``.
        text: the TOML document, for line numbers; empty where there is none.
        model: the settings class, for the names and ranges that are allowed.
    """
    lines = key_lines(text)
    problems: dict[tuple[str, ...], tuple[int, str]] = {}
    for details in error.errors():
        path, sentence = _explain(details, model)
        if path not in problems:
            # A section that is an inline table, or is absent, is found by its own line or not.
            line = next((lines[path[:n]] for n in range(len(path), 0, -1) if path[:n] in lines), 0)
            problems[path] = (line, sentence)
    ordered = sorted(problems.items(), key=lambda item: item[1][0])
    path, (line, sentence) = ordered[0]
    place = f"{source}: line {line}" if line else source
    message = f"{place}: {'.'.join(path)} {sentence}"
    message += "" if message.endswith("?") else "."
    if len(ordered) > 1:
        others = ", ".join(".".join(path) for path, _ in ordered[1:5])
        more = ", ..." if len(ordered) > 5 else ""
        message += f" Also wrong: {others}{more}."
    return message


def describe_expected(field: FieldInfo) -> str:
    """What a key takes, in words: ``a number more than 0 and at most 10``."""
    annotation = field.annotation
    bounds = {
        name: value
        for name in ("gt", "ge", "lt", "le")
        for part in field.metadata
        if (value := getattr(part, name, None)) is not None
    }
    if get_origin(annotation) is Literal:
        return "one of " + ", ".join(_show(value) for value in get_args(annotation))
    if get_origin(annotation) in (Union, types.UnionType):
        return " or ".join(_WORDS[kind] for kind in get_args(annotation))
    if get_origin(annotation) is tuple:
        return f"a list of {len(get_args(annotation))} numbers"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "a table of keys"
    return _WORDS[annotation or str] + _describe_bounds(bounds)


def key_lines(text: str) -> dict[tuple[str, ...], int]:
    """The line (from 1) of every table header and key of a TOML document.

    Good enough for error messages: a line inside a multi-line string that looks like a key is
    taken for one only where no real key of that name came before.
    """
    lines: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = _split(header.group(1))
            lines.setdefault(table, number)
        elif key := _KEY.match(line):
            path = table + _split(key.group(1))
            for length in range(1, len(path) + 1):
                lines.setdefault(path[:length], number)
    return lines


def _split(dotted: str) -> tuple[str, ...]:
    return tuple(part.strip().strip("\"'") for part in dotted.split("."))


def _describe_bounds(bounds: Mapping[str, float]) -> str:
    if "ge" in bounds and "le" in bounds:
        return f" from {_number(bounds['ge'])} to {_number(bounds['le'])}"
    words = {"gt": "more than", "ge": "at least", "lt": "less than", "le": "at most"}
    parts = [f"{words[name]} {_number(value)}" for name, value in bounds.items()]
    return " " + " and ".join(parts) if parts else ""


def _number(value: float) -> str:
    return str(int(value)) if value == int(value) else f"{value:.6g}"


def _show(value: Any) -> str:
    """A value as TOML writes it, cut to a readable length."""
    if isinstance(value, bool):
        shown = str(value).lower()
    elif isinstance(value, str):
        value = without_password(value)
        shown = '"' + value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
    elif isinstance(value, Mapping):
        shown = "a table"
    elif isinstance(value, list | tuple):
        shown = "[" + ", ".join(_show(item) for item in value) + "]"
    else:
        shown = str(value)
    return shown if len(shown) <= 60 else shown[:57] + "..."


def _explain(details: ErrorDetails, model: type[BaseModel]) -> tuple[tuple[str, ...], str]:
    """The key that one error is about, and the sentence's end that follows it."""
    location = tuple(str(part) for part in details["loc"])
    if details["type"] == "refused":
        context = details["ctx"]
        path = (*location, *context["key"].split("."))
        return path, f"is {_show(context['read'])}: expected {context['words']}"
    if details["type"] == "extra_forbidden":
        return location, _explain_unknown(location, model)
    # Deeper parts of the location are members of a union or places in a list.
    path = location[:2]
    field = _field(path, model)
    read = details["input"]
    if location[2:] and get_origin(field.annotation) is tuple:
        return path, f"holds {_show(read)}: expected {describe_expected(field)}"
    return path, f"is {_show(read)}: expected {describe_expected(field)}"


def _explain_unknown(path: tuple[str, ...], model: type[BaseModel]) -> str:
    siblings = list(_section(path[:-1], model).model_fields)
    if close := difflib.get_close_matches(path[-1], siblings, n=1, cutoff=0.5):
        return f"is not known: did you mean {'.'.join((*path[:-1], close[0]))}?"
    # A key may be right but in the wrong section.
    for name, field in model.model_fields.items():
        section = field.annotation
        if not isinstance(section, type) or not issubclass(section, BaseModel):
            continue
        if path[-1] in section.model_fields:
            return f"is not known: did you mean {name}.{path[-1]}?"
    kind = "the keys are" if path[:-1] else "the sections are"
    return f"is not known: {kind} {', '.join(siblings)}"


def _section(path: tuple[str, ...], model: type[BaseModel]) -> type[BaseModel]:
    for name in path:
        section = model.model_fields[name].annotation
        assert isinstance(section, type)
        assert issubclass(section, BaseModel)
        model = section
    return model


def _field(path: tuple[str, ...], model: type[BaseModel]) -> FieldInfo:
    return _section(path[:-1], model).model_fields[path[-1]]
