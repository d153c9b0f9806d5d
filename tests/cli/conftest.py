"""The commands, in process and in a folder of their own."""

import pytest

from omnidyn.cli import main


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An own folder, in which the test runs."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def call(here, capsys):
    """Run a command: (exit code, stdout, stderr)."""

    def run(*arguments):
        code = main(list(arguments))
        return code, *capsys.readouterr()

    return run
