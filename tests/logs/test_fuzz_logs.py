"""Whatever the names, units and cells of a table: a Run, or an OmnidynError."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from omnidyn import load_robot
from omnidyn.errors import OmnidynError
from omnidyn.logs.columns.guess import guess_columns
from omnidyn.logs.columns.mapping import load_map, map_to_toml, parse_column
from omnidyn.logs.read_log import LogOptions, log_from_table, map_columns
from omnidyn.logs.table.table import FileTable

ROBOT = load_robot("axebot")
PARTS = [
    *("t", "w", "u", "i", "m", "1", "2", "0", "99", "_", " ", "cmd", "set", "vel", "pos", "x", "vx", "yaw", "rpm"),
    *("rad_s", "V", "s", "ms", "time", "duty", "pwm", "bat", "ü", "(", "[A]", ":", "=", "motor", "speed"),
]
names = st.one_of(st.lists(st.sampled_from(PARTS), min_size=1, max_size=5).map("".join), st.text(max_size=12))
units = st.sampled_from(["", "s", "ms", "V", "%", "rpm", "ticks", "rad/s", "pix", "m/s", "-", "SI", "#", "A", "deg"])
cells = st.one_of(
    st.lists(st.floats(allow_infinity=False) | st.just(float("nan")), min_size=6, max_size=6),
    st.just([0.0, 0.1, 0.2, 0.3, 0.4, 0.5]),
    st.just([0.0, 10.0, 20.0, 30.0, 30.0, 50.0]),
    st.just(["2026-11-20T10:00:00", "", "a", "b", "c", "d"]),
)


@st.composite
def tables(draw):
    columns, given_units = {}, {}
    for name in draw(st.lists(names, min_size=1, max_size=8, unique=True)):
        values = draw(cells)
        columns[name] = tuple(values) if isinstance(values[0], str) else np.array(values)
        given_units[name] = draw(units)
    return FileTable(tuple(columns), columns, np.arange(2, 8), given_units, "fuzz.csv", "0" * 64)


options = st.builds(
    LogOptions,
    overrides=st.lists(st.tuples(names, names).map("=".join), max_size=1).map(tuple),
    assume=st.dictionaries(st.sampled_from(["u", "w", "w1", "t", "x"]), units.filter(bool), max_size=2),
    latency=st.dictionaries(st.sampled_from(["w", "u", "vx"]), st.sampled_from([0.01, -0.2]), max_size=1),
    current_unsigned=st.booleans(),
)


@settings(max_examples=400, deadline=None)
@given(tables(), options, st.sampled_from([None, ROBOT]), st.booleans())
def test_a_table_is_a_run_or_refused(table, how, robot, sort):
    try:
        columns = map_columns(table, robot, how)
        run = log_from_table(table, columns, robot, how).to_run(sort=sort)
    except OmnidynError:
        return
    assert (np.diff(run.t) > 0.0).all()


@settings(max_examples=200, deadline=None)
@given(tables())
def test_what_was_guessed_can_be_saved_and_used(tmp_path_factory, table):
    columns = guess_columns(table)
    path = tmp_path_factory.mktemp("map") / "map.toml"
    path.write_text(map_to_toml(columns), "utf-8")
    assert load_map(path).columns == dict(columns.columns)


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=30), names, names)
def test_any_words_after_column_are_read_or_refused(text, component, column):
    for words in (text, f"{component}={column}", f"u1={text}"):
        try:
            parse_column(words)
        except OmnidynError:
            continue
