"""What the routes share: where the services are, and what the OpenAPI document says of problems."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import Depends, Request, Response

from polepilot.core.errors import InputError
from polepilot.server.errors import PROBLEM_TYPE
from polepilot.server.schemas import Id

if TYPE_CHECKING:
    from polepilot.server.services import Services

_MEANINGS = {
    403: "A foreign Host or Origin.",
    404: "There is no such thing.",
    409: "Refused in the present state; `code` says why and `remedy` what to do.",
    412: "Somebody else changed it meanwhile.",
    413: "The body is too large.",
    422: "What was sent is not what was expected; `detail` names it.",
    428: "If-Match is missing.",
    503: "The robot or a device does not answer.",
}


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The ``responses`` of a route that may fail in these ways."""
    schema = {"$ref": "#/components/schemas/Problem"}
    return {
        status: {"description": _MEANINGS[status], "content": {PROBLEM_TYPE: {"schema": schema}}}
        for status in sorted({*statuses, 403, 413})
    }


def get_services(request: Request) -> Any:
    """The services that the application was made with."""
    return request.app.state.services


if TYPE_CHECKING:
    ServicesDep = Services
else:
    ServicesDep = Annotated[Any, Depends(get_services)]


_LOOK = 0.25
"""Seconds between looks whether somebody still waits."""


async def while_waited_for(request: Request, work: Awaitable[Any]) -> Any:
    """What ``work`` answers; it is given up when whoever asked for it leaves."""
    task = asyncio.ensure_future(work)
    try:
        while not (await asyncio.wait({task}, timeout=_LOOK))[0]:
            if await request.is_disconnected():
                # Nobody reads this answer.
                return Response(status_code=503)
        return task.result()
    finally:
        task.cancel()


_JSON_NAMES = {
    list: "list",
    str: "text",
    int: "number",
    float: "number",
    bool: "truth value",
    type(None): "null",
}


def _refuse_constant(name: str) -> float:
    raise InputError(f"the body holds {name}: expected numbers that JSON knows.")


async def json_object(request: Request) -> dict[str, Any]:
    """The body as a JSON object.

    Raises:
        InputError: it is something else.
    """
    try:
        document = json.loads(await request.body(), parse_constant=_refuse_constant)
        # Half of a surrogate pair is valid JSON, but no text that could be kept or shown.
        json.dumps(document, ensure_ascii=False).encode()
    except RecursionError:
        raise InputError("the body is nested too deeply.", code="bad_json") from None
    except UnicodeEncodeError:
        raise InputError("the body holds half a character (a lone surrogate).") from None
    except ValueError as error:
        raise InputError(f"the body is not JSON: {error}.", code="bad_json") from None
    if not isinstance(document, dict):
        raise InputError(
            f"the body is a JSON {_JSON_NAMES[type(document)]}: expected an object.",
            code="bad_json",
        )
    return document


JsonObject = Annotated[dict[str, Any], Depends(json_object)]


def body_of(schema: str) -> dict[str, Any]:
    """``openapi_extra`` of a route that reads its body with ``json_object``."""
    reference = {"$ref": f"#/components/schemas/{schema}"}
    content = {"application/json": {"schema": reference}}
    return {"requestBody": {"required": True, "content": content}}


PathId = Id
