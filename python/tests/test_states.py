"""Engines by key: the same from their states as those that go on."""

from __future__ import annotations

import random
import unittest

import numpy
from test_shsa import TANK, columns

import shsa
from shsa import _states

SECOND = 10**9
RENEWAL = _states.Renewal(7 * SECOND, 3 * SECOND)


def rows(seconds: float = 40.0) -> _states.Rows:
    """Three floats of a tank; the first one is wrong from the 10th second on."""
    data = columns(seconds)
    times = numpy.repeat(numpy.round(numpy.array(data.pop("time")) * SECOND).astype(numpy.int64), 3)
    signals = numpy.tile(numpy.arange(3, dtype=numpy.uint16), len(times) // 3)
    return _states.Rows(signals, times, times, numpy.array(list(data.values())).T.ravel())


def healed(engines: list[_states.Engines], cuts: list[int]) -> tuple[list[object], _states.State]:
    """The outputs of a stream that is cut there, each part given to one of the engines, and the last state."""
    everything, state, outputs = rows(), None, []
    for number, (begin, end) in enumerate(zip([0, *cuts], [*cuts, len(everything.values)])):
        part = everything.part(begin, end)
        state, columns, _ = engines[number % len(engines)].give("tank", state, part)
        outputs += [list(zip(*it[:-1])) + it.events for it in columns]
    return [row for part in outputs for row in part], state


class States(unittest.TestCase):
    def setUp(self) -> None:
        self.tank = shsa.Model(TANK)

    def engines(self, limit: int = 10) -> _states.Engines:
        return _states.Engines(self.tank, RENEWAL, limit)

    def test_it_does_not_matter_who_goes_on_nor_where_the_stream_is_cut(self) -> None:
        whole, state = healed([self.engines()], [])
        self.assertGreater(len(whole), 50)
        chance = random.Random(1)
        for count in (1, 5, 40):
            cuts = sorted(chance.sample(range(1, 600), count))
            kept, forgetful = self.engines(), self.engines(limit=0)
            by_one, by_none = healed([kept], cuts), healed([forgetful], cuts)
            by_two = healed([self.engines(), self.engines()], cuts)
            # Values by their order, events among themselves: the parts of a batch put out values first.
            for outputs, _ in (by_one, by_none, by_two):
                self.assertEqual(sorted(outputs, key=repr), sorted(whole, key=repr))
            self.assertEqual(by_one[1], by_two[1])
            self.assertEqual(by_one[1], by_none[1])
            self.assertLess(kept.arisen, forgetful.arisen)

    def test_an_engine_that_is_never_renewed_is_one_that_goes_on(self) -> None:
        engines = _states.Engines(self.tank, _states.NONE, 0)
        outputs, _ = healed([engines], [100, 200, 300])
        single, data = shsa.Engine(self.tank), rows()
        for signal, at, value in zip(data.signals, data.received.tolist(), data.values.tolist()):
            single.handle(self.tank.signals[signal], value, at)
        expected = [it.time_ns for it in single.outputs() if isinstance(it, shsa.Publication)]
        self.assertEqual([it[1] for it in outputs if isinstance(it, tuple)], expected)

    def test_a_kept_engine_that_went_another_way_is_not_used(self) -> None:
        engines, everything = self.engines(), rows()
        first, _, _ = engines.give("tank", None, everything.part(0, 300))
        # An attempt of a batch that has failed later: its state is not what goes on.
        engines.give("tank", first, everything.part(500, 600))
        again = engines.give("tank", first, everything.part(300, 450))
        alone = self.engines().give("tank", first, everything.part(300, 450))
        self.assertEqual(again[0], alone[0])
        self.assertEqual(repr(again[1]), repr(alone[1]))

    def test_what_is_kept_is_bounded(self) -> None:
        _, state = healed([self.engines()], list(range(30, 600, 30)))
        self.assertLessEqual(len(_states.unpacked(state.tail).values), 15 * 7 + 15)
        engines = self.engines(limit=3)
        for key in range(10):
            engines.give(key, None, rows().part(0, 30))
        self.assertEqual(list(engines.kept), [7, 8, 9])

    def test_rows_are_packed_without_loss(self) -> None:
        data = rows(2)
        late = data._replace(stamps=data.stamps - 5)
        for parts in ([], [data], [late, data.part(3, 3), data.part(4, 9)]):
            unpacked = _states.unpacked(b"".join(map(_states.packed, parts)))
            for at, column in enumerate(unpacked):
                self.assertEqual(column.tobytes(), b"".join(part[at].tobytes() for part in parts))

    def test_another_model_goes_on_by_names(self) -> None:
        before, _, _ = self.engines().give("tank", None, rows(20))
        other = shsa.Model(TANK.replace("float_1", "float_0") + "# without the first float\n")
        engines = _states.Engines(other, RENEWAL, 1)
        after, [outputs], _ = engines.give("tank", before, rows().part(300, 330))
        self.assertNotEqual(after.model, before.model)
        self.assertTrue(any("float_1" in event and "refused" in event for event in outputs.events), outputs.events)

    def test_silence_is_noticed_when_time_passes(self) -> None:
        engines, data = self.engines(), rows(20)
        state, _, due = engines.give("tank", None, data)
        self.assertEqual(due, state.now_ns)
        nothing = data.part(0, 0)
        after, [outputs], _ = engines.give("tank", state, nothing, state.now_ns + 10 * SECOND)
        self.assertEqual(sum('"silent"' in event for event in outputs.events), 3)
        self.assertEqual(after.now_ns, state.now_ns + 10 * SECOND)

    def test_what_is_wrong_is_told(self) -> None:
        with self.assertRaisesRegex(shsa.ShsaError, "the overlap must be shorter"):
            _states.Engines(self.tank, _states.Renewal(SECOND, SECOND), 1)
        engine = shsa.Engine(self.tank)._engine
        with self.assertRaisesRegex(shsa.ShsaError, "different lengths"):
            engine.handle_all(self.tank.signals, b"\0\0", b"", b"", b"")
        with self.assertRaisesRegex(shsa.ShsaError, "signal 7 of 3 is none"):
            engine.handle_all(self.tank.signals, b"\7\0", bytes(8), bytes(8), bytes(8))
        with self.assertRaisesRegex(shsa.ShsaError, "no signal 'float_9'"):
            engine.handle_all(["float_9"], b"\0\0", bytes(8), bytes(8), bytes(8))


if __name__ == "__main__":
    unittest.main()
