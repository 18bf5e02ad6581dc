"""Every function of the package, from the wheel, from the project's folder."""

import math
import pathlib
import queue
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.request

import pandas
import pyarrow
import pyarrow.parquet

import shsa

TANK = """
shsa: 1
variables: { level: { unit: cm, range: [0, 10 m] } }
signals:
  float_1: { variable: level, unit: m, rate: 5 Hz, value_error: 0.05 }
  float_2: { variable: level, unit: m, rate: 5 Hz, value_error: 0.05 }
  float_3: { variable: level, unit: m, rate: 5 Hz, value_error: 0.05 }
needs: { level: { signal: healed_level, max_age: 1 s } }
"""


def columns(seconds: float = 20.0, wrong_from: float = 10.0) -> dict[str, list[float]]:
    """Three floats of a tank at 5 Hz; the first one is wrong from a time on."""
    times = [step / 5 for step in range(int(5 * seconds))]
    level = [5 + 2 * math.sin(at / 10) + 0.01 * math.sin(70 * at) for at in times]
    wrong = [value + (0.5 if at >= wrong_from else 0) for at, value in zip(times, level)]
    return {"time": times, "float_1": wrong, "float_2": level, "float_3": list(level)}


def kinds(drive: shsa.Replay) -> list[tuple[str, str | None]]:
    return [(event["kind"], event["signal"]) for event in drive.events]


class Written:
    """The compiled part of a replay, which remembers where it has written the last table."""

    def __init__(self, compiled: object) -> None:
        self.compiled = compiled
        self.memory = b""

    def last(self) -> range:
        begin = pyarrow.py_buffer(self.memory).address
        return range(begin, begin + len(self.memory) + 1)

    def __getattr__(self, name: str) -> object:
        def written() -> object:
            table = getattr(self.compiled, name)()
            self.memory = table[0]
            return table

        return written


class Models(unittest.TestCase):
    def test_a_wrong_model_is_refused_with_every_place(self) -> None:
        text = "shsa: 1\nvariables: { level: }\nsignals: { a: { variable: levl }, b: { variable: leve } }\n"
        with self.assertRaises(shsa.ModelError) as caught:
            shsa.Model(text, "tank.yaml")
        self.assertIn("tank.yaml:3:27", str(caught.exception))
        errors = [problem for problem in caught.exception.problems if problem.severity == "error"]
        self.assertEqual([(error.line, error.column) for error in errors], [(3, 27), (3, 50)])
        self.assertEqual(errors[0].help, "did you mean `level`?")
        self.assertIsInstance(caught.exception, ValueError)

    def test_a_missing_file_is_told(self) -> None:
        with self.assertRaises(FileNotFoundError):
            shsa.Model.load("no/such.yaml")

    def test_elements_have_names(self) -> None:
        tank = shsa.Model(TANK, "tank.yaml")
        self.assertEqual((tank.variables, tank.relations, tank.needs), (["level"], [], ["healed_level"]))
        self.assertEqual(repr(tank), "Model('tank.yaml', 3 signals, 1 needs)")
        self.assertEqual(tank.name, "tank.yaml")

    def test_warnings_are_those_of_the_command(self) -> None:
        text = TANK.replace("max_age: 1 s", "max_age: 1 s, max_width: 1 mm")
        found = shsa.Model(text).check()
        self.assertTrue(any("nothing meets what the need healed_level demands" in it.message for it in found))

    def test_plans(self) -> None:
        car = shsa.Model.load("examples/car.yaml")
        ways = car.plan("speed", behind=True)
        self.assertEqual([way.utility for way in ways], sorted((way.utility for way in ways), reverse=True))
        self.assertEqual(len(car.plan("speed", top=1, behind=True)), 1)
        without = car.plan("speed", exclude=["/gnss/speed", "/radar/speed"])
        self.assertFalse(any("/gnss/speed" in way.signals for way in without))
        with self.assertRaisesRegex(shsa.ShsaError, "no variable 'sped'; did you mean 'speed'"):
            car.plan("sped")
        with self.assertRaisesRegex(shsa.ShsaError, "no signal '/gnss/sped'; did you mean '/gnss/speed'"):
            car.plan("speed", exclude=["/gnss/sped"])

    def test_analyses(self) -> None:
        found = shsa.Model(TANK).analyze(additions=0)
        self.assertEqual([it["signal"] for it in found["signals"]], ["float_1", "float_2", "float_3"])
        self.assertTrue(all(it["substitutable"] for it in found["signals"]))


class Replays(unittest.TestCase):
    def setUp(self) -> None:
        self.tank = shsa.Model(TANK, "tank.yaml")

    def check(self, recordings: shsa.Recordings) -> None:
        drive = shsa.replay(self.tank, recordings)
        self.assertEqual(kinds(drive)[0], ("failed", "float_1"))
        self.assertEqual(drive.report["observations"], 300)
        self.assertTrue(drive.report["needs"]["level"]["met"])
        self.assertEqual(drive.warnings, [])

    def test_a_dictionary_of_arrays(self) -> None:
        self.check(columns())

    def test_a_data_frame_with_a_column_of_times(self) -> None:
        self.check(pandas.DataFrame(columns()))

    def test_a_data_frame_with_moments_as_index(self) -> None:
        frame = pandas.DataFrame(columns())
        frame.index = pandas.Timestamp("2026-05-01", tz="UTC") + pandas.to_timedelta(frame.pop("time"), unit="s")
        self.check(frame)

    def test_a_table_of_arrow(self) -> None:
        self.check(pyarrow.table(columns()))

    def test_several_tables_by_their_names(self) -> None:
        car = shsa.Model.load("examples/car.yaml")
        files = sorted(pathlib.Path("examples/monday").glob("*.csv"))
        frames = {file.stem: pandas.read_csv(file) for file in files}
        self.assertGreater(len(frames), 1)
        from_files, from_frames = shsa.replay(car, "examples/monday").report, shsa.replay(car, frames).report
        self.assertEqual(from_files["observations"], from_frames["observations"])
        self.assertEqual(from_files["signals"], from_frames["signals"])
        self.assertEqual(from_files["needs"], from_frames["needs"])

    def test_a_file_gives_what_its_data_frame_gives(self) -> None:
        frame = pandas.DataFrame(columns())
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "tank.csv"
            frame.to_csv(path, index=False)
            from_file = shsa.replay(self.tank, path).report
        from_frame = shsa.replay(self.tank, frame).report
        from_file.pop("elapsed_s"), from_frame.pop("elapsed_s")
        self.assertEqual(from_file, from_frame)

    def test_missing_values_are_none(self) -> None:
        frame = pandas.DataFrame(columns(wrong_from=99))
        frame.loc[frame["time"] >= 10, "float_1"] = math.nan
        drive = shsa.replay(self.tank, frame)
        self.assertEqual(kinds(drive)[0], ("silent", "float_1"))
        self.assertEqual(drive.report["signals"]["float_1"]["missing"], 50)

    def test_faults_are_injected(self) -> None:
        clean = columns(wrong_from=99)
        self.assertEqual(shsa.replay(self.tank, clean).events, [])
        drive = shsa.replay(self.tank, clean, inject="bias=0.5:float_2@10s..")
        self.assertEqual(kinds(drive)[0], ("failed", "float_2"))
        self.assertLess(drive.report["needs"]["level"]["max_error"], 60)
        noisy = [
            shsa.replay(self.tank, clean, inject=["noise=0.5:float_2@10s.."], seed=seed).events
            for seed in (1, 1, 2)
        ]
        self.assertEqual(noisy[0], noisy[1])
        self.assertNotEqual(noisy[0], noisy[2])
        late = shsa.replay(self.tank, clean, inject="drop:float_3@99s..")
        self.assertEqual(late.warnings, ["the fault of float_3 changes nothing"])

    def test_wrong_faults_and_recordings_are_told(self) -> None:
        clean = columns()
        with self.assertRaisesRegex(shsa.ShsaError, "the fault 'bias'"):
            shsa.replay(self.tank, clean, inject="bias")
        with self.assertRaisesRegex(shsa.ShsaError, "no signal 'float'"):
            shsa.replay(self.tank, clean, inject="drop:float@1s..")
        with self.assertRaisesRegex(shsa.ShsaError, "no/such.csv"):
            shsa.replay(self.tank, "no/such.csv")
        with self.assertRaisesRegex(shsa.ShsaError, "none of the model's signals"):
            shsa.replay(self.tank, {"time": [0.0, 1.0], "other": [1.0, 2.0]})

    def test_results_are_tables(self) -> None:
        drive = shsa.replay(self.tank, columns())
        values = drive.to_pandas()
        self.assertEqual(len(values), drive.report["needs"]["level"]["published"])
        self.assertEqual(set(values["quality"]), {"good", "substitute"})
        self.assertEqual(drive.value_table().num_rows, len(values))
        events = drive.event_table().to_pandas()
        self.assertEqual(list(events["kind"]), [event["kind"] for event in drive.events])

    def test_tables_are_valid_and_come_back_from_a_file(self) -> None:
        drive = shsa.replay(self.tank, columns())
        for table in (drive.value_table(), drive.event_table()):
            table.validate(full=True)
            sink = pyarrow.BufferOutputStream()
            pyarrow.parquet.write_table(table, sink)
            self.assertTrue(pyarrow.parquet.read_table(sink.getvalue()).equals(table))
        values = drive.value_table()
        kinds = {"time": pyarrow.timestamp("ns", "UTC"), "lo": pyarrow.float64(), "signal": pyarrow.string()}
        self.assertEqual({name: values.schema.field(name).type for name in kinds}, kinds)
        self.assertEqual(values["element"].null_count, values.num_rows)
        self.assertEqual(values["signal"].unique().to_pylist(), ["healed_level"])
        self.assertEqual(shsa.replay(self.tank, columns(wrong_from=99)).event_table().num_rows, 0)

    def test_columns_are_not_copied(self) -> None:
        drive = shsa.replay(self.tank, columns())
        written = Written(drive._replay)
        drive._replay = written  # type: ignore[assignment]
        for made in (drive.value_table, lambda: pyarrow.table(drive), drive.event_table):
            table = made()
            for name in table.column_names:
                chunks = table[name].chunks
                self.assertEqual(len(chunks), 1, name)
                for buffer in filter(None, chunks[0].buffers()):
                    self.assertIn(buffer.address, written.last(), name)
        frame = drive.to_pandas(copy=False)
        for name in ("lo", "hi"):
            self.assertIn(frame[name].to_numpy().__array_interface__["data"][0], written.last(), name)
        for name in ("time", "received"):
            self.assertIn(frame[name].array.asi8.__array_interface__["data"][0], written.last(), name)
        own = drive.to_pandas()
        own.loc[0, "lo"] = -1.0
        self.assertEqual((own["lo"][0], list(own["lo"][1:])), (-1.0, list(frame["lo"][1:])))

    def test_nothing_is_leaked(self) -> None:
        table = pyarrow.table(columns(seconds=4))

        def resident() -> int:
            status = pathlib.Path("/proc/self/status").read_text()
            return int(status.split("VmRSS:")[1].split()[0])

        def replays(count: int) -> None:
            for _ in range(count):
                shsa.replay(self.tank, table).report

        replays(200)
        before = resident()
        replays(1000)
        self.assertLess(resident() - before, 1024, "kB more after 1,000 replays")


class LongWork(unittest.TestCase):
    def setUp(self) -> None:
        self.tank = shsa.Model(TANK, "tank.yaml")
        self.day = columns(seconds=2 * 3600, wrong_from=1e9)

    def test_other_threads_run_meanwhile_and_progress_is_told(self) -> None:
        told: list[tuple[int, int]] = []
        turns = 0
        is_over = threading.Event()

        def turn() -> None:
            nonlocal turns
            while not is_over.wait(0.001):
                turns += 1

        other = threading.Thread(target=turn)
        other.start()
        drive = shsa.replay(self.tank, self.day, progress=lambda done, total: told.append((done, total)))
        is_over.set()
        other.join()
        self.assertGreater(turns, 10)
        self.assertEqual(drive.report["observations"], 3 * len(self.day["time"]))
        self.assertTrue(all(done <= total for done, total in told))
        self.assertEqual(told[-1][1], drive.report["observations"])

    def test_an_exception_in_the_progress_ends_the_work(self) -> None:
        class Enough(Exception):
            pass

        def enough(done: int, total: int) -> None:
            raise Enough

        for work in (
            lambda: shsa.replay(self.tank, self.day, progress=enough),
            lambda: shsa.campaign(self.tank, self.day, progress=enough),
        ):
            with self.assertRaises(Enough):
                work()

    def test_an_interrupt_ends_the_work(self) -> None:
        import _thread

        # A process that was started in the background of a shell ignores the interrupt.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        self.addCleanup(signal.signal, signal.SIGINT, before)
        interrupt = threading.Timer(0.2, _thread.interrupt_main)
        interrupt.start()
        with self.assertRaises(KeyboardInterrupt):
            shsa.campaign(self.tank, self.day, onsets=1000)


class Lab(unittest.TestCase):
    def test_what_cannot_be_calibrated_is_told(self) -> None:
        # The guide calibrates: that takes seconds.
        car = shsa.Model.load("examples/car.yaml")
        with self.assertRaisesRegex(shsa.ShsaError, "the split at 1000000 s lies outside"):
            shsa.calibrate(car, "examples/monday", split=1e6)
        with self.assertRaisesRegex(shsa.ShsaError, "none of the model's signals"):
            shsa.calibrate(car, {"time": [0.0, 1.0], "other": [1.0, 2.0]})

    def test_tries_faults(self) -> None:
        tank = shsa.Model(TANK)
        table = columns(seconds=60, wrong_from=99)
        found = shsa.campaign(tank, table, kinds=["bias"], amounts=[8], signals=["float_1"], onsets=2)
        [cell] = found.report["cells"]
        self.assertEqual((cell["runs"], cell["detected"]), (2, 2))
        with self.assertRaisesRegex(shsa.ShsaError, "no kind of fault 'bais'; known are stuck, bias"):
            shsa.campaign(tank, table, kinds=["bais"])

    def test_learns(self) -> None:
        found = shsa.learn(["examples/monday", "examples/tuesday"])
        self.assertIn("relations", found.patch)
        with self.assertRaisesRegex(shsa.ShsaError, "with a model"):
            shsa.learn(columns())

    def test_examines(self) -> None:
        chance = random.Random(1)
        times = [step / 5 for step in range(3_000)]
        level = [5 + 2 * math.sin(at / 10) for at in times]
        floats = {f"float_{it}": [value + chance.gauss(0, 0.01) for value in level] for it in (1, 2, 3)}
        sound = shsa.doctor({"time": times, **floats})
        self.assertEqual((sound.findings, sound.warnings), ([], []))
        self.assertTrue(shsa.Model(sound.model).needs)
        floats["float_2"] = [it + (0.5 if 400 < at < 460 else 0) for at, it in zip(times, floats["float_2"])]
        found = shsa.doctor({"time": times, **floats})
        self.assertEqual(found.findings[0]["signals"], ["float_2"])
        self.assertIn("float_2", found.page)
        with self.assertRaisesRegex(shsa.ShsaError, "nothing in the recording can be a signal"):
            shsa.doctor({"time": times, "flat": [1.0] * len(times)})


class Engines(unittest.TestCase):
    def test_a_loop_of_its_own(self) -> None:
        tank = shsa.Model(TANK)
        engine, data = shsa.Engine(tank), columns()
        self.assertIsNone(engine.next_deadline())
        outputs: list[shsa.Publication | shsa.Event] = []
        now = 0
        for step, at in enumerate(data["time"]):
            now = round(at * 1e9)
            for signal in tank.signals:
                engine.handle(signal, data[signal][step], now, stamp_ns=now)
            engine.advance(now)
            outputs.extend(engine.outputs())
        events = [it for it in outputs if isinstance(it, shsa.Event)]
        values = [it for it in outputs if isinstance(it, shsa.Publication)]
        self.assertEqual((events[0].kind, events[0].signal), ("failed", "float_1"))
        self.assertIn("float_1 says", events[0].because)
        self.assertGreater(events[0].fields["probability"], 0.9)
        self.assertEqual((values[-1].need, values[-1].quality), ("healed_level", "substitute"))
        self.assertAlmostEqual(values[-1].value, 100 * data["float_2"][-1], delta=20)
        self.assertEqual(engine.verdict("float_1"), "failed")
        self.assertGreater(engine.next_deadline() or 0, now)

        other = shsa.Engine(tank)
        other.restore(engine.snapshot(), now)
        self.assertEqual(other.verdict("float_1"), "failed")
        engine.advance(now + 10_000_000_000)
        self.assertEqual(engine.verdict("float_2"), "silent")

    def test_what_is_wrong_is_told(self) -> None:
        engine = shsa.Engine(shsa.Model(TANK))
        with self.assertRaisesRegex(shsa.ShsaError, "no signal 'float_9'"):
            engine.handle("float_9", 1.0, 0)
        with self.assertRaisesRegex(shsa.ShsaError, "no signal 'x'"):
            engine.verdict("x")
        with self.assertRaisesRegex(shsa.ShsaError, "line 1"):
            engine.restore("{", 0)

    def test_bounds_and_vectors(self) -> None:
        model = shsa.Model(
            "shsa: 1\nvariables: { scan: { unit: m, shape: vector }, least: { unit: m } }\n"
            "relations: { nearest: least = min(scan) }\n"
            "signals: { lidar: { variable: scan, rate: 10 Hz, value_error: 0.1 }, sonar: { variable: least } }\n"
            "needs: { scan: { signal: out, max_age: 1 s }, least: { signal: near, max_age: 1 s } }\n"
        )
        engine = shsa.Engine(model)
        engine.handle("lidar", [3.0, 1.5], 0)
        engine.handle("sonar", (1.4, 1.6), 0)
        engine.advance(0)
        published = {it.need: it.bounds for it in engine.outputs() if isinstance(it, shsa.Publication)}
        self.assertEqual(len(published["out"]), 2)
        self.assertEqual(published["near"], [(1.4, 1.6)])


class Runs(unittest.TestCase):
    def test_a_run_between_functions(self) -> None:
        healed: queue.Queue[tuple[str, object, str | None, str | None]] = queue.Queue()
        tank = shsa.Model(TANK, "plant/tank.yaml")
        with shsa.Runtime(tank, publish=lambda *value: healed.put(value), http="127.0.0.1:0") as run:
            # The first one waits for the other one to speak.
            run.push("float_2", 5.0)
            run.push("float_1", 5.0)
            self.assertEqual(healed.get(timeout=60)[2:], ("Good", "float_1"))
            run.order(order="forbid", signal="float_1")
            run.push("float_2", (4.9, 5.1))
            need, bounds, quality, source = healed.get(timeout=60)
            self.assertEqual((need, quality, source), ("healed_level", "UncertainSubstituteValue", "float_2"))
            self.assertIsInstance(bounds, tuple)
            self.assertEqual(run.state()["models"]["tank"]["signals"]["float_2"]["accepted"], 2)
            self.assertIn("substituted", [event["kind"] for event in run.events()])
            with urllib.request.urlopen(run.address or "", timeout=60) as page:
                self.assertIn(b"<html", page.read())
            with self.assertRaisesRegex(shsa.ShsaError, "float_9"):
                run.order(order="forbid", signal="float_9")
        self.assertIsNone(run.stop())
        with self.assertRaises(shsa.ShsaError):
            run.state()

    def test_a_run_says_what_becomes_of_a_need_and_of_its_connection(self) -> None:
        values: queue.Queue[tuple[object, ...]] = queue.Queue()
        states: queue.Queue[dict[str, object]] = queue.Queue()
        uncertain = TANK.replace("max_age: 1 s", "max_age: 400 ms, max_width: 2 m")

        def until(wanted: str) -> dict[str, object]:
            while (status := states.get(timeout=60))["quality"] != wanted:
                pass
            return status

        with shsa.Runtime(
            shsa.Model(uncertain, "tank.yaml"),
            publish=lambda *value: values.put(value),
            stamped=lambda *value: values.put(value),
            status=states.put,
        ) as run:
            self.assertEqual(until("Bad")["signal"], "healed_level")
            run.push("float_1", 5.0, stamp_ns=time.time_ns() - 10_000_000)
            plain, stamped = values.get(timeout=60), values.get(timeout=60)
            self.assertEqual(stamped[:4], plain)
            self.assertLess(abs(time.time_ns() - int(str(stamped[4]))), 5_000_000_000)
            self.assertEqual(until("Bad")["source"], None)
            run.disconnected("the cable is cut")
            run.disconnected("the cable is still cut")
            run.connected()
            # One of two is wrong, and nobody knows which: their bounds go out.
            found: tuple[object, ...] = ()  # in cm, as the variable is
            end = time.monotonic() + 60
            while found != ((495.0, 605.0), "UncertainSubNormal"):
                self.assertLess(time.monotonic(), end, found)
                run.push("float_1", 5.0)
                run.push("float_2", 6.0)
                # What comes at once after a silence may have waited, and does not count.
                time.sleep(0.2)
                while not values.empty():
                    found = values.get()[1:3]
            events: list[str] = []
            while "connected" not in events:
                events += [event["kind"] for event in run.events()]
                time.sleep(0.01)
            self.assertEqual(events.count("disconnected"), 1)

    def test_a_run_ends_with_its_process(self) -> None:
        program = (
            "import shsa, sys\n"
            f"run = shsa.Runtime(shsa.Model({TANK!r}), publish=lambda *value: None)\n"
            "run.push('float_1', 5.0)\n"
        )
        done = subprocess.run([sys.executable, "-c", program], timeout=120, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_a_bus_that_is_none_is_told(self) -> None:
        with self.assertRaisesRegex(shsa.ShsaError, "is no bus; write memory, mqtt"):
            shsa.Runtime(shsa.Model(TANK), bus="carrier pigeon")
        with self.assertRaisesRegex(shsa.ShsaError, "is no address"):
            shsa.Runtime(shsa.Model(TANK), http="here")


if __name__ == "__main__":
    unittest.main()
