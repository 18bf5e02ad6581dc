"""The subscription of a connection to an OPC UA server: what comes is pushed into a run."""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections.abc import Iterable
from typing import Any

import asyncua
from asyncua import ua

from . import Runtime
from ._opcua_nodes import Input
from ._opcua_values import reading

log = logging.getLogger("shsa.opcua")

AT_ONCE = 500
"""How many nodes are subscribed by one request: servers limit it."""
QUEUE = 32
"""How many values of a node may wait at the server between two messages."""
HELD_S = 1.0
"""How often a value that stands is read, where the model declares no rate."""
HANDLES = itertools.count(10_000)
"""Of subscribed nodes; the library's own begin at 201."""


class Loss:
    """The loss of a connection."""

    def __init__(self) -> None:
        self._because: str | None = None
        self._came = asyncio.Event()

    @property
    def has_come(self) -> bool:
        return self._came.is_set()

    async def come(self, error: Exception) -> None:
        self._because = self._because or str(error) or type(error).__name__
        self._came.set()

    async def wait(self) -> None:
        """Raises `ConnectionError` once the connection is lost."""
        await self._came.wait()
        raise ConnectionError(self._because)


class Receiver:
    """The subscription of a connection: what comes is pushed into the run."""

    def __init__(
        self, run: Runtime, client: asyncua.Client, loss: Loss, stamps: str, takes_uncertain: bool
    ) -> None:
        self._run, self._client, self._loss = run, client, loss
        self._stamps, self._takes_uncertain = stamps, takes_uncertain
        self._items: dict[int, Input] = {}
        self._nodes: dict[str, asyncua.Node] = {}
        self._missing: dict[Input, str] = {}

    async def subscribe(self, inputs: list[Input], spaces: list[str]) -> None:
        """Subscribes to all nodes; those that the server does not have now are reported, and left to `renew`."""
        self._spaces = spaces
        periods = [it.period_s for it in inputs if it.period_s is not None]
        publishing_ms = min(max(500 * min(periods, default=0.2), 20), 1_000)
        self._subscription = await self._client.create_subscription(publishing_ms, self)
        await self._add(inputs)
        for it, because in self._missing.items():
            url = self._client.server_url.geturl()
            log.warning("%s does not give %s, and is asked again: %s", url, it.node, because)

    async def _add(self, inputs: Iterable[Input]) -> None:
        self._missing = {}
        found = [it for it in inputs if self._resolve(it)]
        for begin in range(0, len(found), AT_ONCE):
            await self._request(found[begin : begin + AT_ONCE])

    async def _request(self, inputs: list[Input]) -> None:
        handles = [next(HANDLES) for _ in inputs]
        # The first values may come before the answer.
        self._items.update(zip(handles, inputs))
        requests = [self._item(handle, it) for handle, it in zip(handles, inputs)]
        results = await self._subscription.create_monitored_items(requests)
        for handle, it, result in zip(handles, inputs, results):
            if isinstance(result, ua.StatusCode):
                del self._items[handle], self._nodes[it.topic]
                self._missing[it] = result.name

    def _resolve(self, given: Input) -> bool:
        try:
            self._nodes[given.topic] = self._client.get_node(node_id(given.node, self._spaces))
        except ua.UaError as error:
            self._missing[given] = str(error)
        return given not in self._missing

    def _item(self, handle: int, given: Input) -> ua.MonitoredItemCreateRequest:
        """Every sample counts, also one that repeats the value before: its time stamp is new."""
        parameters = ua.MonitoringParameters(
            ClientHandle=ua.IntegerId(handle),
            # Twice as often as values come, so that none is missed; -1: as often as values are published.
            SamplingInterval=ua.Duration(-1 if given.period_s is None else 500 * given.period_s),
            Filter=ua.DataChangeFilter(Trigger=ua.DataChangeTrigger.StatusValueTimestamp),
            QueueSize=ua.Counter(QUEUE),
            DiscardOldest=True,
        )
        node = ua.ReadValueId(NodeId=self._nodes[given.topic].nodeid, AttributeId=ua.AttributeIds.Value)
        return ua.MonitoredItemCreateRequest(node, ua.MonitoringMode.Reporting, parameters)

    def datachange_notification(self, node: asyncua.Node, value: Any, data: Any) -> None:
        """Called by asyncua for each value."""
        item = data.monitored_item
        self._take(self._items[item.ClientHandle], item.Value)

    async def status_change_notification(self, status: ua.StatusChangeNotification) -> None:
        """Called by asyncua when the server has ended the subscription."""
        await self._loss.come(ConnectionError(f"the subscription has ended: {status.Status.name}"))

    def _take(self, given: Input, data: ua.DataValue) -> None:
        # The stamp of a value that stands says when it changed; it is true now.
        stamps = "received" if given.holds else self._stamps
        observed = reading(data, stamps, self._takes_uncertain)
        if observed is not None:
            self._run.push(given.topic, observed.value, observed.stamp_ns)

    async def read_held(self) -> None:
        """Reads what stands, as only changes are reported: it may also stand because the source is gone."""
        while True:
            held = [it for it in self._items.values() if it.holds and it.topic in self._nodes]
            await asyncio.sleep(min((it.period_s or HELD_S for it in held), default=HELD_S))
            if held:
                data = await self._client.read_attributes([self._nodes[it.topic] for it in held])
                for it, value in zip(held, data):
                    self._take(it, value)

    async def renew(self, every_s: float) -> None:
        """Looks for missing nodes again."""
        while True:
            await asyncio.sleep(every_s)
            if self._missing:
                await self._add(list(self._missing))


def node_id(text: str, spaces: list[str]) -> ua.NodeId:
    """A node id, its namespace by the server's present number. Raises `asyncua.ua.UaError` for a namespace that the server does not have."""
    node = ua.NodeId.from_string(text)
    uri = getattr(node, "NamespaceUri", None)
    if uri is None:
        return node
    if uri not in spaces:
        raise ua.UaError(f"no namespace {uri}")
    return ua.NodeId(node.Identifier, ua.Int16(spaces.index(uri)), node.NodeIdType)


def described(error: Exception) -> str:
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
