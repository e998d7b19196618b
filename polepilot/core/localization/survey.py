"""Map building: where all poles stand, and the path, from one recorded drive.

`survey_start` makes a first map, `survey_problem` states the least squares over poles, path and
what distorts measurements, `survey_solve` solves it, `survey_work` leaves out what is not to be
believed, and `survey_refine` brings in a map that was measured by hand.
"""

from __future__ import annotations

from polepilot.core.errors import InputError
from polepilot.core.localization.survey_refine import refine
from polepilot.core.localization.survey_result import Survey
from polepilot.core.localization.survey_run import SurveyOptions, SurveyRun
from polepilot.core.localization.survey_start import first_map
from polepilot.core.localization.survey_work import Progress, Work

_LEAST_DRIVE = 0.5


def survey(
    run: SurveyRun, options: SurveyOptions | None = None, progress: Progress | None = None
) -> Survey:
    """Estimate all poles and the path together.

    Raises:
        InputError: what the recording or the options lack, in words.
    """
    options = options or SurveyOptions()
    tell = progress or (lambda _text, _share: None)
    if run.sightings() == 0:
        raise InputError(f"no landmark was seen in {len(run.pictures)} pictures.")
    if run.travelled() < _LEAST_DRIVE:
        raise InputError(
            f"the robot drove {run.travelled():.2f} m: expected at least {_LEAST_DRIVE} m, better "
            "a round past all poles."
        )
    _check_known(run, options)
    first = first_map(run, lambda share: tell("first map", share))
    work = Work(run, first, tell)
    work.check_named(options)
    if options.hand_measured:
        return refine(work, options)
    known, frame = work.frame(options)
    work.settle(known)
    work.check_named(options)
    return work.result(frame, options)


def _check_known(run: SurveyRun, options: SurveyOptions) -> None:
    """Poles that options name have to be in the recording."""
    counts = run.sighting_counts()
    named = [*options.anchors, *(options.distance[:2] if options.distance else ())]
    missing = [k for k in named if k not in counts]
    if missing:
        seen = ", ".join(str(k) for k in sorted(counts))
        raise InputError(f"pole {missing[0]} was never seen; the recording shows {seen}.")
