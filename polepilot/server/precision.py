"""Precision maps are computed in a process of their own, which remembers the last site's spots."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from polepilot.core.vehicle import Camera, PanUnit, RobotModel
from polepilot.server.worker import Worker, serve

if TYPE_CHECKING:
    from polepilot.core.localization.precision import PrecisionField

TIMEOUT = 60.0
"""Seconds after which a map is given up."""
_FIELDS = 3
"""So many sites (or resolutions of one) are remembered."""


class Precision(Worker):
    """Hands jobs to the process, one at a time; it is started when the first one comes."""

    def __init__(self, model: RobotModel) -> None:
        super().__init__("polepilot.server.precision", "precision map", "precision")
        self._robot = {"camera": asdict(model.camera), "pan": asdict(model.pan)}

    async def map(
        self,
        site: dict[str, Any],
        *,
        detail: str = "coarse",
        resolution: float | None = None,
        suggest: int = 0,
    ) -> dict[str, Any]:
        """The PrecisionRecord document of a site (SITE.json) with its landmarks.

        Raises:
            SiteError, InputError: the site cannot be used, or not with these options.
            BusyError: it took too long, or the process was killed.
        """
        job = {"site": site, "detail": detail, "resolution": resolution, "suggest": suggest}
        remedy = "Use the coarse map, or a simpler drawing."
        found: dict[str, Any] = await self.ask({**job, **self._robot}, TIMEOUT, remedy)
        return found


_fields: OrderedDict[Any, PrecisionField] = OrderedDict()


def compute(job: dict[str, Any]) -> dict[str, Any]:
    """Carry out one job, in the process."""
    from polepilot.core.localization.precision import PrecisionField, fine_resolution
    from polepilot.core.localization.precision_grid import CLASSES
    from polepilot.core.localization.precision_sight import Sweep
    from polepilot.core.localization.precision_suggest import suggest
    from polepilot.core.site import parse_site

    site = parse_site(job["site"], "the site")
    camera = dict(job["camera"], distortion=tuple(job["camera"]["distortion"]))
    sweep = Sweep(Camera(**camera), PanUnit(**job["pan"]))
    resolution = job["resolution"]
    if resolution is None and job["detail"] == "fine":
        resolution = fine_resolution(site)
    key = (site.boundary, site.islands, site.walls, site.no_go, sweep, resolution)
    field = _fields.get(key)
    if field is None:
        field = _fields[key] = PrecisionField(site, sweep, resolution)
        while len(_fields) > _FIELDS:
            _fields.popitem(last=False)
    _fields.move_to_end(key)
    document = {**field.precision(site.landmarks).to_json(), "classes": list(CLASSES)}
    if job["suggest"]:
        document["suggest"] = suggest(site, job["suggest"], sweep).to_json()
    return document


def main() -> None:
    """Answer until standard input ends."""
    serve(compute, ("polepilot.core.localization.precision_suggest",))


if __name__ == "__main__":
    main()
