"""Who takes a turn when, and what is made of the seconds."""

import time

import pytest

from experiments.shared.timing import Timing, bursts, fastest, interleaved, ratio, timed


def test_bursts_take_turns():
    calls = []
    ways = {"a": lambda x: calls.append(f"a{x}"), "b": lambda x: calls.append(f"b{x}")}
    taken = bursts(ways, [(1,), (2,), (3,)], length=2)
    assert calls == ["a1", "a2", "b1", "b2", "a3", "b3"]
    assert {name: [len(turn) for turn in turns] for name, turns in taken.items()} == {
        "a": [2, 1],
        "b": [2, 1],
    }


def test_a_call_is_timed_and_its_value_kept():
    value, seconds = timed(lambda x: time.sleep(0.02) or x, 3)
    assert value == 3
    assert 0.02 <= seconds < 1


def test_interleaved_has_a_first_call_and_a_time_per_round():
    count = iter(range(100))
    times = interleaved({"slow at first": lambda: time.sleep(0 if next(count) else 0.05)}, rounds=4)
    assert times["slow at first"].first_seconds >= 0.05
    assert len(times["slow at first"].seconds) == 4
    assert times["slow at first"].median_ms < 1e3 * times["slow at first"].first_seconds


def test_fastest_is_of_one_call_however_often_it_is_repeated():
    seconds = fastest(
        {"short": lambda: time.sleep(1e-3), "long": lambda: time.sleep(1e-2)}, rounds=2
    )
    assert 1e-3 <= seconds["short"] < seconds["long"]


def test_ratios_are_taken_round_by_round():
    assert ratio(Timing(0, [2.0, 30.0, 8.0]), Timing(0, [1.0, 10.0, 4.0])) == pytest.approx(2)
