"""Workspace: logs with their maps, robots and fits as one file: a zip archive with a manifest in JSON.

A file that comes back is trusted no more than an upload. Before anything is written its names, their number, sizes and
growth are bounded; files get names of this server; the manifest is plain values of a fixed form, and nothing else is
read from it.
"""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
import struct
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from omnidyn.errors import InputError
from omnidyn.files import open_regular
from omnidyn.statement import ERROR, NOTE
from omnidyn.studio.calls import safe_name
from omnidyn.studio.fit.state import Fitting
from omnidyn.studio.session import MAX_BYTES, MAX_FILE_BYTES, MAX_FILES, Session
from omnidyn.studio.task import Task

SUFFIX, FILE_NAME = ".zip", "workspace.zip"
SCHEMA, MANIFEST = 1, "manifest.json"
MAX_MANIFEST, MAX_TABLE, MAX_DIRECTORY = 2**20, 2**20, 2**18  # bytes
MAX_GROWTH, GROWING = 200, 64 * 2**20  # times what is packed; bytes below which it does not matter
MEMBER = re.compile(r"(?:logs|maps|robots|fits)/\d{1,3}-[A-Za-z0-9._-]{1,80}", re.ASCII)
END, END_BYTES, END_64, END_64_BYTES = b"PK\x05\x06", 22, b"PK\x06\x07", 20  # of an archive without a comment
# What a manifest holds: of each entry its text, its flags and its files, those that may be absent last.
FORM: dict[str, tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...], tuple[str, ...]]] = {
    "logs": (("name", "group"), ("unsigned", "held_out"), ("file",), ("map",)),
    "robots": (("name",), (), ("file",), ()),
    "fits": (("name", "verdict", "note"), ("failed",), ("robot", "numbers", "warnings"), ("report",)),
}
FIT_FILES = {"robot": "robot.toml", "numbers": "numbers.csv", "warnings": "warnings.csv", "report": "report.html"}


@dataclass
class Workspace:
    """What a workspace holds. robot: the name of the one that is chosen; files: member -> where it lies."""

    robot: str = ""
    logs: list[dict[str, Any]] = field(default_factory=list)
    robots: list[dict[str, Any]] = field(default_factory=list)
    fits: list[dict[str, Any]] = field(default_factory=list)
    files: dict[str, Path] = field(default_factory=dict)

    def add(self, kind: str, path: Path | str, name: str = "") -> str:
        """Take a file in; the name that it gets in the archive."""
        member = f"{kind}/{len(self.files) + 1}-{safe_name(name or Path(path).name)}"
        self.files[member] = Path(path)
        return member

    @property
    def entries(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """All entries, with the list in which each stands."""
        for kind in FORM:
            for entry in getattr(self, kind):
                yield kind, entry


def workspace_of(session: Session, fitting: Fitting) -> Workspace:
    """What a session holds. Raises InputError for a log that is a folder."""
    space = Workspace(session.robot)
    for log in session.logs.values():
        if not Path(log.path).is_file():
            got, remedy = log.name, "remove it from the studio, and name it again on the command line"
            raise InputError("only files can be kept in a workspace", got=got, expected="a file", remedy=remedy)
        columns = space.add("maps", log.map) if log.map else ""
        flags = {"unsigned": log.unsigned, "held_out": log.key in fitting.held_out}
        space.logs.append(
            {
                "name": log.label,
                "group": fitting.group_of(log.key),
                **flags,
                "file": space.add("logs", log.path, log.label),
                "map": columns,
            }
        )
    for name, kept in fitting.history.items():
        fit = kept.fit
        if fit.folder is None or fit.result is None:
            continue
        files = {
            key: space.add("fits", fit.folder / file, FIT_FILES[key]) if (fit.folder / file).is_file() else ""
            for key, file in {**FIT_FILES, "robot": kept.file}.items()
        }
        said = {key: fit.result[key] for key in ("verdict", "failed")}
        space.fits.append({"name": name, "note": kept.note, **said, **files})
    for name, path in session.robots.items():
        if name not in fitting.history and Path(path).is_file():
            space.robots.append({"name": name, "file": space.add("robots", path, name)})
    return space


def write(space: Workspace, path: Path) -> None:
    """Write a workspace. Raises InputError for one too large to be opened again."""
    manifest = {"schema": SCHEMA, "robot": space.robot, **{kind: getattr(space, kind) for kind in FORM}}
    try:
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, allowZip64=False, strict_timestamps=False) as archive:
            archive.writestr(MANIFEST, json.dumps(manifest, indent=1))
            for member, file in space.files.items():
                archive.write(file, member)
    except zipfile.LargeZipFile:
        raise InputError("too large for a workspace", expected=f"at most {MAX_BYTES // 2**30} GiB") from None


def read(path: str | Path, folder: Path | None = None) -> Workspace:
    """A workspace, its files unpacked into numbered folders of a folder; without one it is checked only.

    Raises InputError for what is none, or is larger than uploads may be.
    """
    name = str(path)
    try:
        with open_regular(path) as stream:
            _check_end(stream)
            with zipfile.ZipFile(stream) as archive:
                members = _members(archive)
                space = _manifest(archive, members)
                for number, (member, entry) in enumerate(members.items(), 1):
                    space.files[member] = _unpack(archive, entry, folder and folder / str(number), member)
    except (zipfile.BadZipFile, EOFError, OSError, NotImplementedError, RuntimeError, UnicodeError) as error:
        raise _none(f"{type(error).__name__}: {error}").at(name) from None
    except InputError as error:
        raise error.at(name) from None
    return space


def _none(got: str, expected: str = "a file that the studio wrote") -> InputError:
    return InputError("not a workspace", got=got, expected=expected, remedy="save the workspace again in the studio")


def _check_end(stream: Any) -> None:
    """Refuse an archive whose list of files alone would fill the memory."""
    stream.seek(0, io.SEEK_END)
    stream.seek(max(0, stream.tell() - END_BYTES - END_64_BYTES))
    tail = stream.read()
    end = tail[-END_BYTES:]
    if len(end) < END_BYTES or not end.startswith(END) or tail[:-END_BYTES].startswith(END_64):
        raise _none("no zip archive, or another kind of one")
    count, size = struct.unpack_from("<H", end, 10)[0], struct.unpack_from("<I", end, 12)[0]
    if count > 4 * MAX_FILES or size > MAX_DIRECTORY:
        raise _none(f"{count} files", f"at most {4 * MAX_FILES} files")
    stream.seek(0)


def _members(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """The files beside the manifest, by name. Raises InputError for other names, too many bytes, too much growth."""
    entries = archive.infolist()
    names = [entry.filename for entry in entries]
    for name in names:
        if (name != MANIFEST and not MEMBER.fullmatch(name)) or names.count(name) > 1:
            raise _none(f"a file {name[:80]!r}", "names of a workspace, each once")
    size, packed = sum(entry.file_size for entry in entries), sum(entry.compress_size for entry in entries)
    if size > MAX_BYTES or any(entry.file_size > MAX_FILE_BYTES for entry in entries):
        raise _none(f"{size} bytes", f"at most {MAX_FILE_BYTES} bytes in a file and {MAX_BYTES} in all")
    if size > GROWING and size > MAX_GROWTH * packed:
        raise _none(f"{packed} bytes that become {size}", f"at most {MAX_GROWTH} times as many")
    if any(entry.flag_bits & 1 for entry in entries):
        raise _none("an encrypted file")
    return {entry.filename: entry for entry in entries if entry.filename != MANIFEST}


def _manifest(archive: zipfile.ZipFile, members: Mapping[str, Any]) -> Workspace:
    """What the manifest says. Raises InputError where it has another form, or names other files than there are."""
    if MANIFEST not in archive.namelist():
        raise _none("no manifest")
    with archive.open(MANIFEST) as stream:
        content = stream.read(MAX_MANIFEST + 1)
    try:
        table = json.loads(content) if len(content) <= MAX_MANIFEST else None
    except (ValueError, RecursionError):
        table = None
    if not isinstance(table, dict) or table.get("schema") != SCHEMA or not isinstance(table.get("robot"), str):
        raise _none("another manifest", f"schema {SCHEMA}")
    logs, robots, fits = (_entries(table.get(kind), kind) for kind in FORM)
    space = Workspace(table["robot"], logs, robots, fits)
    named = [entry[key] for kind, entry in space.entries for key in (*FORM[kind][2], *FORM[kind][3]) if entry[key]]
    if sorted(named) != sorted(members):
        raise _none(f"{len(named)} files in the manifest, {len(members)} in the archive", "the same, each once")
    return space


def _entries(value: Any, kind: str) -> list[dict[str, Any]]:
    """A list of the manifest, each entry with what it must have and no more."""
    text, flags, files, absent = FORM[kind]
    if not isinstance(value, list) or len(value) > MAX_FILES:
        raise _none(f"{kind} of another form", f"a list of at most {MAX_FILES}")
    types = {**dict.fromkeys((*text, *files, *absent), str), **dict.fromkeys(flags, bool)}
    for entry in value:
        if kind == "fits" and isinstance(entry, dict):
            entry.setdefault("note", "")  # a workspace from before there were notes
        if kind == "logs" and isinstance(entry, dict):
            entry.setdefault("group", "")  # and groups
        if not isinstance(entry, dict) or {key: type(item) for key, item in entry.items()} != types:
            raise _none(f"an entry of {kind} of another form", ", ".join(types))
        if not all(entry[key] for key in files):
            raise _none(f"an entry of {kind} without its file")
    return value


def _unpack(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, folder: Path | None, member: str) -> Path:
    """Write a file of the archive, at most as long as it says it is; without a folder, only read it."""
    if folder is None:
        with archive.open(entry) as source:
            while source.read(2**20):
                pass
        return Path()
    folder.mkdir(parents=True)
    path = folder / safe_name(member.partition("-")[2])
    with archive.open(entry) as source, path.open("xb") as target:
        shutil.copyfileobj(source, target)
    return path


def adopt(space: Workspace, session: Session, fitting: Fitting) -> None:
    """Add what a workspace holds to a session. Raises RefusedError where that is more than it takes."""
    count = len(space.logs) + len(space.robots) + len(space.fits)
    session.make_room(count, sum(path.stat().st_size for path in space.files.values()))
    names = {}
    for entry in space.robots:
        name = session.free_name(safe_name(entry["name"]))
        session.robots[name] = str(space.files[entry["file"]])
        names[entry["name"]] = name
    for entry in space.fits:
        fit = _fit(entry, space.files)
        (name,) = fitting.keep(fit, safe_name(entry["name"]))
        names[entry["name"]] = name
        fitting.note(name, entry["note"])
        fitting.last = fitting.last if fitting.last.running else fit
    chosen = names.get(space.robot, space.robot)
    session.robot = chosen if chosen in session.robots else session.robot
    held_out = fitting.held_out
    for entry in space.logs:
        log = session.add_log(str(space.files[entry["file"]]), safe_name(entry["name"]))
        log.map, log.unsigned = str(space.files[entry["map"]]) if entry["map"] else "", entry["unsigned"]
        held_out += [log.key] * entry["held_out"]
        fitting.name_group(log.key, entry["group"])
    fitting.hold_out(held_out)
    session.changed_all()


def _fit(entry: Mapping[str, Any], files: Mapping[str, Path]) -> Task:
    """A fit with its files in a folder, as the tab Fit shows it."""
    folder = files[entry["robot"]].parent
    for key, name in FIT_FILES.items():
        if entry[key] and files[entry[key]] != folder / name:
            shutil.move(files[entry[key]], folder / name)
    warnings = _table(folder / FIT_FILES["warnings"], ("severity", "text"))
    shown = {
        "verdict": entry["verdict"],
        "failed": entry["failed"],
        "severity": ERROR if entry["failed"] else NOTE,
        "interrupted": False,
        "numbers": _table(folder / FIT_FILES["numbers"]),
        "warnings": [dict(zip(warnings["head"], row, strict=True)) for row in warnings["rows"]],
        "advice": [],
        "remedies": [],
        "report": bool(entry["report"]),
    }
    return Task(result=shown, folder=folder)  # no command: one of a stranger would be run by hand


def _table(path: Path, columns: Sequence[str] = ()) -> dict[str, Sequence[Any]]:
    """A table as it was written; empty for what is none, or has other columns."""
    with path.open("rb") as file:
        text = file.read(MAX_TABLE).decode("utf-8", "replace")
    try:
        head, *rows = csv.reader(io.StringIO(text), strict=True)
    except (csv.Error, ValueError):
        head, rows = [], []
    if columns and head != [*columns]:
        head, rows = [], []
    return {"head": head, "rows": [row for row in rows if len(row) == len(head)]}
