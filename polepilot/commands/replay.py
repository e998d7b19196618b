"""`polepilot replay`: the localizer over a recorded run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def replay(
    dataset: Annotated[
        Path,
        typer.Argument(
            metavar="RECORDING",
            help="Folder with dataset.json, samples.jsonl and pictures; or the log of a run "
            "(run.mcap), or its folder.",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", help="Folder for the trajectories.")],
    method: Annotated[
        str | None,
        typer.Option(
            "--method", help="ekf, or the paper's method: paper. A log: what the run used."
        ),
    ] = None,
    smooth: Annotated[
        bool, typer.Option("--smooth", help="Also write smoothed.tum, the offline best.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Run the localizer over a recorded run and write where the robot was.

    A log that was cut off is replayed as far as it goes, and that is said.
    """
    import json as json_module
    import math
    import sys
    from dataclasses import replace

    import numpy as np
    from rich.console import Console
    from rich.progress import Progress

    from polepilot.core.errors import DatasetError, ImageError, InputError
    from polepilot.core.observation import Detection
    from polepilot.core.robot.dataset import FrameFile, read_dataset
    from polepilot.core.robot.replay import replay as run
    from polepilot.core.robot.replay import smooth as smoothed_poses
    from polepilot.core.robot.replay import write_results
    from polepilot.core.robot.run_log import find_log, read_run_log
    from polepilot.core.trajectory import Trajectory, heading_errors, position_errors
    from polepilot.core.vision.detector import LandmarkDetector
    from polepilot.core.vision.images import read_image

    if method not in (None, "ekf", "paper"):
        raise InputError(f"--method is {method!r}: expected 'ekf' or 'paper'.")
    log = None if (dataset / "dataset.json").exists() else find_log(dataset)
    recording = read_dataset(dataset) if log is None else read_run_log(log)
    for note in recording.notes:
        sys.stderr.write(note + "\n")
    settings = recording.settings
    if method is not None:
        settings = replace(settings, method="paper" if method == "paper" else "ekf")
    camera = recording.camera
    detector = LandmarkDetector(
        camera,
        {number: mark.kind for number, mark in recording.landmarks.items()},
        recording.paint,
    )

    unusable: list[str] = []

    def see(frame: FrameFile) -> list[Detection]:
        try:
            image = read_image(frame.path)
            if image.shape[:2] != (camera.height, camera.width):
                raise ImageError(
                    f"{frame.path}: {image.shape[1]} x {image.shape[0]} pixels: expected "
                    f"{camera.width} x {camera.height}."
                )
        except ImageError as error:
            unusable.append(f"samples.jsonl:{frame.line}: {error.message}")
            raise
        return detector.detect(image)

    screen = Console(stderr=True)
    with Progress(console=screen, transient=True, disable=not screen.is_terminal) as bars:
        task = bars.add_task("replaying", total=recording.frames)
        result = run(
            recording,
            see,
            settings,
            lambda done: bars.update(task, completed=done),
        )
    if len(unusable) == result.frames:
        # A picture may be lost; with all of them lost it is no recording.
        raise DatasetError(f"{dataset}: none of its pictures can be used; {unusable[0]}")
    write_results(result, out, smoothed_poses(recording, result) if smooth else None)
    notes = [*recording.notes]
    if result.refusal:
        notes.append(f"No pose was found: {result.refusal}")
        sys.stderr.write(notes[-1] + "\n")
    if json:
        typer.echo(json_module.dumps({**result.to_json(), "notes": notes}))
        return
    typer.echo(f"{len(result.estimates)} poses from {result.frames} pictures -> {out}")
    for event in result.events:
        typer.echo(f"  {event.stamp:9.2f} s  {event.code:17} {event.text}")
    if recording.truth is not None and result.estimates:
        seen = Trajectory(
            np.array([e.stamp for e in result.estimates]),
            np.array([e.pose for e in result.estimates]),
        )
        position = position_errors(recording.truth, seen)
        heading = heading_errors(recording.truth, seen)
        typer.echo(
            f"position error  mean {100 * position.mean:.1f} cm, p95 {100 * position.p95:.1f} cm, "
            f"max {100 * position.max:.1f} cm (not aligned)"
        )
        mean, p95, worst = (math.degrees(v) for v in (heading.mean, heading.p95, heading.max))
        typer.echo(f"heading error   mean {mean:.2f}°, p95 {p95:.2f}°, max {worst:.2f}°")
