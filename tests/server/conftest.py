"""The application around a fake robot, for the tests of the server."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from server.fakes import FakeRobot, TestClient, fake_services, plan_document

from polepilot.server.app import create_app
from polepilot.server.listener import Listener, bind
from polepilot.server.logs import configure_logs
from polepilot.server.services import Services

BASE = "http://127.0.0.1:8000"


@pytest.fixture(scope="session", autouse=True)
def _logs() -> None:
    configure_logs()


@pytest.fixture
def services(tmp_path: Path) -> Services:
    return fake_services(tmp_path / "data")


@pytest.fixture
def client(services: Services) -> Iterator[TestClient]:
    """A running application; its first start holds the demo site, loaded."""
    with TestClient(create_app(services), base_url=BASE, raise_server_exceptions=False) as client:
        yield client


@pytest.fixture
def robot(services: Services) -> FakeRobot:
    robot: Any = services
    return robot.robot


@pytest.fixture
def route_plan(client: TestClient, services: Services) -> int:
    """The number of a kept route plan on the demo site."""
    site = services.store.site(1)
    return services.store.add_plan(site, "route", "Tour", None, plan_document("route")).id


@pytest.fixture
def scan_plan(client: TestClient, services: Services) -> int:
    site = services.store.site(1)
    return services.store.add_plan(site, "scan", None, None, plan_document("scan")).id


class Running:
    """A service that listens on a port of its own, with a robot that is not real."""

    def __init__(self, services: Services) -> None:
        self.services = services
        self._socket = bind("127.0.0.1", 0)
        services.port = self._socket.getsockname()[1]
        self._ready = threading.Event()
        self._listener = Listener(create_app(services), services, self._ready.set)
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()
        assert self._ready.wait(10)

    @property
    def address(self) -> str:
        return f"127.0.0.1:{self.services.port}"

    @property
    def url(self) -> str:
        return f"http://{self.address}"

    @property
    def robot(self) -> FakeRobot:
        services: Any = self.services
        return services.robot

    def stop(self) -> bool:
        """Returns whether it has ended within five seconds."""
        self._listener.should_exit = True
        self._thread.join(5)
        return not self._thread.is_alive()

    def _serve(self) -> None:
        asyncio.run(self._listener.serve([self._socket]))


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[Callable[..., Running]]:
    """Starts services; those that a test leaves running are stopped."""
    running: list[Running] = []

    def start(**options: Any) -> Running:
        running.append(Running(fake_services(tmp_path / f"data{len(running)}", **options)))
        return running[-1]

    yield start
    ended = [one.stop() for one in running]
    assert all(ended)
