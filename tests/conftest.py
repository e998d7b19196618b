"""What holds for all tests: chance is seeded, here that of Hypothesis."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("seeded", derandomize=True, deadline=None)
settings.load_profile("seeded")
