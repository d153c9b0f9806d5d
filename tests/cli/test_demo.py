"""The demo: what it writes, what it may replace, what it must not touch."""

import json
import signal

import pytest

from omnidyn.cli import main
from omnidyn.cli.demo_folder import MARKER, check_folder, write_folder
from omnidyn.cli.terminal.streams import width
from omnidyn.errors import InputError
from omnidyn.paper.claim import ClaimVerdict
from omnidyn.paper.claims import all_claims, claims_document
from tests.support.outputs import strict

FIGURES = ["fig1_robot", "fig2_traces", "fig3_friction", "fig4_steps", "fig5_dead_zone", "fig6_reconcile"]
FILES = {f"figures/{name}.{form}" for name in FIGURES for form in ("png", "svg")}
FILES |= {MARKER, "report.html", "result.json"}


def files_of(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder in which `omnidyn demo` has run, and what it said."""
    place = tmp_path_factory.mktemp("demo")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        assert main(["demo"]) == 0
    return place / "omnidyn-demo"


def test_it_writes_report_numbers_and_figures(made):
    assert set(files_of(made)) == FILES


def test_the_result_holds_every_claim_and_where_it_comes_from(made):
    result = strict((made / "result.json").read_text("utf-8"))
    assert [claim["key"] for claim in result["claims"]] == [claim.key for claim in all_claims()]
    assert sum(result["verdicts"].values()) == len(result["claims"])
    assert [figure["name"] for figure in result["figures"]] == FIGURES
    assert result["provenance"]["command"] == "omnidyn demo"
    assert result["provenance"]["inputs"][0]["name"] == "axebot"


def test_a_second_run_replaces_it_with_the_same_bytes_and_keeps_what_others_put_there(made, monkeypatch, capsys):
    monkeypatch.chdir(made.parent)
    before = files_of(made)
    (made / "notes.txt").write_text("mine")
    (made / "report.html").write_text("damaged")
    assert main(["demo"]) == 0
    assert files_of(made) == {**before, "notes.txt": b"mine"}
    (made / "notes.txt").unlink()
    out, err = capsys.readouterr()
    assert "cannot be reproduced" in out
    assert "omnidyn: open omnidyn-demo" in err


def test_for_machines_it_prints_the_result(made, monkeypatch, capsys):
    monkeypatch.chdir(made.parent)
    assert main(["demo", "--json", "--out", "other"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((made.parent / "other" / "result.json").read_text("utf-8"))


@pytest.mark.parametrize("arguments", [[], ["--out", "."], ["--out", "sub"]])
def test_a_folder_with_other_things_in_it_is_refused_at_once(tmp_path, monkeypatch, capsys, arguments):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("omnidyn.paper.claims.all_claims", None)  # would be a bug, exit 1
    for name in ("omnidyn-demo", "sub"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "thesis.txt").write_text("mine")
    before = files_of(tmp_path)
    assert main(["demo", *arguments]) == 3
    assert "the folder has other things in it" in capsys.readouterr().err
    assert files_of(tmp_path) == before


@pytest.mark.parametrize(
    "out, words",
    [("file", "got a file"), ("none/demo", "mkdir -p"), ("x" * 4000, "too long"), ("a\0b", "null")],
)
def test_a_bad_place_is_refused(tmp_path, monkeypatch, out, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match=words):
        check_folder(out)
    assert files_of(tmp_path) == {"file": b"mine"}


def test_force_writes_into_any_folder_and_removes_nothing(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    write_folder(check_folder(str(tmp_path), force=True), {"report.html": b"1", "figures/a.png": b"2"})
    assert set(files_of(tmp_path)) == {"thesis.txt", MARKER, "report.html", "figures/a.png"}


def test_what_an_earlier_demo_wrote_and_this_one_does_not_is_removed(tmp_path):
    write_folder(tmp_path, {"report.html": b"1", "figures/old.png": b"2"})
    write_folder(check_folder(str(tmp_path)), {"report.html": b"3"})
    assert set(files_of(tmp_path)) == {MARKER, "report.html"}


@pytest.mark.parametrize("marker", ["", "[", "{}", "null", '["../victim", "/etc/x", 5, "", null]', "[" * 100_000])
def test_a_damaged_marker_removes_nothing_outside(tmp_path, marker):
    (tmp_path / "victim").write_text("mine")
    folder = tmp_path / "demo"
    folder.mkdir()
    (folder / MARKER).write_text(marker)
    write_folder(check_folder(str(folder)), {"report.html": b"1"})
    assert (tmp_path / "victim").read_text() == "mine"
    assert set(files_of(folder)) == {MARKER, "report.html"}


def test_a_demo_that_was_killed_can_be_done_again(tmp_path, monkeypatch):
    import omnidyn.cli.demo_folder as module

    folder = tmp_path / "demo"
    real = module.write_atomic

    def dies_at_the_second_file(path, content, force=False):
        if str(path).endswith("b.png"):
            raise KeyboardInterrupt
        return real(path, content, force)

    monkeypatch.setattr(module, "write_atomic", dies_at_the_second_file)
    with pytest.raises(KeyboardInterrupt):
        write_folder(folder, {"a.html": b"1", "b.png": b"2"})
    monkeypatch.setattr(module, "write_atomic", real)
    write_folder(check_folder(str(folder)), {"a.html": b"1", "b.png": b"2"})
    assert set(files_of(folder)) == {MARKER, "a.html", "b.png"}


def test_sigterm_in_the_middle_unwinds(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("omnidyn.paper.claims.all_claims", lambda: signal.raise_signal(signal.SIGTERM))
    assert main(["demo"]) == 143
    assert files_of(tmp_path) == {}
    assert capsys.readouterr().err == "omnidyn: terminated\n"


# ---- the table of claims --------------------------------------------------------------------------------


@pytest.mark.parametrize("columns", [20, 40, 110])
def test_the_table_fits_the_terminal(monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    lines = claims_document(all_claims()).to_text(width()).splitlines()
    assert max(map(len, lines)) <= columns


def test_the_table_has_every_claim_and_the_counts():
    claims = all_claims()
    table = claims_document(claims).to_text(4000)
    for claim in claims:
        assert f"{claim.place}: {claim.statement}" in table
    for verdict in ClaimVerdict:
        assert f"{sum(claim.verdict == verdict for claim in claims)} {verdict.value}" in table
