"""The studio in a real browser: a long log, and from an empty page to a fitted robot.

Of the log: seconds to the first word of progress and to the first picture, and how often a second it is drawn in a pan.
Of the robot: clicks and seconds with the example log, where nothing is compiled and where all is.

Needs Chromium and playwright, as the tests of the studio do: see tests/studio/conftest.py.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks.size import scaled
from benchmarks.table import Table, machine
from tests.studio.conftest import launched, running

ROWS, STEP = scaled(3_600_000, 100_000), 0.001  # [s]
SIGNALS = ("u1_V", "u2_V", "u3_V", "vx_m_s", "vy_m_s", "omega_rad_s")
PICTURE_GOAL_S = {"parquet": 8.0, "csv": 20.0}
PROGRESS_GOAL_S, PAN_GOAL_HZ = 1.0, 25.0
CLICKS = ("#example", "role=tab[name='Fit']", "#fit:not([disabled])")
CLICK_GOAL = 9
PANS = """() => new Promise(done => {
    const plot = document.querySelector('omni-plot'), whole = plot.meta.end - plot.meta.begin;
    plot.look(plot.meta.begin, plot.meta.begin + whole / 2);
    const begun = performance.now(), frames = plot.frames;
    const step = () => {
        const share = (performance.now() - begun) / 4000;
        if (share >= 1) { done(1000 * (plot.frames - frames) / (performance.now() - begun)); return; }
        const begin = plot.meta.begin + share * whole / 2;
        plot.look(begin, begin + whole / 2);
        requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
})"""
SIGNS = (  # of progress, of a picture, of the end
    "document.querySelector('#reading, #verdict') || /\\d %/.test(document.querySelector('omni-drop').innerText)",
    "document.querySelector('omni-plot')?.frames > 0",
    "document.querySelector('#verdict')",
)


def measure() -> Table:
    """Write the log as Parquet and as CSV, and look at both: named on the command line, and dropped on the page."""
    table = Table(
        f"studio_log: {ROWS} rows, {len(SIGNALS)} channels, in a browser",
        ["file", "given", "MB", "progress s", "picture s", "checked s", "pans Hz"],
    )
    table.notes.append(machine())
    table.notes.append("progress, picture, checked: from the moment when the file is given; pans: half of the log wide")
    with tempfile.TemporaryDirectory(prefix="omnidyn-studio-log-") as folder, launched() as browser:
        with patch.dict(os.environ, NUMBA_CACHE_DIR=str(Path(folder) / "compiled")):
            for state in ("nothing compiled", "compiled by it"):
                table.notes.append(_first_fit(browser, state))
        for path in _written(Path(folder)):
            for given in ("dropped", "named"):
                _add(table, browser, path, given)
    return table


def _first_fit(browser, state: str) -> str:
    """From an empty page to a fitted robot, in words."""
    with running() as studio:
        page = browser.new_page()
        page.set_default_timeout(300_000)
        page.goto(studio.address)
        page.wait_for_selector("#example")
        begun = time.monotonic()
        for click in CLICKS:
            page.click(click)
        asked = time.monotonic()
        page.wait_for_selector("#fit-verdict")
        done = time.monotonic()
        page.close()
    met = "pass" if len(CLICKS) <= CLICK_GOAL else "MISS"
    return (
        f"example log to fitted robot, {state}: {len(CLICKS)} clicks (at most {CLICK_GOAL}: {met}), "
        f"{done - begun:.1f} s, {done - asked:.1f} s of them after the last click"
    )


def _written(folder: Path) -> list[Path]:
    """The same rows as Parquet and as CSV."""
    import pyarrow as pa
    from pyarrow import csv, parquet

    draws = np.random.default_rng(1)
    columns = {"t_s": np.round(np.arange(ROWS) * STEP, 3)}
    for name in SIGNALS[:3]:
        columns[name] = np.round(draws.uniform(-5.0, 5.0, ROWS // 500).repeat(500), 3)
    for name in SIGNALS[3:]:
        columns[name] = np.round(np.cumsum(draws.normal(0.0, 1e-3, ROWS)) + draws.normal(0.0, 0.02, ROWS), 6)
    paths = [folder / "log.parquet", folder / "log.csv"]
    parquet.write_table(pa.table(columns), paths[0], use_dictionary=False)
    csv.write_csv(pa.table(columns), paths[1])
    return paths


def _add(table: Table, browser, path: Path, given: str) -> None:
    """One file, in a studio of its own."""
    named = given == "named"
    with running(*([str(path)] if named else [])) as studio:
        begun = time.monotonic()
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.set_default_timeout(120_000)
        page.goto(studio.address)
        page.wait_for_selector("#example")
        if not named:
            page.wait_for_timeout(5000)  # a page that stands there: what a process needs is loaded
            begun = time.monotonic()
            page.set_input_files("input[type=file] >> nth=0", str(path))
        spent = []
        for sign in SIGNS:
            page.wait_for_function(sign)
            spent.append(time.monotonic() - begun)
        page.wait_for_function(SIGNS[1])  # the page is laid out anew where the verdict has come
        pans = page.evaluate(PANS)
        page.close()
    goal = PICTURE_GOAL_S[path.suffix[1:]]
    met = spent[1] <= goal and spent[0] <= PROGRESS_GOAL_S and pans >= PAN_GOAL_HZ
    numbers = dict(zip(("progress s", "picture s", "checked s"), (round(s, 2) for s in spent), strict=True))
    table.add(
        f"<= {PROGRESS_GOAL_S:g} s, {goal:g} s, >= {PAN_GOAL_HZ:g} Hz",
        met,
        **{"file": path.suffix[1:], "given": given, "MB": round(path.stat().st_size / 1e6), "pans Hz": round(pans)},
        **numbers,
    )
