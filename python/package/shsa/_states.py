"""Engines by key, each with a state from which another process continues it exactly.

`Engine.snapshot` leaves out what new evidence brings back: the comparisons and values of the last seconds. An engine that begins from it
alone decides later than one that went on. So a `State` is a snapshot and the observations since: from both, the same engine arises in
whichever process. To bound the observations, an engine is renewed at times that only they determine: the snapshot is taken some seconds
before, and the observations of these seconds are given again. So nothing recent is missing, but statistics over minutes begin anew.
"""

from __future__ import annotations

import hashlib
import struct
import zlib
from collections import OrderedDict
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from . import Engine, Model
from ._errors import ShsaError

if TYPE_CHECKING:
    import numpy

LENGTH = struct.Struct("<I")


class Rows(NamedTuple):
    """Observations in the order of their reception: arrays of one length."""

    signals: numpy.ndarray[Any, Any]
    """The place of each signal in `Model.signals`, uint16."""
    stamps: numpy.ndarray[Any, Any]
    """When the value was true, ns, int64."""
    received: numpy.ndarray[Any, Any]
    """When the engine receives it, ns, int64, ascending."""
    values: numpy.ndarray[Any, Any]
    """In the signal's unit, float64."""

    def part(self, begin: int, end: int) -> Rows:
        """Some of them; O(1)."""
        return Rows(*(column[begin:end] for column in self))

    def columns(self) -> tuple[bytes, bytes, bytes, bytes]:
        """The bytes of each array."""
        signals, stamps, received, values = (column.tobytes() for column in self)
        return signals, stamps, received, values


class Columns(NamedTuple):
    """What an engine has put out, as `_shsa.Engine.take` gives it; times in ns, bounds in the unit of the variable."""

    needs: numpy.ndarray[Any, Any]
    times: numpy.ndarray[Any, Any]
    truths: numpy.ndarray[Any, Any]
    elements: numpy.ndarray[Any, Any]
    lo: numpy.ndarray[Any, Any]
    hi: numpy.ndarray[Any, Any]
    qualities: numpy.ndarray[Any, Any]
    events: list[str]


def packed(rows: Rows) -> bytes:
    """Rows as bytes: about 10 for each. O(rows)."""
    import numpy

    signals, stamps, received, values = rows
    steps = numpy.diff(received, prepend=numpy.int64(0))
    content = b"".join(column.tobytes() for column in (signals, steps, received - stamps, values))
    # Times repeat themselves, numbers do not: more effort gains nothing.
    frame = zlib.compress(content, 1)
    return LENGTH.pack(len(frame)) + frame


def unpacked(frames: bytes) -> Rows:
    """The rows of all frames, in their order. O(rows)."""
    import numpy

    parts = [_unframed(content) for content in _frames(frames)]
    if not parts:
        return Rows(*(numpy.empty(0, kind) for kind in (numpy.uint16, numpy.int64, numpy.int64, numpy.float64)))
    return Rows(*(numpy.concatenate(columns) for columns in zip(*parts)))


def _frames(frames: bytes) -> Iterator[bytes]:
    at = 0
    while at < len(frames):
        (length,) = LENGTH.unpack_from(frames, at)
        at += LENGTH.size
        yield zlib.decompress(frames[at : at + length])
        at += length


def _unframed(content: bytes) -> Rows:
    import numpy

    count = len(content) // 26
    signals = numpy.frombuffer(content, numpy.uint16, count)
    steps = numpy.frombuffer(content, numpy.int64, count, 2 * count)
    ages = numpy.frombuffer(content, numpy.int64, count, 10 * count)
    values = numpy.frombuffer(content, numpy.float64, count, 18 * count)
    received = numpy.cumsum(steps)
    return Rows(signals, received - ages, received, values)


@dataclass(frozen=True)
class State:
    """From which an engine arises; times in ns."""

    model: bytes
    """A digest of the model."""
    version: bytes
    """A digest of everything that the engine was given, in its order."""
    base: bytes | None
    """The snapshot that it begins with, packed; ``None``: it begins as new,"""
    base_ns: int
    """at this time."""
    middle: bytes | None
    """The snapshot that the next engine begins with, once it is taken, packed,"""
    middle_ns: int
    """at this time."""
    tail: bytes
    """The observations since the beginning, packed."""
    received_ns: int
    """The last reception."""
    advanced_ns: int
    """Until when time has passed without observations."""

    @property
    def now_ns(self) -> int:
        """No observation is received before."""
        return max(self.received_ns, self.advanced_ns)


NEVER = -(2**63)


class Renewal(NamedTuple):
    """When an engine begins anew from its snapshot, in ns."""

    period: int
    """After so much time; at most so much of observations is kept."""
    overlap: int
    """The snapshot is so old then, and the observations since are given again."""


NONE = Renewal(2**62, 1)
"""An engine goes on for ever."""


@dataclass
class _Live:
    """An engine at work, its state, and what it has put out."""

    engine: Engine
    state: State
    outputs: list[Columns] = field(default_factory=list)


class Engines:
    """Engines of one model by key. Those of the last calls are kept, at most ``limit``; each goes on only where its version is the state's.

    An engine that has another version, or is not kept, arises from the state: O(observations in the state).
    """

    def __init__(self, model: Model, renewal: Renewal, limit: int) -> None:
        if not 0 < renewal.overlap < renewal.period:
            raise ShsaError("the overlap must be shorter than the time between renewals, and longer than 0")
        self.model, self.renewal, self.limit = model, renewal, limit
        self.digest = hashlib.blake2b(model.text.encode(), digest_size=16).digest()
        self.kept: OrderedDict[Hashable, tuple[bytes, Engine]] = OrderedDict()
        self.arisen = 0
        """How many engines have arisen from their states."""

    def give(
        self, key: Hashable, state: State | None, rows: Rows, until_ns: int | None = None
    ) -> tuple[State, list[Columns], int | None]:
        """Gives rows to the engine of a key, then lets time pass until a moment.

        Returns the state after it, the outputs, and when time has to pass at the latest (ns; ``None``: nothing is waited for). The result
        depends on the arguments alone, not on what is kept. The rows must not be received before ``state.now_ns``.
        """
        live = self._live(key, state, int(rows.received[0]) if len(rows.received) else until_ns or 0)
        digest = hashlib.blake2b(live.state.version + self.digest, digest_size=16)
        for column in rows.columns():
            digest.update(column)
        digest.update(repr(until_ns).encode())
        self._observe(live, rows)
        if until_ns is not None and until_ns > live.state.now_ns:
            live.engine.advance(until_ns)
            live.state = replace(live.state, advanced_ns=until_ns)
        live.outputs.append(_taken(live.engine))
        after = replace(live.state, version=digest.digest())
        self._keep(key, after.version, live.engine)
        return after, live.outputs, live.engine.next_deadline()

    def _live(self, key: Hashable, state: State | None, begin_ns: int) -> _Live:
        # What is taken out is not there if this call fails, and its next attempt begins from the state.
        version, engine = self.kept.pop(key, (b"", None))
        if state is None:
            state = State(self.digest, repr(self.renewal).encode(), None, begin_ns, None, 0, b"", NEVER, NEVER)
            return _Live(Engine(self.model), state)
        if state.model != self.digest:
            state = self._of_this_model(state)
            # What it says of the change is new.
            return _Live(self._begun(state), state)
        if engine is None or version != state.version:
            engine = self._arisen(state)
        return _Live(engine, state)

    def _of_this_model(self, state: State) -> State:
        """The state of an engine of another model: its last snapshot, as only there everything has its name."""
        at, last = state.now_ns, state.middle or state.base
        return replace(
            state, model=self.digest, base=last, base_ns=at, middle=None, middle_ns=0, tail=b"", advanced_ns=at
        )

    def _begun(self, state: State) -> Engine:
        engine = Engine(self.model)
        if state.base is not None:
            engine.restore(zlib.decompress(state.base).decode(), state.base_ns)
        return engine

    def _arisen(self, state: State) -> Engine:
        self.arisen += 1
        engine = self._begun(state)
        self._handle(engine, unpacked(state.tail))
        engine.advance(state.advanced_ns)
        # Its outputs went out when they were new.
        engine._engine.take()
        return engine

    def _handle(self, engine: Engine, rows: Rows) -> None:
        engine._engine.handle_all(self.model.signals, *rows.columns())

    def _observe(self, live: _Live, rows: Rows) -> None:
        import numpy

        begin, count = 0, len(rows.received)
        while begin < count:
            period, overlap = self.renewal
            due = live.state.base_ns + (period - overlap if live.state.middle is None else period)
            end = int(numpy.searchsorted(rows.received, min(due, 2**63 - 1)))
            if end > begin:
                part = rows.part(begin, end)
                self._handle(live.engine, part)
                tail = live.state.tail + packed(part)
                live.state = replace(live.state, tail=tail, received_ns=int(part.received[-1]))
            if end < count:
                self._turn(live, int(rows.received[end]))
            begin = end

    def _turn(self, live: _Live, now_ns: int) -> None:
        """Takes the snapshot for the next engine, or lets that one take over, before what is received now."""
        live.engine.advance(now_ns - 1)
        if live.state.middle is None:
            middle = zlib.compress(live.engine.snapshot().encode())
            live.state = replace(live.state, middle=middle, middle_ns=now_ns)
            return
        live.outputs.append(_taken(live.engine))
        base, base_ns = live.state.middle, live.state.middle_ns
        tail = unpacked(live.state.tail)
        recent = packed(Rows(*(column[tail.received >= base_ns] for column in tail)))
        live.state = replace(live.state, base=base, base_ns=base_ns, middle=None, middle_ns=0, tail=recent)
        live.engine = self._arisen(live.state)
        live.engine.advance(now_ns - 1)
        live.engine._engine.take()

    def _keep(self, key: Hashable, version: bytes, engine: Engine) -> None:
        self.kept[key] = (version, engine)
        if len(self.kept) > self.limit:
            self.kept.popitem(last=False)


def _taken(engine: Engine) -> Columns:
    import numpy

    (needs, times, truths, elements, lo, hi, qualities), events = engine._engine.take()
    return Columns(
        numpy.frombuffer(needs, numpy.uint16),
        numpy.frombuffer(times, numpy.int64),
        numpy.frombuffer(truths, numpy.int64),
        numpy.frombuffer(elements, numpy.int32),
        numpy.frombuffer(lo, numpy.float64),
        numpy.frombuffer(hi, numpy.float64),
        numpy.frombuffer(qualities, numpy.uint8),
        events,
    )
