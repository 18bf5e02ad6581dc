"""Structured Streaming: an engine for each key, whose state is in Spark's checkpoint."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy
import pandas
from pyspark.sql import Column, DataFrame
from pyspark.sql import functions as F
from pyspark.sql.streaming.state import GroupState, GroupStateTimeout

from ._errors import ShsaError
from ._states import NONE, Columns, Engines, Renewal, Rows, State

if TYPE_CHECKING:
    from . import Model

STATE = (
    "model binary, version binary, base binary, base_ns bigint, middle binary, middle_ns bigint, tail binary, received_ns bigint, "
    "advanced_ns bigint, seen_ns bigint"
)
HEALED = (
    "time_us bigint, received_us bigint, kind string, signal string, element int, lo double, hi double, quality string, "
    "variable string, because string, substitution string, fields string"
)
COLUMNS = [column.split()[0] for column in HEALED.split(", ")]
QUALITIES = numpy.array(["good", "substitute", "uncertain"], dtype=object)


def heal(
    stream: DataFrame,
    model: Model,
    *,
    key: str = "vehicle",
    time: str = "time",
    late: str = "10 seconds",
    renew_s: float | None = 60.0,
    overlap_s: float = 20.0,
    forget_s: float | None = None,
    keep: int = 2000,
) -> DataFrame:
    """Heals a stream, with an engine for each key: a row for each published value and for each decision. Also a table, at once.

    The rows of the stream have the columns of the key and of the time (a timestamp: when the value was true), and either ``signal`` and
    ``value``, or a column for each signal of the model that is there. What is missing or not a number is no value; other signals
    are left out. ``late`` is Spark's watermark: rows that are this much before the latest time of the batch before the last one, or of an
    earlier one, are dropped.

    Within a batch, the values of a key are given to its engine in the order of their times. A value whose time is before what the engine has
    had is received now, with its own time stamp. Where no row of a key comes late in this sense, the result does not depend on how
    the stream is cut into batches. A key without rows lets time pass until the watermark: its silent sensors are noticed once the
    others go on.

    The state is a snapshot of the engine and the observations since. An engine is renewed from its snapshot every ``renew_s``, with the
    observations of the last ``overlap_s`` given again, and may then decide otherwise than one that goes on (docs/spark.md has figures);
    ``None``: never, and the state grows with the stream. After ``forget_s`` without rows, a key is forgotten; never if it is not given.
    Each Python worker keeps ``keep`` engines, of some 100 kB each; one that is not kept, or is not where the state is, arises from it.

    The result has the columns of the key, ``time`` and ``received`` (timestamps: when the value was true, and when it was computed; of a
    decision both are its moment), ``kind`` (``value``, or that of the event), ``signal``, ``element`` (of a vector), ``lo``,
    ``hi`` and ``quality`` of a value; ``variable``, ``because``, ``substitution`` and all ``fields`` as JSON of an event.
    `values` and `events` select them. Values of vectors cannot be given, only numbers.

    A batch costs O(its rows) for each key, and O(rows in the state) where another process takes a key over. Raises `ShsaError` if the
    stream has no readings or ``overlap_s`` is not between 0 and ``renew_s``.
    """
    renewal = NONE if renew_s is None else Renewal(round(renew_s * 1e9), round(overlap_s * 1e9))
    Engines(model, renewal, keep)
    named = f"`{key}`"
    moment = F.unix_micros(F.col(f"`{time}`").cast("timestamp")).alias("_time_us")
    # The column of times itself stays, as it is by which Spark drops what is late.
    head = [F.col(named), F.col(f"`{time}`"), moment]
    readings, is_long = _readings(stream.columns, model)
    rows = stream.withWatermark(time, late).select(*head, *readings)
    if is_long:
        rows = rows.where(F.col("signal").isin(model.signals))
    text, name = model.text, model.name
    forget = None if forget_s is None else round(forget_s * 1e9)

    def step(
        group: tuple[Any, ...], frames: Iterator[pandas.DataFrame], state: GroupState
    ) -> Iterator[pandas.DataFrame]:
        engines = _engines(text, name, renewal, keep)
        healed = _step(engines, group, key, frames, state, forget)
        if healed is not None:
            yield healed

    def whole(group: tuple[Any, ...], frame: pandas.DataFrame) -> pandas.DataFrame:
        engines = _engines(text, name, renewal, 0)
        _, outputs, _ = engines.give(group, None, _rows([frame], engines.model, None))
        return _frame(group[0], key, engines.model, outputs)

    schema = f"{named} {stream.schema[key].dataType.simpleString()}, {HEALED}"
    grouped = rows.groupBy(named)
    if stream.isStreaming:
        healed = grouped.applyInPandasWithState(
            step, schema, STATE, "append", GroupStateTimeout.EventTimeTimeout
        )
    else:
        healed = grouped.applyInPandas(whole, schema)
    moments = [F.timestamp_micros(F.col(f"{name}_us")).alias(name) for name in ("time", "received")]
    return healed.select(F.col(named), *moments, *COLUMNS[2:])


def values(healed: DataFrame) -> DataFrame:
    """The published values of what `heal` returns."""
    return healed.where("kind = 'value'").drop("kind", "variable", "because", "substitution", "fields")


def events(healed: DataFrame) -> DataFrame:
    """The decisions of what `heal` returns."""
    return healed.where("kind <> 'value'").drop("received", "element", "lo", "hi", "quality")


def _readings(columns: list[str], model: Model) -> tuple[list[Column], bool]:
    """The columns of the readings, and whether each row has one only, with the name of its signal."""
    if {"signal", "value"} <= set(columns):
        return [F.col("signal"), F.col("value").try_cast("double")], True
    there = [name for name in model.signals if name in columns]
    if not there:
        raise ShsaError("the stream has neither `signal` and `value` nor a column of a signal of the model")
    return [F.col(f"`{name}`").try_cast("double") for name in there], False


@lru_cache(maxsize=8)
def _engines(text: str, name: str, renewal: Renewal, keep: int) -> Engines:
    from . import Model

    return Engines(Model(text, name), renewal, keep)


def _step(
    engines: Engines,
    group: tuple[Any, ...],
    key: str,
    frames: Iterable[pandas.DataFrame],
    state: GroupState,
    forget_ns: int | None,
) -> pandas.DataFrame | None:
    """The outputs of a key's batch, or of its timeout; ``None`` while it has had no reading."""
    before, seen_ns = _read(state)
    watermark_ns = state.getCurrentWatermarkMs() * 1_000_000
    if state.hasTimedOut:
        rows, until = _rows([], engines.model, before), watermark_ns
    else:
        rows, until = _rows(list(frames), engines.model, before), None
        if before is None and len(rows.values) == 0:
            return None
        seen_ns = max(seen_ns, *rows.received[-1:].tolist(), before.now_ns if before else seen_ns)
    after, outputs, deadline = engines.give(group, before, rows, until)
    forgotten = None if forget_ns is None else seen_ns + forget_ns
    if state.hasTimedOut and forgotten is not None and forgotten <= watermark_ns:
        state.remove()
    else:
        state.update(tuple(getattr(after, field) for field in after.__dataclass_fields__) + (seen_ns,))
        due = min(it for it in (deadline, forgotten, 2**62) if it is not None)
        if due < 2**62:
            # Whole milliseconds, after the watermark, is what Spark takes.
            state.setTimeoutTimestamp(max(-(-due // 1_000_000), watermark_ns // 1_000_000 + 1))
    return _frame(group[0], key, engines.model, outputs)


def _read(state: GroupState) -> tuple[State | None, int]:
    if not state.exists:
        return None, -(2**63)
    model, version, base, base_ns, middle, middle_ns, tail, received_ns, advanced_ns, seen_ns = state.get
    snapshots = [None if it is None else bytes(it) for it in (base, middle)]
    before = State(
        bytes(model),
        bytes(version),
        snapshots[0],
        base_ns,
        snapshots[1],
        middle_ns,
        bytes(tail),
        received_ns,
        advanced_ns,
    )
    return before, seen_ns


def _rows(frames: list[pandas.DataFrame], model: Model, state: State | None) -> Rows:
    """The readings of a batch, in the order of time, then of the signals in the model, then of the values: a shuffle has none."""
    parts = [part for frame in frames for part in _parts(frame, model)]
    kinds = (numpy.uint16, numpy.int64, numpy.float64)
    columns = zip(*parts) if parts else ([], [], [])
    signals, stamps, numbers = (numpy.concatenate([numpy.empty(0, k), *c]) for k, c in zip(kinds, columns))
    order = numpy.lexsort((numbers, signals, stamps))
    stamps = stamps[order]
    received = stamps if state is None else numpy.maximum(stamps, state.now_ns)
    return Rows(signals[order].astype(numpy.uint16), stamps, received, numbers[order])


def _parts(frame: pandas.DataFrame, model: Model) -> Iterator[tuple[Any, Any, Any]]:
    places = {name: place for place, name in enumerate(model.signals)}
    stamps = frame["_time_us"].to_numpy(numpy.int64) * 1000
    if "signal" in frame:
        columns = [(frame["signal"].map(places).to_numpy(numpy.uint16), frame["value"])]
    else:
        columns = [(numpy.full(len(frame), places[name], numpy.uint16), frame[name]) for name in frame if name in places]
    for signals, column in columns:
        numbers = column.to_numpy(numpy.float64, na_value=numpy.nan)
        is_number = ~numpy.isnan(numbers)
        yield signals[is_number], stamps[is_number], numbers[is_number]


def _frame(name: Any, key: str, model: Model, outputs: list[Columns]) -> pandas.DataFrame:
    """Outputs as rows: the values, then the events."""
    events = [json.loads(event) for it in outputs for event in it.events]
    moments = numpy.array([event.pop("time_ns") for event in events], numpy.int64)
    numbers = [numpy.concatenate(parts) for parts in zip(*(it[:-1] for it in outputs))]
    needs, times, truths, elements, lo, hi, qualities = numbers
    count = len(times)

    def texts(of_values: Any, field: str) -> Any:
        column = numpy.empty(count + len(events), dtype=object)
        column[:count] = of_values
        column[count:] = [event.get(field) for event in events]
        return pandas.Series(column, dtype=object)

    def missing(of_values: Any, is_missing: Any) -> tuple[Any, Any]:
        padded = numpy.concatenate([of_values, numpy.zeros(len(events), of_values.dtype)])
        return padded, numpy.concatenate([is_missing, numpy.ones(len(events), bool)])

    never = numpy.zeros(count, bool)
    columns = {
        "time_us": numpy.concatenate([truths, moments]) // 1000,
        "received_us": numpy.concatenate([times, moments]) // 1000,
        "kind": texts("value", "kind"),
        "signal": texts(numpy.array(model.needs, dtype=object)[needs], "signal"),
        "element": pandas.arrays.IntegerArray(*missing(elements, elements < 0)),
        "lo": pandas.arrays.FloatingArray(*missing(lo, never)),
        "hi": pandas.arrays.FloatingArray(*missing(hi, never)),
        "quality": texts(QUALITIES[qualities], "quality"),
        **{field: texts(None, field) for field in ("variable", "because", "substitution")},
    }
    for event in events:
        event["fields"] = json.dumps(event)
    return pandas.DataFrame({key: [name] * (count + len(events)), **columns, "fields": texts(None, "fields")})
