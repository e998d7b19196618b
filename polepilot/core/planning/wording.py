"""Lengths as plans write them for people: centimetres below ten metres."""

from __future__ import annotations


def in_words(length: float) -> str:
    """``0.4`` metres as "40 cm", ``0.125`` as "12.5 cm", ``12.34`` as "12.3 m"."""
    if abs(length) < 9.995:
        return f"{round(length * 100, 1):g} cm"
    return f"{length:.1f} m"


def measured_in_words(length: float) -> str:
    """As ``in_words``, to a whole centimetre from one centimetre on."""
    return in_words(round(length, 2 if length >= 0.01 else 3))
