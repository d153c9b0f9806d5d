"""A bag of ROS 2 is a folder: metadata.yaml, and the files of one recording, split where they grew too long."""

from __future__ import annotations

import os
import re
from pathlib import Path

METADATA = "metadata.yaml"  # never read: a bag is what its files are
BAG_SUFFIXES = (".db3", ".mcap", ".db3.zstd", ".mcap.zstd")


def is_bag_folder(path: str | os.PathLike) -> bool:
    """Whether a path is a folder that holds one recording of ROS 2."""
    return os.path.isfile(os.path.join(path, METADATA)) and bool(_files(Path(path)))


def files_of(path: str | os.PathLike) -> list[Path]:
    """The files of a recording in their order: those in its folder, else the file itself."""
    return _files(Path(path)) if is_bag_folder(path) else [Path(path)]


def _files(folder: Path) -> list[Path]:
    found = [each for each in folder.iterdir() if each.name.lower().endswith(BAG_SUFFIXES) and each.is_file()]
    return sorted(found, key=lambda each: natural(each.name))


def natural(name: str) -> list[tuple[int, str]]:
    """A key by which numbers in names count as numbers: exp2 before exp10."""
    return [(int(part), "") if part.isdecimal() else (0, part) for part in re.split(r"(\d+)", name)]
