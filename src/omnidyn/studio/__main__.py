"""python -m omnidyn.studio [FILES]: the server, until it is interrupted."""

from __future__ import annotations

import argparse
import sys

from omnidyn.errors import MissingExtraError
from omnidyn.studio import PORT

if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="omnidyn studio")
    parser.add_argument("files", nargs="*")
    parser.add_argument("--host", default="")
    parser.add_argument("--port", type=int, default=PORT)
    parser.add_argument("--no-browser", action="store_true")
    arguments = parser.parse_args()
    try:
        import nicegui  # noqa: F401
    except ImportError:
        raise MissingExtraError("the studio needs nicegui", remedy='pip install "omnidyn[studio]"') from None
    from omnidyn.studio.server import serve

    sys.exit(serve(arguments.files, arguments.host, arguments.port, not arguments.no_browser))
