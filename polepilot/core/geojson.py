"""Sites as GeoJSON: a FeatureCollection in local metres, a ``role`` property per feature.

Roles: ``boundary`` (Polygon; its holes are islands), ``island`` (Polygon), ``wall`` (LineString),
``no_go`` (Polygon), ``landmark`` (Point, properties id and what differs from the usual kind),
``route`` (LineString or Point, properties name and heading), ``start`` (Point, property heading).
Other properties and members are left alone, as RFC 7946 asks; a third coordinate (height) is not
used.
"""

from __future__ import annotations

from typing import Any

from polepilot.core.errors import SiteError
from polepilot.core.site_file import Reader, kind_of

_LANDMARK_KEYS = ("id", "bits", "segment", "diameter", "shape")
_GEOMETRY = {
    "boundary": ("Polygon",),
    "island": ("Polygon",),
    "wall": ("LineString",),
    "no_go": ("Polygon",),
    "landmark": ("Point",),
    "route": ("LineString", "Point"),
    "start": ("Point",),
}


def is_geojson(document: Any) -> bool:
    """Whether a JSON document means to be GeoJSON."""
    return isinstance(document, dict) and document.get("type") in ("FeatureCollection", "Feature")


def from_geojson(document: dict[str, Any], source: str) -> dict[str, Any]:
    """The SITE.json document that a FeatureCollection describes; numbers are not checked yet.

    Raises:
        SiteError: a feature without a known role, or with a geometry that does not fit its role.
    """
    reader = Reader(source)
    features = document.get("features") if document["type"] != "Feature" else [document]
    site: dict[str, Any] = {key: [] for key in ("islands", "walls", "no_go", "landmarks", "routes")}
    if "name" in document:
        site["name"] = document["name"]
    for index, feature in enumerate(reader.array(features, "features", "a list of features")):
        _add(site, feature, f"features[{index}]", reader)
    if "boundary" not in site:
        raise SiteError(f"{source}: no feature has the role 'boundary': expected one.")
    return site


def _add(site: dict[str, Any], feature: Any, field: str, reader: Reader) -> None:
    if not isinstance(feature, dict) or not isinstance(feature.get("geometry"), dict):
        raise reader.refuse(field, "has no geometry: expected a GeoJSON feature.")
    properties = feature.get("properties") or {}
    role = properties.get("role") if isinstance(properties, dict) else None
    if not isinstance(role, str) or role not in _GEOMETRY:
        expected = ", ".join(_GEOMETRY)
        raise reader.refuse(f"{field} has the role", f"{role!r}: expected one of {expected}.")
    geometry = feature["geometry"]
    if geometry.get("type") not in _GEOMETRY[role]:
        expected = " or ".join(_GEOMETRY[role])
        raise reader.refuse(
            field, f"({role}) is a {str(geometry.get('type'))[:40]}: expected a {expected}."
        )
    where = f"{field}.coordinates"
    coordinates = _flat(
        reader.array(geometry.get("coordinates"), where, "coordinates"), where, reader
    )
    if role == "boundary":
        if "boundary" in site:
            raise reader.refuse(field, "is a second boundary: expected one.")
        site["boundary"], *holes = coordinates or [[]]
        site["islands"] += holes
    elif role in ("island", "no_go"):
        if len(coordinates) != 1:
            what = "an island" if role == "island" else "a no-go area"
            raise reader.refuse(field, f"is {what} with holes: expected one ring.")
        site["islands" if role == "island" else "no_go"].append(coordinates[0])
    elif role == "wall":
        site["walls"].append(coordinates)
    elif role == "landmark":
        if len(coordinates) != 2:
            raise reader.refuse(field, f"(landmark) is at {kind_of(coordinates)}, not at a point.")
        entry = {key: properties[key] for key in _LANDMARK_KEYS if key in properties}
        site["landmarks"].append({**entry, "x": coordinates[0], "y": coordinates[1]})
    elif role == "route":
        nodes = [coordinates] if geometry["type"] == "Point" else coordinates
        entry = {"name": properties.get("name"), "nodes": nodes}
        if properties.get("heading") is not None:
            entry["heading"] = properties["heading"]
        site["routes"].append(entry)
    else:
        if "start" in site:
            raise reader.refuse(field, "is a second start: expected one.")
        heading = properties.get("heading")
        site["start"] = coordinates if heading is None else [*coordinates, heading]


def _flat(coordinates: list[Any], where: str, reader: Reader, depth: int = 3) -> list[Any]:
    """Coordinates without heights: lists in ``depth`` levels, a Polygon's being the deepest."""
    if coordinates and not any(isinstance(entry, list | tuple) for entry in coordinates):
        return coordinates[:2]
    if depth == 1:
        raise reader.refuse(where, "has lists within points: expected numbers [x, y].")
    return [
        _flat(list(entry), where, reader, depth - 1) if isinstance(entry, list | tuple) else entry
        for entry in coordinates
    ]


def to_geojson(site: dict[str, Any]) -> dict[str, Any]:
    """A SITE.json document (``Site.to_json()``) as a FeatureCollection that reads back the same."""
    features = [_feature("boundary", "Polygon", [_closed(site["boundary"])])]
    features += [_feature("island", "Polygon", [_closed(ring)]) for ring in site.get("islands", ())]
    features += [_feature("wall", "LineString", wall) for wall in site.get("walls", ())]
    features += [_feature("no_go", "Polygon", [_closed(ring)]) for ring in site.get("no_go", ())]
    for mark in site.get("landmarks", ()):
        kind = {key: mark[key] for key in _LANDMARK_KEYS if key in mark}
        features.append(_feature("landmark", "Point", [mark["x"], mark["y"]], **kind))
    for route in site.get("routes", ()):
        nodes = route["nodes"]
        single = len(nodes) == 1
        shape = ("Point", nodes[0]) if single else ("LineString", nodes)
        named = {key: value for key, value in route.items() if key != "nodes"}
        features.append(_feature("route", *shape, **named))
    if (start := site.get("start")) is not None:
        heading = {"heading": start[2]} if len(start) == 3 else {}
        features.append(_feature("start", "Point", start[:2], **heading))
    return {"type": "FeatureCollection", "name": site.get("name", ""), "features": features}


def _feature(role: str, kind: str, coordinates: Any, **properties: Any) -> dict[str, Any]:
    return {
        "type": "Feature",
        "properties": {"role": role, **properties},
        "geometry": {"type": kind, "coordinates": coordinates},
    }


def _closed(ring: list[Any]) -> list[Any]:
    return [*ring, ring[0]]
