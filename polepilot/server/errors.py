"""From the one error tree to HTTP: every failure is an ``application/problem+json`` document.

| error | status |
|---|---|
| InputError (SiteError adds ``where``) | 422 |
| RefusedError | 409 |
| NotFoundError | 404 |
| PreconditionError | 412, or 428 where the header is missing |
| DeviceError | 503 |
| no room left on the disk | 507, code ``disk_full`` |
| a body, path or query that does not fit the schema | 422, the field named |
| anything else | 500, code ``internal``, logged |
"""

from __future__ import annotations

import errno
import math
import sqlite3
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from polepilot.core.errors import (
    DeviceError,
    InputError,
    PolepilotError,
    RefusedError,
    SiteError,
)

PROBLEM_TYPE = "application/problem+json"
_STATUS: tuple[tuple[type[PolepilotError], int], ...] = (
    (InputError, 422),
    (RefusedError, 409),
    (DeviceError, 503),
)
_CODES = {
    403: "forbidden",
    404: "not_found",
    405: "method_not_allowed",
    413: "too_large",
    415: "unsupported_media_type",
}

_REMEDIES = {
    403: "Use our own page, at the address that the service printed.",
    404: "Look at the list of what there is.",
    405: "Look into /openapi.json for what this address takes.",
    413: "Send less at once.",
    422: "Mend it and try again.",
    503: "Wait a moment and try again.",
}
"""What to do where an error itself does not say so."""

log = structlog.get_logger("polepilot.server")


class NotFoundError(PolepilotError):
    """What the address names does not exist."""

    code = "not_found"


class PreconditionError(PolepilotError):
    """An edit that was not made on the present version; ``status`` is 412 or 428."""

    code = "conflict"

    def __init__(self, message: str, *, status: int, remedy: str = "", code: str) -> None:
        super().__init__(message, remedy=remedy, code=code)
        self.status = status


class BusyError(PolepilotError):
    """The service cannot take more of this now (HTTP 503)."""

    code = "busy"


def problem(
    status: int,
    detail: str,
    *,
    code: str,
    remedy: str = "",
    where: tuple[float, float] | None = None,
    headers: Mapping[str, str] | None = None,
) -> JSONResponse:
    """The problem document (RFC 9457) as a response."""
    document: dict[str, Any] = {
        "type": f"urn:polepilot:problem:{code}",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
        "code": code,
        "remedy": remedy or _REMEDIES.get(status, ""),
    }
    if where is not None and all(map(math.isfinite, where)):
        document["where"] = list(where)
    return JSONResponse(document, status, headers=headers, media_type=PROBLEM_TYPE)


def problem_of(error: PolepilotError) -> JSONResponse:
    """The response that an error of the tree is answered with."""
    where = error.where if isinstance(error, SiteError) else None
    return problem(
        status_of(error), error.message, code=error.code, remedy=error.remedy, where=where
    )


def status_of(error: PolepilotError) -> int:
    """The HTTP status of an error of the tree."""
    if isinstance(error, PreconditionError):
        return error.status
    if isinstance(error, NotFoundError):
        return 404
    if isinstance(error, BusyError):
        return 503
    return next((status for kind, status in _STATUS if isinstance(error, kind)), 500)


def explain(errors: list[Any]) -> str:
    """One sentence for the first of pydantic's complaints, the field named."""
    first = errors[0]
    place = ".".join(str(part) for part in first["loc"] if part != "body") or "the body"
    more = f" ({len(errors) - 1} more)" if len(errors) > 1 else ""
    return f"{place}: {first['msg']}{more}."


async def _on_polepilot_error(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, PolepilotError)
    if status_of(error) == 500:
        log.error("request failed", path=request.url.path, error=str(error), exc_info=error)
    return problem_of(error)


async def _on_validation_error(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    return problem(422, explain(list(error.errors())), code="bad_input")


async def _on_http_error(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    if error.status_code == 400:
        # FastAPI's word for a body that is not even text.
        return problem(422, "the body is not JSON.", code="bad_json")
    code = _CODES.get(error.status_code, "http_error")
    detail = str(error.detail)
    if error.status_code == 405:
        detail = "This address does not take that method."
    return problem(error.status_code, detail, code=code, headers=error.headers)


async def _on_disk_error(request: Request, error: Exception) -> JSONResponse:
    if not is_disk_full(error):
        return await _on_unknown_error(request, error)
    log.error("the disk is full", path=request.url.path, error=str(error))
    return problem(
        507,
        "The disk is full: this was not kept.",
        code="disk_full",
        remedy="Make room on the disk of the robot's computer and try again.",
    )


def is_disk_full(error: BaseException) -> bool:
    """Whether there is no room left for what was to be written."""
    if isinstance(error, sqlite3.Error):
        return getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL
    return isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT)


async def _on_unknown_error(request: Request, error: Exception) -> JSONResponse:
    log.error("request failed", path=request.url.path, error=str(error), exc_info=error)
    return problem(
        500,
        "The service made a mistake; the log says which.",
        code="internal",
        remedy="Report it with the lines of the log around this moment.",
    )


def install(app: FastAPI) -> None:
    """Make ``app`` answer every failure with a problem document."""
    app.add_exception_handler(PolepilotError, _on_polepilot_error)
    app.add_exception_handler(RequestValidationError, _on_validation_error)
    app.add_exception_handler(HTTPException, _on_http_error)
    app.add_exception_handler(sqlite3.Error, _on_disk_error)
    app.add_exception_handler(OSError, _on_disk_error)
    app.add_exception_handler(Exception, _on_unknown_error)
