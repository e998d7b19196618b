"""The page's files: the right one, packed where that is possible, and nothing from elsewhere."""

from __future__ import annotations

import gzip
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI
from server.fakes import TestClient

from polepilot.server import errors
from polepilot.server.page import mount_page


@pytest.fixture
def page(tmp_path: Path) -> TestClient:
    static = tmp_path / "static"
    (static / "assets").mkdir(parents=True)
    (static / "index.html").write_text("<!doctype html><title>Polepilot</title>")
    script = b"console.log('polepilot');" * 50
    (static / "assets" / "index-abc123.js").write_bytes(script)
    (static / "assets" / "index-abc123.js.gz").write_bytes(gzip.compress(script))
    (static / "icon.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    (static / ".source-hash").write_text("0123")
    (tmp_path / "secret.txt").write_text("secret")
    app = FastAPI()
    errors.install(app)
    mount_page(app, static)
    return TestClient(app)


@pytest.mark.parametrize("path", ["/", "/draw", "/check", "/drive", "/prove/12", "/setup"])
def test_the_page_has_addresses_of_its_own(page: TestClient, path: str) -> None:
    answer = page.get(path)
    assert "<title>Polepilot" in answer.text
    assert answer.headers["content-type"].startswith("text/html")
    assert answer.headers["cache-control"] == "no-cache"
    assert page.head(path).status_code == 200


def test_hashed_files_are_kept_for_ever(page: TestClient) -> None:
    packed = page.get("/assets/index-abc123.js", headers={"Accept-Encoding": "gzip"})
    plain = page.get("/assets/index-abc123.js", headers={"Accept-Encoding": "identity"})
    assert packed.headers["content-encoding"] == "gzip"
    assert "content-encoding" not in plain.headers
    assert packed.text == plain.text
    for answer in (packed, plain):
        assert "immutable" in answer.headers["cache-control"]
        assert answer.headers["content-type"].startswith("text/javascript")
    assert page.get("/icon.svg").headers["content-type"].startswith("image/svg")


@pytest.mark.parametrize(
    "path",
    [
        "/../secret.txt",
        "/%2e%2e/secret.txt",
        "/assets/..%2f..%2fsecret.txt",
        "/assets/../../secret.txt",
        "//etc/passwd",
        "/%00",
        "/assets",
        "/assets/index-000000.js",
        "/" + "x" * 5000,
    ],
)
def test_nothing_else(page: TestClient, path: str) -> None:
    answer: httpx.Response = page.get(path)
    assert answer.status_code == 404
    assert answer.json()["code"] == "not_found"


def test_a_page_that_was_not_built(tmp_path: Path) -> None:
    app = FastAPI()
    errors.install(app)
    mount_page(app, tmp_path / "nowhere")
    answer = TestClient(app).get("/")
    assert (answer.status_code, answer.json()["code"]) == (404, "page_not_built")


def test_what_the_build_keeps_for_itself_is_not_served(page: TestClient) -> None:
    assert page.get("/.source-hash").status_code == 404
    assert page.get("/assets/../.source-hash").status_code == 404
