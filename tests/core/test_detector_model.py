"""The model of the detector against what the detector did on pictures of other programs."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from polepilot.core import detector_model as model
from polepilot.core.landmark import LandmarkKind
from polepilot.core.vehicle import Camera

RESULTS = Path(__file__).parents[2] / "docs" / "results"


def measured(pictures: str) -> dict[str, dict[str, Any]]:
    """Errors of the default detector by distance, of both renderers: ``"4-6 m"`` and so on."""
    found = {}
    for name in ("studio", "darkroom"):
        report = json.loads((RESULTS / f"{name}-default.json").read_text())
        for distance, figures in report[pictures]["distance"].items():
            found[f"{name} {distance}"] = figures
    return found


@pytest.mark.parametrize(
    ("pictures", "least", "most"),
    [("photo", 0.65, 1.45), ("pan", 0.5, 1.45), ("clean", 0.4, 1.1), ("clean-8-12", 0.5, 1.1)],
)
def test_errors_are_those_of_the_detector(pictures: str, least: float, most: float) -> None:
    """Half of what 95 % of the errors stay below is a standard deviation. With photographs and
    while panning it is the model's; in plain rooms the model is cautious."""
    for place, figures in measured(pictures).items():
        near, far = map(float, place.split()[1].split("-"))
        away = 0.5 * (near + far)
        sigma = model.range_sigma(Camera(), LandmarkKind(), away, 1.0)
        ratio = figures["range_p95_percent"] / 100 * away / 1.96 / sigma
        assert least < ratio < most, (place, ratio)
        turned = math.radians(figures["bearing_p95_deg"]) / 1.96 / model.BEARING_SIGMA
        assert 0.3 < turned < 1.3, (place, turned)


def test_numbers_and_arrays_give_the_same() -> None:
    camera, kind = Camera(), LandmarkKind(bits=6, segment=0.06, diameter=0.1)
    away, cosine = np.array([2.0, 5.0, 11.0]), np.array([1.0, 0.98, 0.95])
    together = model.range_sigma(camera, kind, away, cosine)
    apart = [
        model.range_sigma(camera, kind, float(a), float(c))
        for a, c in zip(away, cosine, strict=True)
    ]
    np.testing.assert_allclose(together, apart, rtol=1e-12)


def test_limits_by_hand() -> None:
    """Code of 65 cm, lens 40 cm high, C = 600, 300 rows of which 2 at each edge do not count."""
    assert model.farthest(LandmarkKind()) == pytest.approx(16)
    assert model.farthest(LandmarkKind(segment=0.025)) == pytest.approx(8)
    below = 600 * 0.40 / 147.5
    assert model.nearest_depth(Camera(), LandmarkKind()) == pytest.approx(below)
    above = 600 * (13 * 0.08 - 0.40) / 147.5
    assert model.nearest_depth(Camera(), LandmarkKind(segment=0.08)) == pytest.approx(above)
    # At 3 m the code covers 600 * 0.65 / (3 - 0.035) pixels.
    share = math.hypot(model.RANGE_SHARE, model.EDGE_PIXELS / (600 * 0.65 / 2.965))
    assert model.range_sigma(Camera(), LandmarkKind(), 3.0, 1.0) == pytest.approx(3 * share)
