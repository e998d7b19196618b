"""Compiles polepilot/core/vision/native/*.c into polepilot/core/vision/_kernel.so.

The compiler is `$CC`; else the first of cc, gcc and clang on the PATH that works; else Zig's, which
the `ziglang` wheel brings for x86-64 and aarch64, Linux and macOS: hatch_build.py asks for that
wheel only where it is needed. A stamp beside the library, a hash of everything that went into it,
makes sure that nothing is built twice.

The library runs on every processor of its kind (no -march=native), exports only what is marked
`__attribute__((visibility("default")))`, and is loaded by ctypes, so that it fits every Python.
"""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from build_hooks import BuildError, say

SOURCES = Path("polepilot/core/vision/native")
LIBRARY = Path("polepilot/core/vision/_kernel.so")
STAMP = Path("polepilot/core/vision/_kernel.stamp")

ZIGLANG = "ziglang==0.17.1"
"""The wheel with Zig's compiler. Exactly this one: it is what the tests compile with."""

BASE = ("-std=c99", "-fPIC", "-shared", "-fvisibility=hidden")
FLAGS = (*BASE, "-O3", "-fno-math-errno", "-ffp-contract=off")
"""No contraction: fused multiply-adds would make the answers differ between compilers."""

STRICT = ("-Wall", "-Wextra", "-Werror")
"""Added by the tests. An installation does not fail for a warning of a compiler yet to come."""

SANITIZE = (
    *BASE,
    *("-O1", "-g", "-fno-omit-frame-pointer"),
    *("-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"),
)
ADVICE = "Install one (Debian: apt-get install gcc libc6-dev), or `pip install ziglang`."


@dataclass(frozen=True)
class Compiler:
    """A C compiler: the words that call it, and its name and version for people."""

    command: tuple[str, ...]
    name: str


def build(root: Path) -> bool:
    """Build the kernel if it is out of date; True where something was done.

    Raises:
        BuildError: there are no sources or no compiler, or it refuses the sources.
    """
    sources = sources_of(root)
    compiler = find_compiler()
    if is_current(root, compiler):
        say("the eye's kernel is up to date.")
        return False
    if compiler is None:
        raise BuildError(f"the eye's kernel cannot be built: there is no C compiler. {ADVICE}")
    say(f"building the eye's kernel with {compiler.name} ...")
    library = root / LIBRARY
    with TemporaryDirectory(prefix="_kernel-", dir=library.parent) as folder:
        fresh = Path(folder) / library.name
        compile_sources(compiler, sources, fresh)
        problem = loading_problem(fresh)
        if problem is not None:
            raise BuildError(f"the eye's kernel was built but cannot be loaded: {problem}")
        (root / STAMP).unlink(missing_ok=True)
        # A process that uses the old library keeps its mapping: a new file takes the old one's name
        fresh.replace(library)
    (root / STAMP).write_text(f"{source_hash(root)}\n{compiler.name}\n", "utf-8")
    return True


def build_sanitized(root: Path, out: Path) -> Path:
    """Build a kernel that stops at every wrong access and undefined operation, for fuzzing.

    Returns:
        The library that has to be preloaded (LD_PRELOAD) to load it into Python.

    Raises:
        BuildError: there are no sources, or no gcc or clang (Zig has no sanitizer), or it refuses
            the sources.
    """
    compiler = machine_compiler()
    if compiler is None:
        raise BuildError(f"sanitizing needs gcc or clang. {ADVICE}")
    sources = sources_of(root)
    say(f"building the eye's kernel with {compiler.name} and sanitizers ...")
    # clang links its runtime into programs only, unless told otherwise
    flags = (*SANITIZE, "-shared-libasan") if "clang" in compiler.name else SANITIZE
    compile_sources(compiler, sources, out, flags)
    for name in ("libasan.so", f"libclang_rt.asan-{os.uname().machine}.so", "libclang_rt.asan.so"):
        answer = run([*compiler.command, f"-print-file-name={name}"])
        runtime = Path(answer.stdout.strip())
        if runtime.is_absolute() and runtime.is_file():
            return runtime.resolve()
    raise BuildError(f"the address sanitizer's library of {compiler.name} is missing.")


def build_requirements(root: Path) -> list[str]:
    """What pip has to fetch for the build: Zig, where the machine has no compiler of its own."""
    if machine_compiler() is not None or is_current(root, None):
        return []
    return [ZIGLANG]


def sources_of(root: Path) -> list[Path]:
    """The C sources, in order.

    Raises:
        BuildError: there are none.
    """
    sources = sorted((root / SOURCES).glob("*.c"))
    if not sources:
        raise BuildError(f"the eye's kernel cannot be built: no C source in {root / SOURCES}.")
    return sources


def source_hash(root: Path) -> str:
    """Of everything in the folder of the sources, the flags, and the kind of machine."""
    digest = hashlib.sha256(f"{FLAGS}\0{sysconfig.get_platform()}\0".encode())
    for path in sorted(path for path in (root / SOURCES).glob("*") if path.is_file()):
        digest.update(f"{path.name}\0{path.stat().st_size}\0".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def is_current(root: Path, compiler: Compiler | None) -> bool:
    """Whether the library is there, fits this machine, and was built from these very sources.

    Args:
        compiler: by which it has to be built; None for any.
    """
    try:
        built_from, built_by = (root / STAMP).read_text("utf-8").splitlines()
    except (OSError, ValueError):
        return False
    return (
        built_from == source_hash(root)
        and (compiler is None or built_by == compiler.name)
        and loading_problem(root / LIBRARY) is None
    )


def find_compiler() -> Compiler | None:
    """The machine's own, else Zig's, else None.

    Raises:
        BuildError: `$CC` is set and does not work.
    """
    return machine_compiler() or zig_compiler()


def machine_compiler() -> Compiler | None:
    """`$CC`, else the first of cc, gcc and clang that can build a library.

    Raises:
        BuildError: `$CC` is set and does not work.
    """
    chosen = shlex.split(os.environ.get("CC", ""))
    for command in [chosen] if chosen else [["cc"], ["gcc"], ["clang"]]:
        if shutil.which(command[0]) is None:
            problem = "there is no such program"
        else:
            compiler = Compiler(tuple(command), name_of(command))
            # macOS has a cc that only says how to get one; Debian's gcc may come without libc6-dev
            found = trial(compiler)
            if found is None:
                return compiler
            problem = found
        if chosen:
            raise BuildError(f"the C compiler that CC names, {shlex.join(chosen)}: {problem}")
    return None


def zig_compiler() -> Compiler | None:
    """The compiler in the `ziglang` wheel, if that is installed."""
    spec = find_spec("ziglang")
    if spec is None or spec.origin is None:
        return None
    zig = Path(spec.origin).parent / "zig"
    version = run([str(zig), "version"]).stdout.strip() if zig.is_file() else ""
    if not version:
        return None
    # Left alone, Zig compiles for the very processor that it runs on, and adds 90 kB for debuggers.
    return Compiler((str(zig), "cc", "-mcpu=baseline", "-g0"), f"zig {version}")


def name_of(command: Sequence[str]) -> str:
    """Of a compiler: the first line of what it says about itself, and how it is called."""
    lines = run([*command, "--version"]).stdout.splitlines()
    about = lines[0].strip() if lines else "of unknown version"
    called = shlex.join(command)
    return about if about.startswith(f"{called} ") else f"{called} ({about})"


def trial(compiler: Compiler) -> str | None:
    """What keeps the compiler from building a library; None if nothing does."""
    with TemporaryDirectory(prefix="polepilot-") as folder:
        source = Path(folder) / "trial.c"
        source.write_text("#include <math.h>\ndouble trial(double x) { return exp(x); }\n")
        try:
            compile_sources(compiler, [source], Path(folder) / "trial.so")
        except BuildError as error:
            return str(error)
    return None


def compile_sources(
    compiler: Compiler, sources: Sequence[Path], out: Path, flags: Sequence[str] = FLAGS
) -> None:
    """One call of the compiler; its words are shown only where it fails.

    Raises:
        BuildError: it fails; what it says is in the message.
    """
    with TemporaryDirectory(prefix="polepilot-zig-") as cache:
        words = [*compiler.command, *flags, "-o", str(out), *map(str, sources), "-lm"]
        done = run(words, {"ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache})
    if done.returncode != 0 or not out.is_file():
        told = [line for line in (done.stderr or done.stdout).splitlines() if line.strip()][:40]
        raise BuildError("\n".join([f"{compiler.name} fails.", *told]))


def loading_problem(library: Path) -> str | None:
    """Why the library cannot be loaded here; None if it can. Missing symbols count.

    Tried in another process: this one would keep it open, and take a new one for the old.
    """
    attempt = f"import ctypes; ctypes.CDLL({str(library.absolute())!r})"
    done = run([sys.executable, "-I", "-S", "-c", attempt])
    if done.returncode == 0:
        return None
    return done.stderr.strip().rsplit("\n", 1)[-1] or f"status {done.returncode}"


def run(
    words: Sequence[str], more: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """A program that says little, with English messages; a failure to start is its failure."""
    environment = {**os.environ, "LC_ALL": "C", **(more or {})}
    try:
        return subprocess.run(
            list(words),
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
    except OSError as error:
        return subprocess.CompletedProcess(list(words), 127, "", str(error))
