"""Two clocks in one bag, a clock that was set, stamps that were not: found, said, and mended where one way is right."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import omnidyn
from omnidyn.logs.read_log import recorded_log
from omnidyn.logs.readers.ros.clocks import Clocked, trusted
from tests.support.bags import BagMaker, write_mcap

S = 10**9
START = 1_700_000_000 * S


def topics(seconds=10.0, **rates):
    """Topics received 2 ms after their stamps, in the order of reception."""
    stamps = {
        name: START + np.rint(np.arange(int(seconds * rate)) / rate * 1e9).astype(np.int64)
        for name, rate in rates.items()
    }
    receive = {name: each + 2_000_000 for name, each in stamps.items()}
    every = np.sort(np.concatenate(list(receive.values())), kind="stable")
    return {
        name: Clocked(f"/{name}", receive[name], np.searchsorted(every, receive[name]), stamps[name]) for name in rates
    }


def changed(topic, receive=None, header=None):
    return Clocked(
        topic.topic,
        topic.receive if receive is None else receive,
        topic.order,
        topic.header if header is None else header,
    )


def test_stamps_of_one_clock_are_taken_as_they_are():
    given = topics(a=100.0, b=30.0)
    found, notes = trusted(list(given.values()))
    assert all(np.array_equal(found[f"/{name}"], each.header) for name, each in given.items())
    assert notes == []


def test_a_topic_without_stamps_takes_the_time_of_reception():
    given = topics(a=100.0, b=30.0)
    bare = changed(given["b"], header=np.zeros_like(given["b"].header))
    found, notes = trusted([given["a"], bare])
    assert np.array_equal(found["/b"], bare.receive)
    assert notes == ["/b: no stamps, so the times of reception are taken, which lag behind by the way to it"]


def test_single_messages_without_a_stamp_take_what_the_others_lag_by():
    given = topics(a=100.0)
    header = given["a"].header.copy()
    header[[3, 50]] = 0
    found, notes = trusted([changed(given["a"], header=header)])
    assert np.array_equal(found["/a"], given["a"].header)
    assert "2 messages have no stamp" in notes[0]


def test_a_topic_stamped_by_another_clock_is_moved_onto_the_first():
    """A microcontroller counts from its start: 1970."""
    given = topics(a=100.0, b=30.0)
    boot = changed(given["b"], header=given["b"].header - START + 17 * S)
    found, notes = trusted([given["a"], boot])
    assert np.array_equal(found["/a"], given["a"].header)
    assert np.abs(found["/b"] - given["b"].header).max() <= 2_000_000
    assert any("/b is stamped by another clock" in note and "that of /a" in note for note in notes)


def test_topics_without_stamps_go_with_those_of_a_simulation():
    """Played again, or simulated: all stamps lie far from the times of reception, and time runs at another pace."""
    given = topics(a=100.0, b=30.0)
    header = ((given["a"].header - START) * 0.5).astype(np.int64) + 5 * S
    bare = changed(given["b"], header=np.zeros_like(given["b"].header))
    found, notes = trusted([changed(given["a"], header=header), bare])
    assert np.array_equal(found["/a"], header)
    told = (given["b"].header - START) * 0.5 + 5 * S
    assert np.abs(found["/b"] - told).max() < 5_000_000
    assert any("another clock, or a recording that was played again" in note for note in notes)
    assert any("stamps begin in 1970" in note for note in notes)


def test_a_recorder_whose_clock_is_set_back_does_not_mix_before_and_after():
    given = topics(a=100.0, b=30.0)
    moved = []
    for each in given.values():
        late = np.where(each.receive > START + 5 * S, 3 * S, 0)
        moved.append(changed(each, each.receive - late, np.zeros_like(each.header)))
    found, notes = trusted(moved)
    assert any("the clock of the recorder was set back by 2.99" in note for note in notes)
    for name, each in given.items():
        before = each.receive <= START + 5 * S
        assert (np.diff(found[f"/{name}"]) > 0).all()
        assert np.array_equal(found[f"/{name}"][before], each.receive[before])
        steps = np.diff(found[f"/{name}"][~before]) - np.diff(each.receive[~before])
        assert (steps == 0).all()


def test_a_recorder_that_starts_in_1970_and_learns_the_time_loses_half_a_century():
    given = topics(a=100.0)["a"]
    early = given.receive < START + 5 * S
    receive = np.where(early, given.receive - START + 10 * S, given.receive)
    header = np.where(early, given.header - START + 10 * S, given.header)
    found, notes = trusted([changed(given, receive, header)])
    steps = np.diff(found["/a"])
    assert steps.max() < 2 * S
    assert steps.min() > 0
    assert any("was set forward by" in note for note in notes)


def test_a_sensor_whose_clock_jumps_is_mended_by_the_times_of_reception():
    given = topics(a=100.0, b=30.0)
    jump = np.where(given["b"].receive > START + 4 * S, 2 * S, 0)
    found, notes = trusted([given["a"], changed(given["b"], header=given["b"].header - 2 * S + jump)])
    assert np.array_equal(found["/b"], given["b"].header)
    assert any("/b: its clock was set 1 time, by up to 2 s" in note for note in notes)


def test_messages_that_come_late_now_and_then_are_no_jump():
    given = topics(a=100.0)["a"]
    late = given.receive.copy()
    late[[20, 300]] += 800_000_000
    found, notes = trusted([changed(given, receive=late)])
    assert np.array_equal(found["/a"], given.header)
    assert notes == []


def written(topics, order):
    """The topics as they stand in a file in which message k of all, by time, is at place order[k]."""
    return [
        Clocked(each.topic, each.receive[rows], order[each.order][rows], each.header[rows])
        for each in topics
        for rows in [np.argsort(order[each.order], kind="stable")]
    ]


@pytest.mark.parametrize("stamped", [True, False])
@pytest.mark.parametrize("way", ["shuffled", "chunks", "halves", "backward", "every other chunk"])
def test_messages_out_of_order_are_no_clock_that_was_set(way, stamped):
    given = list(topics(a=100.0, b=30.0, c=7.0).values())
    if not stamped:
        given = [changed(each, header=np.zeros_like(each.header)) for each in given]
    count = sum(len(each.receive) for each in given)
    quarter, part = (np.array_split(np.arange(count), parts) for parts in (4, 30))
    files = {
        "shuffled": np.random.default_rng(0).permutation(count),
        "backward": np.arange(count)[::-1],
        "chunks": np.concatenate([quarter[k] for k in (2, 0, 3, 1)]),
        "halves": np.roll(np.arange(count), count // 2),
        "every other chunk": np.concatenate(part[::2] + part[1::2]),
    }
    order = np.empty(count, dtype=np.int64)
    order[files[way]] = np.arange(count)
    found, notes = trusted(written(given, order))
    assert not any("was set" in note for note in notes)
    for each in given:
        assert np.array_equal(np.sort(found[each.topic]), each.header if stamped else each.receive)


def test_a_slow_recording_whose_clock_is_set_back_is_still_told():
    each = topics(a=10.0)["a"]
    late = np.where(each.receive > START + 5 * S, 3 * S, 0)
    _, notes = trusted([changed(each, each.receive - late, np.zeros_like(each.header))])
    assert any("the clock of the recorder was set back by 2.9" in note for note in notes)


# ---- received at any pace, with pauses ---------------------------------------------------------------------

STEP = 34_000_000  # [ns] between stamps, of simulated time
PACES = st.floats(-1.0, 1.0).map(lambda power: 10.0**power)  # simulated seconds in a second of the recorder
BREAKS = st.lists(st.tuples(st.floats(0.05, 0.95), st.floats(0.1, 60.0)), max_size=4)  # (where, how long [s])


def received(true, pace, pauses, stalls, rng):
    """When messages of simulated times are received [ns], in their order.

    A pause stops all. A stall only holds messages back: they come at its end, at once.
    """
    wall, span = (true - true[0]) / pace, (true[-1] - true[0]) / pace
    late = wall + rng.uniform(0.0, 2e6, len(wall))
    for where, length in pauses:
        late += np.where(wall > where * span, length * S, 0.0)
    for where, length in stalls:
        begin = late[int(where * len(late))]
        late = np.where((late >= begin) & (late < begin + length * S), begin + length * S, late)
    return START + np.rint(np.maximum.accumulate(late)).astype(np.int64)


def simulated(pace, pauses=(), stalls=(), seed=0, count=400):
    """(stamped topic, bare topic, the true times of that): every fifth message of both is of the bare one."""
    rng = np.random.default_rng(seed)
    true = 5 * S + np.cumsum(np.rint(STEP * rng.uniform(0.8, 1.2, count))).astype(np.int64)
    receive, order, bare = received(true, pace, pauses, stalls, rng), np.arange(count), np.arange(count) % 5 == 4
    stamped = Clocked("/odom", receive[~bare], order[~bare], true[~bare])
    return stamped, Clocked("/cmd_vel", receive[bare], order[bare], np.zeros(bare.sum(), np.int64)), true[bare]


@given(PACES, BREAKS, BREAKS, st.integers(0, 99))
def test_regular_stamps_are_believed_whenever_they_were_received(pace, pauses, stalls, seed):
    """No row is moved, none comes before one that it followed; what has no stamp lies between its neighbours."""
    stamped, bare, true = simulated(pace, pauses, stalls, seed)
    found, notes = trusted([stamped, bare])
    np.testing.assert_array_equal(found["/odom"], stamped.header)
    assert not any("was set" in note or "go back" in note for note in notes)
    assert (np.diff(found["/cmd_vel"]) >= 0).all()
    if not stalls:
        assert np.abs(found["/cmd_vel"] - true)[1:-1].max() < 2.5 * STEP + 2e6 * pace


@given(PACES, BREAKS, BREAKS, st.floats(0.1, 0.9), st.floats(1.0, 1e6), st.booleans(), st.integers(0, 99))
def test_where_a_clock_was_set_rows_keep_their_order_and_steps(pace, pauses, stalls, where, jump, back, seed):
    stamped, bare, _ = simulated(pace, pauses, stalls, seed)
    k = int(where * len(stamped.header))
    if not back:
        jump += 5000.0 if pauses or stalls else 0.0  # beyond what eight of 60 s at ten times real time hide
    header = (
        stamped.header
        + 10**7 * S
        + np.where(np.arange(len(stamped.header)) >= k, round((-jump if back else jump) * S), 0)
    )
    found, notes = trusted([changed(stamped, header=header), bare])
    steps, own = np.diff(found["/odom"]), np.diff(stamped.header)
    assert (steps > 0).all()
    assert sum("its clock was set 1 time" in note for note in notes) == 1
    np.testing.assert_array_equal(np.delete(steps, k - 1), np.delete(own, k - 1))
    assert steps[k - 1] < S
    assert (np.diff(found["/cmd_vel"]) >= 0).all()


@given(PACES, BREAKS, st.integers(0, 99))
def test_messages_without_a_stamp_stay_between_those_that_have_one(pace, pauses, seed):
    stamped, _, _ = simulated(pace, pauses, seed=seed)
    blank = np.random.default_rng(seed).random(len(stamped.header)) < 0.3
    found, _ = trusted([changed(stamped, header=np.where(blank, 0, stamped.header))])
    assert (np.diff(found["/odom"]) >= 0).all()
    np.testing.assert_array_equal(found["/odom"][~blank], stamped.header[~blank])


@pytest.mark.parametrize("pace", [0.22, 1.0, 3.0])
def test_topics_of_one_simulated_clock_are_of_one_clock_however_late_one_begins(pace):
    first, _, _ = simulated(pace)
    second = Clocked("/joints", first.receive[250:], first.order[250:] + 1000, first.header[250:])
    found, notes = trusted([first, second])
    np.testing.assert_array_equal(found["/joints"], second.header)
    assert not any("stamped by another clock" in note for note in notes)


@pytest.mark.parametrize("pace, pause", [(1.0, 0.0), (0.22, 0.0), (1.0, 20.0), (0.22, 0.8), (1.0, 0.6), (3.0, 0.8)])
def test_a_bag_of_a_simulation_lasts_as_long_as_its_stamps_say(tmp_path, pace, pause):
    """39.95 s at 34 ms; a pause was a gap of 20 s, a stall 111.6 s, and at three times real time parts overlapped."""
    pytest.importorskip("mcap")
    pytest.importorskip("rosbags")
    maker = BagMaker(start=0)
    for k in range(1176):
        t, wall = 5.0 + 0.034 * k, 1.76e9 + 0.034 * k / pace + pause * (k > 600)
        maker.odometry(t, (0.01 * k, 0.0, 0.0), (0.3, 0.0, 0.0), late=wall - t)
    run = omnidyn.read_log(write_mcap(maker, tmp_path / "log.mcap"))
    np.testing.assert_allclose(run.t - run.t[0], 0.034 * np.arange(1176), atol=1e-6)
    np.testing.assert_allclose(run.pose[:, 0], 0.01 * np.arange(1176))


@pytest.mark.parametrize("seed", range(24))
@pytest.mark.some(7)
def test_only_what_was_lost_is_lost_at_any_pace(tmp_path, seed):
    """A real-time factor of .1 to 10, a pause and a stall of up to 60 s, jitter; in every other bag 40 are lost."""
    pytest.importorskip("mcap")
    pytest.importorskip("rosbags")
    rng, count = np.random.default_rng(seed), 400
    pace, lost = 10.0 ** rng.uniform(-1.0, 1.0), 40 * (seed % 2)
    pauses, stalls = (((rng.uniform(0.1, 0.9), rng.uniform(0.0, 60.0)),) for _ in range(2))
    true = 5 * S + np.cumsum(np.rint(STEP * rng.uniform(1.0 - 0.2 * (seed % 3), 1.0, count))).astype(np.int64)
    kept = np.delete(np.arange(count), np.arange(150, 150 + lost))
    receive = received(true[kept], pace, pauses, stalls, rng)
    maker = BagMaker(start=0)
    for k, wall in zip(kept, receive, strict=True):
        maker.odometry(true[k] / S, (0.01 * k, 0.0, 0.0), (0.3, 0.0, 0.0))
        maker.said[-1].receive = int(wall)
    log = recorded_log(write_mcap(maker, tmp_path / "log.mcap"))
    np.testing.assert_allclose(log.t - log.t[0], (true[kept] - true[0]) / S, atol=2e-6)
    np.testing.assert_allclose(log.channels["pose"][:, 0], 0.01 * kept)
    gaps = omnidyn.check(log).of("gap")
    assert [finding.count for finding in gaps] == [1] * bool(lost)
    assert all(abs(finding.numbers["lost_rows"] - lost) < 0.2 * lost for finding in gaps)


def test_stamps_that_go_back_again_and_again_are_no_time():
    given = topics(seconds=60.0, a=100.0)["a"]
    looped = START + (given.header - START) % (2 * S)  # a recording of two seconds, played in a loop
    found, notes = trusted([changed(given, header=looped)])
    assert np.array_equal(found["/a"], given.receive)
    assert any("/a: its stamps go back too often to be a time" in note for note in notes)
