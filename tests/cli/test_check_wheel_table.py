"""omnidyn check --wheel-table: a table beside the verdict, or a word on why there is none."""

import json

import numpy as np
import pytest

import omnidyn


@pytest.mark.parametrize(
    ("files", "code", "words"),
    [
        (["fine.csv"], 0, ""),
        (["short.csv"], 4, "wheel 1 has too few speeds forward"),
        (["voltage.csv"], 3, "no speeds were asked for in this log"),
        (["fine.csv", "none.csv"], 3, "none.csv: no such file"),
    ],
)
@pytest.mark.parametrize("json_", [False, True])
def test_a_log_that_gives_no_table_is_checked_all_the_same(call, here, files, code, words, json_):
    asked = np.repeat(np.repeat([[0.0], [1.0], [2.0], [-1.0], [-2.0]], 40, axis=0), 3, axis=1)
    t = 0.05 * np.arange(200)
    omnidyn.write_run(omnidyn.Run(t=t, wheel_speed_command=asked, wheel_speed=0.8 * asked), "fine.csv")
    omnidyn.write_run(omnidyn.Run(t=t, wheel_speed_command=asked, wheel_speed=0.0 * asked), "short.csv")
    omnidyn.write_run(omnidyn.Run(t=t, voltage=asked, wheel_speed=asked), "voltage.csv")
    options = ["--robot", "lekiwi", "--wheel-table", "wheels.csv", *(["--json"] if json_ else [])]
    got, out, err = call("check", *files, *options)
    assert (got == code) if code else got in (0, 4)  # its verdict may be a warning
    assert err.count(words) == 1 if words else "error:" not in err
    assert (here / "wheels.csv").exists() == (not words)
    assert out
    if json_:
        assert ("wheel_table" in json.loads(out)) == (not words)
