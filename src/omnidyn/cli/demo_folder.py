"""The folder of the demo: ours to replace if a marker says that we made it, else somebody's property."""

from __future__ import annotations

import contextlib
import json
import os
import shlex
from collections.abc import Mapping
from pathlib import Path

from omnidyn.errors import InputError
from omnidyn.files import write_atomic

MARKER = ".omnidyn-demo"


def check_folder(path: str, force: bool = False) -> Path:
    """Refuse, before any work is done, a folder that is not ours to write in. Raises InputError."""
    try:
        if "\0" in path:
            raise ValueError("a null character in the name")
        return _checked(Path(path), force)
    except (OSError, ValueError) as error:
        raise InputError("cannot use this folder", got=str(error), where=path[:80]) from None


def _checked(folder: Path, force: bool) -> Path:
    if folder.exists() and not folder.is_dir():
        raise InputError("cannot write the demo there", got="a file", expected="a folder", where=str(folder))
    if folder.is_dir():
        if any(folder.iterdir()) and not (folder / MARKER).is_file() and not force:
            raise InputError(
                "the folder has other things in it",
                expected="a new folder, or one that the demo made",
                remedy="use --out with another name, or --force to write into it",
                where=str(folder),
            )
        target = folder
    else:
        target = folder.absolute().parent
    if not target.is_dir():
        raise InputError(
            "the folder does not exist",
            got=str(target),
            remedy=f"mkdir -p {shlex.quote(str(target))}",
            where=str(folder),
        )
    if not os.access(target, os.W_OK | os.X_OK):
        raise InputError("the folder is not writable", got=str(target), where=str(folder))
    return folder


def write_folder(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write all files, each whole or not at all; what an earlier demo wrote and this one does not is removed.

    `files`: path below the folder -> content. What anybody else put there stays.
    """
    try:
        folder.mkdir(exist_ok=True)
        for name in files:
            (folder / name).parent.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError("cannot make the folder", got=error.strerror or str(error), where=str(folder)) from None
    earlier = _made_before(folder)
    # First the marker: a demo that is killed from here on leaves a folder that the next one may complete.
    write_atomic(folder / MARKER, json.dumps(sorted({*files, *earlier}), indent=1) + "\n", force=True)
    for name, content in files.items():
        write_atomic(folder / name, content, force=True)
    for name in earlier - set(files):
        with contextlib.suppress(OSError):
            (folder / name).unlink()
    write_atomic(folder / MARKER, json.dumps(sorted(files), indent=1) + "\n", force=True)


def _made_before(folder: Path) -> set[str]:
    """Names in the marker of an earlier demo; a damaged marker names nothing, and no name leads out of the folder."""
    try:
        names = json.loads((folder / MARKER).read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return set()
    names = names if isinstance(names, list) else []
    parts = {name: Path(name).parts for name in names if isinstance(name, str) and not Path(name).is_absolute()}
    return {name for name, file_name in parts.items() if file_name and ".." not in file_name}
