"""The built page: files of polepilot/server/static, index.html for the page's own addresses."""

from __future__ import annotations

import mimetypes
from pathlib import Path

from fastapi import FastAPI, Request, Response
from fastapi.responses import FileResponse

from polepilot.server.errors import NotFoundError

STATIC = Path(__file__).parent / "static"
PAGES = ("draw", "check", "drive", "prove", "setup")
"""First parts of the addresses that the page itself understands."""
_FOREVER = "public, max-age=31536000, immutable"


def mount_page(app: FastAPI, static: Path = STATIC) -> None:
    """Serve the page wherever no route of ``app`` matches; call it last."""

    @app.api_route("/{path:path}", methods=["GET", "HEAD"], include_in_schema=False)
    def page(path: str, request: Request) -> Response:
        return file_response(static, path, request.headers.get("accept-encoding", ""))


def file_response(static: Path, path: str, accepted: str) -> Response:
    """The file at ``path``, gzipped if it was built so and the browser takes it.

    Raises:
        NotFoundError: there is no such file, or the page was not built.
    """
    first = path.split("/", 1)[0]
    name = "index.html" if path == "" or first in PAGES else path
    root = static.resolve()
    try:
        file = (root / name).resolve()
        # What begins with a dot is the build's own.
        hidden = any(part.startswith(".") for part in Path(name).parts)
        found = file.is_relative_to(root) and file.is_file() and not hidden
    except (OSError, ValueError):
        found = False
    if not found:
        if name == "index.html":
            raise NotFoundError(
                "The page is not built.",
                code="page_not_built",
                remedy="Install again without POLEPILOT_PAGE=skip.",
            )
        raise NotFoundError("There is nothing at this address.")
    headers = {
        # Vite writes the content's hash into the names below assets/.
        "Cache-Control": _FOREVER if first == "assets" else "no-cache",
        "Vary": "Accept-Encoding",
    }
    kind = mimetypes.guess_type(file.name)[0] or "application/octet-stream"
    packed = file.with_name(f"{file.name}.gz")
    if packed.is_file() and "gzip" in accepted:
        headers["Content-Encoding"] = "gzip"
        file = packed
    return FileResponse(file, media_type=kind, headers=headers)
