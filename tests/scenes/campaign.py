"""Judges a detector on pictures whose truth is known: ``python -m scenes.campaign`` (in tests/).

A landmark is read where an answer has its id and lies within 8 pixels of its column. Any other
answer is a wrong id where it overlaps a landmark, else a false alarm. Answers that read a landmark
which is partly hidden rightly count for nothing, neither good nor bad.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, get_args

import cv2
import numpy as np
from scenes.truth import Family, Scene, Truth

from polepilot.core.landmark import LandmarkKind, recommended_ids
from polepilot.core.observation import Detection, Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision.detector import Detector, LandmarkDetector
from polepilot.core.vision.measure import column_of
from polepilot.core.vision.paper import PaperDetector

KINDS = {number: LandmarkKind() for number in range(1, 16)}
APART = {number: LandmarkKind() for number in recommended_ids(4)}
"""The ids that are offered: no two of them differ in one segment only."""
CAMERA = Camera()
NEAR = 8.0
"""Pixels between an answer and the landmark that it reads, at most."""
STEP = 2.0
"""Metres per row of the table by distance."""


@dataclass(frozen=True, slots=True)
class Reading:
    """What became of one landmark; errors are None where it was not read."""

    range: float
    orange: bool
    hidden: bool
    read: bool
    range_error: float | None = None
    """Relative."""
    bearing_error: float | None = None
    """Radians."""
    range_ratio: float | None = None
    """Error over sigma."""
    bearing_ratio: float | None = None


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of one picture."""

    family: Family
    seed: int
    readings: tuple[Reading, ...]
    answers: int
    wrong: int
    wrong_orange: int
    false: int
    seconds: float
    note: str = ""


@dataclass(frozen=True, slots=True)
class Marks:
    """Answers and truths of a picture, matched."""

    read: dict[int, Detection] = field(default_factory=dict)
    """By the truth's index."""
    wrong: list[tuple[Detection, int]] = field(default_factory=list)
    """With the index of the truth that it overlaps."""
    false: list[Detection] = field(default_factory=list)


def half_width(distance: float, kind: LandmarkKind) -> float:
    """Half of the pixels that a landmark covers from left to right, about."""
    return CAMERA.constant * kind.diameter / 2 / distance


def match(answers: Sequence[Detection], truths: Sequence[Truth], camera: Camera) -> Marks:
    """Which answer reads which landmark."""
    marks = Marks()
    for answer in answers:
        column = column_of(answer.bearing, camera)
        apart = [abs(column - column_of(truth.bearing, camera)) for truth in truths]
        right = [
            index
            for index, truth in enumerate(truths)
            if truth.id == answer.id and apart[index] <= NEAR and index not in marks.read
        ]
        under = [
            index
            for index, truth in enumerate(truths)
            if apart[index]
            <= half_width(truth.range, truth.kind) + half_width(answer.range, truth.kind)
        ]
        if right:
            marks.read[min(right, key=lambda index: apart[index])] = answer
        elif under:
            marks.wrong.append((answer, min(under, key=lambda index: apart[index])))
        else:
            marks.false.append(answer)
    return marks


def judge(scene: Scene, marks: Marks, seconds: float) -> Verdict:
    """The marks of a picture as figures."""
    readings = []
    for index, truth in enumerate(scene.truths):
        answer = marks.read.get(index)
        if answer is None:
            readings.append(Reading(truth.range, truth.orange_surround, truth.hidden, False))
            continue
        off = answer.range - truth.range
        turned = answer.bearing - truth.bearing
        readings.append(
            Reading(
                *(truth.range, truth.orange_surround, truth.hidden, True),
                off / truth.range,
                turned,
                off / answer.range_sigma,
                turned / answer.bearing_sigma,
            )
        )
    return Verdict(
        scene.family,
        scene.seed,
        tuple(readings),
        len(marks.read) + len(marks.wrong) + len(marks.false),
        len(marks.wrong),
        sum(scene.truths[index].orange_surround for _, index in marks.wrong),
        len(marks.false),
        seconds,
        scene.note,
    )


def annotated(scene: Scene, marks: Marks, scale: int = 3) -> Image:
    """The picture enlarged: read green, missed red, wrong and false answers yellow."""
    image = cv2.resize(scene.image, None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST)
    camera = CAMERA

    def place(column: float, row: float) -> tuple[int, int]:
        return round((column + 0.5) * scale), round((row + 0.5) * scale)

    for index, truth in enumerate(scene.truths):
        x = column_of(truth.bearing, camera)
        unit = camera.constant / (truth.range * math.cos(truth.bearing))
        top = camera.center_y - unit * (truth.kind.height - camera.mount_height)
        bottom = camera.center_y + unit * camera.mount_height
        half = half_width(truth.range, truth.kind) + 5
        color = (0, 200, 0) if index in marks.read else (0, 0, 255)
        if truth.hidden:
            color = (255, 120, 0)
        cv2.rectangle(image, place(x - half, top - 8), place(x + half, bottom + 8), color, 1)
        text = f"{truth.id} {truth.range:.1f}m{' o' * truth.orange_surround}"
        at = place(x - half, top - 10)
        cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.5, color, 1, cv2.LINE_AA)
    for answer in [one for one, _ in marks.wrong] + marks.false:
        low, high = place(answer.column - 3, answer.top), place(answer.column + 3, answer.bottom)
        cv2.rectangle(image, low, high, (0, 255, 255), 1)
        at = place(answer.column + 5, answer.bottom)
        text = f"{answer.id} {answer.range:.1f}m"
        cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 255, 255), 1, cv2.LINE_AA)
    label = f"{scene.family} {scene.seed} {scene.note}"
    cv2.putText(image, label, (4, 12), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (255, 255, 255), 2)
    cv2.putText(image, label, (4, 12), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (0, 0, 0), 1)
    return np.asarray(image, np.uint8)


@cache
def _program(name: str) -> Callable[[Family, int], Scene]:
    return importlib.import_module(f"scenes.{name}").scene  # type: ignore[no-any-return]


@cache
def _fingerprint(name: str) -> str:
    """Of everything that a program's pictures depend on, so that no old picture is taken."""
    digest = hashlib.sha256(np.__version__.encode() + cv2.__version__.encode())
    folder = Path(__file__).parent
    for path in [*sorted(folder.glob(f"{name}*.py")), folder / "truth.py"]:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def picture(program: str, family: Family, seed: int, keep: Path | None) -> Scene:
    """A scene, rendered or (``keep``: a folder) as it was rendered before."""
    if keep is None:
        return _program(program)(family, seed)
    folder = keep / f"{program}-{_fingerprint(program)}" / family
    shown, told = folder / f"{seed:06d}.png", folder / f"{seed:06d}.json"
    if told.exists():
        known = json.loads(told.read_text())
        image = cv2.imread(str(shown), cv2.IMREAD_COLOR)
        if image is not None:
            truths = tuple(
                Truth(**{**one, "kind": LandmarkKind(**one["kind"])}) for one in known["truths"]
            )
            return Scene(np.asarray(image, np.uint8), truths, family, seed, known["note"])
    scene = _program(program)(family, seed)
    folder.mkdir(parents=True, exist_ok=True)
    # The picture first, the text last and whole: where there is a text there is a picture.
    _, data = cv2.imencode(".png", scene.image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    document = {"truths": [asdict(truth) for truth in scene.truths], "note": scene.note}
    for path, content in ((shown, data.tobytes()), (told, json.dumps(document).encode())):
        part = path.with_suffix(f".{os.getpid()}.part")
        part.write_bytes(content)
        part.replace(path)
    return scene


@cache
def _detector(name: str) -> Detector:
    if name == "paper":
        return PaperDetector(CAMERA, KINDS)
    return LandmarkDetector(CAMERA, APART if name == "apart" else KINDS)


def look(
    job: tuple[Family, int], program: str, detector: str, keep: Path | None, misses: Path | None
) -> Verdict:
    """One picture, rendered, read and judged."""
    family, seed = job
    scene = picture(program, family, seed, keep)
    start = time.perf_counter()
    answers = _detector(detector).detect(scene.image)
    seconds = time.perf_counter() - start
    if detector == "apart":
        scene, answers = _without_others(scene, answers)
    marks = match(answers, scene.truths, CAMERA)
    missed = any(
        index not in marks.read and not truth.hidden for index, truth in enumerate(scene.truths)
    )
    if misses is not None and (missed or marks.wrong or marks.false):
        misses.mkdir(parents=True, exist_ok=True)
        name = f"{family}-{seed:06d}{'-wrong' * bool(marks.wrong)}{'-false' * bool(marks.false)}"
        cv2.imwrite(str(misses / f"{name}.png"), annotated(scene, marks))
    return judge(scene, marks, seconds)


def _without_others(scene: Scene, answers: list[Detection]) -> tuple[Scene, list[Detection]]:
    """Without the landmarks that would not stand on a site with the ids `APART`."""
    there = tuple(truth for truth in scene.truths if truth.id in APART)
    others = [truth for truth in scene.truths if truth.id not in APART]
    taken = match(answers, others, CAMERA).wrong
    kept = [one for one in answers if not any(one is other for other, _ in taken)]
    return replace(scene, truths=there), kept


def figures(readings: Iterable[Reading]) -> dict[str, Any]:
    """How many of these landmarks were read, and how well."""
    every = [one for one in readings if not one.hidden]
    read = [one for one in every if one.read]
    out: dict[str, Any] = {
        "landmarks": len(every),
        "read": len(read),
        "read_percent": 100 * len(read) / len(every) if every else None,
    }
    if not read:
        return out
    error = 100 * np.abs([one.range_error or 0.0 for one in read])
    turned = np.degrees(np.abs([one.bearing_error or 0.0 for one in read]))
    out |= {
        "range_mean_percent": float(error.mean()),
        "range_p95_percent": float(np.percentile(error, 95)),
        "range_max_percent": float(error.max()),
        "range_bias_percent": float(100 * np.mean([one.range_error or 0.0 for one in read])),
        "bearing_median_deg": float(np.median(turned)),
        "bearing_p95_deg": float(np.percentile(turned, 95)),
    }
    for name, values in (
        ("range", [one.range_ratio or 0.0 for one in read]),
        ("bearing", [one.bearing_ratio or 0.0 for one in read]),
    ):
        middle = float(np.median(values))
        out[f"{name}_ratio_std"] = float(np.sqrt(np.mean(np.square(values))))
        out[f"{name}_ratio_robust"] = float(1.4826 * np.median(np.abs(np.array(values) - middle)))
    return out


CAMERAS = ("sharp", "jpeg", "mosaic")
"""What has become of colour: a larger picture was averaged down; JPEG kept one colour for four
pixels; the sensor had one colour for every pixel of this very picture."""


def camera_of(note: str) -> str:
    """Which of `CAMERAS` took a picture, by the note of either program."""
    if "native sensor" in note or "mosaic" in note:
        return "mosaic"
    if "sensor" in note:  # the darkroom names only what it has left whole
        return "sharp" if "jpeg 0" in note or "4:4:4" in note else "jpeg"
    return "jpeg" if "4:2:0" in note else "sharp"


def summary(verdicts: Sequence[Verdict], words: Sequence[str] = ()) -> dict[str, Any]:
    """All figures of a campaign, by family; ``words`` split it by what the notes say."""
    out: dict[str, Any] = {}
    for family in dict.fromkeys(verdict.family for verdict in verdicts):
        ours = [verdict for verdict in verdicts if verdict.family == family]
        readings = [reading for verdict in ours for reading in verdict.readings]
        answers = sum(verdict.answers for verdict in ours)
        wrong = sum(verdict.wrong for verdict in ours)
        false = sum(verdict.false for verdict in ours)
        row = {
            "frames": len(ours),
            **figures(readings),
            "answers": answers,
            "wrong": wrong,
            "wrong_percent": 100 * wrong / answers if answers else 0.0,
            "false": false,
            "false_per_1000": 1000 * false / len(ours),
            "milliseconds": 1e3 * float(np.median([verdict.seconds for verdict in ours])),
        }
        if family == "hidden":
            row["hidden"] = sum(reading.hidden for reading in readings)
            row["hidden_read"] = sum(reading.hidden and reading.read for reading in readings)
        if any(reading.orange for reading in readings):
            row["orange"] = figures(one for one in readings if one.orange)
            row["orange"]["wrong"] = sum(verdict.wrong_orange for verdict in ours)
            row["plain"] = figures(one for one in readings if not one.orange)
            row["plain"]["wrong"] = wrong - row["orange"]["wrong"]
        row["cameras"] = {
            camera: figures(
                reading
                for verdict in ours
                for reading in verdict.readings
                if camera_of(verdict.note) == camera and not reading.orange
            )
            for camera in CAMERAS
        }
        places = sorted({math.floor(one.range / STEP) * STEP for one in readings})
        row["distance"] = {
            f"{low:.0f}-{low + STEP:.0f} m": figures(
                one for one in readings if low <= one.range < low + STEP
            )
            for low in places
        }
        row["words"] = {
            f"{'with' if there else 'without'} {word}": figures(
                reading
                for verdict in ours
                if (word in verdict.note) == there
                for reading in verdict.readings
            )
            for word in words
            for there in (True, False)
        }
        out[family] = row
    return out


_COLUMNS = (
    ("landmarks", "poles", "d"),
    ("read_percent", "read %", ".2f"),
    ("wrong", "wrong", "d"),
    ("wrong_percent", "wrong %", ".2f"),
    ("false_per_1000", "false/1000", ".1f"),
    ("range_mean_percent", "range %", ".3f"),
    ("range_p95_percent", "p95", ".3f"),
    ("range_max_percent", "max", ".2f"),
    ("range_bias_percent", "bias", "+.3f"),
    ("bearing_median_deg", "bear.", ".4f"),
    ("bearing_p95_deg", "p95", ".4f"),
    ("range_ratio_std", "r/sig", ".2f"),
    ("range_ratio_robust", "rob.", ".2f"),
    ("bearing_ratio_std", "b/sig", ".2f"),
    ("bearing_ratio_robust", "rob.", ".2f"),
    ("milliseconds", "ms", ".2f"),
)


def table(result: dict[str, Any]) -> str:
    """The figures for a person, widths in characters."""
    lines = [" " * 24 + "".join(f"{title:>11}" for _, title, _ in _COLUMNS)]

    def line(name: str, row: dict[str, Any]) -> None:
        cells = [
            f"{row[key]:{form}}" if row.get(key) is not None else "" for key, _, form in _COLUMNS
        ]
        lines.append(f"{name:24}" + "".join(f"{cell:>11}" for cell in cells))

    for family, row in result.items():
        line(f"{family} ({row['frames']})", row)
        if "orange" in row:
            line("  surround orange", row["orange"])
            line("  surround not orange", row["plain"])
        for place, part in (row["words"] | row["distance"]).items():
            line(f"  {place}", part)
        if "hidden" in row:
            lines.append(f"  partly hidden: {row['hidden']}, of them read {row['hidden_read']}")
    return "\n".join(lines)


def run(
    families: Sequence[Family],
    frames: int,
    seed: int = 0,
    *,
    program: str = "studio",
    detector: str = "default",
    processes: int = 2,
    keep: Path | None = None,
    misses: Path | None = None,
) -> list[Verdict]:
    """Pictures ``seed`` to ``seed + frames - 1`` of every family, judged."""
    jobs = [(family, seed + index) for family in families for index in range(frames)]
    work = partial(look, program=program, detector=detector, keep=keep, misses=misses)
    if processes == 1:
        return [work(job) for job in jobs]
    with ProcessPoolExecutor(processes, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        return list(pool.map(work, jobs, chunksize=8))


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs a campaign and prints its table."""
    parser = argparse.ArgumentParser(prog="python -m scenes.campaign", description=__doc__)
    parser.add_argument("--program", default="studio", help="studio or darkroom")
    parser.add_argument("--frames", type=int, default=100, help="per family")
    parser.add_argument("--seed", type=int, default=0, help="of the first picture")
    parser.add_argument("--families", nargs="+", choices=get_args(Family), default=get_args(Family))
    parser.add_argument("--detector", choices=("default", "paper", "apart"), default="default")
    parser.add_argument("--json", type=Path, help="file for the figures")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--save-misses", type=Path, help="folder for annotated pictures")
    parser.add_argument("--cache", type=Path, help="folder that keeps rendered pictures")
    parser.add_argument(
        "--by",
        nargs="+",
        default=(),
        metavar="WORD",
        help="split by words of the notes, such as mosaic, 4:2:0, jpeg, sharpened",
    )
    options = parser.parse_args(arguments)
    verdicts = run(
        options.families,
        options.frames,
        options.seed,
        program=options.program,
        detector=options.detector,
        processes=options.processes,
        keep=options.cache,
        misses=options.save_misses,
    )
    result = summary(verdicts, options.by)
    if options.json is not None:
        options.json.write_text(json.dumps(result, indent=1) + "\n")
    sys.stdout.write(table(result) + "\n")


if __name__ == "__main__":
    main()
