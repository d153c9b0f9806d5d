"""docs/how-to/train-a-policy.md: its Python runs as it stands, in an empty folder."""

import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[3] / "docs" / "how-to" / "train-a-policy.md"


def test_the_python_of_the_page_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    assert len(blocks) == 6
    names = {}
    for block in blocks:
        exec(block, names)
    assert names["observation"].shape == (4096, 9)
    assert capsys.readouterr().out == "(256, 256, 3)\npid\n"
