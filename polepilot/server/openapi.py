"""Print the OpenAPI document: ``python -m polepilot.server.openapi > web/openapi.json``."""

from __future__ import annotations

import json
import sys

from polepilot.server.app import create_app


def main() -> None:
    """The document, sorted, without anything that changes from run to run."""
    json.dump(create_app().openapi(), sys.stdout, indent=2, sort_keys=True, ensure_ascii=False)
    sys.stdout.write("\n")


if __name__ == "__main__":
    main()
