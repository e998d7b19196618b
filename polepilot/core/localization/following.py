"""How a motor or a servo follows what it is told: with a lag, and no faster than it can.

    d value / dt = (told - value) / lag,    but at most 1 / slowness

A hobby servo needs 0.1 to 0.2 s for 60 degrees, whatever its lag: in a turn from lock to lock that
is some degrees of heading. Along with the value goes its derivative by the lag, from which a filter
learns it.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class Followed(NamedTuple):
    """What has been reached, and how that depends on the lag."""

    value: float
    by_lag: float = 0.0
    """Per second of the lag."""


def follow(told: float, start: Followed, age: float, lag: float, slowness: float) -> Followed:
    """Where ``start`` has come to after ``age`` seconds; without a lag it is there at once.

    Args:
        told: to be reached.
        start: where it was, and its derivative there.
        age: seconds.
        lag: time constant, seconds.
        slowness: least seconds per unit; 0 is as fast as the lag allows.
    """
    value, by_lag = start
    left = told - value
    if lag == 0.0:
        return Followed(told)
    if left == 0.0 and by_lag == 0.0:
        return start
    way = 1.0 if left > 0.0 else -1.0
    # At full speed until what is left would be done more slowly anyway.
    full = way * left * slowness - lag
    if full <= 0.0:
        share = age / lag
        kept = math.exp(-share)
        return Followed(told - left * kept, (by_lag - left * share / lag) * kept)
    if age <= full:
        return Followed(value + way * age / slowness, by_lag)
    # What is left then is lag / slowness; both that and the moment depend on the lag.
    rest = way * lag / slowness * math.exp((full - age) / lag)
    longer = way * slowness / lag
    return Followed(
        told - rest,
        rest * (longer * by_lag - 1.0 / lag - (age - way * left * slowness) / lag**2),
    )
