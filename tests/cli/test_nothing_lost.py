"""Nothing is lost: inputs stay, results are written whatever happens to pages, pictures and talk."""

import os
import subprocess
import sys

import pytest

from omnidyn.errors import InputError
from omnidyn.model.presets import PRESETS
from tests.cli.test_process import VOLTAGES, environment

LOG = "axis,speed,force\nx,0,2.25\nx,0.37,2.48\nx,0.74,2.79\nx,1.08,3.28\n"


@pytest.fixture
def here(here):
    """An own folder with a voltage file and a robot."""
    (here / "u.csv").write_text(VOLTAGES)
    (here / "r.toml").write_text((PRESETS / "axebot.toml").read_text())
    return here


@pytest.fixture
def driven(here, call):
    """The folder, with a log of that robot in it too."""
    (here / "turn.csv").write_text(
        "t_s,u1_V,u2_V,u3_V\n"
        + "".join(f"{k / 100},{4 * (k // 50 % 2)},{3 - 6 * (k // 70 % 2)},{-4 * (k // 90 % 2)}\n" for k in range(600))
    )
    assert call("simulate", "r.toml", "turn.csv", "-o", "log.csv")[0] == 0
    return here


@pytest.mark.parametrize("out", ["u.csv", "r.toml", "link.csv"])
def test_simulate_does_not_replace_what_it_reads(call, here, out):
    (here / "link.csv").symlink_to("u.csv")
    before = (here / out).read_text()
    code, _, err = call("simulate", "r.toml", "u.csv", "-o", out, "--force")
    assert code == 3
    assert "replace its own input" in err
    assert (here / out).read_text() == before


@pytest.mark.parametrize(
    "arguments",
    [
        ["identify", "log.csv", "--robot", "r.toml", "-o", "r.toml"],
        ["compare", "log.csv", "--robot", "r.toml", "--picture", "log.csv"],
        ["check", "log.csv", "--robot", "r.toml", "--save-map", "r.toml"],
        ["deadzone", "r.svg", "--map", "r.svg"],
        ["init", "new", "--like", "r.toml", "-o", "r.toml"],
    ],
)
def test_no_command_replaces_what_it_reads(call, driven, arguments):
    (driven / "r.svg").write_text((driven / "r.toml").read_text())
    before = {path.name: path.read_bytes() for path in driven.iterdir()}
    assert call(*arguments, "--force")[0] == 3
    assert {path.name: path.read_bytes() for path in driven.iterdir()} == before


def test_two_results_of_one_name_are_refused(call, driven):
    code, _, err = call("identify", "log.csv", "--robot", "r.toml", "-o", "x.html", "--report", "./x.html")
    assert code == 3
    assert "two results in one file" in err


def test_groups_of_one_name_are_refused():
    from omnidyn.cli.identify_show import Out, outputs

    with pytest.raises(InputError, match="two results in one file"):
        outputs(Out("", "x.toml", True, False), ["a b", "a-b"])


@pytest.mark.long  # of a log without noise; test_result_first.py has it of a short one
def test_a_page_that_cannot_be_drawn_costs_no_fit(call, driven, monkeypatch):
    import omnidyn.report.fit_page as page

    def breaks(*_):
        raise RuntimeError("a font is missing")

    monkeypatch.setattr(page, "render_fit", breaks)
    code, out, err = call("identify", "log.csv", "--robot", "r.toml", "-o", "fit.toml", "--report", "fit.html")
    assert code == 0
    assert "omnidyn: not made: the page: bug: RuntimeError: a font is missing" in err
    assert "Not made: the page (bug: RuntimeError: a font is missing)" in " ".join(out.split())
    assert "Coulomb" in out or "coulomb" in out
    assert (driven / "fit.toml").is_file()
    assert not (driven / "fit.html").exists()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
@pytest.mark.parametrize("redirect", ["2>/dev/full", "2>&-", ">/dev/full", "2>/dev/full >/dev/full"])
def test_a_full_stream_costs_no_result(here, redirect):
    command = [sys.executable, "-m", "omnidyn", "simulate", "r.toml", "u.csv", "-o", "run.csv"]
    result = subprocess.run(
        ["sh", "-c", f'exec "$@" {redirect}', "sh", *command],
        cwd=here,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (here / "run.csv").stat().st_size > 1000
    assert result.returncode == (3 if ">/dev/full" in redirect.replace("2>/dev/full", "") else 0)
    assert "Traceback" not in result.stderr


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
@pytest.mark.parametrize("redirect", ["2>/dev/full", "2>/dev/full >/dev/full"])
def test_talk_to_a_full_stream_keeps_the_exit_code(here, redirect):
    """What could not be said waits in a buffer, and Python ends with 120 where that cannot be written."""
    command = [sys.executable, "-m", "omnidyn", "simulate", "r.toml", "no.csv"]
    result = subprocess.run(
        ["sh", "-c", f'exec "$@" {redirect}', "sh", *command], cwd=here, env=environment(), timeout=120, check=False
    )
    assert result.returncode == 3


@pytest.mark.parametrize(
    "arguments",
    [
        ["simulate", "axebot", "no.csv"],
        ["simulate", "no.toml", "u.csv"],
        ["check", "no.csv"],
        ["compare", "no.csv", "--robot", "axebot"],
        ["identify", "no.csv", "--robot", "axebot"],
        ["identify", "u.csv", "--robot", "no.toml"],
        ["deadzone", "no.toml"],
        ["init", "new", "--log", "no.csv"],
    ],
)
def test_a_missing_file_is_told_before_anything_slow_is_loaded(here, arguments):
    script = (
        "import sys\nfrom omnidyn.cli import main\n"
        f"code = main({arguments!r})\n"
        "heavy = {'numpy', 'numba', 'scipy', 'matplotlib'}\n"
        "print(code, sorted(heavy & set(sys.modules)))"
    )
    result = subprocess.run(
        [sys.executable, "-c", script],
        cwd=here,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    )
    assert result.stdout == "3 []\n"
    assert result.stderr.count("\n") == 1
    assert "no such file" in result.stderr


@pytest.mark.parametrize("name", ["run.xlsx", "run.XLS", "run.db3", "run.wpilog", "run.npz", "run.json"])
def test_a_run_is_not_written_under_the_name_of_another_format(call, here, name):
    code, _, err = call("simulate", "r.toml", "u.csv", "-o", name)
    assert code == 3
    assert f"{name}: a run is not written in this format" in err
    assert "expected .csv, .parquet, .mcap or .mat" in err
    assert not (here / name).exists()
