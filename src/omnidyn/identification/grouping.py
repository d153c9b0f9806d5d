"""Which runs belong to which group, and which are held out: by globs and folders of their sources."""

from __future__ import annotations

import fnmatch
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from omnidyn.errors import InputError, printable


def matches(path: str, pattern: str) -> bool:
    """Whether a file belongs to a group: its path matches the glob, or lies in the folder of that name."""
    plain_path = os.path.normpath(path)
    folder = os.path.normpath(pattern)
    if fnmatch.fnmatch(plain_path, folder) or fnmatch.fnmatch(os.path.basename(plain_path), pattern):
        return True
    parents = [str(parent) for parent in Path(plain_path).parents]
    return any(fnmatch.fnmatch(parent, folder) or os.path.basename(parent) == folder for parent in parents)


def held_out(sources: Sequence[str], patterns: Sequence[str]) -> list[bool]:
    """Which runs are held out. Raises InputError for a pattern that none matches, and where nothing is left."""
    for pattern in patterns:
        if not any(matches(source, pattern) for source in sources):
            raise InputError(
                "no log to hold out",
                got=pattern,
                expected="a name, a glob or a folder of logs that are given",
                remedy="give that log among the others too: it is read, and left out of the fit",
                where="hold_out",
            )
    held_out_mask = [any(matches(source, pattern) for pattern in patterns) for source in sources]
    if patterns and all(held_out_mask):
        raise InputError(
            "every log is held out", got=", ".join(patterns), expected="one or more to fit", where="hold_out"
        )
    return held_out_mask


def group_names(sources: Sequence[str], patterns: Sequence[str], option: str) -> list[str]:
    """The group of each run, "" for one of none. patterns: NAME=GLOB each; option: where they come from.

    Raises InputError for a pattern that cannot be read or that no run matches, and for a run of two groups.
    """
    pairs = [_pair(text, option) for text in patterns]
    names = []
    for source in sources:
        names_of_source = list(dict.fromkeys(name for name, pattern in pairs if matches(source, pattern)))
        if len(names_of_source) > 1:
            raise InputError(
                "a log belongs to two groups",
                got=" and ".join(names_of_source),
                where=source,
                remedy=f"make the patterns of `{option}` narrower",
            )
        names.append(names_of_source[0] if names_of_source else "")
    for name, pattern in pairs:
        if name not in names:
            raise InputError(
                "no log belongs to this group",
                got=pattern,
                expected="a glob or a folder of LOG...",
                where=f"`{option}` {name}",
            )
    return names


def names_of_groups(groups: str | Sequence[str] | None, sources: Sequence[str]) -> list[str] | None:
    """The group of each run, "" for one of none; None where there are no groups.

    groups: NAME=GLOB each, of the sources of runs, or a name for every run. Raises InputError as `group_names` does,
    and for names that are not one for each run.
    """
    if isinstance(groups, Mapping):
        raise InputError(
            "groups are not a table", got=groups, expected='["NAME=GLOB", ...] or a name for every run', where="groups"
        )
    words = [groups] if isinstance(groups, str) else list(groups or ())
    if not words:
        return None
    if isinstance(groups, str) or any("=" in word for word in words):
        return group_names(sources, words, "groups")
    if len(words) != len(sources):
        raise InputError(
            "groups need a name for every run",
            got=f"{len(words)} names for {len(sources)} runs",
            expected="as many names as runs, or NAME=GLOB each",
            where="groups",
        )
    return words


def _pair(text: str, option: str) -> tuple[str, str]:
    name, equals, pattern = text.partition("=")
    if not equals or not name.strip() or not pattern.strip():
        raise InputError(
            "cannot read the group", got=text, expected="NAME=GLOB, such as gray=gray_surface", where=option
        )
    return printable(name.strip()), pattern.strip()
