"""The deploy files fit the program as it is."""

from __future__ import annotations

import inspect
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from polepilot.commands.serve import serve
from polepilot.server.settings import Settings

DEPLOY = Path(__file__).parents[1] / "deploy"
OPTIONS = {f"--{name.replace('_', '-')}" for name in inspect.signature(serve).parameters}


def test_service_calls_the_program_as_it_is() -> None:
    unit = (DEPLOY / "polepilot.service").read_text()
    line = re.search(r"^ExecStart=(.*)$", unit, re.MULTILINE)
    assert line is not None
    words = shlex.split(line.group(1))
    script = (DEPLOY / "install.sh").read_text()
    assert words[0] == "/opt/polepilot/venv/bin/polepilot"
    assert "venv=$root/opt/polepilot/venv" in script
    assert words[1] == "serve"
    given = dict(zip(words[2::2], words[3::2], strict=True))
    assert set(given) <= OPTIONS
    assert given["--config"] == "/etc/polepilot/robot.toml"
    assert '"$root/etc/polepilot/robot.toml"' in script
    # A refused configuration ends with status 2 and must not start again and again.
    assert "RestartPreventExitStatus=2" in unit


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd here")
def test_service_is_a_valid_unit(tmp_path: Path) -> None:
    unit = (DEPLOY / "polepilot.service").read_text()
    # User and program do not exist on the machine that tests.
    unit = re.sub(r"^ExecStart=\S+", "ExecStart=/bin/true", unit, flags=re.MULTILINE)
    unit = re.sub(r"^(User|Group)=.*$", r"\1=root", unit, flags=re.MULTILINE)
    copy = tmp_path / "polepilot.service"
    copy.write_text(unit)
    done = subprocess.run(
        ["systemd-analyze", "verify", str(copy)], capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert done.returncode == 0


def test_container_and_proxy_meet_the_default_port() -> None:
    port = Settings().server.port
    containerfile = (DEPLOY / "Containerfile").read_text()
    assert f"http://127.0.0.1:{port}/api/v1/about" in containerfile
    assert set(re.findall(r'"(--[a-z]+)"', containerfile)) <= OPTIONS
    caddy = (DEPLOY / "Caddyfile").read_text()
    assert f"reverse_proxy 127.0.0.1:{port}" in caddy
    assert f"header_up Host 127.0.0.1:{port}" in caddy
    # The foreign Origin is refused before it is rewritten.
    assert caddy.index("respond @foreign") < caddy.index("request_header @own Origin")


def test_rule_makes_the_port_that_the_documentation_names() -> None:
    rules = (DEPLOY / "99-polepilot.rules").read_text()
    assert 'SYMLINK+="polepilot"' in rules
    labels = set(re.findall(r'LABEL="(\w+)"', rules))
    assert set(re.findall(r'GOTO="(\w+)"', rules)) == labels
    for line in rules.splitlines():
        assert not line or line.startswith(("#", "ACTION", "SUBSYSTEM", "ATTRS", "GOTO", "LABEL", "SYMLINK"))  # fmt: skip  # noqa: E501


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["--help"], 0, "sudo deploy/install.sh"),
        (["--bogus"], 2, "unknown option --bogus"),
        (["--root"], 1, "--root needs a folder"),
    ],
)
def test_install_script_answers(arguments: list[str], status: int, words: str) -> None:
    done = subprocess.run(
        ["sh", str(DEPLOY / "install.sh"), *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == status
    assert words in done.stdout + done.stderr


def test_install_script_refuses_an_old_python_before_it_changes_anything(tmp_path: Path) -> None:
    old = tmp_path / "python"
    old.write_text("#!/bin/sh\nexit 1\n")
    old.chmod(0o755)
    root = tmp_path / "root"
    done = subprocess.run(
        ["sh", str(DEPLOY / "install.sh"), "--root", str(root)],
        env={"PYTHON": str(old), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "needs Python 3.11 or newer" in done.stderr
    assert not root.exists()
