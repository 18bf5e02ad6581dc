"""Values with status code and time stamps: from an OPC UA server into a run, and of needs for a server."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from datetime import datetime, timedelta, timezone
from typing import Any, Union

from asyncua import ua

EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
UNDATED = 1602
"""OPC UA counts from 1601: a moment before this year is none."""

NOT_MEASURED = (
    ua.StatusCodes.UncertainLastUsableValue,
    ua.StatusCodes.UncertainSubstituteValue,
    ua.StatusCodes.UncertainInitialValue,
)
"""Uncertain values that no sensor has measured now."""

KIND = 0xFFFF_0000
"""The bits of a status code that tell which one it is; the others tell of limits and lost values."""

STAMPS = ("source", "server", "received")
"""Whose clock the time of a value is taken from."""

Value = Union["tuple[float, float]", "list[float]"]


@dataclass(frozen=True)
class Reading:
    """An observation."""

    value: float | list[float]
    """Not a number: the server has none."""
    stamp_ns: int | None
    """When it was true, in ns since 1970; ``None``: when it is received."""


def reading(given: ua.DataValue, stamps: str, takes_uncertain: bool) -> Reading | None:
    """What a server says: no number where it is bad, nothing where it is uncertain, unless uncertain measurements are taken."""
    status = given.StatusCode or ua.StatusCode()
    if status.is_uncertain() and (not takes_uncertain or status.value & KIND in NOT_MEASURED):
        return None
    content = None if given.Value is None else given.Value.Value
    return Reading(math.nan if status.is_bad() else _numbers(content), _stamp(given, stamps))


def _numbers(content: Any) -> float | list[float]:
    """A number, also of a truth value; a list of numbers; not a number of anything else."""
    if isinstance(content, (bool, int, float)):
        return float(content)
    if isinstance(content, (list, tuple)) and all(isinstance(it, (bool, int, float)) for it in content):
        return [float(it) for it in content]
    return math.nan


def _stamp(given: ua.DataValue, stamps: str) -> int | None:
    """The stamp of the source, else that of the server, as far as ``stamps`` trusts them."""
    trusted = [given.SourceTimestamp] if stamps == "source" else []
    trusted += [given.ServerTimestamp] if stamps != "received" else []
    dated = [it for it in trusted if it is not None and it.year >= UNDATED]
    return nanoseconds(dated[0]) if dated else None


def nanoseconds(moment: datetime) -> int:
    """Since 1970; a moment without a zone is in UTC."""
    since = (moment if moment.tzinfo else moment.replace(tzinfo=timezone.utc)) - EPOCH
    return (since.days * 86_400 + since.seconds) * 10**9 + since.microseconds * 1_000


def moment(ns: int) -> datetime:
    """The time of ns since 1970, to the microsecond."""
    return EPOCH + timedelta(microseconds=ns // 1_000)


@dataclass(frozen=True)
class Shown:
    """What is known of a need."""

    quality: str
    """The name of its status code."""
    source: str = ""
    """Signals and relations that serve it."""
    value: Value | None = None
    """The bounds of a number, or the elements of a vector; ``None``: there is no value."""
    stamp_ns: int = 0
    """When the value was true."""

    @property
    def bounds(self) -> tuple[float, float] | None:
        """Of a number."""
        return self.value if isinstance(self.value, tuple) else None

    @property
    def plain(self) -> float | list[float] | None:
        """The middle of the bounds, or the elements."""
        return sum(self.bounds) / 2 if self.bounds else self.value and list(self.value)

    def followed_by(self, quality: str, source: str | None, now_ns: int) -> Shown:
        """After a status: a need that nothing serves keeps its last value while that is usable."""
        if quality == "UncertainLastUsableValue" and self.value is not None:
            return replace(self, quality=quality)
        return Shown(quality, source or "", stamp_ns=now_ns) if quality == "Bad" else self


def status(quality: str) -> ua.StatusCode:
    """The status code of this name."""
    return ua.StatusCode(getattr(ua.StatusCodes, quality))


def written(content: Any, kind: ua.VariantType, shown: Shown) -> ua.DataValue:
    """A part of a need, with the need's status code and stamp."""
    is_bad = shown.value is None
    value = ua.Variant(None, ua.VariantType.Null) if is_bad else ua.Variant(content, kind)
    stamp = moment(shown.stamp_ns) if shown.stamp_ns else None
    return ua.DataValue(Value=value, StatusCode=status(shown.quality), SourceTimestamp=stamp)
