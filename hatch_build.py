"""Builds what is not Python while Polepilot is installed: the page and the eye's kernel.

hatchling calls it for every wheel, the editable one too. By hand:

    python hatch_build.py                           build both, where they are out of date
    python hatch_build.py --kernel                  build the kernel alone
    python hatch_build.py --kernel --sanitize OUT   a kernel for fuzzing; prints what to preload
    python hatch_build.py --npm WORDS               npm WORDS in web/, with the Node of the build
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent
sys.path.insert(0, str(ROOT))  # hatchling does not do it

from build_hooks import BuildError, kernel, page, say  # noqa: E402

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:  # run by hand, in an environment without the build requirements
    BuildHookInterface = object  # type: ignore[assignment,misc]


class BuildHook(BuildHookInterface):  # type: ignore[misc]
    """What hatchling calls."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """Build requirements of this machine, besides those in pyproject.toml."""
        return kernel.build_requirements(ROOT) if self.target_name == "wheel" else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if self.target_name != "wheel":
            return
        page.build_page(ROOT)
        build_data["artifacts"].append(f"/{page.STATIC.as_posix()}/**")
        kernel.build(ROOT)
        build_data["artifacts"].append(f"/{kernel.LIBRARY.as_posix()}")
        if version == "standard":
            # Loaded by ctypes, the library fits every Python of this platform.
            platform = self.build_config.builder.get_best_matching_tag().rsplit("-", 1)[1]
            build_data["tag"] = f"py3-none-{platform}"
            build_data["pure_python"] = False


def main() -> int:
    try:
        match sys.argv[1:]:
            case ["--npm", *words]:
                return page.run_npm(ROOT / "web", words)
            case ["--kernel", "--sanitize", out]:
                print(f"LD_PRELOAD={kernel.build_sanitized(ROOT, Path(out).absolute())}")
            case ["--kernel"]:
                kernel.build(ROOT)
            case []:
                kernel.build(ROOT)
                page.build_page(ROOT)
            case words:
                raise BuildError(f"unknown words {words}, see the head of {Path(__file__).name}.")
    except BuildError as error:
        say(str(error))
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
