"""`polepilot serve --board host`: the whole service with the C core as its microcontroller."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import httpx
import pytest

from polepilot.core.errors import InputError
from polepilot.server.firmware import host_program

COMMAND = [sys.executable, "-c", "from polepilot.commands.main import main; main()", "serve"]
CONFIG = '[simulation]\nsensing = "measured"\n[server]\npanel = false\n'


def children(pid: int) -> list[str]:
    """Command lines of a process' children."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            if status.read_text().rsplit(")", 1)[1].split()[1] == str(pid):
                found.append((status.parent / "cmdline").read_text().replace("\0", " "))
        except OSError:
            continue
    return found


def test_a_mission_is_driven_through_the_c_core(tmp_path: Path) -> None:
    config = tmp_path / "robot.toml"
    config.write_text(CONFIG)
    service = subprocess.Popen(
        [*COMMAND, "--port=0", f"--data={tmp_path}", f"--config={config}", "--board=host"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert service.stdout is not None
        line = service.stdout.readline()
        found = re.search(r"http://\S+:\d+/", line)
        assert found, line
        with httpx.Client(base_url=f"{found[0]}api/v1", timeout=30) as client:
            drive(client)
        (board,) = (words for words in children(service.pid) if "polepilot-board" in words)
        assert "--in-step" in board
        service.send_signal(signal.SIGTERM)
        _, said = service.communicate(timeout=30)
        assert (service.returncode, "Traceback" in said) == (0, False), said
    finally:
        service.kill()
        service.communicate()
    assert not any(board in path.read_text() for path in _command_lines())


def _command_lines() -> list[Path]:
    return [path for path in Path("/proc").glob("[0-9]*/cmdline") if path.exists()]


def drive(client: httpx.Client) -> None:
    def until(what: str, seconds: float = 60) -> dict[str, object]:
        end = time.monotonic() + seconds
        while True:
            snapshot: dict[str, object] = client.get("/robot").json()
            if what == "ready" and snapshot["state"] == "ready":
                return snapshot
            mission = snapshot["mission"]
            if isinstance(mission, dict) and what == "driving" and mission["travelled"] > 0.3:
                return snapshot
            assert time.monotonic() < end, snapshot
            time.sleep(0.05)

    until("ready")
    plan = client.post("/plans", json={"site_id": 1, "mode": "scan"})
    assert plan.status_code == 201, plan.text
    run = client.post("/missions", json={"plan_id": plan.json()["id"]})
    assert run.status_code == 201, run.text
    until("driving")


def test_without_sources_it_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--board host: the firmware's sources are not in"):
        host_program(tmp_path)


def test_a_compiler_that_fails_is_no_traceback(tmp_path: Path) -> None:
    (tmp_path / "Makefile").write_text("host:\n\t@echo 'x.c:1: error: no such thing' >&2; false\n")
    with pytest.raises(InputError, match=r"has failed: x.c:1: error: no such thing"):
        host_program(tmp_path)
