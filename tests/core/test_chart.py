"""Charts as SVG and PNG: the same things at the same places."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polepilot.core.chart import Chart, Field, steps
from polepilot.core.errors import InputError
from polepilot.core.evaluation import compare
from polepilot.core.evaluation_plot import draw
from polepilot.core.trajectory import Trajectory

NAMES = {"s": "http://www.w3.org/2000/svg"}


def sheet() -> Chart:
    chart = Chart(100, 60, "one & only <sheet>")
    chart.line(np.array([(10, 10), (90, 10)]), "#ff0000", 4)
    chart.line(np.array([(10, 30), (90, 30)]), "#0000ff", 2, dashed=True)
    chart.dot(50, 45, "#00ff00", 4)
    chart.text(5, 58, "words & more", size=8)
    return chart


def test_both_formats_show_the_same(tmp_path: Path) -> None:
    sheet().save(tmp_path / "a.svg")
    root = ElementTree.fromstring((tmp_path / "a.svg").read_text("utf-8"))
    assert root.findtext("s:title", namespaces=NAMES) == "one & only <sheet>"
    strokes = [node.get("stroke") for node in root.findall("s:path", NAMES)]
    assert strokes == ["#ff0000", "#0000ff", "#00ff00"]
    sheet().save(tmp_path / "a.PNG")
    image = cv2.imread(str(tmp_path / "a.PNG"))
    assert image is not None
    assert image.shape == (120, 200, 3)
    assert image[20, 100].tolist() == [0, 0, 255]
    assert image[90, 100].tolist() == [0, 255, 0]
    blue = (image[60, 22:178] == (255, 0, 0)).all(axis=1).mean()
    assert 0.4 < blue < 0.9, "dashes and gaps"
    assert (image[100:, :100] < 128).any(), "words"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.PNG", "a.svg"]


def test_what_cannot_be_saved_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.svg or \.png"):
        sheet().save(tmp_path / "a.pdf")
    with pytest.raises(InputError, match="cannot be written"):
        sheet().save(tmp_path / "gone" / "a.svg")


def test_a_map_is_to_scale() -> None:
    points = np.array([(0.0, 0.0), (10.0, 2.0)])
    field = Field.to_scale(Chart(300, 200, ""), 20, 10, 260, 150, points)
    (a, b, c) = field.at(np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]))
    assert b[0] - a[0] == pytest.approx(a[1] - c[1])
    low, high = field.at(points)
    assert 20 <= low[0] < high[0] <= 280
    assert 10 <= high[1] < low[1] <= 160


@given(st.floats(-1e4, 1e4), st.floats(1e-3, 1e4))
def test_scales_are_round_and_inside(low: float, span: float) -> None:
    values = steps(low, low + span)
    assert 2 <= len(values) <= 6
    slack = 1e-6 * span + 1e-9
    assert low - slack <= values[0] < values[-1] <= low + span + slack


def track(offset: float, count: int = 400) -> Trajectory:
    t = np.linspace(0, 40, count)
    return Trajectory(t, np.stack([np.cos(t / 5) + offset, np.sin(t / 5), t * 0], axis=1))


def test_the_four_kinds_of_points() -> None:
    truth, tracks = track(0.0), {"estimated": track(0.01), "measured": track(0.03)}
    compared = {name: one for name, t in tracks.items() if (one := compare(truth, t)) is not None}
    targets = np.stack([track(0).poses[::40, 0] * 1.2, track(0).poses[::40, 1]], axis=1)
    text = draw("run", truth, tracks, compared, targets, [(7, (1.5, 0.5))]).svg()
    root = ElementTree.fromstring(text)
    words = [node.text for node in root.findall("s:text", NAMES)]
    for word in ("real", "measured", "estimated", "target", "7", "x, m", "position error, cm"):
        assert word in words
    assert drawn(root, "#e69f00") > 3 * 390, "measured, on the map and over time"
    assert drawn(root, "#009e73") == 2 * (10 + 1), "crosses, and one in the legend"


def drawn(root: ElementTree.Element, color: str) -> int:
    """Lines and dots of this colour."""
    paths = root.findall("s:path", NAMES)
    return sum((node.get("d") or "").count("M") for node in paths if node.get("stroke") == color)


def test_a_lost_pose_is_no_line() -> None:
    """Where the estimate is missing for ten seconds, nothing is drawn across."""
    truth, whole = track(0.0), track(0.01)
    kept = (whole.stamps < 10) | (whole.stamps > 20)
    gappy = Trajectory(whole.stamps[kept], whole.poses[kept])
    counts = []
    for one in (whole, gappy):
        compared = compare(truth, one)
        assert compared is not None
        nothing = np.empty((0, 2))
        svg = draw("a", truth, {"estimated": one}, {"estimated": compared}, nothing).svg()
        counts.append(drawn(ElementTree.fromstring(svg), "#0072b2"))
    assert counts[1] == counts[0] + 3, "one more piece on the map and in both strips"
