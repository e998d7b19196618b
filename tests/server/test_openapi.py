"""The OpenAPI document: what the page's types are made from is what the program says."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema_rs
import pytest
import schemathesis
from hypothesis import HealthCheck, settings
from schemathesis import Case
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    status_code_conformance,
)
from server.conftest import Running
from server.fakes import fake_services

from polepilot.server.app import create_app
from polepilot.server.schemas import Problem

COMMITTED = Path(__file__).parents[2] / "web" / "openapi.json"


DOCUMENT = create_app().openapi()


def document() -> dict[str, Any]:
    return create_app().openapi()


def test_the_committed_document_is_the_present_one() -> None:
    """Mend it with: python -m polepilot.server.openapi > web/openapi.json"""
    assert json.loads(COMMITTED.read_text("utf-8")) == document()


def test_every_reference_exists() -> None:
    text = json.dumps(document())
    schemas = document()["components"]["schemas"]
    for part in text.split('"#/components/schemas/')[1:]:
        assert part.split('"')[0] in schemas


def test_every_failure_is_a_problem() -> None:
    for path, methods in document()["paths"].items():
        for method, operation in methods.items():
            for status, response in operation["responses"].items():
                if status >= "400":
                    assert list(response["content"]) == ["application/problem+json"], (
                        path,
                        method,
                    )


schema = schemathesis.openapi.from_dict(DOCUMENT)


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    running = Running(fake_services(tmp_path_factory.mktemp("data")))
    yield running
    assert running.stop()


@schema.parametrize()
@settings(max_examples=10, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
def test_nothing_that_is_sent_breaks_it(case: Case, running: Running) -> None:
    """Random requests, good and bad: never a 5xx, always what the document says."""
    answer = case.call(base_url=running.url)
    case.validate_response(
        answer, checks=[not_a_server_error, status_code_conformance, content_type_conformance]
    )
    declared = case.operation.definition.raw["responses"].get(str(answer.status_code))
    if declared is None:
        # Also methods are tried that an address does not have.
        code = Problem.model_validate(answer.json()).code
        assert code in ("method_not_allowed", "not_found")
        return
    for kind, content in declared.get("content", {}).items():
        if kind.endswith("json") and (body := content.get("schema")):
            whole = {**body, "components": DOCUMENT["components"]}
            jsonschema_rs.Draft202012Validator(whole).validate(answer.json())
