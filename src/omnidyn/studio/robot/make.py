"""A robot that is described by a few sizes."""

from __future__ import annotations

import asyncio
import sys

from omnidyn.studio.calls import safe_name
from omnidyn.studio.session import ROBOT_SUFFIX, Session
from omnidyn.studio.worker import EndedError


async def make_robot(session: Session, name: str, options: list[str]) -> str:
    """The robot that `omnidyn init` writes for these options; an error in words, or ""."""
    path = session.new_folder() / f"{safe_name(name)}{ROBOT_SUFFIX}"
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "omnidyn", "init", path.stem, *options, "-o", str(path)),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.PIPE,
    )
    _, said = await process.communicate()
    if process.returncode:
        words = said.decode("utf-8", "replace").strip().removeprefix("omnidyn: error: ")
        return session.shown(words) or str(EndedError(process.returncode))
    session.add_robot(str(path), path.name)
    return ""
