"""robot.example.toml and the tables of docs/configuration.md, made from the settings themselves.

``python -m polepilot.server.settings_docs`` writes both; a test fails where they have drifted.
"""

from __future__ import annotations

import inspect
import math
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from polepilot.server.settings import Settings
from polepilot.server.settings_errors import describe_expected

BEGIN, END = "<!-- settings: begin -->", "<!-- settings: end -->"
_ROOT = Path(__file__).parents[2]
EXAMPLE = _ROOT / "robot.example.toml"
PAGE = _ROOT / "docs" / "configuration.md"


def example() -> str:
    """robot.example.toml: every key with its default, its meaning and its range."""
    lines = [
        "# robot.toml: what this robot is. All values here are the defaults, the simulated robot;",
        "# keep only the keys that you change. Lengths in metres, angles in radians.",
        "# Start with: polepilot serve --config robot.toml",
    ]
    for section, model, values in _sections():
        lines += ["", f"# {_first_line(model)}", f"[{section}]"]
        for key, field in model.model_fields.items():
            value = getattr(values, key)
            comment = f"{field.description}{_range(field)}{_in_degrees(key, value)}"
            lines += textwrap.wrap(comment, 100, initial_indent="# ", subsequent_indent="# ")
            lines.append(f"{key} = {_toml(value)}")
    return "\n".join(lines) + "\n"


def tables() -> str:
    """One Markdown table per section."""
    parts: list[str] = []
    for section, model, values in _sections():
        parts += [f"### [{section}]", "", _first_line(model), ""]
        parts += ["| key | default | takes | meaning |", "|---|---|---|---|"]
        for key, field in model.model_fields.items():
            value = getattr(values, key)
            parts.append(
                f"| `{section}.{key}` | `{_toml(value)}`{_in_degrees(key, value)} "
                f"| {_cell(describe_expected(field))} | {_cell(_describe(field))} |"
            )
        parts.append("")
    return "\n".join(parts)


def with_tables(page: str) -> str:
    """``page`` with what stands between the two marks replaced by the tables of today."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n\n{tables()}\n{END}{after}"


def _sections() -> Iterator[tuple[str, type[BaseModel], Any]]:
    defaults = Settings()
    for name in Settings.model_fields:
        values = getattr(defaults, name)
        yield name, type(values), values


def _range(field: FieldInfo) -> str:
    """`` [from 32 to 8192]``, or nothing where the kind of value says it all."""
    words = describe_expected(field)
    bounds = words.removeprefix("a whole number").removeprefix("a number").strip()
    return f" [{bounds}]" if bounds and bounds != words else ""


def _first_line(model: type[BaseModel]) -> str:
    return (inspect.getdoc(model) or "").splitlines()[0]


def _describe(field: FieldInfo) -> str:
    return field.description or ""


def _cell(words: str) -> str:
    return words.replace("|", "\\|")


def _in_degrees(key: str, value: Any) -> str:
    if not re.search(r"_rad(_s)?$", key):
        return ""
    values = value if isinstance(value, tuple) else (value,)
    unit = " degrees per second" if key.endswith("_rad_s") else " degrees"
    return f" ({', '.join(f'{math.degrees(v):.4g}' for v in values)}{unit})"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    return repr(value)


def main() -> None:
    """Write both files."""
    EXAMPLE.write_text(example(), encoding="utf-8")
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
