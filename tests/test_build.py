"""The eye's kernel is compiled while Polepilot is installed, with or without a C compiler."""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from build_hooks import BuildError, kernel

ROOT = Path(__file__).parents[1]
TWICE = """\
#include <math.h>
#include "twice.h"

static double helper(double x) { return hypot(x, 0.0); }
double hidden(double x) { return helper(x); }
__attribute__((visibility("default"))) double twice(double x) { return FACTOR * hidden(x); }
"""
OVERRUN = """\
#include <stdlib.h>
__attribute__((visibility("default"))) int overrun(int n)
{
    char *bytes = malloc((size_t)n);
    bytes[n] = 1;
    int read = bytes[n];
    free(bytes);
    return read;
}
"""
ANY_PROCESSOR = """\
#if defined(__AVX__) || defined(__SSE4_1__) || defined(__ARM_FEATURE_DOTPROD)
#error "made for the processor of this very machine"
#endif
int nothing(void);
int nothing(void) { return 0; }
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder with nothing but the sources of a small kernel."""
    native = tmp_path / "project" / kernel.SOURCES
    native.mkdir(parents=True)
    (native / "twice.c").write_text(TWICE)
    (native / "twice.h").write_text("#define FACTOR 2.0\n")
    return tmp_path / "project"


@pytest.fixture
def no_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "nothing").mkdir()
    monkeypatch.setenv("PATH", str(tmp_path / "nothing"))
    monkeypatch.delenv("CC", raising=False)


def twice(project: Path, x: float) -> float:
    # Another name each time: a library that is open already would not be opened anew.
    copy = project / f"copy-{len(list(project.glob('copy-*')))}.so"
    shutil.copy(project / kernel.LIBRARY, copy)
    function = ctypes.CDLL(str(copy)).twice
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double]
    return float(function(x))


def compilers() -> dict[str, kernel.Compiler | None]:
    return {"machine": kernel.machine_compiler(), "zig": kernel.zig_compiler()}


def test_kernel_in_the_tree_is_up_to_date() -> None:
    assert kernel.is_current(ROOT, None), "run `python hatch_build.py --kernel`"


def test_kernel_is_built_when_something_changed_and_only_then(project: Path) -> None:
    library = project / kernel.LIBRARY
    assert kernel.build(project)
    assert twice(project, -1.5) == 3.0
    first = library.stat()
    assert not kernel.build(project)
    assert library.stat().st_ino == first.st_ino
    assert library.stat().st_mtime_ns == first.st_mtime_ns

    (project / kernel.SOURCES / "twice.h").write_text("#define FACTOR 3.0\n")
    assert not kernel.is_current(project, None)
    assert kernel.build(project)
    assert twice(project, -1.5) == 4.5

    library.write_bytes(b"not a library")
    assert kernel.build(project)
    library.unlink()
    assert kernel.build(project)
    other = kernel.Compiler(("other",), "other 1.0")
    assert kernel.is_current(project, kernel.find_compiler())
    assert not kernel.is_current(project, other)
    assert {path.name for path in library.parent.iterdir()} == {
        "native",
        kernel.LIBRARY.name,
        kernel.STAMP.name,
    }


def test_an_open_library_survives_its_successor(project: Path) -> None:
    kernel.build(project)
    old = ctypes.CDLL(str(project / kernel.LIBRARY)).twice
    old.restype, old.argtypes = ctypes.c_double, [ctypes.c_double]
    (project / kernel.SOURCES / "twice.h").write_text("#define FACTOR 5.0\n")
    kernel.build(project)
    assert old(1.0) == 2.0
    assert twice(project, 1.0) == 5.0


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("int broken(void) { return nonsense; }\n", r"more\.c:1:.*nonsense"),
        ("int absent(void);\nint broken(void);\nint broken(void) { return absent(); }\n", "absent"),
    ],
)
def test_sources_that_fail_are_named_and_the_old_library_stays(
    project: Path, source: str, words: str
) -> None:
    kernel.build(project)
    before = (project / kernel.LIBRARY).read_bytes()
    (project / kernel.SOURCES / "more.c").write_text(source)
    with pytest.raises(BuildError, match=f"(?s){words}"):
        kernel.build(project)
    assert (project / kernel.LIBRARY).read_bytes() == before
    assert not list((project / kernel.LIBRARY).parent.glob("_kernel-*"))


def test_a_folder_without_sources_is_an_error(project: Path) -> None:
    (project / kernel.SOURCES / "twice.c").unlink()
    with pytest.raises(BuildError, match=r"no C source in .*native"):
        kernel.build(project)


def test_only_what_is_marked_is_exported(project: Path) -> None:
    kernel.build(project)
    library = ctypes.CDLL(str(project / kernel.LIBRARY))
    assert hasattr(library, "twice")
    assert not hasattr(library, "hidden")


@pytest.mark.parametrize("name", ["machine", "zig"])
def test_the_eye_compiles_without_a_warning(name: str, tmp_path: Path) -> None:
    compiler = compilers()[name]
    assert compiler is not None
    out = tmp_path / "kernel.so"
    flags = (*kernel.FLAGS, *kernel.STRICT)
    kernel.compile_sources(compiler, kernel.sources_of(ROOT), out, flags)
    assert kernel.loading_problem(out) is None


def test_the_eye_compiles_for_a_raspberry_pi(tmp_path: Path) -> None:
    zig = kernel.zig_compiler()
    assert zig is not None
    pi = kernel.Compiler((*zig.command, "-target", "aarch64-linux-gnu.2.31"), zig.name)
    out = tmp_path / "kernel.so"
    flags = (*kernel.FLAGS, *kernel.STRICT, "-Wl,--no-undefined")
    kernel.compile_sources(pi, kernel.sources_of(ROOT), out, flags)
    head = out.read_bytes()[:20]
    machine = 183  # EM_AARCH64
    assert head[:6] == b"\x7fELF\x02\x01"
    assert struct.unpack_from("<H", head, 18) == (machine,)
    if platform.machine() == "x86_64":
        assert kernel.loading_problem(out) is not None


@pytest.mark.parametrize("name", ["machine", "zig"])
def test_the_library_runs_on_every_processor_of_its_kind(name: str, tmp_path: Path) -> None:
    compiler = compilers()[name]
    assert compiler is not None
    source = tmp_path / "any.c"
    source.write_text(ANY_PROCESSOR)
    kernel.compile_sources(compiler, [source], tmp_path / "any.so")


@pytest.mark.usefixtures("no_compiler")
def test_without_a_compiler_zig_builds_the_kernel(
    project: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert kernel.machine_compiler() is None
    assert kernel.build_requirements(project) == [kernel.ZIGLANG]
    assert kernel.build(project)
    assert "building the eye's kernel with zig" in capfd.readouterr().err
    assert twice(project, 2.0) == 4.0
    assert kernel.build_requirements(project) == []


@pytest.mark.usefixtures("no_compiler")
def test_without_any_compiler_it_says_what_to_install(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kernel, "find_spec", lambda _: None)
    with pytest.raises(BuildError, match=r"no C compiler.*apt-get install gcc"):
        kernel.build(project)


def test_a_cc_that_does_not_work_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CC", raising=False)
    next_one = next((name for name in ("gcc", "clang") if shutil.which(name)), None)
    broken = tmp_path / "cc"
    broken.write_text("#!/bin/sh\necho 'please install the tools' >&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    found = kernel.machine_compiler()
    assert (found.command if found else None) == ((next_one,) if next_one else None)

    monkeypatch.setenv("CC", str(broken))
    with pytest.raises(BuildError, match=r"CC names.*\n.*please install the tools"):
        kernel.machine_compiler()


def test_cc_chooses_the_compiler_with_its_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CC", raising=False)
    own = kernel.machine_compiler()
    assert own is not None
    monkeypatch.setenv("CC", f"{shutil.which(own.command[0])} -pipe")
    chosen = kernel.machine_compiler()
    assert chosen is not None
    assert chosen.command == (shutil.which(own.command[0]), "-pipe")
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(BuildError, match="no-such-compiler: there is no such program"):
        kernel.find_compiler()


def test_the_compiler_that_is_fetched_is_the_tested_one() -> None:
    assert kernel.ZIGLANG in (ROOT / "constraints.txt").read_text().splitlines()


def test_a_sanitized_kernel_stops_at_a_wrong_access(tmp_path: Path) -> None:
    native = tmp_path / kernel.SOURCES
    native.mkdir(parents=True)
    (native / "overrun.c").write_text(OVERRUN)
    out = tmp_path / "sanitized.so"
    runtime = kernel.build_sanitized(tmp_path, out)
    done = subprocess.run(
        [sys.executable, "-c", f"import ctypes; ctypes.CDLL({str(out)!r}).overrun(24)"],
        env={**os.environ, "LD_PRELOAD": str(runtime), "ASAN_OPTIONS": "detect_leaks=0"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert "heap-buffer-overflow" in done.stderr
    assert "overrun.c:5" in done.stderr


@pytest.fixture
def whole_project(project: Path) -> Path:
    """All that hatchling needs, with the small kernel and without the page."""
    for name in ("pyproject.toml", "README.md", "LICENSE", ".gitignore", "hatch_build.py"):
        shutil.copy(ROOT / name, project)
    ignore = shutil.ignore_patterns("__pycache__", "static", "native", "_kernel*")
    for name in ("build_hooks", "polepilot"):
        shutil.copytree(ROOT / name, project / name, ignore=ignore, dirs_exist_ok=True)
    return project


def hatchling(project: Path, *words: str, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, *words],
        cwd=project,
        env={**os.environ, "POLEPILOT_PAGE": "skip", **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_wheel_brings_the_library_and_not_its_sources(whole_project: Path) -> None:
    hatchling(whole_project, "-m", "hatchling", "build", "-t", "wheel")
    (wheel,) = (whole_project / "dist").iterdir()
    assert "-py3-none-" in wheel.name
    assert not wheel.name.endswith("-any.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (about,) = (name for name in names if name.endswith(".dist-info/WHEEL"))
        assert "Root-Is-Purelib: false" in archive.read(about).decode()
    native = {name for name in names if "kernel" in name.lower() or "native" in name}
    assert kernel.LIBRARY.as_posix() in native
    assert native <= {kernel.LIBRARY.as_posix(), "polepilot/core/vision/kernel.py"}


def test_pip_fetches_a_compiler_only_where_there_is_none(
    whole_project: Path, tmp_path: Path
) -> None:
    ask = "import hatchling.build as b; print(*b.get_requires_for_build_editable())"
    assert kernel.machine_compiler() is not None
    assert "ziglang" not in hatchling(whole_project, "-c", ask)
    (tmp_path / "empty").mkdir()
    nowhere = {"PATH": str(tmp_path / "empty"), "CC": ""}
    assert kernel.ZIGLANG in hatchling(whole_project, "-c", ask, **nowhere).split()


def test_the_script_says_what_it_does_not_know(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "hatch_build.py"), "--bogus"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "unknown words ['--bogus']" in done.stderr
    assert "Traceback" not in done.stderr
