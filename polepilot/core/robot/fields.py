"""Fields of JSON documents that came from outside: checked one by one, with the place in errors."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from polepilot.core.errors import DatasetError, InputError
from polepilot.core.landmark import LandmarkKind
from polepilot.core.vision.paint import ORANGE, Paint

LARGEST = 1e12
"""No time, length or angle of a recording is larger."""
MOST = 1_000_000
"""No count is larger: columns, rows, bits, ids."""


class Fields:
    """An object of a JSON document that knows where it stands.

    What is asked for and not there, or of another kind, is a DatasetError that names the place.
    """

    def __init__(self, path: Path, place: str, document: Any) -> None:
        self.where = f"{path}: {place or 'the document'}"
        self.path, self._place = path, place
        if not isinstance(document, dict):
            raise DatasetError(f"{self.where}: expected an object with named fields.")
        self.document = document

    def __contains__(self, key: str) -> bool:
        return key in self.document

    def value(self, key: str) -> Any:
        if key not in self.document:
            raise DatasetError(f"{self.where}: the field {key!r} is missing.")
        return self.document[key]

    def child(self, key: str) -> Fields:
        place = f"{self._place}.{key}" if self._place else key
        return Fields(self.path, place, self.value(key))

    def number(
        self, key: str, above: float | None = None, within: tuple[float, float] | None = None
    ) -> float:
        value = self.value(key)
        low, high = within or (-LARGEST, LARGEST)
        good = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not good or not low <= value <= high or (above is not None and value <= above):
            limit = "" if above is None else f" above {above:g}"
            limit += "" if within is None else f" from {low:.4g} to {high:.4g}"
            raise DatasetError(
                f"{self.where}: {key} is {shown(value)}: expected a finite number{limit}."
            )
        return float(value)

    def number_or_none(self, key: str, above: float | None = None) -> float | None:
        return None if self.value(key) is None else self.number(key, above)

    def items(self, key: str) -> list[Fields]:
        """The objects of a list."""
        values = self.value(key)
        if not isinstance(values, list):
            raise DatasetError(f"{self.where}: {key} is {shown(values)}: expected a list.")
        return [
            Fields(self.path, f"{self._place} {key}[{index}]".strip(), value)
            for index, value in enumerate(values)
        ]

    def count(self, key: str) -> int:
        value = self.value(key)
        if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= MOST:
            raise DatasetError(
                f"{self.where}: {key} is {shown(value)}: expected a whole number, 1 to {MOST}."
            )
        return value

    def text(self, key: str) -> str:
        value = self.value(key)
        if not isinstance(value, str) or not value:
            raise DatasetError(f"{self.where}: {key} is {shown(value)}: expected a text.")
        return value

    def kind(self, default: LandmarkKind | None = None) -> LandmarkKind:
        """The size of a landmark: bits, segment_m, diameter_m, and shape where it is not round."""
        try:
            if default is None:
                return LandmarkKind(
                    bits=self.count("bits"),
                    segment=self.number("segment_m", above=0),
                    diameter=self.number("diameter_m", above=0),
                    shape=self.value("shape") if "shape" in self else "cylinder",
                )
            return LandmarkKind(
                bits=self.count("bits") if "bits" in self else default.bits,
                segment=self.number("segment_m") if "segment_m" in self else default.segment,
                diameter=self.number("diameter_m") if "diameter_m" in self else default.diameter,
                shape=self.value("shape") if "shape" in self else default.shape,
            )
        except DatasetError:
            raise
        except InputError as error:
            raise DatasetError(f"{self.where}: {error.message}") from error

    def paint(self) -> Paint:
        """``bright``, of the landmarks' bright segments; orange where it is not said."""
        if "bright" not in self:
            return ORANGE
        text = self.text("bright")
        try:
            return Paint.parse(text)
        except InputError as error:
            raise DatasetError(f"{self.where}: {error.message}") from error


def parse_json(text: str, where: Path) -> Any:
    """JSON; ``where`` is the file, or file and line where each line is a document."""
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        line = f":{error.lineno}" if where.is_file() else ""
        raise DatasetError(f"{where}{line}: no valid JSON: {error.msg}.") from error
    except (ValueError, RecursionError) as error:  # endless digits, endless brackets
        raise DatasetError(f"{where}: no JSON that can be read: {error}.") from error


def shown(value: Any) -> str:
    """A value as messages show it, short."""
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."
