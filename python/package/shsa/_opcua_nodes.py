"""Which node of an OPC UA server each signal and each need of a model has."""

from __future__ import annotations

import ipaddress
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Union
from urllib.parse import urlsplit

from ._errors import ShsaError

if TYPE_CHECKING:
    from . import Model

NODE = re.compile(r"(nsu?=[^;]+;)?[isgb]=.+")
"""A node id: ``ns=2;s=Tank.Level``, ``nsu=urn:plant;i=1001``, ``i=2258``."""


@dataclass(frozen=True)
class Input:
    """Where the values of a topic come from."""

    topic: str
    """The name under which the run takes them."""
    node: str
    """The id of the variable."""
    holds: bool
    """The value stands until it changes."""
    period_s: float | None
    """The shortest time between two values, if the model declares it."""


@dataclass(frozen=True)
class Output:
    """Where a need goes: the ids of variables, ``None`` where there is none."""

    value: str | None = None
    """A number, or a list for a vector; with status code and time stamp."""
    quality: str | None = None
    """A text: the name of the status code, for servers that take none beside a value."""
    source: str | None = None
    """A text: signals and relations that serve the need."""
    lower: str | None = None
    """A number: the lower bound."""
    upper: str | None = None
    """A number: the upper bound."""


@dataclass(frozen=True)
class Need:
    """A need as the model has it."""

    name: str
    unit: str | None
    is_vector: bool


Outputs = Mapping[str, Union[str, Mapping[str, str], Output]]
"""The node of each need; or several by what goes there: ``value``, ``quality``, ``source``, ``lower``, ``upper``."""


def needs(model: Model) -> list[Need]:
    """The needs of a model, in its order."""
    return [Need(**need) for need in json.loads(model._model.places())["needs"]]


def inputs(model: Model, nodes: Mapping[str, str]) -> list[Input]:
    """The node of each signal, once for each topic: as ``nodes`` says, else the ``source`` of the signal.

    Raises `ShsaError` for a signal that the model does not have or that has no node, and for two nodes with one topic.
    """
    signals: list[dict[str, Any]] = json.loads(model._model.places())["signals"]
    _known(nodes, [signal["name"] for signal in signals], "signal")
    found: dict[str, Input] = {}
    for signal in signals:
        name, topic = signal["name"], signal["topic"]
        node = nodes.get(name, signal["place"].removesuffix("!changed").rstrip())
        if not NODE.fullmatch(node):
            raise ShsaError(
                f"the signal {name} has no node: '{node}' is no node id; give its `source` one, such as ns=2;s=Tank.Level, "
                "or name the node beside the model"
            )
        before = found.get(topic)
        if before is not None and before.node != node:
            raise ShsaError(
                f"{before.node} and {node} both give the values of {topic}: over OPC UA each signal needs a `source` of its own"
            )
        periods: list[float] = [signal["period_s"]] if signal["period_s"] is not None else []
        periods += [before.period_s] if before is not None and before.period_s is not None else []
        holds = signal["holds"] or before is not None and before.holds
        found[topic] = Input(topic, node, holds, min(periods, default=None))
    return list(found.values())


def outputs(model: Model, given: Outputs, is_served: bool) -> dict[str, Output]:
    """The nodes of each need: as ``given`` says, else its name, where that is a node id.

    Raises `ShsaError` for a need that the model does not have, and for one without a node unless it ``is_served`` here.
    """
    names = [need.name for need in needs(model)]
    _known(given, names, "need")
    found = {name: _output(name, given.get(name, name if NODE.fullmatch(name) else Output())) for name in names}
    without = [name for name, output in found.items() if output.value is None]
    if without and not is_served:
        raise ShsaError(
            f"the need {without[0]} has no node: name it beside the model, make its `signal` a node id, or serve the needs here"
        )
    return found


def _output(need: str, given: str | Mapping[str, str] | Output) -> Output:
    if isinstance(given, Output):
        return given
    places = {"value": given} if isinstance(given, str) else dict(given)
    _known(places, [field.name for field in fields(Output)], f"part of the need {need}")
    for node in places.values():
        if not isinstance(node, str) or not NODE.fullmatch(node):
            raise ShsaError(f"the node of the need {need}: {node!r} is no node id, such as ns=2;s=Tank.Level")
    return Output(**places)


def _known(given: Mapping[str, Any], names: list[str], what: str) -> None:
    for name in given:
        if name not in names:
            raise ShsaError(f"no {what} '{name}'; there are {', '.join(names) or 'none'}")


def read(text: str, name: str) -> tuple[dict[str, str], Outputs]:
    """A map in JSON: ``{"signals": {SIGNAL: NODE}, "needs": {NEED: NODE}}``, either of which may be absent."""
    try:
        given = json.loads(text)
    except ValueError as error:
        raise ShsaError(f"{name} is no JSON: {error}") from error
    if not isinstance(given, dict) or not all(isinstance(part, dict) for part in given.values()):
        raise ShsaError(f'{name} is no map of nodes: {{"signals": {{SIGNAL: NODE}}, "needs": {{NEED: NODE}}}}')
    _known(given, ["signals", "needs"], f"part of {name}")
    signals = given.get("signals", {})
    for signal, node in signals.items():
        if not isinstance(node, str):
            raise ShsaError(f"the node of the signal {signal} in {name} is no text")
    return signals, given.get("needs", {})


def endpoint(url: str, is_secure: bool, is_insecure_allowed: bool) -> None:
    """Checks an address: without security it must be one of this machine, unless that is allowed.

    Raises `ShsaError`.
    """
    parts = urlsplit(url)
    if parts.scheme != "opc.tcp" or not parts.hostname:
        raise ShsaError(f"'{url}' is no address of OPC UA: opc.tcp://HOST:PORT")
    if "@" in parts.netloc:
        raise ShsaError("user and password do not belong in the address, which others can read")
    if not is_secure and not is_insecure_allowed and not _is_loopback(parts.hostname):
        raise ShsaError(
            f"{parts.hostname} is another machine: give certificates (security), or allow a connection that anyone in between can read "
            "and change (insecure)"
        )


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
