"""What Spark costs, by workers that are pinned to one core each on this machine: the figures of docs/spark.md. Prints tables.

    python python/bench/spark.py renewals                       what an engine decides otherwise that is renewed
    python python/bench/spark.py recordings [COUNT [SECONDS]]   recordings replayed by 1 and 2 workers, and singly
    python python/bench/spark.py stream [VEHICLES [SECONDS [ROUNDS]]]   vehicles healed by 1 and 2 workers
"""

from __future__ import annotations

import json
import os
import pathlib
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy
import pyspark
from pyspark.sql import SparkSession
from pyspark.sql import functions as F

import shsa
import shsa.spark
from shsa import _states

sys.path.append(str(pathlib.Path(__file__).parent.parent / "tests"))
import standalone

FOLDER = pathlib.Path(tempfile.mkdtemp(prefix="shsa-bench-"))
SIGNALS = [f"speed_{number}" for number in range(5)]
MODEL = shsa.Model(
    "shsa: 1\n"
    "variables: { speed: { unit: m/s, range: [-10, 60], max_rate: 6 m/s^2 } }\n"
    "signals:\n"
    + "".join(f"  {name}: {{ variable: speed, rate: 10 Hz, value_error: 0.3 }}\n" for name in SIGNALS)
    + "needs: { speed: { signal: healed, max_age: 300 ms } }\n",
    "five.yaml",
)


def load() -> str:
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"


def cpu_s() -> float:
    """The time that the cores have worked for the cluster, and for this process."""
    parents = {int(it.name): standalone.parent(it) for it in pathlib.Path("/proc").iterdir() if it.name.isdigit()}
    ours = [os.getpid()]
    for process in ours:
        ours.extend(child for child, parent in parents.items() if parent == process)
    return sum(map(worked_s, ours))


def worked_s(process: int) -> float:
    try:
        fields = pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    # Its own time, and that of its children that have ended.
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def spark(workers: int) -> Iterator[SparkSession]:
    """A session on a cluster of so many workers."""
    with standalone.Cluster(FOLDER / f"cluster-{time.monotonic_ns()}", workers, memory="3g", pinned=True) as cluster:
        builder = SparkSession.builder.master(cluster.master)
        settings = {
            "spark.driver.host": "127.0.0.1",
            "spark.driver.bindAddress": "127.0.0.1",
            "spark.ui.enabled": "false",
            "spark.ui.showConsoleProgress": "false",
            "spark.executor.memory": "2g",
            "spark.executor.cores": "1",
            "spark.sql.shuffle.partitions": "4",
            "spark.sql.adaptive.enabled": "false",
            "spark.local.dir": str(FOLDER / "local"),
        }
        for name, value in settings.items():
            builder = builder.config(name, value)
        session = builder.getOrCreate()
        session.sparkContext.setLogLevel("OFF")
        executors = session.sparkContext._jsc.sc().statusTracker().getExecutorInfos
        standalone.wait(lambda: len(executors()) == workers + 1)
        try:
            yield session
        finally:
            session.stop()


def drives(session: SparkSession, vehicles: int, seconds: int, begin: int = 0) -> Any:
    """Rows of vehicles at 10 Hz; of one in five, one sensor is wrong half of the time."""
    level = "15 + 8 * sin(step / 200 + vehicle)"
    broken = "IF(vehicle % 5 = 0 AND step div 300 % 2 = 1, 3, 0)"
    noise = [f"{level} + 0.25 * (2 * rand({number}) - 1)" for number in range(5)]
    noise[0] += f" + {broken}"
    rows = session.range(begin * 10 * vehicles, (begin + seconds) * 10 * vehicles, 1, 4)
    rows = rows.selectExpr(f"id % {vehicles} AS vehicle", f"id div {vehicles} AS step")
    named = [f"{value} AS {name}" for name, value in zip(SIGNALS, noise)]
    return rows.selectExpr("vehicle", "timestamp_millis(1700000000000 + 100 * step) AS time", *named)


def stream(vehicles: int = 10_000, seconds: int = 60, rounds: int = 1) -> None:
    step = 10
    source = FOLDER / "drives"
    with spark(2) as session:
        for number in range(seconds // step):
            drives(session, vehicles, step, number * step).coalesce(2).write.parquet(str(source / f"{number:03}"))
        schema = session.read.parquet(str(source / "000")).schema
    print(f"{vehicles} vehicles, {len(SIGNALS)} signals at 10 Hz, {seconds} s in batches of {step} s; without the first batch:")
    print("| workers | values | s | values a second | CPU for a vehicle and second, ms | state a vehicle, kB | load |")
    print("|---|---|---|---|---|---|---|")
    seen = []
    for workers in (1, 2) * rounds:
        output = FOLDER / f"healed-{time.monotonic_ns()}"
        with spark(workers) as session:
            # Each batch has the two files of a step.
            read = session.readStream.schema(schema).option("maxFilesPerTrigger", 2)
            healed = shsa.spark.heal(read.parquet(str(source / "*")), MODEL, keep=vehicles)
            sink = healed.writeStream.format("parquet").option("checkpointLocation", str(output / "state"))
            before = load()
            query = sink.trigger(availableNow=True).start(str(output / "rows"))
            # The first batch starts Python in each worker.
            standalone.wait(lambda: query.lastProgress or query.exception(), 3600)
            began, before_s = time.monotonic(), cpu_s()
            query.awaitTermination()
            took, cpu = time.monotonic() - began, cpu_s() - before_s
            if query.exception():
                raise SystemExit(str(query.exception()))
            rows = sum(it["numInputRows"] for it in query.recentProgress[1:])
            kept = session.read.format("statestore").load(str(output / "state")).select("value.groupState.*")
            lengths = "+".join(f"ifnull(length({name}), 0)" for name in ("base", "middle", "tail"))
            [size] = kept.selectExpr(f"avg({lengths} + 48)").first()
        values, vehicle_s = rows * len(SIGNALS), rows / 10
        speed = f"{values / took:.0f} | {1000 * cpu / vehicle_s:.3f}"
        seen.append(values / took)
        print(f"| {workers} | {values} | {took:.1f} | {speed} | {size / 1000:.1f} | {before} |", flush=True)
        shutil.rmtree(output)
    ratios = [two / one for one, two in zip(seen[::2], seen[1::2])]
    print("two workers:", ", ".join(f"{ratio:.2f}" for ratio in ratios), "times one")


def recordings(count: int = 200, seconds: int = 300) -> None:
    source = FOLDER / "recordings"
    with spark(2) as session:
        rows = drives(session, count, seconds).orderBy("vehicle", "time")
        table = rows.toPandas()
    source.mkdir()
    for vehicle, own in table.groupby("vehicle"):
        own.drop(columns="vehicle").to_parquet(source / f"vehicle={vehicle}.parquet", index=False)
    paths = {path.stem.removeprefix("vehicle="): path for path in source.iterdir()}
    began = time.monotonic()
    single = {name: shsa.replay(MODEL, path).report for name, path in paths.items()}
    print(f"{count} recordings of {seconds} s; singly {time.monotonic() - began:.1f} s, {load()}")
    for report in single.values():
        report.pop("elapsed_s")
    seen = []
    for workers in (1, 2, 1, 2):
        with spark(workers) as session:
            shsa.spark.replay(MODEL, dict(list(paths.items())[:workers])).collect()
            began = time.monotonic()
            found = shsa.spark.replay(MODEL, paths).collect()
            seen.append(time.monotonic() - began)
        same = sum(row.report == json.dumps(single[row.vehicle]) for row in found)
        print(f"{workers} workers: {seen[-1]:.1f} s, {same} of {count} the same bytes, {load()}", flush=True)
    print(f"two workers: {seen[0] / seen[1]:.2f} and {seen[2] / seen[3]:.2f} times one")


def renewals(vehicles: int = 100, seconds: int = 600) -> None:
    """Drives of ten minutes with six faults each: bias, silence, or a value that stands still, for 3 to 40 s."""
    chance = numpy.random.default_rng(5)
    rows = [drive(chance, seconds) for _ in range(vehicles)]
    values, events = zip(*(outputs(it, _states.NONE) for it in rows))
    print("| renewed every, s | overlap, s | values that differ | events that differ |\n|---|---|---|---|")
    for period, overlap in ((30, 10), (60, 20), (120, 60), (300, 60)):
        renewed = [outputs(it, _states.Renewal(period * 10**9, overlap * 10**9)) for it in rows]
        of_values = sum(len(one - other) for one, (other, _) in zip(values, renewed)) / sum(map(len, values))
        of_events = sum(len(one ^ other) for one, (_, other) in zip(events, renewed)) / sum(map(len, events))
        print(f"| {period} | {overlap} | {100 * of_values:.2f} % | {100 * of_events:.2f} % |", flush=True)


def drive(chance: numpy.random.Generator, seconds: int) -> _states.Rows:
    times = numpy.arange(10 * seconds) / 10
    columns = 15 + 8 * numpy.sin(times / 20) + chance.uniform(-0.25, 0.25, (len(SIGNALS), len(times)))
    for _ in range(6):
        signal, kind = chance.integers(len(SIGNALS)), chance.integers(3)
        begin = chance.uniform(5, seconds - 5)
        during = (times >= begin) & (times < begin + chance.uniform(3, 40))
        wrong = columns[signal][during]
        columns[signal][during] = (wrong + 2.4, numpy.full_like(wrong, numpy.nan), wrong[:1].repeat(len(wrong)))[kind]
    # A row for each moment and signal.
    signals = numpy.tile(numpy.arange(len(SIGNALS), dtype=numpy.uint16), len(times))
    stamps = numpy.repeat((times * 1000).round().astype(numpy.int64) * 10**6, len(SIGNALS))
    given = ~numpy.isnan(columns.T.ravel())
    return _states.Rows(signals[given], stamps[given], stamps[given], columns.T.ravel()[given])


def outputs(rows: _states.Rows, renewal: _states.Renewal) -> tuple[set[Any], set[Any]]:
    _, parts, _ = _states.Engines(MODEL, renewal, 0).give("", None, rows)
    columns = [numpy.concatenate(column).tolist() for column in zip(*(it[:-1] for it in parts))]
    events = [json.loads(event) for it in parts for event in it.events]
    return set(zip(*columns)), {(it["time_ns"], it["kind"], it["signal"], it["variable"]) for it in events}


if __name__ == "__main__":
    os.environ.setdefault("SPARK_LOCAL_IP", "127.0.0.1")
    os.environ.setdefault("PYSPARK_PYTHON", sys.executable)
    print(f"pyspark {pyspark.__version__}, {load()}")
    try:
        {"renewals": renewals, "recordings": recordings, "stream": stream}[sys.argv[1]](*map(int, sys.argv[2:]))
    finally:
        shutil.rmtree(FOLDER, ignore_errors=True)
