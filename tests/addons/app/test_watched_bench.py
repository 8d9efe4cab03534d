"""A bench that is watched says at once where a row cannot be read, and watches on."""

from bowdenfit.addons.app import live
from bowdenfit.inference.interval import Interval
from bowdenfit.questions import watch as watch_room


def make_answer(mountings):
    """An answer after so many mountings."""
    interval = Interval(0.12, 0.01, 0.12, 0.1, 0.14)
    return watch_room.WatchedAnswer("cable", mountings, 3 * mountings, "mu", "mu", "", interval, False, "", {}, clock="12:00")


def follow(monkeypatch, tmp_path, *answers):
    """A bench whose watching has ended after some answers."""
    monkeypatch.setattr(live, "watch", lambda *_, **__: iter(answers))
    bench = live.WatchedBench(tmp_path, "")
    bench._thread.join(timeout=10)
    assert not bench.running and not bench.refusal
    return bench


def test_files_that_cannot_be_read_are_remembered_until_they_can_be(monkeypatch, tmp_path):
    sentence = "forces.csv, row 17: 'many' is not a number."
    spoiled = follow(monkeypatch, tmp_path, make_answer(2), watch_room.UnreadableFiles(sentence))
    assert (spoiled.unreadable, len(spoiled.history.answers)) == (sentence, 1)
    corrected = follow(monkeypatch, tmp_path, make_answer(2), watch_room.UnreadableFiles(sentence), make_answer(3))
    assert (corrected.unreadable, len(corrected.history.answers)) == ("", 2)
