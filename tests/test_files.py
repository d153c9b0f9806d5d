"""Files that are written: what is refused, what stays of the file that was there."""

import contextlib
import errno
import os
import stat
import tracemalloc

import pytest

from omnidyn.errors import InputError
from omnidyn.files import check_output, keep_apart, open_atomic, parse_toml, write_atomic
from tests.support.growth import LINEAR, growth

posix = pytest.mark.skipif(os.name != "posix", reason="modes, links and pipes of POSIX")


@posix
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o444])
def test_a_file_that_is_replaced_hands_on_its_mode(tmp_path, mode):
    path = tmp_path / "secret.csv"
    path.write_text("old")
    path.chmod(mode)
    write_atomic(path, "new", force=True)
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == mode


@posix
def test_a_link_stays_and_what_it_leads_to_is_written(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "run.csv").write_text("old")
    (tmp_path / "run.csv").symlink_to("there/run.csv")
    write_atomic(tmp_path / "run.csv", "new", force=True)
    assert (tmp_path / "run.csv").is_symlink()
    assert (tmp_path / "there" / "run.csv").read_text() == "new"


@posix
def test_a_link_to_nothing_makes_what_it_leads_to(tmp_path):
    (tmp_path / "run.csv").symlink_to("new.csv")
    write_atomic(tmp_path / "run.csv", "new")
    assert (tmp_path / "run.csv").is_symlink()
    assert (tmp_path / "new.csv").read_text() == "new"


@posix
def test_links_in_a_circle_are_refused(tmp_path):
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(InputError, match="links in a circle"):
        write_atomic(tmp_path / "a", "new", force=True)


@posix
@pytest.mark.parametrize("force", [False, True])
def test_what_is_no_regular_file_is_refused(tmp_path, force):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("pipe")
    for path in (tmp_path / "pipe", tmp_path / "link", "/dev/null"):
        with pytest.raises(InputError, match="no regular file"):
            check_output(path, force)
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


@posix
def test_an_input_is_no_place_for_a_result(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "u.csv").write_text("")
    (tmp_path / "link.csv").symlink_to("u.csv")
    os.link("u.csv", "hard.csv")
    for name in ("u.csv", "./u.csv", "link.csv", "hard.csv", tmp_path / "u.csv"):
        with pytest.raises(InputError, match="replace its own input"):
            keep_apart([name], ["u.csv"])
    keep_apart(["other.csv", ""], ["u.csv", ""])


def test_two_results_need_two_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="two results in one file"):
        keep_apart(["fit.toml", "./fit.toml"])


DEEP = {
    "dotted": "a" + ".a" * 20_000 + " = 1\n",
    "quoted": '"a"' + " . 'a'" * 20_000 + " = 1\n",
    "table": "[a" + ".a" * 20_000 + "]\nx = 1\n",
    "tables": "[[ a" + ".a" * 20_000 + "]]\nx = 1\n",
    "inline": "x = { a" + ".a" * 20_000 + " = 1 }\n",
    "behind another": "x = { b = 1, a" + ".a" * 20_000 + " = 1 }\n",
}


@pytest.mark.parametrize("text", DEEP.values(), ids=DEEP)
def test_a_key_that_nests_deeply_is_refused_before_it_is_parsed(text):
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=r"robot.toml:2: a key nests too deeply"):
            parse_toml("# a robot\n" + text, "robot.toml")
        assert tracemalloc.get_traced_memory()[1] < 10 * len(text) + 100_000
    finally:
        tracemalloc.stop()


def test_the_search_for_deep_keys_takes_no_time():
    for piece in ("\n", " ", "[", "a", ',"', "a." * 15 + "\n{ ", "{ "):

        def read(size, number, piece=piece):
            with contextlib.suppress(InputError):
                parse_toml(piece * size, "")

        assert growth(read, 2**19) <= LINEAR, piece


def test_what_stands_in_text_and_numbers_is_no_key():
    words = ".".join("abcdefghijklmnopqrstuvwxyz")
    assert parse_toml(f'x = "{words}"\ny = 1.5  # {words}', "") == {"x": words, "y": 1.5}


@pytest.mark.parametrize("where", ["fsync", "replace", "write"])
def test_where_writing_fails_the_old_file_stays(tmp_path, monkeypatch, where):
    """A disk that is full at any of the three moments; nothing is left beside the old file either."""
    path = tmp_path / "fit.toml"
    path.write_text("old")

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    def replaced():
        with open_atomic(path, True) as stream:
            stream.write(b"new")
            if where == "write":
                full()

    with monkeypatch.context() as patch:
        if where != "write":
            patch.setattr(os, where, full)
        with pytest.raises(InputError, match="cannot write it; got No space left"):
            replaced()
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["fit.toml"]
