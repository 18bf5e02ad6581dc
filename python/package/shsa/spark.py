"""Many recordings, and many vehicles at once, on a cluster of Apache Spark: ``pip install 'shsa[spark]'``.

`replay`, `calibrate`, `campaign` and `learn` do with each of many recordings what the functions of these names in `shsa` do with one: a
task each, a row each. `heal` heals a stream, with an engine for each key. The package must be installed on the workers.
"""

from __future__ import annotations

import json
import os
import pathlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from time import perf_counter
from typing import TYPE_CHECKING, Any, Union

import pyarrow
from pyspark.sql import DataFrame, SparkSession

import shsa

from . import _spark_stream
from ._errors import ShsaError
from ._recordings import Path

if TYPE_CHECKING:
    from . import Model

__all__ = ["calibrate", "campaign", "events", "heal", "learn", "replay", "values"]

Recordings = Union[DataFrame, Path, Mapping[str, Union[Path, Sequence[Path]]]]
"""A table with a column of keys: the rows of a key are a recording. Or a folder, each of whose files and folders is a recording; or the
paths of each recording by its key. Workers must find them at the same paths."""

Work = Callable[[Any], pyarrow.Table]

FOUND = "report string, patch string, warnings array<string>"
END = "error string, elapsed_s double"
ARROW = {
    "string": pyarrow.string(),
    "array<string>": pyarrow.list_(pyarrow.string()),
    "bigint": pyarrow.int64(),
    "double": pyarrow.float64(),
    # Spark's moments are in microseconds.
    "timestamp": pyarrow.timestamp("us", "UTC"),
}
VALUES = (
    "time timestamp, received timestamp, session bigint, signal string, unit string, element bigint, lo double, hi double, "
    "quality string, admitted string, level string"
)
EVENTS = (
    "time timestamp, time_s double, session bigint, kind string, signal string, variable string, symptom string, because string, "
    "substitution string, need string, relation string, cause string, probability double"
)


def replay(
    model: Model,
    recordings: Recordings,
    *,
    key: str = "vehicle",
    rows: str = "reports",
    inject: str | Sequence[str] = (),
    seed: int = 1,
) -> DataFrame:
    """The whole loop over each recording, as `shsa.replay`.

    ``rows`` are ``reports``: one for each recording, with its figures as JSON, its warnings, and its duration; ``values``: one for each
    published value, as of `Replay.value_table`; or ``events``: one for each decision, as of `Replay.event_table`. Each has the
    column of keys. A recording that fails is one row, with the reason in ``error``.
    """
    schema = {"reports": FOUND, "values": VALUES, "events": EVENTS}.get(rows)
    if schema is None:
        raise ShsaError(f"rows are reports, values or events, not '{rows}'")

    def work(recording: Any) -> pyarrow.Table:
        drive = shsa.replay(model, recording, inject=inject, seed=seed)
        if rows == "values":
            return drive.value_table()
        if rows == "events":
            return drive.event_table()
        return _found(drive.report, None, drive.warnings)

    return _each(recordings, key, schema, work)


def calibrate(
    model: Model,
    recordings: Recordings,
    *,
    key: str = "vehicle",
    false_alarms: float = 0.5,
    split: float | None = None,
    skip: Sequence[tuple[float, float]] = (),
) -> DataFrame:
    """The numbers that each recording needs, as `shsa.calibrate`: a row each, with ``report``, ``patch``, ``warnings``, ``error``."""

    def work(recording: Any) -> pyarrow.Table:
        found = shsa.calibrate(model, recording, false_alarms=false_alarms, split=split, skip=skip)
        return _found(found.report, found.patch, found.warnings)

    return _each(recordings, key, FOUND, work)


def campaign(
    model: Model,
    recordings: Recordings,
    *,
    key: str = "vehicle",
    kinds: Sequence[str] = (),
    amounts: Sequence[float] = (2, 4, 8),
    signals: Sequence[str] = (),
    onsets: int = 3,
    seeds: int = 1,
    duration: float | None = None,
) -> DataFrame:
    """A grid of faults in each recording, as `shsa.campaign`: a row each, with ``report``, ``warnings``, ``error``."""

    def work(recording: Any) -> pyarrow.Table:
        found = shsa.campaign(
            model,
            recording,
            kinds=kinds,
            amounts=amounts,
            signals=signals,
            onsets=onsets,
            seeds=seeds,
            duration=duration,
        )
        return _found(found.report, None, found.warnings)

    return _each(recordings, key, FOUND, work)


def learn(
    recordings: Recordings, model: Model | None = None, *, key: str = "vehicle", need: str | None = None
) -> DataFrame:
    """The relations that hold in each recording, as `shsa.learn`: a row each, with ``report``, ``patch``, ``warnings``, ``error``.

    The rows of a table need a model.
    """

    def work(recording: Any) -> pyarrow.Table:
        found = shsa.learn(recording, model, need=need)
        return _found(found.report, found.patch, found.warnings)

    return _each(recordings, key, FOUND, work)


heal = _spark_stream.heal
values = _spark_stream.values
events = _spark_stream.events


def _found(report: dict[str, Any], patch: str | None, warnings: list[str]) -> pyarrow.Table:
    # Its duration has a column of its own: the rest is the same in each run.
    figures = {name: figure for name, figure in report.items() if name != "elapsed_s"}
    return pyarrow.table({"report": [json.dumps(figures)], "patch": [patch], "warnings": [warnings]})


def _each(recordings: Recordings, key: str, schema: str, work: Work) -> DataFrame:
    if isinstance(recordings, DataFrame):
        return _each_group(recordings, key, schema, work)
    named = _named(recordings, key)
    names, paths = list(named), list(named.values())

    def run(batches: Iterator[pyarrow.RecordBatch]) -> Iterator[pyarrow.RecordBatch]:
        for at in (number for batch in batches for number in batch.column("id").to_pylist()):
            rows = _rows(key, pyarrow.scalar(names[at], pyarrow.string()), schema, lambda: work(paths[at]))
            yield from rows.to_batches()

    session = SparkSession.active()
    numbers = session.range(0, len(paths), 1, numPartitions=max(1, len(paths)))
    return numbers.mapInArrow(run, f"`{key}` string, {schema}, {END}")


def _named(recordings: Any, key: str) -> dict[str, list[str]]:
    """The paths of each recording; workers have other working folders."""
    if isinstance(recordings, Mapping):
        one = (str, os.PathLike)
        lists = {name: [paths] if isinstance(paths, one) else paths for name, paths in recordings.items()}
        return {str(name): [os.path.abspath(path) for path in paths] for name, paths in lists.items()}
    found = sorted(path for path in pathlib.Path(recordings).iterdir() if path.name[0] not in "._")
    if not found:
        raise ShsaError(f"no recordings are in {os.fspath(recordings)}")
    return {path.name.removeprefix(f"{key}="): [os.path.abspath(path)] for path in found}


def _each_group(table: DataFrame, key: str, schema: str, work: Work) -> DataFrame:
    def run(group: tuple[pyarrow.Scalar, ...], rows: pyarrow.Table) -> pyarrow.Table:
        return _rows(key, group[0], schema, lambda: work(_ordered(rows.drop_columns([key]))))

    kind = table.schema[key].dataType.simpleString()
    return table.groupBy(f"`{key}`").applyInArrow(run, f"`{key}` {kind}, {schema}, {END}")


def _ordered(rows: pyarrow.Table) -> pyarrow.Table:
    """In the order of time, then of the values: a shuffle has none."""
    others = sorted(name for name in rows.column_names if name != "time")
    return rows.sort_by([(name, "ascending") for name in ("time", *others)])


def _rows(key: str, name: pyarrow.Scalar, schema: str, work: Callable[[], pyarrow.Table]) -> pyarrow.Table:
    """The rows of a recording; one with the error if it fails."""
    began = perf_counter()
    columns = [column.split() for column in f"{schema}, {END}".split(", ")]
    given = {}
    error, count = None, 1
    try:
        table = work()
        given, count = dict(zip(table.column_names, table.columns)), table.num_rows
    except Exception as problem:  # Whatever is wrong with a recording, the others go on.
        error = f"{type(problem).__name__}: {problem}"
    said = {"error": pyarrow.repeat(pyarrow.scalar(error, pyarrow.string()), count)}
    said["elapsed_s"] = pyarrow.repeat(perf_counter() - began, count)
    absent = pyarrow.nulls(count)
    cells = {
        name: (given | said).get(name, absent).cast(ARROW[kind], safe=False) for name, kind in columns
    }
    return pyarrow.table({key: pyarrow.repeat(name, count), **cells})
