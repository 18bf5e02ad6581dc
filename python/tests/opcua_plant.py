"""An OPC UA server with a tank, for tests: opcua_plant.py PORT CERTIFICATE KEY. Orders come by lines of standard input; the first one lets it
start.

``Tank.float_1`` to ``Tank.float_3`` say 5 m, 20 times a second; ``Tank.valve`` is changed by order only. An order is ``NODE VALUE`` or ``NODE
STATUS``. ``Tank.Healed`` with ``.Quality`` and ``.Source`` may be written, and so may ``Tank.Plain``, which takes no status code.
"""

from __future__ import annotations

import asyncio
import math
import sys
from datetime import datetime, timezone

import asyncua
from asyncua import ua
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.internal_server import InternalServer
from asyncua.server.user_managers import UserManager


class Operators(UserManager):
    """Who may enter."""

    def get_user(
        self, iserver: InternalServer, username: str | None = None, password: str | None = None, certificate: object = None
    ) -> User | None:
        return User(UserRole.User) if (username, password) == ("operator", "secret") else None


class Plant:
    def __init__(self) -> None:
        self.offsets = {"float_1": 0.0, "float_2": 0.0, "float_3": 0.0}
        self.states = dict.fromkeys(self.offsets, "Good")

    async def run(self, port: str, certificate: str, key: str) -> None:
        server = asyncua.Server()
        await server.init()
        server.set_endpoint(f"opc.tcp://127.0.0.1:{port}/plant")
        await server.load_certificate(certificate)
        await server.load_private_key(key)
        server.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
        server.set_identity_tokens([ua.UserNameIdentityToken])
        server.iserver.user_manager = Operators()
        await self.build(server)
        self.takes_plain_values_only(server)
        sys.stdin.readline()
        async with server:
            print("ready", flush=True)
            await asyncio.gather(self.measure(), self.obey())

    async def build(self, server: asyncua.Server) -> None:
        self.space = await server.register_namespace("urn:tank")
        tank = await server.nodes.objects.add_object(self.space, "Tank")

        async def variable(name: str, value: float | str, is_writable: bool = False) -> asyncua.Node:
            node = await tank.add_variable(ua.NodeId(f"Tank.{name}", self.space), name, value)
            if is_writable:
                await node.set_writable()
            return node

        self.nodes = {name: await variable(name, 5.0) for name in self.offsets}
        self.nodes["valve"] = await variable("valve", 0.0)
        for name, value in (("Healed", 0.0), ("Healed.Quality", ""), ("Healed.Source", ""), ("Plain", 0.0)):
            await variable(name, value, is_writable=True)

    def takes_plain_values_only(self, server: asyncua.Server) -> None:
        """As many controllers do."""
        write, plain = server.iserver.aspace.write_attribute_value, ua.NodeId("Tank.Plain", self.space)

        async def refuse(node: ua.NodeId, attribute: ua.AttributeIds, value: ua.DataValue) -> ua.StatusCode:
            if node == plain and (value.SourceTimestamp is not None or value.StatusCode != ua.StatusCode()):
                return ua.StatusCode(ua.StatusCodes.BadWriteNotSupported)
            return await write(node, attribute, value)

        server.iserver.aspace.write_attribute_value = refuse

    async def measure(self) -> None:
        step = 0
        while True:
            step += 1
            for name, offset in self.offsets.items():
                await self.write(name, 5 + 0.01 * math.sin(step) + offset, self.states[name])
            await asyncio.sleep(0.05)

    async def write(self, name: str, value: float, status: str = "Good") -> None:
        now = datetime.now(timezone.utc)
        code = ua.StatusCode(getattr(ua.StatusCodes, status))
        await self.nodes[name].write_value(ua.DataValue(Value=ua.Variant(value), StatusCode=code, SourceTimestamp=now))

    async def obey(self) -> None:
        loop = asyncio.get_running_loop()
        while line := await loop.run_in_executor(None, sys.stdin.readline):
            name, order = line.split()
            if name in self.offsets and order[0].isalpha():
                self.states[name] = order
            elif name in self.offsets:
                self.offsets[name] = float(order)
            else:
                await self.write(name, float(order))
        # Whoever gave the orders is gone.
        sys.exit()


asyncio.run(Plant().run(*sys.argv[1:]))
