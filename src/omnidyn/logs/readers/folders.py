"""Logs that are folders: a bag of ROS 2 (metadata.yaml and the files of one recording, split where they grew too long),
and a dataset of LeRobot (meta/info.json and data/).

The command line loads this file without NumPy.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

METADATA = "metadata.yaml"  # never read: a bag is what its files are
INFO = "meta/info.json"  # of a dataset of LeRobot
BAG_SUFFIXES = (".db3", ".mcap", ".db3.zstd", ".mcap.zstd")


def is_bag_folder(path: str | os.PathLike) -> bool:
    """Whether a path is a folder that holds one recording of ROS 2."""
    return os.path.isfile(os.path.join(path, METADATA)) and bool(_files(Path(path)))


def is_dataset_folder(path: str | os.PathLike) -> bool:
    """Whether a path is the folder of a dataset of LeRobot."""
    return os.path.isfile(os.path.join(path, INFO)) and bool(data_files(Path(path)))


def is_log_folder(path: str | os.PathLike) -> bool:
    """Whether a path is a folder that is one log."""
    return is_bag_folder(path) or is_dataset_folder(path)


def log_folders(path: str | os.PathLike) -> list[Path]:
    """The folders below a path that are one log each."""
    folders = [file.parent for file in Path(path).rglob(METADATA)]
    folders += [file.parent.parent for file in Path(path).rglob("info.json") if file.parent.name == "meta"]
    return [folder for folder in folders if is_log_folder(folder)]


def data_files(folder: Path) -> list[Path]:
    """The files of the rows of a dataset, in their order."""
    files = [file for file in (folder / "data").rglob("*.parquet") if file.is_file()]
    return sorted(files, key=lambda file: natural(str(file)))


def files_of(path: str | os.PathLike) -> list[Path]:
    """The files of a recording in their order: those in its folder, else the file itself."""
    if is_bag_folder(path):
        return _files(Path(path))
    return data_files(Path(path)) if is_dataset_folder(path) else [Path(path)]


def _files(folder: Path) -> list[Path]:
    files = [file for file in folder.iterdir() if file.name.lower().endswith(BAG_SUFFIXES) and file.is_file()]
    return sorted(files, key=lambda file: natural(file.name))


def natural(name: str) -> list[tuple[int, str]]:
    """A key by which numbers in names count as numbers: exp2 before exp10."""
    return [(int(part), "") if part.isdecimal() else (0, part) for part in re.split(r"(\d+)", name)]
