"""Healing between a plant's OPC UA server and whoever reads its needs: ``pip install 'shsa[opcua]'``.

A `Link` subscribes to the nodes of a model's signals, heals what it receives in a `shsa.Runtime`, and gives the needs back as variables: of
the same server, or of one of its own. ``python -m shsa.opcua MODEL opc.tcp://HOST:4840`` does so until it is interrupted. The guide is
``docs/opcua.md``.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import random
import time
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from dataclasses import dataclass, field
from typing import Any

try:
    import asyncua
except ImportError as error:
    raise ImportError("shsa.opcua needs the package asyncua: pip install 'shsa[opcua]'") from error
from asyncua import ua

from . import Model, Runtime, _opcua_nodes
from ._errors import ShsaError
from ._opcua_inputs import Loss, Receiver, described, node_id
from ._opcua_nodes import Input, Output, Outputs
from ._opcua_outputs import Outbox, Serve, Server, Targets
from ._opcua_values import STAMPS, Shown, Value

__all__ = ["Access", "Input", "Link", "Output", "Outputs", "Serve", "read_map"]

FIRST_PAUSE_S = 0.1
"""Before a connection is tried again; each further pause is twice as long."""
LOST_S = 1.0
"""A server that answers nothing for about twice this time is gone."""
LEAVING_S = 2.0
"""How long the last messages to a server may take."""

read_map = _opcua_nodes.read


@dataclass(frozen=True)
class Access:
    """How a server is reached."""

    user: str | None = None
    password: str | None = field(default=None, repr=False)
    security: str | None = None
    """``POLICY,MODE,CERTIFICATE,PRIVATE_KEY[,SERVER_CERTIFICATE]``, as for `asyncua.Client.set_security_string`, such as
    ``Basic256Sha256,SignAndEncrypt,shsa.der,shsa.pem,plant.der``. Without the certificate of the server, any server is trusted."""
    application_uri: str = "urn:shsa"
    """As in the certificate."""
    insecure: bool = False
    """Without ``security``, another machine may be reached, too."""
    configure: Callable[[asyncua.Client], Awaitable[object]] | None = None
    """Sets what else a client has, before it connects."""


class Link:
    """A model between a plant's server and whoever reads its needs, in real time.

    ``nodes`` are the nodes of signals whose ``source`` is no node id; ``outputs`` are those of needs whose ``signal`` is none (see `Output`).
    With ``serve``, the needs are variables of a server of our own, too. ``stamps`` says whose clock is right: that of the ``source``, of the
    ``server``, or neither (``received``). Uncertain values are no observations unless ``take_uncertain``. A lost connection is
    tried again after pauses up to ``retry_s``. ``name``, ``http`` and ``state`` are those of `shsa.Runtime`.

    Raises `ShsaError` for a signal or a need without a node, and for an address of another machine without security.

    >>> tank = shsa.Model('''
    ... shsa: 1
    ... variables: { level: { unit: m, range: [0, 10] } }
    ... signals:
    ...   float: { variable: level, source: ns=2;s=Tank.Float, rate: 5 Hz, value_error: 0.05 }
    ...   radar: { variable: level, source: ns=2;s=Tank.Radar, rate: 5 Hz, value_error: 0.05 }
    ... needs: { level: { signal: healed_level, max_age: 1 s } }
    ... ''')
    >>> link = shsa.opcua.Link(tank, "opc.tcp://127.0.0.1:4840", outputs={"healed_level": "ns=2;s=Tank.Healed"})
    >>> [it.node for it in link.inputs], link.outputs["healed_level"].value
    (['ns=2;s=Tank.Float', 'ns=2;s=Tank.Radar'], 'ns=2;s=Tank.Healed')

    ``asyncio.run(link.run())`` goes on until `stop`.
    """

    def __init__(
        self,
        model: Model,
        url: str,
        *,
        nodes: Mapping[str, str] | None = None,
        outputs: Outputs | None = None,
        serve: Serve | str | None = None,
        access: Access = Access(),
        stamps: str = "source",
        take_uncertain: bool = False,
        retry_s: float = 10.0,
        name: str = "shsa",
        http: str | None = None,
        state: str | os.PathLike[str] | None = None,
    ) -> None:
        if stamps not in STAMPS:
            raise ShsaError(f"no stamps of '{stamps}': {', '.join(STAMPS)}")
        _opcua_nodes.endpoint(url, access.security is not None, access.insecure)
        served = Serve(serve) if isinstance(serve, str) else serve
        if served is not None:
            _opcua_nodes.endpoint(served.url, served.certificate is not None, served.insecure)
        self.model = model
        self.url = url
        self.access = access
        self.inputs: list[Input] = _opcua_nodes.inputs(model, nodes or {})
        """Where values come from."""
        self.outputs: dict[str, Output] = _opcua_nodes.outputs(model, outputs or {}, served is not None)
        """Where each need goes."""
        self.runtime: Runtime | None = None
        """The run, while it lasts."""
        self._served = served
        self._stamps, self._takes_uncertain, self._retry_s = stamps, take_uncertain, retry_s
        self._run: dict[str, Any] = {"name": name, "http": http, "state": state}

    async def run(self, started: Callable[[Runtime], object] | None = None) -> None:
        """Connects, heals and writes until `stop`, or until it is cancelled; ``started`` is called once with the run.

        Raises `ShsaError` if the run cannot begin, and `OSError` if the address of our own server is taken.
        """
        self._loop, self._stopping = asyncio.get_running_loop(), asyncio.Event()
        self._outboxes = [Outbox(), Outbox()]
        run = Runtime(self.model, stamped=self._published, status=self._changed, **self._run)
        self.runtime = run
        try:
            if started is not None:
                started(run)
            await _first(self._stopping.wait(), self._keep_connected(run), self._serve())
        finally:
            self.runtime = None
            run.stop()

    def stop(self) -> None:
        """Ends the run in order; may be called from any thread."""
        self._loop.call_soon_threadsafe(self._stopping.set)

    # What the run says, in its own thread.

    def _published(
        self, need: str, value: Value, quality: str | None, source: str | None, stamp_ns: int
    ) -> None:
        self._put(need, lambda _: Shown(quality or "Good", source or "", value, stamp_ns))

    def _changed(self, status: dict[str, Any]) -> None:
        now = time.time_ns()
        self._put(
            status["signal"], lambda before: before.followed_by(status["quality"], status["source"], now)
        )

    def _put(self, need: str, after: Callable[[Shown], Shown]) -> None:
        def put() -> None:
            for outbox in self._outboxes:
                before = outbox.known.get(need, Shown("Good"))
                shown = after(before)
                # Every second says again that nothing serves a need.
                if shown != before and not shown.quality == before.quality == "Bad":
                    outbox.put(need, shown)

        # The loop is closed once the run has ended by itself.
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(put)

    # Our own server.

    async def _serve(self) -> None:
        if self._served is None:
            await self._stopping.wait()
            return
        server = await Server.started(self._served, self._run["name"], _opcua_nodes.needs(self.model))
        try:
            while True:
                await server.write(await self._outboxes[1].take())
        finally:
            await server.stop()

    # The plant's server.

    async def _keep_connected(self, run: Runtime) -> None:
        """A connection after the other."""
        pause = FIRST_PAUSE_S
        while True:
            began = time.monotonic()
            try:
                await self._connected(run)
            except (OSError, asyncio.TimeoutError, ua.UaError) as error:
                run.disconnected(f"{self.url}: {described(error)}")
            if time.monotonic() - began > self._retry_s:
                pause = FIRST_PAUSE_S
            # Many clients of a server that starts again do not come all at once.
            await asyncio.sleep(pause * random.uniform(0.75, 1.25))
            pause = min(2 * pause, self._retry_s)

    async def _client(self) -> asyncua.Client:
        client = asyncua.Client(self.url, watchdog_intervall=LOST_S)
        client.application_uri = self.access.application_uri
        client.name = client.description = "shsa"
        if self.access.user is not None:
            client.set_user(self.access.user)
        if self.access.password is not None:
            client.set_password(self.access.password)
        if self.access.security is not None:
            await client.set_security_string(self.access.security)
        if self.access.configure is not None:
            await self.access.configure(client)
        return client

    async def _connected(self, run: Runtime) -> None:
        """One connection, until it is lost; raises what ends it."""
        client, loss = await self._client(), Loss()
        client.connection_lost_callback = loss.come
        try:
            await client.connect()
        except BaseException:
            client.disconnect_socket()
            raise
        targets = None
        try:
            spaces = await client.get_namespace_array()
            targets = await Targets.of(client, lambda node: node_id(node, spaces), self.outputs)
            receiver = Receiver(run, client, loss, self._stamps, self._takes_uncertain)
            await receiver.subscribe(self.inputs, spaces)
            run.connected()
            self._outboxes[0].again()
            await _first(loss.wait(), self._write(targets), receiver.read_held(), receiver.renew(self._retry_s))
        finally:
            if targets is not None and not loss.has_come:
                await _within(targets.leave())
            await _within(client.disconnect())

    async def _write(self, targets: Targets) -> None:
        while True:
            await targets.write(await self._outboxes[0].take())


async def _first(*works: Coroutine[Any, Any, object]) -> None:
    """Works until one of them ends; raises what that one has raised."""
    tasks = [asyncio.ensure_future(work) for work in works]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    for task in done:
        task.result()


async def _within(work: Coroutine[Any, Any, object]) -> None:
    """Does what the other side may refuse, or not answer."""
    with contextlib.suppress(OSError, asyncio.TimeoutError, ua.UaError):
        await asyncio.wait_for(work, LEAVING_S)


if __name__ == "__main__":
    from ._opcua_command import main

    main()
