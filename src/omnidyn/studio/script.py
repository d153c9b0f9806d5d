"""Script: the work of a session as one Python file that makes the same numbers from the same logs.

It holds maps and robots as text and calls the library; names and notes of a user stand in it as literals only.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from omnidyn.studio import calls
from omnidyn.studio.calls import LogFile
from omnidyn.studio.fit.state import Fitting, Recipe
from omnidyn.studio.task import Task

FILE_NAME = "work.py"
HEAD = '''\
"""The work of a session of omnidyn studio. Run it in a folder with the logs: python {name}

It writes its maps, paths and robots there, over files of these names.
"""

from pathlib import Path

import omnidyn
'''


@dataclass
class Files:
    """Texts that the script writes, by name. A name that has another text already gets that of a fit before it."""

    texts: dict[str, str] = field(default_factory=dict)

    def put(self, name: str, path: str, of: str) -> str:
        """Take a file; the name that it gets."""
        text = Path(path).read_text("utf-8")
        name = name if self.texts.get(name, text) == text else f"{of}-{name}"
        self.texts[name] = text
        return name

    def log(self, log: LogFile, of: str) -> LogFile:
        """The log, with the name that its map gets."""
        if not log.map:
            return log
        ending = "-columns.toml"
        return replace(log, stem=self.put(log.map_name, log.map, of).removesuffix(ending))

    def robot(self, path: str, presets: Iterable[str], of: str) -> str:
        """The preset, or the name that the file of a robot gets."""
        return path if path in presets else self.put(Path(path).name, path, of)


def script(fitting: Fitting, others: Mapping[str, Task]) -> str:
    """The Python file. others: name -> the last comparison, drift and tracking, which have calls of their own."""
    session, files, lines, last = fitting.session, Files(), list[str](), None
    for name, kept in fitting.history.items():
        recipe, stem = kept.recipe, name.removesuffix(".toml")
        lines += ["", f"print({f'{stem}: {kept.note}' if kept.note else stem!r})"]
        if recipe is None:
            lines.append("print('opened with a workspace: how it was made is not known')")
            lines.append(f"Path({name!r}).write_text({Path(session.robots[name]).read_text('utf-8')!r}, 'utf-8')")
            continue
        if recipe is not last:  # else another group of the same fit
            *before, call = _python(recipe, files, session.presets, stem).splitlines()
            lines += [*before, f"fit = {call}", "print(fit.headline)"]
        last, estimate = recipe, f"fit.groups[{kept.group!r}]" if kept.group else "fit.estimate"
        lines.append(f"print({{name: float(value) for name, value in {estimate}.value.items()}})")
        lines.append(f"omnidyn.save_robot({estimate}.robot, {name!r}, force=True)")
    for name, task in others.items():
        if task.python and task.result is not None:
            python = task.python
            for file, path in task.files.items():
                if path not in session.presets:
                    python = python.replace(repr(file), repr(files.put(file, path, name)))
            *before, call = python.splitlines()
            lines += ["", f"print({name!r})", *before, f"print({call})"]
    written = [f"Path({name!r}).write_text({text!r}, 'utf-8')" for name, text in files.texts.items()]
    return "\n".join([HEAD.format(name=FILE_NAME), *written, *lines, ""])


def _python(recipe: Recipe, files: Files, presets: Iterable[str], of: str) -> str:
    """The Python call of a fit, with the names that its files have in the script."""
    logs = {log.key: files.log(log, of) for log in recipe.logs}
    held_out = [logs[log.key] for log in recipe.held_out]
    robot = files.robot(recipe.path, presets, of)
    return calls.fit([*logs.values()], held_out, robot, recipe.free, recipe.groups)[1]
