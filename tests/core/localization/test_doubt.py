"""What speaks against a pose."""

from __future__ import annotations

from polepilot.core.localization.doubt import Doubt
from polepilot.core.observation import RangeBearing


def seen(number: int, stamp: float = 0.0) -> RangeBearing:
    return RangeBearing(stamp, number, 3.0, 0.0, 0.01, 0.001)


def test_a_stranger_alone_makes_it_doubtful_two_make_it_lost() -> None:
    doubt = Doubt(0.2)
    doubt.add(seen(3), 0.5)
    assert doubt.judge(0.0, {1}, False) is None
    assert doubt.spread == 0.0
    doubt.add(seen(3, 0.1), 0.6)
    judged = doubt.judge(0.1, {1}, False)
    assert judged is not None
    assert judged.status == "degraded"
    assert doubt.spread == 0.6
    for stamp in (0.2, 0.3):
        doubt.add(seen(4, stamp), 0.5)
    judged = doubt.judge(0.3, {1}, False)
    assert judged is not None
    assert judged.status == "lost"
    assert "Landmark 3 and 4 appear more than 20 cm" in judged.reason
    doubt.clear()
    assert doubt.judge(0.4, {1}, True) is None


def test_standing_one_contradiction_of_a_trusted_landmark_is_enough() -> None:
    for trusted, standing, lost in (({1}, True, True), ({1}, False, False), (set(), True, False)):
        doubt = Doubt(0.2)
        doubt.add(seen(1), 0.5)
        judged = doubt.judge(0.0, trusted, standing)
        assert (judged is not None and judged.status == "lost") is lost


def test_one_that_contradicts_for_long_is_enough() -> None:
    doubt = Doubt(0.2)
    doubt.add(seen(3), 0.5)
    doubt.add(seen(3, 6.0), 0.5)
    judged = doubt.judge(6.0, set(), False)
    assert judged is not None
    assert judged.status == "lost"
