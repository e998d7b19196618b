"""robot.toml changed by a program: some keys replaced, everything else as a person wrote it.

Line by line, so that comments, order and other keys stay; what comes out is read again and has to
differ from what went in by the wanted keys alone. The old file is kept beside the new one.
"""

from __future__ import annotations

import copy
import itertools
import os
import shutil
import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from polepilot.core.errors import ConfigError
from polepilot.server.settings import load_settings, parse_settings
from polepilot.server.settings_errors import key_lines

Value = int | float | tuple[float, ...]
Changes = Mapping[str, Mapping[str, Value]]
"""Section -> key -> value."""

_BOM = "\N{ZERO WIDTH NO-BREAK SPACE}"


def as_toml(changes: Changes) -> str:
    """The changes as lines to put into robot.toml by hand."""
    parts = []
    for section, values in changes.items():
        parts += [f"[{section}]", *(f"{key} = {toml_value(v)}" for key, v in values.items())]
    return "\n".join(parts)


def toml_value(value: Value) -> str:
    """A number, or a list of numbers, as TOML writes it."""
    if isinstance(value, tuple):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    return repr(value)


def changed(text: str, changes: Changes, source: str) -> str:
    """``text``, a TOML document from ``source``, with ``changes`` put in.

    Raises:
        ConfigError: the document cannot be read, or cannot be changed without touching more than
            the wanted keys (an inline table, say), or the result cannot be used.
    """
    parse_settings(text, source)  # says what is wrong with the file as it is
    before = tomllib.loads(text)
    lines = text.split("\n")
    for section, values in changes.items():
        for key, value in values.items():
            if before.get(section, {}).get(key) != _plain(value):
                lines = _with_key(lines, section, key, toml_value(value))
    result = "\n".join(lines)
    if not _is(result, before, changes):
        wanted = "; ".join(as_toml(changes).split("\n"))
        raise ConfigError(
            f"{source}: is written in a way that cannot be changed line by line: put in by hand: "
            f"{wanted}."
        )
    parse_settings(result, source)
    return result


def rewrite(path: Path, changes: Changes) -> Path | None:
    """Change robot.toml at ``path``; the old file is kept as ``robot.toml.1`` (or .2, ...).

    The file is replaced in one step, and not at all where that fails.

    Returns:
        Where the old file is kept; None where nothing had to be changed.

    Raises:
        ConfigError: as ``changed``, or there is no such file.
    """
    load_settings(path)
    target = path.resolve()  # what a link points to is replaced, not the link
    text = target.read_bytes().decode("utf-8")
    mark = _BOM if text.startswith(_BOM) else ""
    windows = "\r\n" in text
    plain = text.removeprefix(_BOM).replace("\r\n", "\n")
    result = changed(plain, changes, str(path))
    if result == plain:
        return None
    result = mark + (result.replace("\n", "\r\n") if windows else result)
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    part = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(result.encode("utf-8"))
            file.flush()
            os.fsync(file.fileno())
        shutil.copymode(target, part)
        kept = _keep(target)
        try:
            part.replace(target)
        except OSError:
            kept.unlink()
            raise
    finally:
        part.unlink(missing_ok=True)
    return kept


def _keep(path: Path) -> Path:
    """A copy of ``path`` under the first number that is free."""
    for number in itertools.count(1):
        kept = path.with_name(f"{path.name}.{number}")
        try:
            with kept.open("xb") as file:
                file.write(path.read_bytes())
        except FileExistsError:
            continue
        shutil.copystat(path, kept)
        return kept
    raise AssertionError


def _plain(value: Value) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _is(text: str, before: Mapping[str, Any], changes: Changes) -> bool:
    """Whether ``text`` says what ``before`` said, but for the ``changes``."""
    expected = copy.deepcopy(dict(before))
    for section, values in changes.items():
        table = expected.setdefault(section, {})
        table.update({key: _plain(value) for key, value in values.items()})
    try:
        return tomllib.loads(text) == expected
    except tomllib.TOMLDecodeError:
        return False


def _with_key(lines: Sequence[str], section: str, key: str, shown: str) -> list[str]:
    """``lines`` with one key set; as they were where there is no place for it."""
    places = {path: line - 1 for path, line in key_lines("\n".join(lines)).items()}
    if (section, key) in places:
        return _replaced(lines, places[section, key], shown)
    header = places.get((section,))
    last = max((line for path, line in places.items() if path[:1] == (section,)), default=None)
    if header is None or last is None:
        body = list(lines)
        while body and not body[-1].strip():
            body.pop()
        return [*body, *([""] if body else []), f"[{section}]", f"{key} = {shown}", ""]
    first = lines[header].lstrip()
    if first.startswith("["):
        head = "" if last == header else _indent(lines[last])
    elif any(path[:1] == (section,) and len(path) > 1 for path in places):
        head = f"{_indent(lines[last])}{section}."
    else:
        return list(lines)  # an inline table
    end = last if last == header and first.startswith("[") else _value_end(lines, last)
    return [*lines[: end + 1], f"{head}{key} = {shown}", *lines[end + 1 :]]


def _replaced(lines: Sequence[str], at: int, shown: str) -> list[str]:
    """The value of the key on line ``at`` exchanged; a comment behind it stays."""
    end = _value_end(lines, at)
    name, _, first = lines[at].partition("=")
    value = "\n".join([first, *lines[at + 1 : end + 1]])
    gap = value[: len(value) - len(value.lstrip(" \t"))]
    return [*lines[:at], f"{name}={gap}{shown}{_comment(value)}", *lines[end + 1 :]]


def _value_end(lines: Sequence[str], at: int) -> int:
    """The last line of the value that begins on line ``at``."""
    _, _, first = lines[at].partition("=")
    for end in range(at, len(lines)):
        if _value("\n".join([first, *lines[at + 1 : end + 1]])) is not None:
            return end
    return at


def _comment(value: str) -> str:
    """What follows a value: its comment, with the space before it."""
    meant = _value(value)
    for at, character in enumerate(value):
        if character == "#" and _value(value[:at]) == meant:
            return value[len(value[:at].rstrip()) :]
    return ""


def _value(text: str) -> Any:
    """What stands behind an equals sign, or None where that is no whole value."""
    try:
        return tomllib.loads(f"x ={text}\n").get("x")
    except tomllib.TOMLDecodeError:
        return None


def _indent(line: str) -> str:
    return line[: len(line) - len(line.lstrip())]
