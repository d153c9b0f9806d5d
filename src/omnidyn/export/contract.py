"""The contract of a kind of export, and Export, what a kind gives. One file per kind.

A kind is a function of a robot, and of options that have defaults. It must:

1. give its files as text (or bytes, where the format is an archive), and write none: `Export.write` does;
2. take every number from the robot, by the functions of the model: no physics is written a second time;
3. begin with `refuse`: what it refuses stands in the table of features.py, and nowhere else;
4. say what it leaves out in two places, as comments in the file and in `Export.missing`, in the same words;
5. spell numbers and names by spelling.py, and fill templates by `filled`: a name is data, whatever it holds;
6. give the same bytes for the same robot: no dates, no paths, no names of machines.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from omnidyn.document import Document, Part, Points
from omnidyn.errors import InputError
from omnidyn.files import TEMPORARY_PREFIX, check_output, write_atomic
from omnidyn.shown import Displayable

Content = str | bytes


@dataclass(frozen=True, repr=False)
class Export(Displayable):
    """The files of one export, and what they leave out.

    files: name -> content. A kind with one file is written to a file, one with several (`folder`) into a folder.
    missing: what the format cannot say of this robot. notes: what to know when using it.
    """

    kind: str
    robot: str
    files: Mapping[str, Content]
    missing: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    folder: bool = False

    def __repr__(self) -> str:
        return f"<Export {self.kind} of {self.robot}: {', '.join(self.files)}>"

    @property
    def text(self) -> str:
        """The content of the only file. Raises InputError where there are several, or it is no text."""
        (content,) = self.files.values() if len(self.files) == 1 else (b"",)
        if isinstance(content, bytes):
            raise InputError(
                f"{self.kind} is not a single text",
                got=", ".join(self.files),
                expected="a file or a folder to write to",
                remedy="use write(path)",
            )
        return content

    def write(self, path: str | os.PathLike, force: bool = False) -> list[Path]:
        """Write the file, or the files into a folder, each whole or not at all; the paths that were written.

        A folder that is not there is made. Raises InputError where a file exists (unless `force`) or cannot be written;
        then none is written.
        """
        if not self.folder:
            (content,) = self.files.values()
            return [write_atomic(path, content, force)]
        folder = check_place(path, self.files, force)
        if folder.is_dir():
            return [write_atomic(folder / name, content, force) for name, content in self.files.items()]
        return _new_folder(folder, self.files)

    def document(self) -> Document:
        """What was made, and what it leaves out."""
        parts: list[Part] = [f"{self.robot} as {self.kind}: {', '.join(self.files)}"]
        if self.missing:
            parts += ["", "What this cannot say:", Points(self.missing, name="missing")]
        if self.notes:
            parts += ["", Points(self.notes, name="notes")]
        data = {
            "kind": self.kind,
            "robot": self.robot,
            "files": list(self.files),
            "missing": list(self.missing),
            "notes": list(self.notes),
        }
        return Document(parts, data)


def check_place(path: str | os.PathLike, files: Mapping[str, Content], force: bool) -> Path:
    """Refuse, before anything is written, a folder where not all of the files could be. Raises InputError."""
    folder = Path(path)
    try:
        is_there, is_folder = folder.exists(), folder.is_dir()
    except (OSError, ValueError) as error:
        raise InputError("not a folder name", got=str(error), where=str(path)[:80]) from None
    if is_there and not is_folder:
        raise InputError("this export is several files", got="a file", expected="a folder", where=str(path))
    if not is_there:
        check_output(folder)
        return folder
    for name in files:
        check_output(folder / name, force)
    return folder


def _new_folder(folder: Path, files: Mapping[str, Content]) -> list[Path]:
    """A folder that is there with all of its files, or not at all: made under another name, then renamed."""
    temporary = ""
    try:
        temporary = tempfile.mkdtemp(prefix=TEMPORARY_PREFIX, dir=folder.absolute().parent)
        for name, content in files.items():
            write_atomic(Path(temporary) / name, content)
        os.chmod(temporary, 0o755)
        os.rename(temporary, folder)
    except OSError as error:
        raise InputError("cannot make the folder", got=error.strerror or str(error), where=str(folder)) from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return [folder / name for name in files]
