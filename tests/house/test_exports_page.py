"""docs/exports.md: every kind has its section, and the table says what features.py says."""

import importlib.util
from pathlib import Path

from omnidyn.export.kinds import KINDS
from omnidyn.interop.kinds import READERS

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "exports.md").read_text("utf-8")


def test_the_table_is_that_of_the_code():
    spec = importlib.util.spec_from_file_location("export_table", DOCS / "export_table.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.export_table() in PAGE, "write it again: python docs/export_table.py"
    assert {kind for kinds in module.GROUPS.values() for kind in kinds} == set(KINDS)


def test_every_kind_is_on_the_page():
    for kind in KINDS:
        assert f"omnidyn export {kind} " in PAGE or kind == "json"
    for kind in READERS:
        assert f"omnidyn import {kind} " in PAGE
