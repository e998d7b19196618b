"""The sheet of landmarks that the page offers."""

from __future__ import annotations

import pytest
from printed import read_pdf, rulers
from server.fakes import TestClient

SHEET = "/api/v1/landmarks/sheet.pdf"


def test_is_the_pdf_of_the_command(client: TestClient) -> None:
    answer = client.get(SHEET, params={"ids": "1,2,4", "shape": "flat", "paper": "A3"})
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "application/pdf"
    sheets = read_pdf(answer.content)
    assert len(sheets) == 3
    for sheet in sheets:
        assert rulers(sheet) == [pytest.approx(100, abs=1e-3)]
        assert sorted((sheet.width, sheet.height)) == pytest.approx([297, 420], abs=1e-3)


@pytest.mark.parametrize(
    ("query", "named"),
    [
        ({}, "ids"),
        ({"ids": "0-3"}, "ids"),
        ({"ids": "1", "bits": "7"}, "bits"),
        ({"ids": "1", "bits": "9999999"}, "bits"),
        ({"ids": "1", "segment": "nan"}, "segment"),
        ({"ids": "1", "shape": "cone"}, "shape"),
        ({"ids": "1", "paper": "napkin"}, "paper"),
        ({"ids": "1-255", "bits": "8"}, "sheets"),
        ({"ids": "1", "segment": "10", "diameter": "10"}, "sheets"),
    ],
)
def test_refuses_what_it_cannot_draw(client: TestClient, query: dict[str, str], named: str) -> None:
    answer = client.get(SHEET, params=query)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert named in answer.json()["detail"]
