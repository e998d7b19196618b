"""Landmarks to print, as the page offers them."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response
from starlette.concurrency import run_in_threadpool

from polepilot.core.errors import InputError
from polepilot.core.landmark import LandmarkKind, Shape, parse_ids
from polepilot.core.printing.job import PrintJob
from polepilot.core.printing.paper import parse_paper
from polepilot.core.printing.pdf import pdf_bytes
from polepilot.server.routes.common import problems

router = APIRouter(prefix="/landmarks", tags=["landmarks"])

_MOST_SHEETS = 100
"""Drawing more would take time from the robot."""


@router.get(
    "/sheet.pdf",
    response_class=Response,
    responses={
        200: {"content": {"application/pdf": {"schema": {"type": "string", "format": "binary"}}}},
        **problems(422),
    },
)
async def landmark_sheet(
    ids: Annotated[str, Query(max_length=1000, description="As 1-15 or 1,3,7-9.")],
    bits: Annotated[int, Query(description="Bits per landmark: 4, 5, 6 or 8.")] = 4,
    segment: Annotated[float, Query(description="Length of a segment, metres.")] = 0.05,
    diameter: Annotated[float, Query(description="Thickness or width, metres.")] = 0.07,
    shape: Annotated[Shape, Query(description="A tube, or a flat sticker.")] = "cylinder",
    paper: Annotated[
        str, Query(max_length=40, description="A4, Letter, 420x594 (mm), roll-610 (mm), ...")
    ] = "A4",
) -> Response:
    """Landmarks to scale, with instructions: to print at 100 %, to cut out and to glue."""
    kind = LandmarkKind(bits, segment, diameter, shape)
    job = PrintJob(parse_ids(ids, bits), kind, parse_paper(paper))
    document = await run_in_threadpool(_document, job)
    headers = {"Content-Disposition": 'inline; filename="landmarks.pdf"'}
    return Response(document, media_type="application/pdf", headers=headers)


def _document(job: PrintJob) -> bytes:
    pages = job.pages()
    if len(pages) > _MOST_SHEETS:
        raise InputError(
            f"this would need {len(pages):,} sheets of {job.paper.name}: expected at most"
            f" {_MOST_SHEETS}.",
            remedy="Choose larger paper or fewer ids, or use the landmarks print command.",
        )
    return pdf_bytes(job.drawing(pages))
