"""Imports point one way, and docs/architecture.md names the tree as it is."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "polepilot"

NOUNS = "core"
ALLOWED: dict[str, set[str]] = {
    NOUNS: {NOUNS},
    "core.vision": {NOUNS, "core.vision"},
    "core.localization": {NOUNS, "core.localization"},
    "core.planning": {NOUNS, "core.planning"},
    "core.control": {NOUNS, "core.control"},
    "core.link": {NOUNS, "core.link"},
    "core.printing": {NOUNS, "core.printing"},
    "core.robot": {
        NOUNS,
        "core.vision",
        "core.localization",
        "core.planning",
        "core.control",
        "core.link",
        "core.robot",
    },
    "core.sim": {NOUNS, "core.vision", "core.link", "core.robot.ports", "core.sim"},
    "server": {NOUNS, "core.*", "server"},
    "commands": {NOUNS, "core.*", "server", "commands"},
}
"""Which layer may import which. `core` alone means the nouns, the modules directly in core/."""

PORT_TYPES = {"polepilot.core.robot.ports"}
"""The seam to the world: device adapters of any layer may name these protocols."""

FOREIGN_TO_CORE = {"fastapi", "starlette", "uvicorn", "pydantic", "viser", "typer", "rich", "httpx"}
CLOCKS = {"time", "monotonic", "perf_counter", "time_ns", "monotonic_ns"}
MAY_READ_A_CLOCK = {
    "core/vision/capture.py",
    "core/vision/addresses.py",
    "core/vision/sources.py",
    "core/link/usb.py",
    "core/sim/clock.py",
    "core/robot/robot.py",
}
"""Device adapters, the clocks themselves, and the robot's stopwatch for its own durations."""


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def layer_of(module: str) -> str:
    """``polepilot.core.vision.color`` -> ``core.vision``; nouns -> ``core``."""
    parts = module.split(".")[1:]
    if not parts:
        return NOUNS
    if parts[0] != "core":
        return parts[0]
    folder = PACKAGE / "core" / parts[1] if len(parts) > 1 else PACKAGE
    return f"core.{parts[1]}" if len(parts) > 1 and folder.is_dir() else NOUNS


def imports_of(path: Path) -> list[tuple[int, str]]:
    tree = ast.parse(path.read_text("utf-8"))
    found: list[tuple[int, str]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.append((node.lineno, node.module))
    return found


def allowed(layer: str, target: str) -> bool:
    if target in PORT_TYPES:
        return True
    wanted = ALLOWED[layer]
    target_layer = layer_of(target)
    if target_layer in wanted or ("core.*" in wanted and target_layer.startswith("core")):
        return True
    return any(target.removeprefix("polepilot.") == name for name in wanted)


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_one_way(path: Path) -> None:
    module = ".".join(("polepilot", *path.relative_to(PACKAGE).with_suffix("").parts))
    layer = layer_of(module.removesuffix(".__init__"))
    for line, target in imports_of(path):
        if target.split(".")[0] == "polepilot" and target != "polepilot":
            assert allowed(layer, target), f"{path}:{line}: {layer} must not import {target}"
        if layer.startswith("core"):
            root = target.split(".")[0]
            assert root not in FOREIGN_TO_CORE, f"{path}:{line}: core must not know {root}"


@pytest.mark.parametrize(
    "path",
    [p for p in modules() if p.is_relative_to(PACKAGE / "core")],
    ids=lambda path: str(path.relative_to(PACKAGE)),
)
def test_time_is_an_argument_below_the_runner(path: Path) -> None:
    if str(path.relative_to(PACKAGE)) in MAY_READ_A_CLOCK or "planning" in path.parts:
        return  # planning reports how long it took; nothing depends on it
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if (
            isinstance(node, ast.Attribute)
            and node.attr in CLOCKS
            and isinstance(node.value, ast.Name)
            and node.value.id in {"time", "datetime"}
        ):
            pytest.fail(f"{path}:{node.lineno} reads a clock: take the time as an argument")


def test_the_checks_can_fail() -> None:
    assert not allowed("core.vision", "polepilot.core.planning.route")
    assert not allowed("core.sim", "polepilot.core.robot.robot")
    assert not allowed("core", "polepilot.server.app")
    assert allowed("server", "polepilot.core.robot.robot")


def test_architecture_page_names_every_module() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    named = set(re.findall(r"`((?:core|server|commands)/[\w/]+\.py)`", page))
    real = {str(path.relative_to(PACKAGE)) for path in modules() if path.name != "__init__.py"}
    assert named == real, f"missing: {sorted(real - named)}, gone: {sorted(named - real)}"
