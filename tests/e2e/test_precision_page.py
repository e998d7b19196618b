"""Precision on the page: a drawing is coloured as it is drawn, places are suggested and taken."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from e2e.conftest import PICTURES, Service, Window
from playwright.sync_api import Browser

pytestmark = pytest.mark.browser

PLACE = (2.2, 4.2)
"""On the floor of the demo workshop, with nothing drawn on it."""


@pytest.fixture
def phone(browser: Browser, service: Service) -> Iterator[Window]:
    opened = Window(browser, service.url, (390, 844))
    yield opened
    opened.page.close()
    assert opened.complaints == []


def colour(window: Window, at: tuple[float, float]) -> Any:
    """Red, green, blue of the ground layer at a place of the map."""
    return window.page.evaluate(
        """p => { const [x, y] = window.polepilot.pixelOf(p);
            const canvas = document.querySelector('canvas.map-ground');
            const box = canvas.getBoundingClientRect();
            const ratio = canvas.width / box.width;
            const pen = canvas.getContext('2d');
            const at = [(x - box.left) * ratio, (y - box.top) * ratio].map(Math.round);
            return [...pen.getImageData(...at, 1, 1).data].slice(0, 3); }""",
        list(at),
    )


def show_precision(window: Window) -> None:
    window.open("/draw")
    window.page.get_by_text("Demo workshop").first.wait_for()
    window.press("Precision")
    window.page.get_by_text("mean error of the position").wait_for(timeout=30_000)
    window.page.wait_for_timeout(200)


def figure(window: Window) -> float:
    """The mean error, as it stands in the panel: centimetres."""
    text = window.page.locator(".precision .figure-value").inner_text()
    return float(text.removesuffix(" cm"))


def test_the_drawing_is_coloured_while_a_landmark_is_dragged(
    window: Window, service: Service
) -> None:
    window.open("/draw")
    window.page.get_by_text("Demo workshop").first.wait_for()
    window.page.wait_for_timeout(500)
    plain = colour(window, PLACE)
    show_precision(window)
    assert colour(window, PLACE) != plain
    legend = window.page.get_by_role("list", name="Colours: error in centimetres")
    assert "no fix here" in legend.inner_text()
    assert 0.5 < figure(window) < 3
    before = figure(window)

    answers: list[int] = []
    window.page.on(
        "response", lambda answer: "/precision" in answer.url and answers.append(answer.status)
    )
    window.click(8.0, 2.4)
    x, y = window.page.evaluate("p => window.polepilot.pixelOf(p)", [8.0, 2.4])
    window.page.mouse.move(x, y - 8)
    window.page.mouse.down()
    for step in range(1, 13):
        window.page.mouse.move(x - 40 * step, y - 8)
        window.page.wait_for_timeout(100)
    window.page.wait_for_timeout(500)
    # The button is still down: the map has followed all the same.
    assert len(answers) >= 5
    assert set(answers) == {200}
    assert figure(window) > before
    window.page.mouse.up()
    window.press("Undo")
    window.page.wait_for_timeout(500)
    assert figure(window) == before

    # It belongs to drawing; and it is still there when somebody comes back.
    window.page.get_by_role("link", name="Check").first.click()
    window.page.wait_for_timeout(300)
    assert colour(window, PLACE) == plain
    window.page.get_by_role("link", name="Draw").first.click()
    window.page.wait_for_timeout(300)
    assert colour(window, PLACE) != plain
    window.page.keyboard.press("p")
    window.page.wait_for_timeout(300)
    assert colour(window, PLACE) == plain


def test_suggested_places_are_taken(window: Window, service: Service) -> None:
    show_precision(window)
    before = figure(window)
    window.press("Suggest places")
    places = window.page.get_by_role("list", name="Suggested places").get_by_role("listitem")
    places.first.wait_for(timeout=30_000)
    assert places.count() == 3
    if PICTURES:
        window.page.screenshot(path=f"{PICTURES}/precision.png")
    window.press("Add landmark")
    window.page.wait_for_timeout(200)
    assert places.count() == 2
    window.press("Add all landmarks")
    window.page.get_by_role("button", name="Suggest places").wait_for(timeout=10_000)
    window.page.wait_for_timeout(800)
    assert figure(window) < before
    window.press("Save")
    window.page.get_by_text("Saved.").wait_for(timeout=10_000)
    site = service.get("/sites/1")["site"]
    assert len({mark["id"] for mark in site["landmarks"]}) == 11
    # Each step can be undone.
    window.press("Undo")
    window.press("Undo")
    window.page.wait_for_timeout(800)
    assert figure(window) == before


def test_what_cannot_be_suggested_is_said(window: Window) -> None:
    show_precision(window)
    field = window.page.get_by_label("More landmarks")
    field.fill("9")
    field.press("Enter")
    window.press("Suggest places")
    window.page.get_by_text("ids left").wait_for(timeout=20_000)


def test_on_a_phone(phone: Window) -> None:
    show_precision(phone)
    legend = phone.page.get_by_role("list", name="Colours: error in centimetres")
    legend.scroll_into_view_if_needed()
    wide = phone.page.evaluate(
        "[...document.querySelectorAll('.sheet, .sheet *')].some("
        "e => e.getBoundingClientRect().right > innerWidth + 1)"
    )
    assert not wide
    phone.page.get_by_role("button", name="Suggest places").click()
    phone.page.get_by_role("button", name="Add landmark").first.wait_for(timeout=30_000)
