"""No file of the project names a package registry or a folder of somebody's machine."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# In pieces, so that this file does not find itself.
HOSTS = [
    "pypi" + ".org",
    "python" + "hosted.org",
    "npm" + "js.org",
    "npm" + "js.com",
    "deb." + "debian.org",
    "proxy." + "golang.org",
    "crates" + ".io",
    "conda" + ".anaconda.org",
    "pypi." + "nvidia.com",
]
HOST = re.compile("|".join(map(re.escape, HOSTS)))
# A folder that exists on one machine only. Not part of a longer path or of an address.
MACHINE_PATH = re.compile(r"(?<![\w.~/:-])(?:/(?:root|work|mnt|home/\w+|Users/\w+)(?=[/\s\"'`)]|$)|[A-Z]:\\Users\\)")


def project_files() -> list[Path]:
    """What git tracks or would track."""
    ask = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    try:
        listed = subprocess.run(ask, cwd=ROOT, capture_output=True, check=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    return [ROOT / name for name in listed.split("\0") if name and (ROOT / name).is_file()]


def found(pattern: re.Pattern[str], text: str) -> list[str]:
    return [match.group() for match in pattern.finditer(text)]


@pytest.mark.parametrize("pattern", [HOST, MACHINE_PATH], ids=["registry", "machine path"])
def test_no_file_names_one(pattern):
    hits = {
        str(path.relative_to(ROOT)): names
        for path in project_files()
        if (names := found(pattern, path.read_text("utf-8", errors="ignore")))
    }
    assert not hits


def test_the_patterns_find_what_they_should():
    assert found(HOST, "https://" + HOSTS[0] + "/simple")
    assert found(MACHINE_PATH, 'open("/' + 'root/x")')
    assert found(MACHINE_PATH, "in /" + "home/anna/robot")
    assert not found(MACHINE_PATH, "/usr/bin/python3, ~/work/x, m/s, src/root/a.py")
