"""Two clocks in one bag, a clock that was set, stamps that were not: found, said, and mended where one way is right."""

import numpy as np
import pytest

from omnidyn.logs.readers.ros.clocks import Clocked, trusted

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
