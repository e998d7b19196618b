"""The `serve` command as a process: how it starts, refuses, ends, and survives being killed."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from mcap.reader import make_reader

COMMAND = [sys.executable, "-c", "from polepilot.commands.main import main; main()", "serve"]
MEASURED = """
[simulation]
sensing = "measured"
[server]
panel = false
"""
Start = Callable[..., "Service"]


class Service:
    """A running `polepilot serve`."""

    def __init__(self, data: Path, *arguments: str) -> None:
        config = data.with_suffix(".toml")
        config.write_text(MEASURED)
        self.process = subprocess.Popen(
            [*COMMAND, "--port", "0", "--data", str(data), "--config", str(config), *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        match = re.search(r"http://\S+:\d+/", line)
        assert match, (line, self.process.stderr and self.process.stderr.read())
        self.client = httpx.Client(base_url=f"{match[0]}api/v1", timeout=30)

    def until(self, condition: Callable[[dict[str, Any]], bool], seconds: float = 60) -> None:
        end = time.monotonic() + seconds
        while not condition(snapshot := self.client.get("/robot").json()):
            assert time.monotonic() < end, snapshot
            time.sleep(0.05)

    def start_mission(self) -> int:
        self.until(lambda snapshot: snapshot["state"] == "ready")
        plan = self.client.post("/plans", json={"site_id": 1, "mode": "scan"})
        assert plan.status_code == 201, plan.text
        run = self.client.post("/missions", json={"plan_id": plan.json()["id"]})
        assert run.status_code == 201, run.text
        self.until(lambda snapshot: snapshot["mission"]["travelled"] > 0.2)
        run_id: int = run.json()["id"]
        return run_id

    def end(self, number: int) -> tuple[int, str, float]:
        """Send a signal. Returns exit status, standard error, seconds."""
        self.client.close()
        began = time.monotonic()
        self.process.send_signal(number)
        try:
            _, said = self.process.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.communicate()
            raise
        return self.process.returncode, said, time.monotonic() - began


@pytest.fixture
def start() -> Iterator[Start]:
    services: list[Service] = []

    def begin(data: Path, *arguments: str) -> Service:
        services.append(Service(data, *arguments))
        return services[-1]

    yield begin
    for service in services:
        if service.process.poll() is None:
            service.process.kill()
            service.process.communicate()
        service.client.close()


def refused(*arguments: str) -> str:
    """The one line that a refused start says."""
    done = subprocess.run(
        [*COMMAND, *arguments], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1, done.stderr
    return done.stderr


def log_topics(path: Path) -> set[str]:
    """Channels of a log, by the reader that refuses unfinished files."""
    with path.open("rb") as file:
        return {channel.topic for _, channel, _ in make_reader(file).iter_messages()}


def test_ctrl_c_in_the_middle_of_a_mission(start: Start, tmp_path: Path) -> None:
    service = start(tmp_path / "data")
    run = service.start_mission()
    status, said, took = service.end(signal.SIGINT)
    assert status == 0, said
    assert said == ""
    assert took < 10
    topics = log_topics(tmp_path / "data" / "runs" / str(run) / "run.mcap")
    assert {"site", "plan", "snapshot", "result"} <= topics
    # The run and its record are there after the next start, and so is what is left to do.
    again = start(tmp_path / "data")
    record = again.client.get(f"/runs/{run}").json()
    assert record["outcome"] == "paused"
    assert record["missed"]
    assert again.end(signal.SIGTERM)[:2] == (0, "")


def test_kill_9_in_the_middle_of_a_mission(start: Start, tmp_path: Path) -> None:
    service = start(tmp_path / "data")
    run = service.start_mission()
    site = service.client.get("/sites/1").json()["site"]
    site["name"] = "Kept"
    changed = service.client.put("/sites/1", json=site, headers={"If-Match": '"v1"'})
    assert changed.status_code == 200
    service.until(lambda snapshot: snapshot["mission"]["travelled"] > 1.0)
    assert service.end(signal.SIGKILL)[0] == -signal.SIGKILL

    again = start(tmp_path / "data")
    assert again.client.get("/sites/1").json()["name"] == "Kept"
    end = time.monotonic() + 20
    while (record := again.client.get(f"/runs/{run}").json())["coverage"] is None:
        assert time.monotonic() < end
    assert record["outcome"] == "interrupted"
    assert 0 < record["coverage"] < 0.2
    assert "snapshot" in log_topics(tmp_path / "data" / "runs" / str(run) / "run.mcap")
    again.until(lambda snapshot: snapshot["state"] == "ready")
    body = {"site_id": 1, "mode": "scan", "pending_of": run}
    assert again.client.post("/plans", json=body).status_code == 201
    assert again.end(signal.SIGTERM)[0] == 0


def test_a_port_in_use(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = str(other.getsockname()[1])
        said = refused("--port", port, "--data", str(tmp_path / "data"))
    assert port in said
    assert "in use" in said
    assert not (tmp_path / "data").exists()


def test_a_data_folder_in_use(start: Start, tmp_path: Path) -> None:
    start(tmp_path / "data")
    assert "another Polepilot" in refused("--port", "0", "--data", str(tmp_path / "data"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--host", "0.0.0.0"], "expected 127.0.0.1"),
        (["--host", "192.168.0.7"], "expected 127.0.0.1"),
        (["--port", "70000"], "65535"),
        (["--board", "toaster"], "toaster"),
        (["--board", "serial"], "port"),
        (["--config", "/nowhere/robot.toml"], "/nowhere/robot.toml"),
        (["--data", "/proc/polepilot"], "/proc/polepilot"),
    ],
)
def test_what_is_refused(arguments: list[str], words: str) -> None:
    assert words in refused("--port", "0", *arguments)
