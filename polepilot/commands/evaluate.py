"""`polepilot evaluate`: how far trajectories are from the truth, as a table and as a drawing."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from polepilot.core.robot.run_points import RunPoints


class Alignment(StrEnum):
    none = "none"
    se2 = "se2"


def evaluate(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="ESTIMATED.tum...|RUN",
            help="Trajectories to compare with --truth, the most important one first; or the "
            "folder or the log (run.mcap) of a run.",
        ),
    ],
    truth: Annotated[
        Path | None,
        typer.Option(metavar="TRUTH.tum", help="True poses; a simulated run has its own."),
    ] = None,
    cov: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.cov",
            help="Covariances of the first trajectory, as replay writes them; estimated.cov is "
            "found beside estimated.tum.",
        ),
    ] = None,
    target: Annotated[
        Path | None, typer.Option(metavar="target.csv", help="Targets for the drawing.")
    ] = None,
    align: Annotated[
        Alignment,
        typer.Option(help="se2: also say what is left after the best shift and rotation."),
    ] = Alignment.none,
    longest_gap: Annotated[
        float, typer.Option(min=0.0, help="Of the truth, not to be interpolated over; seconds.")
    ] = 0.5,
    plot: Annotated[
        Path | None, typer.Option(metavar="OUT.svg|png", help="Draw points and errors over time.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Compare estimated trajectories with the true one: errors, NEES, Fig. 15 of the paper."""
    import json
    import sys

    from polepilot.core.errors import InputError
    from polepilot.core.evaluation import compare, read_covariances
    from polepilot.core.evaluation_plot import draw
    from polepilot.core.robot.run_points import read_targets
    from polepilot.core.trajectory import read_tum

    if plot is not None and plot.suffix.lower() not in (".svg", ".png"):
        raise InputError(f"--plot {plot}: expected a name that ends in .svg or .png.")
    points = _points(files)
    for note in points.notes:
        sys.stderr.write(note + "\n")
    true = points.real if truth is None else read_tum(truth)
    if true is None:
        raise InputError(f"{files[0]}: its true poses are not known: give --truth TRUTH.tum.")
    if len(true.stamps) == 0:
        raise InputError(f"{truth or files[0]}: holds no true poses.")
    if cov is not None:
        points.covariances = read_covariances(cov)
    if target is not None:
        points.targets = read_targets(target)

    compared = {}
    for index, (name, track) in enumerate(points.tracks.items()):
        covariances = points.covariances if index == 0 else None
        found = compare(true, track, covariances, align.value, longest_gap)
        if found is None and index == 0:
            raise InputError(
                f"{name}: shares no time with the true poses ({_span(track)}; "
                f"true: {_span(true)}): expected stamps of one clock."
            )
        if found is None:
            sys.stderr.write(f"{name}: left out: shares no time with the true poses.\n")
        else:
            compared[name] = found
    if plot is not None:
        kept = {name: points.tracks[name] for name in compared}
        sheet = draw(" and ".join(kept), true, kept, compared, points.targets, points.landmarks)
        sheet.save(plot)
    document = {
        "alignment": align.value,
        "trajectories": [{"name": name, **one.to_json()} for name, one in compared.items()],
        "notes": points.notes,
    }
    sys.stdout.write(json.dumps(document) + "\n" if as_json else _table(document))


def _points(files: list[Path]) -> RunPoints:
    """What the arguments name: a run, or trajectories."""
    from polepilot.core.errors import InputError
    from polepilot.core.evaluation import read_covariances
    from polepilot.core.robot.run_points import RunPoints, read_run
    from polepilot.core.trajectory import read_tum

    if len(files) == 1 and files[0].suffix.lower() != ".tum":
        return read_run(files[0])
    tracks = {}
    for path in files:
        if path.suffix.lower() != ".tum":
            raise InputError(f"{path}: expected a trajectory (.tum), or one run alone.")
        track = read_tum(path)
        if len(track.stamps) == 0:
            raise InputError(f"{path}: holds no poses.")
        # Files of several runs may have one name.
        name = path.stem if path.stem not in tracks else str(path)
        tracks[name] = track
    beside = files[0].with_suffix(".cov")
    return RunPoints(tracks, covariances=read_covariances(beside) if beside.exists() else None)


def _span(track: Any) -> str:
    if len(track.stamps) == 0:
        return "no poses"
    return f"{track.stamps[0]:.2f} to {track.stamps[-1]:.2f} s"


def _table(document: dict[str, Any]) -> str:
    """Centimetres and degrees, for people."""
    from math import degrees

    heads = ("mean", "rmse", "p95", "max")
    wide = max([12, *(len(one["name"]) + 10 for one in document["trajectories"])])
    lines = [f"{'':{wide}}  {'position, cm':^31}   {'heading, deg':^31}"]
    lines.append(" " * wide + "  " + "   ".join(" ".join(f"{h:>7}" for h in heads) for _ in "ab"))
    for one in document["trajectories"]:
        rows = [(one["name"], one)]
        if one["aligned"] is not None:
            rows.append((f"{one['name']} (aligned)", one["aligned"]))
        for label, errors in rows:
            centimetres = " ".join(f"{100 * errors['position'][h]:7.2f}" for h in heads)
            turned = " ".join(f"{degrees(errors['heading'][h]):7.2f}" for h in heads)
            lines.append(f"{label:{wide}}  {centimetres}   {turned}")
    if document["alignment"] == "none":
        lines.append("Nothing is aligned: errors are those in the map's own frame.")
    else:
        lines.append("Rows without (aligned) are in the map's own frame.")
    for one in document["trajectories"]:
        if one["aligned"] is not None:
            shift = one["aligned"]
            lines.append(
                f"{one['name']}: aligned by {100 * shift['x']:.1f}, {100 * shift['y']:.1f} cm "
                f"and {degrees(shift['rotation']):.2f} deg about the map's origin."
            )
        lines.append(
            f"{one['name']}: {one['compared']} of {one['poses']} poses compared, "
            f"{one['first_t']:.2f} to {one['last_t']:.2f} s, "
            f"longest gap {one['longest_gap']:.2f} s."
        )
        if one["nees"] is not None:
            nees = one["nees"]
            lines.append(
                f"{one['name']}: NEES mean {nees['mean']:.2f} (honest: 3), "
                f"{100 * nees['inside_95']:.1f} % inside the 95 % bound."
            )
    return "\n".join(lines) + "\n"
