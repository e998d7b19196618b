"""The application around a fake robot, for the tests of the server."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from server.fakes import FakeRobot, TestClient, fake_services, plan_document

from polepilot.server.app import create_app
from polepilot.server.services import Services

BASE = "http://127.0.0.1:8000"


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
