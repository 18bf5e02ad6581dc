"""A cluster of Spark's own kind on this machine: a master and workers, each a process, none of which outlives the test."""

from __future__ import annotations

import os
import pathlib
import re
import signal
import subprocess
import time
from collections.abc import Callable

import pyspark


def wait(condition: Callable[[], object], seconds: float = 600) -> None:
    """Waits until a condition holds; for long, as a busy machine may take minutes to start a cluster."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("what was waited for has not happened")
        time.sleep(0.05)


class Cluster:
    """With one core for each worker; a worker that is pinned, with all its processes, has one and no more."""

    def __init__(self, folder: pathlib.Path, workers: int, memory: str = "1g", pinned: bool = False) -> None:
        self.folder = folder
        self.memory = memory
        self.pinned = pinned
        folder.mkdir(parents=True)
        self.processes: list[subprocess.Popen[bytes]] = []
        self.count = workers

    def __enter__(self) -> Cluster:
        try:
            self._start("master.Master", "--port", "0")
            self.master = self._printed(0, r"Starting Spark master at (spark://\S+)")
            for number in range(self.count):
                work = str(self.folder / f"work-{number}")
                self._start("worker.Worker", "--cores", "1", "--memory", self.memory, "--work-dir", work, self.master, core=number)
            for number in range(self.count):
                self._printed(number + 1, r"(Successfully registered) with master")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        for process in reversed(self.processes):
            for child in [*children(process.pid), process.pid]:
                end(child)
            process.wait(timeout=60)

    def kill(self, number: int) -> None:
        """Kills a worker and its executors, without a chance to say goodbye."""
        worker = self.processes[number + 1]
        executors = children(worker.pid)
        # The worker first, or it would start another executor.
        end(worker.pid)
        for executor in executors:
            end(executor)
        worker.wait(timeout=60)

    def _start(self, name: str, *arguments: str, core: int | None = None) -> None:
        home = pathlib.Path(pyspark.__file__).parent
        options = ["-Xmx256m", "-XX:+UseSerialGC", "-XX:TieredStopAtLevel=1", "-cp", f"{home}/jars/*"]
        command = ["java", *options, f"org.apache.spark.deploy.{name}", "--host", "127.0.0.1", "--webui-port", "0"]
        environment = os.environ | {"SPARK_LOCAL_IP": "127.0.0.1", "SPARK_HOME": str(home), "SPARK_SCALA_VERSION": "2.13"}
        if core is not None and self.pinned:
            command = ["taskset", "--cpu-list", str(core % (os.cpu_count() or 1)), *command]
        with open(self._log(len(self.processes)), "wb") as log:
            started = subprocess.Popen([*command, *arguments], env=environment, stdout=log, stderr=log)
        self.processes.append(started)

    def _log(self, number: int) -> pathlib.Path:
        return self.folder / f"{number}.log"

    def _printed(self, number: int, pattern: str) -> str:
        found: list[str] = []

        def is_there() -> bool:
            text = self._log(number).read_text(errors="replace")
            if self.processes[number].poll() is not None:
                raise RuntimeError(f"the process has ended: {text}")
            found.extend(re.findall(pattern, text)[:1])
            return bool(found)

        wait(is_there)
        return found[0]


def children(process: int) -> list[int]:
    """The processes that a process has started."""
    return [int(it.name) for it in pathlib.Path("/proc").iterdir() if it.name.isdigit() and parent(it) == process]


def parent(process: pathlib.Path) -> int | None:
    """The parent of a process, by its folder in ``/proc``; ``None`` if it has ended."""
    try:
        # The name, in brackets, may contain anything.
        return int((process / "stat").read_text().rpartition(")")[2].split()[1])
    except (FileNotFoundError, ProcessLookupError):
        return None


def end(process: int) -> None:
    """Kills a process, if it is there."""
    try:
        os.kill(process, signal.SIGKILL)
    except ProcessLookupError:
        pass
