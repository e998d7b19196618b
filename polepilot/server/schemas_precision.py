"""What goes over the wire about precision maps. Metres, radians, standard deviations."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, FiniteFloat, WithJsonSchema

from polepilot.server.schemas import LandmarkDocument, Model, Request

_SITE = {"$ref": "#/components/schemas/SiteDocument"}
# Read by the site's own reader, whose messages say what is wrong and where.

Grid = list[list[float | None]]
"""Rows from the lowest y on; null where there is no figure."""


class PrecisionOptions(Request):
    detail: Literal["coarse", "fine"] = "coarse"
    """`coarse` is quick enough to be asked for while a landmark is dragged."""
    resolution: Annotated[FiniteFloat, Field(gt=0, le=1000)] | None = None
    """Metres from spot to spot, instead of `detail`."""
    suggest: Annotated[int, Field(strict=True, ge=0, le=20)] = 0
    """For so many more landmarks, the places where they help most."""


class PrecisionRequest(PrecisionOptions):
    """For a kept site."""

    landmarks: list[LandmarkDocument] | None = None
    """Instead of those that the site has, for example while one is dragged."""


class DrawnPrecisionRequest(PrecisionOptions):
    """For a drawing that is not kept."""

    site: Annotated[dict[str, Any], WithJsonSchema({"allOf": [_SITE]})]


class PrecisionSummary(Model):
    mean_position: float | None
    """Over the spots with a fix, 1 sigma along the worst direction."""
    worst_position: float | None
    mean_heading: float | None
    overall: float
    """Mean position error over the whole floor, what has no fix counted as `limit`."""
    coverage: float
    """Share of all ways to stand on the floor at which a fix is possible."""
    limit: float


class SuggestionModel(Model):
    id: int
    x: float
    y: float
    overall: float
    """With this landmark and those before it."""
    mean_position: float | None
    coverage: float


class SuggestionsModel(Model):
    suggestions: list[SuggestionModel]
    before: PrecisionSummary
    places: int
    gain: float
    """Information gained per stand, natural units."""
    gain_bound: float
    """As many of the same places gain no more, whichever they are."""
    overall_bound: float
    """As many of the same places make `overall` no smaller, whichever they are."""


class PrecisionRecord(PrecisionSummary):
    """How well a standing robot will know its pose: a grid of square cells over the floor."""

    x: float
    """Middle of the lower left cell."""
    y: float
    resolution: float
    columns: int
    rows: int
    position: Grid
    heading: Grid
    share: Grid
    """Of the headings that are possible, at how many a fix is."""
    seen: Grid
    """Landmarks read in a sweep, mean over the headings."""
    reason: list[list[int]]
    """0 fix, 1 no landmark in sight, 2 only one, 3 all in one direction, 4 not on the floor."""
    classes: list[float]
    """Where the colours of a drawing change."""
    suggest: SuggestionsModel | None = None
