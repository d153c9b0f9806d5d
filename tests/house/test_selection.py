"""Whether a model predicts held-out blocks better, `compare_blocks` says; no file has another rule.

Another rule is the standard error of a sum over blocks, or a share or standard errors by which a model must win.
"""

import re
from pathlib import Path

IDENTIFICATION = Path(__file__).resolve().parents[2] / "src" / "omnidyn" / "identification"
RULE = re.compile(
    r"std\(ddof=1\)\)? \* np\.sqrt\(len\(|^(PAYS|TIE|\w*(GAIN|BETTER|LOSS|SHAPE)_ERRORS) = ", re.MULTILINE
)
OTHER_QUESTIONS = {"output_error/problem/driving_voltages.py"}


def test_no_further_file_has_a_rule_of_its_own():
    files = {path.relative_to(IDENTIFICATION).as_posix(): path for path in IDENTIFICATION.rglob("*.py")}
    found = {name for name, path in files.items() if RULE.search(path.read_text("utf-8"))} - OTHER_QUESTIONS
    assert not found
