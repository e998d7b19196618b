"""The drawing of a survey."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from polepilot.core.geometry import Pose2D
from polepilot.core.localization.survey_plot import ellipse, plot_survey
from polepilot.core.localization.survey_result import Survey, SurveyedPole
from polepilot.core.site import Site

SPREAD = np.array([[4e-4, 1e-4], [1e-4, 1e-4]])
SITE = Site(boundary=((-1.0, -1.0), (9.0, -1.0), (9.0, 7.0), (-1.0, 7.0)))


def survey(*, wrong: bool = False) -> Survey:
    poles = (
        SurveyedPole(3, 0.0, 0.0, SPREAD, 40, 0, (0.01, 0.0)),
        SurveyedPole(8, 8.0, 6.0, SPREAD, 40, 2, (8.0, 6.3), wrong),
        SurveyedPole(11, 8.0, 0.0, SPREAD, 5, 0),
    )
    path = tuple((0.1 * k, Pose2D(2 + 0.1 * k, 3.0, 0.0)) for k in range(30))
    return Survey(poles, (), path, "map", {}, 1.0)


def test_poles_path_and_ellipses_are_drawn() -> None:
    text = plot_survey(survey(), SITE).svg()
    root = ET.fromstring(text)
    words = [node.text for node in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {"3", "8", "11"} <= set(words)
    assert "times as large" in text
    assert text != plot_survey(survey(wrong=True), SITE).svg()
    assert text != plot_survey(survey()).svg()


def test_png_is_a_picture() -> None:
    assert plot_survey(survey()).encoded(Path("x.png")).startswith(b"\x89PNG")


def test_an_ellipse_holds_95_percent() -> None:
    pole = survey().poles[0]
    outline = ellipse(pole)
    distances = np.einsum("ni,ij,nj->n", outline, np.linalg.inv(SPREAD), outline)
    assert np.allclose(distances, 5.991, rtol=1e-6)
    rng = np.random.default_rng(1)
    drawn = rng.multivariate_normal((0, 0), SPREAD, 20_000)
    inside = np.einsum("ni,ij,nj->n", drawn, np.linalg.inv(SPREAD), drawn) < distances[0]
    assert math.isclose(inside.mean(), 0.95, abs_tol=0.006)
