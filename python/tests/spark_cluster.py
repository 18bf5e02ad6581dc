"""The package on Apache Spark, from the wheel: recordings and streams by two cores, then a stream by two workers, one of which is killed."""

from __future__ import annotations

import contextlib
import io
import json
import math
import os
import pathlib
import random
import re
import shutil
import signal
import tempfile
import time
import unittest
from typing import Any

import pandas
import pyarrow.compute
import pyarrow.parquet
import standalone
from pyspark.sql import DataFrame, SparkSession
from test_shsa import TANK

import shsa
import shsa.spark
from shsa import _spark_stream, _states

FOLDER = pathlib.Path(tempfile.mkdtemp(prefix="shsa-spark-"))
FLOATS = ["float_1", "float_2", "float_3"]
JAVA = "-XX:TieredStopAtLevel=1 -XX:+UseSerialGC"
RECORDINGS = int(os.environ.get("SHSA_SPARK_RECORDINGS", "12"))


def tank() -> shsa.Model:
    return shsa.Model(TANK, "tank.yaml")


def recording(seed: int, seconds: float = 12.0) -> pandas.DataFrame:
    """Three floats of a tank at 5 Hz; one of them, or none, is wrong or silent from a time on."""
    chance = random.Random(seed)
    broken, begin, bias = chance.randrange(4), chance.uniform(2, seconds - 3), chance.choice([0.5, -1.0, math.nan])
    rows = []
    for step in range(int(5 * seconds)):
        at = 1_700_000_000 + 3600 * (seed % 7) + step / 5
        level = 5 + 2 * math.sin(step / 50 + seed)
        values = [level + chance.uniform(-0.04, 0.04) for _ in FLOATS]
        if broken < 3 and step / 5 >= begin:
            values[broken] += bias
        rows.append((pandas.Timestamp(round(at * 1e6), unit="us", tz="UTC"), *values))
    return pandas.DataFrame(rows, columns=["time", *FLOATS])


def readings(vehicles: range, seconds: float) -> pandas.DataFrame:
    """A row for each reading of several tanks, all from the same moment on."""
    parts = []
    for vehicle in vehicles:
        frame = recording(7 * vehicle, seconds).melt("time", var_name="signal")
        parts.append(frame.assign(vehicle=vehicle))
    return pandas.concat(parts).sort_values(["time", "vehicle", "signal"], ignore_index=True)


# Each batch has a renewal of each engine.
FLEET = readings(range(8), 45)
BATCHES = 6
RENEWAL: dict[str, Any] = {"renew_s": 7.0, "overlap_s": 4.0}


def session(master: str, **settings: str) -> SparkSession:
    """A session that listens on this machine only, in a time zone with another offset in summer."""
    builder = SparkSession.builder.master(master).appName("shsa")
    fixed = {
        "spark.driver.host": "127.0.0.1",
        "spark.driver.bindAddress": "127.0.0.1",
        "spark.ui.enabled": "false",
        # The work is short: compiling it well is not worth its time.
        "spark.driver.extraJavaOptions": JAVA,
        "spark.executor.extraJavaOptions": JAVA,
        "spark.ui.showConsoleProgress": "false",
        "spark.sql.shuffle.partitions": "2",
        # Snappy, the usual one, loads no library where musl is installed beside the machine's own C library.
        "spark.sql.parquet.compression.codec": "gzip",
        "spark.sql.session.timeZone": "America/New_York",
        "spark.sql.streaming.stateStore.maintenanceInterval": "5s",
        "spark.local.dir": str(FOLDER / "local"),
        "spark.sql.warehouse.dir": str(FOLDER / "warehouse"),
    }
    for name, value in (fixed | settings).items():
        builder = builder.config(name, value)
    spark = builder.getOrCreate()
    spark.sparkContext.setLogLevel(os.environ.get("SHSA_SPARK_LOG", "OFF"))
    return spark


def written(rows: pandas.DataFrame, folder: pathlib.Path, files: int) -> pathlib.Path:
    """Rows in several files that come one after the other, cut without regard to their times."""
    folder.mkdir(parents=True)
    size = -(-len(rows) // files)
    for number in range(files):
        path = folder / f"{number:04}.parquet"
        part = rows.iloc[number * size : (number + 1) * size]
        pyarrow.parquet.write_table(
            pyarrow.Table.from_pandas(part, preserve_index=False), path, compression="gzip", coerce_timestamps="us"
        )
        os.utime(path, (1_700_000_000 + number,) * 2)
    return folder


def healing(spark: SparkSession, folder: pathlib.Path, output: pathlib.Path, **options: Any) -> Any:
    """A stream of files, one a batch, healed into files."""
    schema = "time timestamp, signal string, value double, vehicle bigint"
    stream = spark.readStream.schema(schema).option("maxFilesPerTrigger", 1).parquet(str(folder))
    healed = shsa.spark.heal(stream, tank(), **options)
    sink = healed.writeStream.format("json").option("checkpointLocation", str(output / "checkpoint"))
    return sink.trigger(availableNow=True).start(str(output / "rows"))


def given(seconds: list[int], state: _states.State | None) -> _states.Rows:
    """Readings as a batch of a stream gives them."""
    micros = pandas.Series(seconds) * 1_000_000
    frame = pandas.DataFrame({"_time_us": micros, "signal": "float_1", "value": 5.0})
    return _spark_stream._rows([frame], tank(), state)


def undisturbed(spark: SparkSession) -> None:
    """Heals the fleet by the cores of this machine."""
    written(FLEET, FOLDER / "fleet", BATCHES)
    query = healing(spark, FOLDER / "fleet", FOLDER / "undisturbed", **RENEWAL)
    if not query.awaitTermination(300) or query.exception():
        raise AssertionError(query.exception() or "the stream has not ended")


def lines(output: pathlib.Path) -> list[str]:
    """What a stream has written, ordered: files have no order."""
    log = [it for it in (output / "rows/_spark_metadata").iterdir() if it.name[0] != "."]
    files = {json.loads(line)["path"] for it in log for line in it.read_text().splitlines()[1:]}
    paths = [pathlib.Path(path.removeprefix("file://")) for path in files]
    return sorted(line for path in paths for line in path.read_text().splitlines())


def by_one_engine(rows: pandas.DataFrame) -> list[tuple[Any, ...]]:
    """What an engine for each vehicle decides and publishes that goes on all the time."""
    found: list[tuple[Any, ...]] = []
    for vehicle, own in rows.groupby("vehicle"):
        engine = shsa.Engine(tank())
        for row in own.itertuples():
            if not math.isnan(row.value):
                engine.handle(row.signal, row.value, row.time.value)
        for it in engine.outputs():
            if isinstance(it, shsa.Publication):
                [(lo, hi)] = it.bounds
                found.append((vehicle, it.time_ns // 1000, "value", it.need, lo, hi, it.quality))
            else:
                found.append((vehicle, it.time_ns // 1000, it.kind, it.signal, None, None, it.because))
    return sorted(found, key=repr)


def as_one(healed: DataFrame) -> list[tuple[Any, ...]]:
    micros = healed.selectExpr(
        "vehicle", "unix_micros(received)", "kind", "signal", "lo", "hi", "coalesce(quality, because)"
    )
    return sorted((tuple(row) for row in micros.collect()), key=repr)


class Spark(unittest.TestCase):
    """Tests by the cores of this machine share one session, and so its processes of Python."""

    spark: SparkSession

    @classmethod
    def setUpClass(cls) -> None:
        cls.spark = session("local[2]")


class Recordings(Spark):
    def test_each_recording_gives_the_bytes_of_a_single_replay(self) -> None:
        recordings = {seed: recording(seed) for seed in range(RECORDINGS)}
        table = pandas.concat([frame.assign(vehicle=seed) for seed, frame in recordings.items()])
        # Rows in disorder, as a shuffle leaves them.
        frame = self.spark.createDataFrame(table.sample(frac=1, random_state=1)).repartition(4)
        tables = ("reports", "values", "events")
        found = {rows: shsa.spark.replay(tank(), frame, rows=rows).toArrow() for rows in tables}
        decisions = 0
        for seed, single in recordings.items():
            drive = shsa.replay(tank(), single)
            report = {name: it for name, it in drive.report.items() if name != "elapsed_s"}
            own = {rows: table.filter(pyarrow.compute.equal(table["vehicle"], seed)) for rows, table in found.items()}
            self.assertEqual(own["reports"]["report"].to_pylist(), [json.dumps(report)])
            self.assertEqual(as_bytes(own["values"]), as_bytes(drive.value_table()))
            self.assertEqual(as_bytes(own["events"]), as_bytes(drive.event_table()))
            decisions += len(drive.events)
        self.assertGreater(decisions, RECORDINGS / 2)

    def test_a_recording_that_fails_is_a_row_with_its_error(self) -> None:
        folder = FOLDER / "recordings"
        folder.mkdir()
        for seed in range(3):
            recording(seed).to_csv(folder / f"vehicle=car-{seed}", index=False)
            os.rename(folder / f"vehicle=car-{seed}", folder / f"car-{seed}.csv")
        (folder / "broken.csv").write_text("no recording")
        found = shsa.spark.replay(tank(), folder).toPandas().set_index("vehicle")
        self.assertEqual(sorted(found.index), ["broken.csv", "car-0.csv", "car-1.csv", "car-2.csv"])
        self.assertIn("ShsaError: ", found.loc["broken.csv", "error"])
        self.assertTrue(pandas.isna(found.loc["broken.csv", "report"]))
        single = shsa.replay(tank(), folder / "car-1.csv").report
        single.pop("elapsed_s")
        self.assertEqual(json.loads(found.loc["car-1.csv", "report"]), single)
        self.assertTrue(pandas.isna(found.loc["car-1.csv", "error"]))
        values = shsa.spark.replay(tank(), {"a": folder / "broken.csv"}, rows="values").collect()
        self.assertEqual([(row.vehicle, row.lo) for row in values], [("a", None)])
        with self.assertRaisesRegex(shsa.ShsaError, "not 'value'"):
            shsa.spark.replay(tank(), folder, rows="value")

    def test_calibrates_tries_faults_and_learns(self) -> None:
        car = shsa.Model.load("examples/car.yaml")
        days = {day: f"{pathlib.Path.cwd()}/examples/{day}" for day in ("monday", "tuesday")}
        tuned = shsa.spark.calibrate(car, days, key="day", split=1e6).collect()
        self.assertTrue(all("the split at 1000000 s lies outside" in row.error for row in tuned))
        grid = {"kinds": ["bias"], "amounts": [8], "signals": ["/gnss/speed"], "onsets": 1}
        for row in shsa.spark.campaign(car, days, key="day", **grid).collect():
            self.assertEqual(json.loads(row.report), shsa.campaign(car, days[row.day], **grid).report)
        for row in shsa.spark.learn(days, key="day").collect():
            self.assertEqual((row.patch, row.error), (shsa.learn(days[row.day]).patch, None))


def as_bytes(table: pyarrow.Table) -> bytes:
    """The content of a table, in an order of its own; times in whole microseconds, as Spark has them."""
    rows = table.drop_columns([name for name in ("vehicle", "error", "elapsed_s") if name in table.column_names])
    micros = pyarrow.timestamp("us", "UTC")
    kinds = [f.with_type(micros) if pyarrow.types.is_timestamp(f.type) else f for f in rows.schema]
    plain = rows.cast(pyarrow.schema([(f.name, f.type) for f in kinds]), safe=False)
    plain = plain.sort_by([(name, "ascending") for name in plain.column_names])
    sink = pyarrow.BufferOutputStream()
    with pyarrow.ipc.new_stream(sink, plain.schema) as stream:
        stream.write_table(plain.combine_chunks())
    return sink.getvalue().to_pybytes()


class Streams(Spark):
    def test_the_cut_into_batches_changes_nothing(self) -> None:
        undisturbed(self.spark)
        schema = "vehicle bigint, received timestamp, kind string, signal string, lo double, hi double, quality string, because string"
        cut = as_one(self.spark.read.schema(schema).json(str(FOLDER / "undisturbed/rows")))
        whole = shsa.spark.heal(self.spark.read.parquet(str(FOLDER / "fleet")), tank(), **RENEWAL)
        self.assertEqual(cut, as_one(whole))
        self.assertGreater(len({row[2] for row in cut}), 3)

    def test_a_late_row_is_received_now_and_one_behind_the_watermark_is_dropped(self) -> None:
        # The watermark is 10 s after the first two rows, and counts from the next batch but one.
        at = [pandas.Timestamp(1_700_000_000 + second, unit="s", tz="UTC") for second in (0, 40, 41, 42, 20, 5)]
        rows = pandas.DataFrame({"time": at, "signal": "float_1", "value": 5.0, "vehicle": 0})
        folder = written(rows, FOLDER / "late", 3)
        query = healing(self.spark, folder, FOLDER / "late-out", late="30 seconds")
        self.assertTrue(query.awaitTermination(300))
        operators = [operator for it in query.recentProgress for operator in it["stateOperators"]]
        self.assertEqual(sum(operator["numRowsDroppedByWatermark"] for operator in operators), 1)

        state, _, _ = _states.Engines(tank(), _states.NONE, 0).give("", None, given([0, 40], None))
        late = given([20], state)
        self.assertEqual([(late.stamps[0], late.received[0])], [(20 * 10**9, 40 * 10**9)])

    def test_a_column_for_each_signal_gives_what_one_engine_gives(self) -> None:
        wide = pandas.concat([recording(7 * it, 90).assign(vehicle=it) for it in range(4)])
        healed = shsa.spark.heal(self.spark.createDataFrame(wide), tank(), renew_s=None)
        self.assertEqual(as_one(healed), by_one_engine(readings(range(4), 90)))
        published = shsa.spark.values(healed).columns
        self.assertEqual(published[:4], ["vehicle", "time", "received", "signal"])
        [fields] = {type(json.loads(row.fields)) for row in shsa.spark.events(healed).collect()}
        self.assertIs(fields, dict)
        with self.assertRaisesRegex(shsa.ShsaError, "neither `signal` and `value`"):
            shsa.spark.heal(self.spark.createDataFrame(wide[["time", "vehicle"]]), tank())

    def test_a_vehicle_that_falls_silent_is_noticed_while_others_go_on(self) -> None:
        # 5 s of event time a batch; the vehicle 0 stops after 20 s.
        source = self.spark.readStream.format("rate-micro-batch")
        source = source.option("rowsPerBatch", 150).option("advanceMillisPerBatch", 5000)
        rows = source.option("startTimestamp", 1_700_000_000_000).option("numPartitions", 1).load()
        rows = rows.selectExpr(
            "timestamp_millis(1700000000000 + 100 * (value div 3)) AS time",
            "concat('float_', 1 + value % 3) AS signal",
            "5D AS value",
            "(value div 3) % 2 AS vehicle",
        ).where("vehicle = 1 OR time < timestamp_seconds(1700000020)")
        healed = shsa.spark.heal(rows, tank(), late="2 seconds", forget_s=60)
        query = healed.writeStream.format("memory").queryName("silence").start()
        try:
            for _ in range(600):
                found = self.spark.sql("SELECT vehicle, kind, signal FROM silence WHERE kind = 'silent'").collect()
                if len(found) == 3 or query.exception() or not query.isActive:
                    break
                query.awaitTermination(0.2)
        finally:
            query.stop()
        self.assertEqual(sorted((row.vehicle, row.signal) for row in found), [(0, name) for name in FLOATS])


class Guide(Spark):
    def test_the_examples_of_the_guide(self) -> None:
        batch, stream = re.findall(r"```python\n(.*?)```", pathlib.Path("docs/spark.md").read_text(), re.DOTALL)
        incoming = written(readings(range(1), 3).astype({"vehicle": str}), FOLDER / "incoming", 1)
        around = {"car": shsa.Model.load("examples/car.yaml"), "folder": FOLDER / "guide", "spark": self.spark}
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(batch, "docs/spark.md", "exec"), around)
        self.assertRegex(printed.getvalue(), r"/gnss/speed\|\s+2\|")
        exec(compile(stream, "docs/spark.md", "exec"), around | {"incoming": str(incoming)}, names := {})
        names["query"].processAllAvailable()
        names["query"].stop()
        self.assertIsNone(names["query"].exception())


class Workers(unittest.TestCase):
    def test_a_killed_worker_changes_nothing_in_the_output(self) -> None:
        spark = session("local[2]")
        if not (FOLDER / "undisturbed").exists():
            undisturbed(spark)
        spark.stop()
        with standalone.Cluster(FOLDER / "cluster", workers=2) as cluster:
            spark = session(cluster.master, **{"spark.executor.memory": "512m", "spark.executor.cores": "1"})
            try:
                executors = spark.sparkContext._jsc.sc().statusTracker().getExecutorInfos
                # The driver counts as one.
                standalone.wait(lambda: len(executors()) == 3)
                query = healing(spark, FOLDER / "fleet", FOLDER / "disturbed", **RENEWAL)
                standalone.wait(lambda: (query.lastProgress or {}).get("batchId", 0) >= 1)
                standalone.wait(lambda: query.status["isTriggerActive"])
                cluster.kill(1)
                standalone.wait(lambda: len(executors()) == 2)
                self.assertLess(query.lastProgress["batchId"], BATCHES - 2, "the worker was killed too late")
                self.assertTrue(query.awaitTermination(300))
                self.assertIsNone(query.exception())
            finally:
                spark.stop()
        self.assertGreater(len(lines(FOLDER / "undisturbed")), 1000)
        self.assertEqual(lines(FOLDER / "disturbed"), lines(FOLDER / "undisturbed"))


class Timed(unittest.TextTestResult):
    """Says how long each test took."""

    def startTest(self, test: unittest.TestCase) -> None:
        self.began = time.monotonic()
        super().startTest(test)

    def addSuccess(self, test: unittest.TestCase) -> None:
        super().addSuccess(test)
        self.stream.writeln(f"    {time.monotonic() - self.began:.1f} s")


if __name__ == "__main__":
    signal.alarm(600)
    try:
        unittest.main(verbosity=2, testRunner=unittest.TextTestRunner(verbosity=2, resultclass=Timed))
    finally:
        shutil.rmtree(FOLDER, ignore_errors=True)
