"""Needs as variables: of the plant's server, and of a server of our own."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import asyncua
from asyncua import ua

from ._errors import ShsaError
from ._opcua_nodes import Need, Output
from ._opcua_values import Shown, written

log = logging.getLogger("shsa.opcua")

NAMESPACE = "urn:shsa"
"""Of the variables of our own server."""

UNCERTAIN = "UncertainSubNormal"
"""The truth is within the bounds, and their middle is no estimate."""

FLOATS = (ua.VariantType.Double, ua.VariantType.Float)



def lower(shown: Shown) -> float | None:
    """The lower bound of a number."""
    return shown.bounds[0] if shown.bounds else None


def upper(shown: Shown) -> float | None:
    """The upper bound of a number."""
    return shown.bounds[1] if shown.bounds else None


Resolve = Callable[[str], ua.NodeId]


class Outbox:
    """What is to be written: the newest of each need, so that a slow server delays nothing. For one reader, in one loop."""

    def __init__(self) -> None:
        self.known: dict[str, Shown] = {}
        """The newest of all needs."""
        self._waiting: dict[str, Shown] = {}
        self._filled = asyncio.Event()

    def put(self, need: str, shown: Shown) -> None:
        self.known[need] = self._waiting[need] = shown
        self._filled.set()

    def again(self) -> None:
        """Everything that is known waits once more."""
        self._waiting = dict(self.known)
        if self._waiting:
            self._filled.set()

    async def take(self) -> dict[str, Shown]:
        """What waits, as soon as something does."""
        await self._filled.wait()
        self._filled.clear()
        taken, self._waiting = self._waiting, {}
        return taken


@dataclass
class Part:
    """A variable of the plant's server that gets a part of a need."""

    node: asyncua.Node
    kind: ua.VariantType
    content: Callable[[Shown], Any]
    is_value: bool
    """A number, which has status code and time stamp beside it, and not a text about it."""
    is_alone: bool = False
    """No bounds are written beside it."""
    takes_status: bool = True
    problems: set[str] = field(default_factory=set)
    """What was reported of it."""

    def data(self, shown: Shown) -> ua.DataValue | None:
        """What is written; ``None``: nothing, as the value alone would not say what it is."""
        if not self.is_value:
            return ua.DataValue(Value=ua.Variant(self.content(shown), self.kind), StatusCode=None)
        if self.takes_status:
            # The middle of bounds is no value without them.
            shown = replace(shown, quality="Bad", value=None) if self.is_alone and shown.quality == UNCERTAIN else shown
            return written(self.content(shown), self.kind, shown)
        if shown.value is None or shown.quality not in ("Good", "UncertainSubstituteValue"):
            return None
        return ua.DataValue(Value=ua.Variant(self.content(shown), self.kind), StatusCode=None)


class Targets:
    """The variables of the plant's server that get needs."""

    def __init__(self, client: asyncua.Client, parts: Mapping[str, list[Part]]) -> None:
        self.client = client
        self.parts = parts

    @classmethod
    async def of(cls, client: asyncua.Client, resolve: Resolve, outputs: Mapping[str, Output]) -> Targets:
        """Looks at the variables; what is no variable for a number is reported and left out."""
        parts: dict[str, list[Part]] = {}
        for need, output in outputs.items():
            wanted = [
                (output.value, FLOATS, lambda shown: shown.plain, True),
                (output.quality, (ua.VariantType.String,), lambda shown: shown.quality, False),
                (output.source, (ua.VariantType.String,), lambda shown: shown.source, False),
                (output.lower, FLOATS, lower, True),
                (output.upper, FLOATS, upper, True),
            ]
            parts[need] = []
            for place, kinds, content, is_value in wanted:
                if place is None:
                    continue
                try:
                    node = client.get_node(resolve(place))
                    kind = await node.read_data_type_as_variant_type()
                except ua.UaError as error:
                    log.warning("the need %s cannot be written to %s: %s", need, place, error)
                    continue
                if kind not in kinds:
                    names = " or ".join(it.name for it in kinds)
                    log.warning("the need %s cannot be written to %s: its type is %s, not %s", need, place, kind.name, names)
                    continue
                is_alone = output.lower is None or output.upper is None
                parts[need].append(Part(node, kind, content, is_value, is_alone))
        return cls(client, parts)

    async def write(self, shown: Mapping[str, Shown]) -> None:
        """Writes parts of needs, in one request, and once more what the server takes without a status code only."""
        again: dict[str, Shown] = {}
        pairs = [
            (need, part, data)
            for need, it in shown.items()
            for part in self.parts.get(need, [])
            if (data := part.data(it)) is not None
        ]
        if not pairs:
            return
        nodes, values = [part.node for _, part, _ in pairs], [data for _, _, data in pairs]
        results = await self.client.write_values(nodes, values, raise_on_partial_error=False)
        for (need, part, _), result in zip(pairs, results):
            if result.value == ua.StatusCodes.BadWriteNotSupported and part.is_value and part.takes_status:
                log.warning(
                    "%s takes no status code and no time stamp: it gets the values of %s alone, and none that is uncertain", part.node, need
                )
                part.takes_status = False
                again[need] = shown[need]
            elif not result.is_good() and result.name not in part.problems:
                part.problems.add(result.name)
                log.warning("%s does not take the need %s: %s (%s)", part.node, need, result.name, result.doc)
        if again:
            await self.write(again)

    async def leave(self) -> None:
        """Nobody writes from now on."""
        await self.write({need: Shown("BadOutOfService") for need in self.parts})


@dataclass(frozen=True)
class Serve:
    """A server of our own, with the needs as variables.

    Its folder has the name of the run, and a variable for each need, whose id is ``nsu=urn:shsa;s=NEED``, with status code and time stamp,
    and with properties: ``Source``, ``Quality``, ``Lower``, ``Upper``, ``Unit``. Clients may read.
    """

    url: str
    """Such as ``opc.tcp://127.0.0.1:4841``."""
    certificate: str | None = None
    """The path of a certificate, with ``private_key``: then all connections are encrypted."""
    private_key: str | None = None
    insecure: bool = False
    """Without a certificate, other machines may connect, too."""


class Server:
    """The needs as variables of a server of our own."""

    def __init__(self, server: asyncua.Server, variables: Mapping[str, list[Part]]) -> None:
        self.server = server
        self.variables = variables

    @classmethod
    async def started(cls, serve: Serve, name: str, needs: list[Need]) -> Server:
        """Starts it. Raises `OSError` if the address is taken."""
        server = asyncua.Server()
        await server.init()
        server.set_endpoint(serve.url)
        server.set_server_name(name)
        server.allow_remote_admin(False)
        policies = [ua.SecurityPolicyType.NoSecurity]
        if serve.certificate and serve.private_key:
            await server.load_certificate(serve.certificate)
            await server.load_private_key(serve.private_key)
            policies = [ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt]
        elif serve.certificate or serve.private_key:
            raise ShsaError("a certificate and its private key belong together")
        server.set_security_policy(policies)
        space = await server.register_namespace(NAMESPACE)
        folder = await server.nodes.objects.add_folder(ua.NodeId(ua.String(name), ua.Int16(space)), name)
        variables = {need.name: await _variable(folder, space, need) for need in needs}
        await server.start()
        return cls(server, variables)

    async def write(self, shown: Mapping[str, Shown]) -> None:
        for need, it in shown.items():
            for part in self.variables[need]:
                data = written(part.content(it), part.kind, it) if part.is_value else part.data(it)
                await self.server.write_attribute_value(part.node.nodeid, data)

    async def stop(self) -> None:
        await self.server.stop()


async def _variable(folder: asyncua.Node, space: int, need: Need) -> list[Part]:
    """The variable of a need with its properties."""

    def place(name: str) -> ua.NodeId:
        return ua.NodeId(ua.String(name), ua.Int16(space))

    number, text = ua.VariantType.Double, ua.VariantType.String
    start: Any = [0.0] if need.is_vector else 0.0
    name = ua.QualifiedName(need.name, ua.UInt16(space))
    variable = await folder.add_variable(place(need.name), name, start, number)
    unknown = ua.DataValue(Value=ua.Variant(), StatusCode=ua.StatusCode(ua.StatusCodes.BadWaitingForInitialData))
    await variable.write_value(unknown)
    if need.unit is not None:
        await variable.add_property(place(f"{need.name}.Unit"), "Unit", need.unit, text)
    quality = await variable.add_property(place(f"{need.name}.Quality"), "Quality", "", text)
    source = await variable.add_property(place(f"{need.name}.Source"), "Source", "", text)
    parts = [
        Part(variable, number, lambda shown: shown.plain, True),
        Part(quality, text, lambda shown: shown.quality, False),
        Part(source, text, lambda shown: shown.source, False),
    ]
    if not need.is_vector:
        below = await variable.add_property(place(f"{need.name}.Lower"), "Lower", 0.0, number)
        above = await variable.add_property(place(f"{need.name}.Upper"), "Upper", 0.0, number)
        parts += [
            Part(below, number, lower, True),
            Part(above, number, upper, True),
        ]
    return parts
