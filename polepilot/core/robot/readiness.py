"""Whether a plan may be started here and now, and why not."""

from __future__ import annotations

from polepilot.core.errors import RefusedError
from polepilot.core.link.protocol import HostLink, LinkState
from polepilot.core.observation import PoseEstimate
from polepilot.core.plan import Plan
from polepilot.core.site import Site

START_TOLERANCE = 0.5
"""How far from the start of its plan a mission may begin, metres."""


def require_ready(
    plan: Plan,
    site: Site | None,
    busy: bool,
    link: HostLink,
    estimate: PoseEstimate | None,
) -> Site:
    """The site that ``plan`` may be driven on.

    The pose need not be known yet: the mission waits for it.

    Raises:
        RefusedError: with what is missing, and what to do about it.
    """
    if site is None:
        raise RefusedError("No map is loaded.", remedy="Choose one.", code="no_site")
    if len(site.landmarks) < 2:
        raise RefusedError(
            f"The site has {len(site.landmarks)} landmark(s), and the robot needs two to know "
            "where it is.",
            remedy="Place at least two landmarks.",
            code="no_landmarks",
        )
    if busy:
        raise RefusedError(
            "A mission is already under way.", remedy="End it first.", code="mission_active"
        )
    if link.estop_pending or link.state is LinkState.ESTOP:
        raise RefusedError(
            "The emergency stop is latched.", remedy="Release it first.", code="estop_latched"
        )
    if not link.ready:
        raise RefusedError(
            "The microcontroller does not answer.",
            remedy="Check the cable and its power.",
            code="link_not_ready",
        )
    if estimate is not None:
        distance = estimate.pose.distance_to((float(plan.path[0][0]), float(plan.path[0][1])))
        if distance > START_TOLERANCE:
            raise RefusedError(
                f"The plan starts {distance:.2f} m from where the robot stands.",
                remedy="Plan again from here.",
                code="elsewhere",
            )
    return site
