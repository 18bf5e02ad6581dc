"""Self-healing of sensor signals.

A model says how the variables of a system relate to each other. From it, ``shsa`` notices a sensor that sends wrong values or falls
silent, names it, and provides its values from the others, with the reasons. The model, the faults and the figures are those of the
command: see its reference.

>>> import shsa
>>> tank = shsa.Model('''
... shsa: 1
... variables: { level: { unit: m, range: [0, 10] } }
... signals:
...   float_1: { variable: level, rate: 5 Hz, value_error: 0.05 }
...   float_2: { variable: level, rate: 5 Hz, value_error: 0.05 }
...   float_3: { variable: level, rate: 5 Hz, value_error: 0.05 }
... needs: { level: { signal: healed_level, max_age: 1 s } }
... ''', "tank.yaml")
>>> tank.signals
['float_1', 'float_2', 'float_3']
"""

from __future__ import annotations

import json
import os
import pathlib
import weakref
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Optional, Union

from . import _recordings, _shsa, _tables
from ._errors import ModelError, Problem, ShsaError, problems
from ._recordings import Recordings

if TYPE_CHECKING:
    import pandas
    import pyarrow

__all__ = [
    "Calibration",
    "Campaign",
    "Diagnosis",
    "Engine",
    "Event",
    "Learned",
    "Model",
    "ModelError",
    "Problem",
    "Publication",
    "Replay",
    "Runtime",
    "ShsaError",
    "Substitution",
    "calibrate",
    "campaign",
    "doctor",
    "learn",
    "replay",
]
__version__ = version("shsa")

Progress = Optional[Callable[[int, int], object]]
"""Called about twenty times a second with what is done and what is to be done; an exception in it ends the work."""


@dataclass(frozen=True)
class Substitution:
    """A way of knowing a variable."""

    utility: float
    """How good it is: higher is better."""
    relations: list[str]
    variables: list[str]
    signals: list[str]
    """The best of the signals that its sources have."""
    formula: str
    """Over its sources, in SI."""


class Model:
    """A model without errors: YAML or JSON.

    Raises `ModelError` with every problem and its place. ``name`` is what problems call the text.
    """

    def __init__(self, text: str, name: str = "model") -> None:
        self._model = _shsa.Model(text, name)
        self.text = text
        """YAML or JSON."""
        self._names: dict[str, list[str]] = json.loads(self._model.names())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Model:
        """Reads a model from a file.

        >>> shsa.Model.load("examples/car.yaml").needs
        ['/car/speed']
        """
        return cls(pathlib.Path(path).read_text(encoding="utf-8"), os.fspath(path))

    @property
    def name(self) -> str:
        """What problems call the text."""
        return self._model.name

    @property
    def variables(self) -> list[str]:
        """The names of the variables, in the order of the text."""
        return self._names["variables"]

    @property
    def relations(self) -> list[str]:
        """The names of the relations, in the order of the text."""
        return self._names["relations"]

    @property
    def signals(self) -> list[str]:
        """The names of the signals, in the order of the text."""
        return self._names["signals"]

    @property
    def needs(self) -> list[str]:
        """The names under which the needs are published, in the order of the text."""
        return self._names["needs"]

    def check(self) -> list[Problem]:
        """The warnings and notes about the model, as ``shsa check`` tells them; errors are raised at its making.

        >>> tank.check()
        []
        """
        return problems(self._model.check())

    def plan(
        self,
        variable: str,
        *,
        top: int = 10,
        exclude: Sequence[str] = (),
        behind: bool = False,
        limit: int | None = None,
    ) -> list[Substitution]:
        """The best substitutions of a variable, best first, at most ``top``.

        ``exclude`` are signals that must not be used, ``behind`` finds those behind variables that signals carry, too, and ``limit`` is
        the most decisions of the search.

        >>> car = shsa.Model.load("examples/car.yaml")
        >>> [way.signals for way in car.plan("speed", exclude=["/gnss/speed"])][0]
        ['/radar/speed']
        """
        plan = json.loads(self._model.plan(variable, top, list(exclude), behind, limit))
        return [Substitution(**found) for found in plan["substitutions"]]

    def analyze(self, *, additions: int = 10, only_runnable: bool = False) -> dict[str, Any]:
        """Which faults can be detected, isolated and survived, as ``shsa analyze --json`` prints it.

        ``additions`` is how many added sensors are rated, ``only_runnable`` counts on relations with a formula only.

        >>> tank.analyze()["signals"][0]["detectable"]
        True
        """
        analysis: dict[str, Any] = json.loads(self._model.analyze(additions, only_runnable))
        return analysis

    def __reduce__(self) -> tuple[type[Model], tuple[str, str]]:
        # Other processes make it anew of its text.
        return Model, (self.text, self.name)

    def __repr__(self) -> str:
        return f"Model({self.name!r}, {len(self.signals)} signals, {len(self.needs)} needs)"


class Replay:
    """A replay that is over. It is a table of its published values for whatever takes tables of Arrow: ``polars.DataFrame(drive)``,
    DuckDB."""

    def __init__(self, compiled: _shsa.Replay) -> None:
        self._replay = compiled
        self._report: dict[str, Any] | None = None

    @property
    def warnings(self) -> list[str]:
        """What is to be told of the recordings."""
        return self._replay.warnings

    @property
    def report(self) -> dict[str, Any]:
        """All figures, as ``shsa replay --json`` prints them."""
        if self._report is None:
            self._report = json.loads(self._replay.report() or "{}")
        return self._report

    @property
    def events(self) -> list[dict[str, Any]]:
        """The decisions, with their reasons."""
        events: list[dict[str, Any]] = self.report["events"]
        return events

    def event_table(self) -> pyarrow.Table:
        """The decisions as a table of Arrow, as ``shsa replay --events`` writes it."""
        return _tables.arrow(self._replay.events())

    def value_table(self) -> pyarrow.Table:
        """Every published value as a table of Arrow, as ``shsa replay --output`` writes it."""
        return _tables.arrow(self._replay.values())

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        """The table of values over the C interface of Arrow."""
        return self.value_table().__arrow_c_stream__(requested_schema)

    def to_pandas(self, *, copy: bool = True) -> pandas.DataFrame:
        """Every published value as a data frame. Without ``copy``, numbers and times are not copied, and can only be read."""
        return _tables.data_frame(self.value_table(), copy=copy)


def replay(
    model: Model,
    recordings: Recordings,
    *,
    inject: str | Sequence[str] = (),
    seed: int = 1,
    progress: Progress = None,
) -> Replay:
    """The whole loop over recordings: files and folders, a data frame, a table of Arrow, a dictionary of arrays, or of tables.

    ``inject`` are faults as ``KIND[=AMOUNT]:SIGNAL@FROM..TO``, ``seed`` is that of what is random in them.

    >>> car = shsa.Model.load("examples/car.yaml")
    >>> drive = shsa.replay(car, "examples/monday", inject="bias=3:/gnss/speed@20s..")
    >>> [(event["kind"], event["signal"]) for event in drive.events][0]
    ('failed', '/gnss/speed')
    >>> drive.report["needs"]["speed"]["met"]
    True
    """
    faults = [inject] if isinstance(inject, str) else list(inject)
    with _recordings.given(recordings) as read:
        return Replay(_shsa.replay(model._model, read, faults, seed, progress))


@dataclass(frozen=True)
class Calibration:
    """The numbers that healthy recordings need."""

    report: dict[str, Any]
    """All figures, as ``shsa calibrate --json`` prints them."""
    patch: str | None
    """The change of the model for ``shsa model patch``; ``None`` if the numbers do worse than those of the model."""
    warnings: list[str]


def calibrate(
    model: Model,
    recordings: Recordings,
    *,
    false_alarms: float = 0.5,
    split: float | None = None,
    skip: Sequence[tuple[float, float]] = (),
    progress: Progress = None,
) -> Calibration:
    """Fits the errors, delays and rhythms of a model to recordings of a healthy system.

    ``false_alarms`` an hour are accepted on data not seen. ``split`` is where the part to fit ends, in seconds from the beginning, half of
    each session if it is not given; ``skip`` are times with a fault, in seconds, too.
    """
    with _recordings.given(recordings) as read:
        report, patch, warnings = _shsa.calibrate(
            model._model, read, false_alarms, split, list(skip), progress
        )
    return Calibration(json.loads(report), patch, warnings)


@dataclass(frozen=True)
class Campaign:
    """What becomes of a grid of faults."""

    report: dict[str, Any]
    """All figures, as ``shsa campaign -o`` writes them."""
    warnings: list[str]


def campaign(
    model: Model,
    recordings: Recordings,
    *,
    kinds: Sequence[str] = (),
    amounts: Sequence[float] = (2, 4, 8),
    signals: Sequence[str] = (),
    onsets: int = 3,
    seeds: int = 1,
    duration: float | None = None,
    progress: Progress = None,
) -> Campaign:
    """Injects every kind and amount of fault into every signal, and counts what is detected, isolated and healed.

    ``amounts`` are multiples of the declared errors; all ``kinds`` and ``signals`` if none are named. A fault begins at ``onsets`` moments, and
    lasts ``duration`` seconds, a quarter of the recording if it is not given.
    """
    multiples = [float(amount) for amount in amounts]
    with _recordings.given(recordings) as read:
        report, warnings = _shsa.campaign(
            model._model, read, list(kinds), multiples, list(signals), onsets, seeds, duration, progress
        )
    return Campaign(json.loads(report), warnings)


@dataclass(frozen=True)
class Learned:
    """Relations between signals."""

    report: dict[str, Any]
    """All figures, as ``shsa learn --json`` prints them."""
    patch: str
    """The change of the model for ``shsa model patch``."""
    warnings: list[str]


def learn(
    recordings: Recordings, model: Model | None = None, *, need: str | None = None, progress: Progress = None
) -> Learned:
    """Finds relations between the signals of a model; without one, between all columns of files.

    ``need`` keeps the fewest relations with which something stands in for what serves this need of the model.
    """
    known = None if model is None else model._model
    with _recordings.given(recordings) as read:
        report, patch, warnings = _shsa.learn(known, read, need, progress)
    return Learned(json.loads(report), patch, warnings)


@dataclass(frozen=True)
class Diagnosis:
    """What is wrong in recordings."""

    report: dict[str, Any]
    """All figures, as ``shsa doctor --json`` prints them."""
    model: str
    """A model of the signals with what was found out, ready to edit."""
    page: str
    """A page for the browser with a picture of each finding."""
    warnings: list[str]

    @property
    def findings(self) -> list[dict[str, Any]]:
        """What is wrong, the largest first; empty where nothing is."""
        return list(self.report["findings"])


def doctor(recordings: Recordings, *, progress: Progress = None) -> Diagnosis:
    """Finds what is wrong in recordings, without a model and without a healthy recording."""
    with _recordings.in_files(recordings) as files:
        is_named = isinstance(recordings, (str, os.PathLike, Sequence))
        names = ", ".join(files) if is_named else "a table"
        report, page, model, warnings = _shsa.doctor(files, names, progress)
    return Diagnosis(json.loads(report), model, page, warnings)


@dataclass(frozen=True)
class Publication:
    """A value of a need."""

    need: str
    """The name under which the need is published."""
    time_ns: int
    """When it was computed."""
    from_ns: int
    """The value was true from this moment on,"""
    to_ns: int
    """to this one."""
    bounds: list[tuple[float, float]]
    """The value in the unit of the variable: one pair of bounds for a number, one for each element of a vector."""
    quality: str
    """``good``, ``substitute`` or ``uncertain``."""

    @property
    def value(self) -> float:
        """The middle of the bounds of a number."""
        [(lo, hi)] = self.bounds
        return (lo + hi) / 2


@dataclass(frozen=True)
class Event:
    """A decision, with its reason."""

    time_ns: int
    kind: str
    """``suspected``, ``failed``, ``silent``, ``substituted``, ``restored``, ``unhealable``, ``refused`` or ``ageing``."""
    signal: str | None
    variable: str | None
    because: str
    substitution: str | None
    """What serves the need now."""
    fields: dict[str, Any]
    """All fields, as in the JSON of the command."""


Output = Union[Publication, Event]


class Engine:
    """An engine in a loop of the caller: observations in, published values and decisions out; time is an argument, in ns.

    >>> engine = shsa.Engine(tank)
    >>> for step in range(100):
    ...     now = step * 200_000_000
    ...     for signal in tank.signals:
    ...         wrong = signal == "float_1" and step >= 50
    ...         engine.handle(signal, 5.5 if wrong else 5.0, now)
    ...     engine.advance(now)
    ...     outputs = list(engine.outputs())
    >>> engine.verdict("float_1"), outputs[-1].value, outputs[-1].quality
    ('failed', 5.0, 'substitute')
    """

    def __init__(self, model: Model) -> None:
        self._engine = _shsa.Engine(model._model)

    def handle(
        self,
        signal: str,
        value: float | tuple[float, float] | Sequence[float],
        received_ns: int,
        stamp_ns: int | None = None,
    ) -> None:
        """Takes an observation: a number in the signal's unit, a pair of bounds, or a list for a vector.

        ``stamp_ns`` is the time stamp that the source gave it; the time of reception if it is not given.
        """
        self._engine.handle(signal, value, received_ns, received_ns if stamp_ns is None else stamp_ns)

    def advance(self, now_ns: int) -> None:
        """Lets time pass, after all observations that were received until now."""
        self._engine.advance(now_ns)

    def poll(self) -> Output | None:
        """The next output, the oldest first."""
        polled = self._engine.poll()
        if polled is None:
            return None
        publication, event = polled
        if publication is not None:
            return Publication(*publication)
        fields: dict[str, Any] = json.loads(event or "{}")
        return Event(
            fields.pop("time_ns"),
            fields["kind"],
            fields["signal"],
            fields["variable"],
            fields["because"],
            fields["substitution"],
            fields,
        )

    def outputs(self) -> Iterator[Output]:
        """All outputs until now."""
        while (output := self.poll()) is not None:
            yield output

    def next_deadline(self) -> int | None:
        """When `advance` is due at the latest, if nothing is observed before; ``None`` when nothing is waited for."""
        return self._engine.next_deadline()

    def verdict(self, signal: str) -> str:
        """What is thought of a signal now: ``unknown``, ``healthy``, ``suspect``, ``failed`` or ``silent``."""
        return self._engine.verdict(signal)

    def snapshot(self) -> str:
        """The state that outlasts the process, as JSON."""
        return self._engine.snapshot()

    def restore(self, snapshot: str, now_ns: int) -> None:
        """Takes over a state before the first observation."""
        self._engine.restore(snapshot, now_ns)


Publish = Callable[[str, Union["tuple[float, float]", "list[float]"], Optional[str], Optional[str]], object]
"""Called with the name of a need, its value (bounds of a number, or a list for a vector), its quality as on a bus (``Good``,
``UncertainSubstituteValue``, ``UncertainSubNormal``) and its source."""

StampedPublish = Callable[
    [str, Union["tuple[float, float]", "list[float]"], Optional[str], Optional[str], int], object
]
"""As `Publish`, with the wall-clock time at which the value was true, in ns, as the last argument."""

Status = Callable[["dict[str, Any]"], object]
"""Called with the status of a need (its name is ``signal``), as on a bus, when it changes and once a second. A need that
nothing serves has no values: its ``quality`` is ``UncertainLastUsableValue``, then ``Bad``."""


class Runtime:
    """A live run in a thread of its own, in real time: on a bus, or between functions of the caller.

    Without a ``bus`` (``mqtt://HOST``, ``zenoh://HOST:PORT``, ``ros2``, as the package was built for), messages come by `push`, values go
    to ``publish`` and ``stamped``, and the status of each need to ``status``, in the thread of the run. ``http`` is where the live page
    is served, such as ``127.0.0.1:0``; ``state`` is the folder of the state that outlasts the process. The run ends with `stop`, with its
    ``with`` block, or with the process. To OPC UA: `shsa.opcua`.

    >>> import queue
    >>> healed = queue.Queue()
    >>> with shsa.Runtime(tank, publish=lambda *value: healed.put(value)) as run:
    ...     run.push("float_2", 5.0)
    ...     run.push("float_1", 5.0)
    ...     healed.get(timeout=60)
    ('healed_level', (4.95, 5.05), 'Good', 'float_1')
    """

    def __init__(
        self,
        models: Model | Sequence[Model],
        *,
        publish: Publish | None = None,
        stamped: StampedPublish | None = None,
        status: Status | None = None,
        bus: str | None = None,
        name: str = "shsa",
        http: str | None = None,
        state: str | os.PathLike[str] | None = None,
    ) -> None:
        run = [models] if isinstance(models, Model) else models
        folder = None if state is None else os.fspath(state)
        functions = _Functions(_values(publish, stamped), _states_of(status))
        self._runtime = _shsa.Runtime([model._model for model in run], functions, bus, name, http, folder)
        # Python's functions cannot be called any more once it has ended.
        self._end = weakref.finalize(self, self._runtime.stop)

    @property
    def address(self) -> str | None:
        """Where the live page is, if it is served."""
        return self._runtime.address

    def push(
        self, topic: str, value: float | tuple[float, float] | Sequence[float], stamp_ns: int | None = None
    ) -> None:
        """A message for a signal, received now; ``stamp_ns`` is the wall-clock time at which its source says that it was true."""
        self._runtime.push(topic, value, stamp_ns)

    def disconnected(self, because: str) -> None:
        """What brings the messages has lost its connection: the run reports it, and counts it as an outage."""
        self._runtime.lose(because)

    def connected(self) -> None:
        """The connection is there again."""
        self._runtime.find()

    def state(self) -> dict[str, Any]:
        """The state of needs, signals and the run, as ``GET /state`` of the command's control interface."""
        state: dict[str, Any] = json.loads(self._runtime.state())
        return state

    def order(self, **order: Any) -> dict[str, Any]:
        """Gives an operator's order, such as ``order="forbid", signal="float_1"``; returns its effect."""
        effect: dict[str, Any] = json.loads(self._runtime.order(json.dumps(order)))
        return effect

    def events(self) -> Iterator[dict[str, Any]]:
        """The decisions that have come since it was asked last."""
        while (event := self._runtime.poll()) is not None:
            yield json.loads(event)

    def stop(self) -> bool | None:
        """Ends the run; tells whether every need was served, ``None`` if it has ended before."""
        self._end.detach()
        return self._runtime.stop()

    def __enter__(self) -> Runtime:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


class _Functions(NamedTuple):
    """What the compiled part calls."""

    publish: StampedPublish | None
    status: Callable[[str], object] | None


def _values(publish: Publish | None, stamped: StampedPublish | None) -> StampedPublish | None:
    """One function of both."""
    if publish is None:
        return stamped
    first = publish

    def both(
        need: str, value: tuple[float, float] | list[float], quality: str | None, source: str | None, stamp_ns: int
    ) -> None:
        first(need, value, quality, source)
        if stamped is not None:
            stamped(need, value, quality, source, stamp_ns)

    return both


def _states_of(status: Status | None) -> Callable[[str], object] | None:
    return None if status is None else lambda text: status(json.loads(text))
