"""What `python3 dev.py release` does: build the wheel and the archive of sources twice, look into them, try the wheel.

Standard library only. What is built is the last commit, not the folder: a tree with changes is refused. RELEASING.md
says what to do before and after.
"""

import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent
BIN, EXE = ("Scripts", ".exe") if os.name == "nt" else ("bin", "")
PYTHONS = ("python3.11", "python3.12", "python3.13", "python3.14")

IN_WHEEL = (
    "omnidyn/py.typed",
    "omnidyn/__init__.py",
    "omnidyn/model/presets/axebot.toml",
    "LICENSE",
    "entry_points.txt",
)
IN_SOURCES = ("README.md", "CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "CODE_OF_CONDUCT.md", "LICENSE")
IN_SOURCES += ("RELIABILITY.md", "RELEASING.md", "SECURITY.md", "dev.py", "release.py", "pyproject.toml")
IN_SOURCES += (
    "locks/core.txt",
    "examples/first_run.py",
    "tests/conftest.py",
    "benchmarks/__main__.py",
    "docs/index.md",
    "recipe/recipe.yaml",
)

TRIAL = """
import importlib.metadata, pathlib, sys
import numpy as np
import omnidyn
place = pathlib.Path(omnidyn.__file__).parent
assert pathlib.Path(sys.prefix) in place.parents, f"not the one that was installed: {place}"
assert (place / "py.typed").is_file()
assert importlib.metadata.version("omnidyn") == omnidyn.__version__
robot = omnidyn.load_robot("axebot")
run = omnidyn.simulate(robot, [[0.0, 3.0, -3.0]] * 1500, 1e-3)
assert abs(run.twist[-1, 0] - 0.7613) < 1e-4, run.twist[-1]
assert not omnidyn.simulate(robot, [[0.0, 0.6, -0.6]] * 1500, 1e-3).pose.any()
print(f"omnidyn {omnidyn.__version__} on Python {sys.version.split()[0]}: it moves, and rests")
"""


def say(words):
    sys.stderr.write(f"release: {words}\n")
    sys.stderr.flush()


def refuse(words):
    sys.exit(f"release: {words}")


def version():
    """The one in pyproject.toml."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]


def disagreements(root=ROOT):
    """What does not agree with the version of pyproject.toml, in words."""
    stated = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    places = {
        "src/omnidyn/__init__.py": r'^__version__ = "(.+)"$',
        "CITATION.cff": r"^version: (.+)$",
        "recipe/recipe.yaml": r'^  version: "(.+)"$',
        "CHANGELOG.md": r"^##+ .*?(\d+\.\d+\.\d+)",  # the first version that a heading names
    }
    found = {}
    for place, pattern in places.items():
        match = re.search(pattern, (root / place).read_text("utf-8"), re.MULTILINE)
        found[place] = match.group(1) if match else "none"
    return [f"{place} says {words}, pyproject.toml {stated}" for place, words in found.items() if words != stated]


def git(*arguments):
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def refuse_a_dirty_tree():
    changes = git("status", "--porcelain")
    if changes:
        refuse(f"the tree has changes; commit or remove them first:\n{changes}")


def environment(folder, env, python=sys.executable):
    """A fresh environment with pip; its Python."""
    subprocess.run([python, "-m", "venv", str(folder)], env=env, check=True)
    return str(folder / BIN / f"python{EXE}")


def built(python, folder, env):
    """Wheel and archive of the last commit, unpacked into a folder of its own: name -> bytes."""
    folder.mkdir()
    archive = folder / "commit.tar"
    git("archive", "--output", str(archive), "HEAD")
    with tarfile.open(archive) as tar:
        tar.extractall(folder / "tree", filter="data")
    epoch = {**env, "SOURCE_DATE_EPOCH": git("log", "-1", "--format=%ct")}
    call = [python, "-m", "hatchling", "build", "-d", str(folder / "dist")]
    subprocess.run(call, cwd=folder / "tree", env=epoch, check=True, stdout=subprocess.DEVNULL)
    return {path.name: path.read_bytes() for path in sorted((folder / "dist").iterdir())}


def names_in(path):
    """What a wheel or an archive of sources holds; the folder that names the version is left out."""
    if path.suffix == ".whl":
        with zipfile.ZipFile(path) as wheel:
            return [re.sub(r"^omnidyn-[^/]+\.dist-info/(licenses/)?", "", name) for name in wheel.namelist()]
    with tarfile.open(path) as archive:
        return [name.partition("/")[2] for name in archive.getnames()]


def lacks(names, wanted):
    """What should be there and is not, and what should not be there."""
    unwanted = [name for name in names if re.search(r"__pycache__|\.pyc$|(^|/)\.venv|^docs/_build|\.kernel$", name)]
    return [f"no {name}" for name in wanted if name not in names] + [f"has {name}" for name in unwanted]


def found_pythons():
    """Those of PYTHONS that are installed and start: a shim may be there without the Python behind it."""
    here = [found for each in PYTHONS if (found := shutil.which(each))]
    works = [each for each in here if not subprocess.run([each, "-c", ""], capture_output=True).returncode]
    return works or [sys.executable]


def tried(wheel, folder, env, python):
    """Install the wheel, with the locked versions of what it needs, and use it from a folder that is not the tree."""
    inside = environment(folder / "env", env, python)
    pip = [inside, "-m", "pip", "install", "-q"]
    subprocess.run(
        [*pip, "--require-hashes", "--only-binary", ":all:", "-r", str(ROOT / "locks" / "core.txt")],
        env=env,
        check=True,
    )
    subprocess.run([*pip, "--no-deps", str(wheel)], env=env, check=True)
    outside = {name: value for name, value in env.items() if name != "PYTHONPATH"}
    command = str(folder / "env" / BIN / f"omnidyn{EXE}")
    for call in ([inside, "-c", TRIAL], [command, "--version"], [command, "deadzone", "axebot"]):
        subprocess.run(call, cwd=folder, env=outside, check=True)


def main(arguments, env):
    if arguments:
        refuse(f"no arguments are taken, got {' '.join(arguments)}")
    refuse_a_dirty_tree()
    if disagreements():
        refuse("; ".join(disagreements()))
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        python = environment(work / "builder", env)
        subprocess.run([python, "-m", "pip", "install", "-q", "hatchling>=1.25"], env=env, check=True)
        first, second = (built(python, work / each, env) for each in ("first", "second"))
        if first != second:
            refuse(f"two builds differ: {[key for key in first if first[key] != second.get(key)]}")
        out = ROOT / "dist"
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir()
        for file, content in first.items():
            (out / file).write_bytes(content)
            names = names_in(out / file)
            missing = lacks(names, IN_WHEEL if file.endswith(".whl") else IN_SOURCES)
            if missing:
                refuse(f"{file}: {', '.join(missing)}")
            print(f"{file}: {len(content)} bytes, {len(names)} files, sha256 {hashlib.sha256(content).hexdigest()}")
        (wheel,) = out.glob("*.whl")
        for k, each in enumerate(found_pythons()):
            (work / f"trial{k}").mkdir()
            tried(wheel, work / f"trial{k}", env, each)
    say("built twice with equal hashes, looked into and tried; both files are in dist/")
    return 0
