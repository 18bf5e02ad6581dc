"""OPC UA, between real servers and clients of asyncua, each server a process of its own."""

from __future__ import annotations

import asyncio
import contextlib
import io
import json
import logging
import math
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import unittest
from datetime import datetime, timedelta, timezone
from typing import Any

import asyncua
from asyncua import ua
from asyncua.crypto import cert_gen

import shsa
import shsa.opcua
from shsa import _opcua_command, _opcua_outputs, _opcua_values

TANK = """
shsa: 1
variables: { level: { unit: m, range: [0, 10] }, valve: { range: [0, 100] } }
signals:
  float_1: { variable: level, source: ns=2;s=Tank.float_1, rate: 10 Hz, value_error: 0.05 }
  float_2: { variable: level, source: ns=2;s=Tank.float_2, rate: 10 Hz, value_error: 0.05 }
  float_3: { variable: level, source: nsu=urn:tank;s=Tank.float_3, rate: 10 Hz, value_error: 0.05 }
  valve: { variable: valve, source: ns=2;s=Tank.valve, hold: true, timeout: 2 s, value_error: 0.5 }
needs:
  level: { signal: ns=2;s=Tank.Healed, max_age: 500 ms }
  valve: { signal: healed_valve, max_age: 1 s }
"""
HERE = pathlib.Path(__file__).parent
HEALED, PLAIN = "ns=2;s=Tank.Healed", "ns=2;s=Tank.Plain"
PROVENANCE = {"quality": HEALED + ".Quality", "source": HEALED + ".Source"}
SERVED, VALVE = "nsu=urn:shsa;s=" + HEALED, "nsu=urn:shsa;s=healed_valve"


def free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port: int = taken.getsockname()[1]
        return port


class Plant:
    """The process of a server, which waits for its start."""

    def __init__(self, port: int, *certificate: pathlib.Path) -> None:
        command = [sys.executable, HERE / "opcua_plant.py", str(port), *certificate]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def start(self) -> None:
        self.order("start")
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == b"ready\n"

    def order(self, order: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{order}\n".encode())
        self.process.stdin.flush()

    def kill(self) -> None:
        self.process.kill()
        self.process.communicate(timeout=60)


class Reader:
    """A client that reads values."""

    def __init__(self, url: str, security: str) -> None:
        # A machine that is busy answers late.
        self.client = asyncua.Client(url, timeout=60, watchdog_intervall=30)
        self.security = security
        self.client.set_user("operator")
        self.client.set_password("secret")

    async def __aenter__(self) -> Reader:
        await self.client.set_security_string(self.security)
        # The server may be about to start.
        async with asyncio.timeout(60):
            while True:
                try:
                    await self.client.connect()
                    break
                except OSError:
                    await asyncio.sleep(0.05)
        self.spaces = await self.client.get_namespace_array()
        return self

    async def __aexit__(self, *_: object) -> None:
        with contextlib.suppress(OSError, asyncio.TimeoutError, ua.UaError):
            await self.client.disconnect()

    async def read(self, node: str) -> ua.DataValue:
        found = self.client.get_node(shsa.opcua.node_id(node, self.spaces))
        data: ua.DataValue = await found.read_data_value(raise_on_bad_status=False)
        return data

    async def until(self, node: str, status: str, value: float | None = None, within: float = 0.1) -> ua.DataValue:
        """The value of a node once it has this status, and is about this one."""
        last = None
        try:
            async with asyncio.timeout(60):
                while True:
                    last = await self.read(node)
                    is_there = last.StatusCode.name == status
                    if is_there and (value is None or abs(last.Value.Value - value) <= within):
                        return last
                    await asyncio.sleep(0.02)
        except TimeoutError:
            raise AssertionError(f"{node} is not {status}, {value}: {last}") from None

    async def until_text(self, node: str, text: str) -> None:
        """Waits until a node has this text."""
        last = None
        try:
            async with asyncio.timeout(60):
                while (last := (await self.read(node)).Value.Value) != text:
                    await asyncio.sleep(0.02)
        except TimeoutError:
            raise AssertionError(f"{node} is {last}, not {text}") from None


class Nodes(unittest.TestCase):
    """Which node each signal and each need has."""

    def setUp(self) -> None:
        self.tank = shsa.Model(TANK)

    def link(self, url: str = "opc.tcp://127.0.0.1:4840", text: str = TANK, **others: Any) -> shsa.opcua.Link:
        return shsa.opcua.Link(shsa.Model(text), url, **({"serve": "opc.tcp://127.0.0.1:4841"} | others))

    def test_they_are_in_the_model_or_beside_it(self) -> None:
        link = self.link(nodes={"float_1": "ns=3;i=7"})
        self.assertEqual([it.node for it in link.inputs][:2], ["ns=3;i=7", "ns=2;s=Tank.float_2"])
        self.assertEqual([it.holds for it in link.inputs], [False, False, False, True])
        self.assertEqual([it.period_s for it in link.inputs], [0.1, 0.1, 0.1, None])
        self.assertEqual(link.outputs[HEALED], shsa.opcua.Output(HEALED))
        self.assertEqual(link.outputs["healed_valve"], shsa.opcua.Output())

    def test_the_guide_is_right(self) -> None:
        guide = pathlib.Path("docs/opcua.md").read_text()
        [model], [nodes] = (re.findall(f"```{kind}\n(.*?)```", guide, re.DOTALL) for kind in ("yaml", "json"))
        link = self.link(text=model, serve=None)
        self.assertEqual([it.node for it in link.inputs], ["ns=2;s=Tank.Float1", "nsu=urn:plant;s=Tank.Float2", "ns=2;i=1003"])
        self.assertEqual(link.outputs["ns=2;s=Tank.Healed"].value, "ns=2;s=Tank.Healed")
        signals, needs = shsa.opcua.read_map(nodes, "map.json")
        other = model.replace("signal: ns=2;s=Tank.Healed", "signal: healed_level")
        link = self.link(text=other, nodes=signals, outputs=needs, serve=None)
        self.assertEqual(link.outputs["healed_level"].source, "ns=2;s=Tank.Healed.Source")

    def test_what_is_wrong_is_said(self) -> None:
        plain = TANK.replace("source: ns=2;s=Tank.float_1, ", "")
        shared = TANK.replace("ns=2;s=Tank.float_1", "tank#1").replace("ns=2;s=Tank.float_2", "tank#2")
        nodes = {"float_1": "i=1", "float_2": "i=2"}
        for expected, given in (
            ("the signal float_1 has no node: 'float_1' is no node id", {"text": plain}),
            ("no signal 'float_9'; there are float_1", {"nodes": {"float_9": "i=1"}}),
            ("i=1 and i=2 both give the values of tank", {"text": shared, "nodes": nodes}),
            ("no need 'float_1'; there are ns=2;s=Tank.Healed", {"outputs": {"float_1": "i=1"}}),
            ("the need healed_valve has no node", {"serve": None}),
            ("'level' is no node id", {"outputs": {HEALED: "level"}}),
            ("no part of the need healed_valve 'colour'", {"outputs": {"healed_valve": {"colour": "i=1"}}}),
            ("is no address of OPC UA", {"url": "http://127.0.0.1"}),
            ("do not belong in the address", {"url": "opc.tcp://me:secret@127.0.0.1:4840"}),
            ("plc is another machine: give certificates", {"url": "opc.tcp://plc:4840"}),
            ("0.0.0.0 is another machine", {"serve": "opc.tcp://0.0.0.0:4841"}),
            ("no stamps of 'sun'", {"stamps": "sun"}),
        ):
            with self.subTest(expected), self.assertRaisesRegex(shsa.ShsaError, re.escape(expected)):
                self.link(**given)
        self.link("opc.tcp://plc:4840", access=shsa.opcua.Access(insecure=True))
        for text in ("{", "[]", '{"signals": []}', '{"nodes": {}}', '{"signals": {"a": 1}}'):
            with self.subTest(text), self.assertRaisesRegex(shsa.ShsaError, "map.json"):
                shsa.opcua.read_map(text, "map.json")

    def test_the_command_says_what_is_wrong(self) -> None:
        for words, expected in ((["no/such.yaml"], "no/such.yaml"), (["examples/car.yaml"], "has no node")):
            said = io.StringIO()
            with contextlib.redirect_stderr(said), self.assertRaises(SystemExit) as ended:
                _opcua_command.main([*words, "opc.tcp://127.0.0.1:4840"])
            self.assertEqual((ended.exception.code, expected in said.getvalue()), (2, True), said.getvalue())


class Values(unittest.TestCase):
    """What a server says, and what it is given."""

    def read(self, content: object, status: str = "Good", stamps: str = "source", uncertain: bool = False) -> Any:
        source, server = (datetime(2026, 5, 1, 12, 0, second, 250_000, timezone.utc) for second in (1, 2))
        code = ua.StatusCode(getattr(ua.StatusCodes, status) | 0x480)
        data = ua.DataValue(Value=ua.Variant(content), StatusCode=code, SourceTimestamp=source, ServerTimestamp=server)
        return _opcua_values.reading(data, stamps, uncertain)

    def test_only_good_values_are_observations(self) -> None:
        self.assertEqual(self.read(5.5).value, 5.5)
        self.assertEqual([self.read(it).value for it in (True, 3, [1, 2.5])], [1.0, 3.0, [1.0, 2.5]])
        self.assertTrue(all(math.isnan(self.read(it).value) for it in (None, "full", ["a"])))
        self.assertTrue(math.isnan(self.read(5.5, "BadSensorFailure").value))
        self.assertIsNone(self.read(5.5, "UncertainSensorNotAccurate"))
        self.assertEqual(self.read(5.5, "UncertainSensorNotAccurate", uncertain=True).value, 5.5)
        self.assertIsNone(self.read(5.5, "UncertainLastUsableValue", uncertain=True))

    def test_a_stamp_is_that_of_the_clock_that_is_right(self) -> None:
        self.assertEqual(self.read(1.0).stamp_ns, 1_777_636_801_250_000_000)
        self.assertEqual(self.read(1.0, stamps="server").stamp_ns, 1_777_636_802_250_000_000)
        self.assertIsNone(self.read(1.0, stamps="received").stamp_ns)
        undated = ua.DataValue(Value=ua.Variant(1.0), SourceTimestamp=datetime(1601, 1, 1))
        self.assertIsNone(_opcua_values.reading(undated, "source", False).stamp_ns)
        self.assertEqual(_opcua_values.moment(1_777_636_801_250_000_999).microsecond, 250_000)

    def test_a_need_keeps_its_last_value_while_that_is_usable(self) -> None:
        shown = _opcua_values.Shown("Good", "float_1", (4.9, 5.1), 7)
        last = shown.followed_by("UncertainLastUsableValue", "float_1", 9)
        self.assertEqual((last.plain, last.stamp_ns, last.quality), (5.0, 7, "UncertainLastUsableValue"))
        bad = last.followed_by("Bad", None, 9)
        self.assertEqual((bad.plain, bad.bounds, bad.stamp_ns), (None, None, 9))
        self.assertEqual(shown.followed_by("Good", "float_1", 9), shown)


    def test_the_middle_of_uncertain_bounds_goes_out_beside_them_only(self) -> None:
        def written(quality: str, **how: bool) -> tuple[object, str] | None:
            part = _opcua_outputs.Part(None, ua.VariantType.Double, lambda shown: shown.plain, True, **how)
            data = part.data(_opcua_values.Shown(quality, "float_1", (4.0, 6.0), 7))
            return data and (data.Value.Value, (data.StatusCode or ua.StatusCode()).name)

        self.assertEqual(written("UncertainSubNormal"), (5.0, "UncertainSubNormal"))
        self.assertEqual(written("UncertainSubNormal", is_alone=True), (None, "Bad"))
        self.assertEqual(written("UncertainSubstituteValue", is_alone=True), (5.0, "UncertainSubstituteValue"))
        # A variable that takes values alone.
        self.assertEqual(written("UncertainSubstituteValue", takes_status=False), (5.0, "Good"))
        self.assertIsNone(written("UncertainSubNormal", takes_status=False))
        self.assertIsNone(written("UncertainLastUsableValue", takes_status=False))


async def printed_until(process: asyncio.subprocess.Process, text: str) -> str:
    """What a process prints up to a line with this text, which must come within 5 seconds."""
    printed = ""
    async with asyncio.timeout(5.0):
        while text not in printed:
            line = (await process.stdout.readline()).decode()
            assert line, f"it has ended, and has printed {printed}"
            printed += line
    return printed


class Healing(unittest.TestCase):
    """The command between the server of a plant and its readers, over connections with certificates."""

    def setUp(self) -> None:
        logging.getLogger("asyncua").setLevel(logging.CRITICAL)
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.port = free_port()
        self.plant, self.served = f"opc.tcp://127.0.0.1:{self.port}/plant", f"opc.tcp://127.0.0.1:{free_port()}"

    async def certificate(self, uri: str) -> tuple[pathlib.Path, pathlib.Path]:
        name = uri.removeprefix("urn:")
        key, certificate = self.folder / f"{name}.pem", self.folder / f"{name}.der"
        await cert_gen.setup_self_signed_certificate(key, certificate, uri, "localhost", [], {})
        return certificate, key

    async def command(self, security: str, certificate: pathlib.Path, key: pathlib.Path) -> asyncio.subprocess.Process:
        model, nodes = self.folder / "tank.yaml", self.folder / "map.json"
        model.write_text(TANK)
        nodes.write_text(json.dumps({"needs": {HEALED: {"value": HEALED} | PROVENANCE, "healed_valve": PLAIN}}))
        line = [sys.executable, "-m", "shsa.opcua", model, self.plant, "--map", nodes, "--retry", "0.2"]
        line += ["--security", security, "--serve", self.served, "--serve-certificate", certificate, "--serve-key", key]
        user = {"SHSA_OPCUA_USER": "operator", "SHSA_OPCUA_PASSWORD": "secret"}
        pipe = asyncio.subprocess.PIPE
        process = await asyncio.create_subprocess_exec(
            *line, "--http", "127.0.0.1:0", stdout=pipe, stderr=pipe, env=os.environ | user
        )
        self.addCleanup(lambda: process.returncode is None and process.kill())
        return process

    def test_a_tank_is_healed_over_faults_and_the_end_of_its_server(self) -> None:
        asyncio.run(self.heal())

    async def heal(self) -> None:
        plant_identity, identity = await self.certificate("urn:plant"), await self.certificate("urn:shsa")
        first, second = (Plant(self.port, *plant_identity) for _ in range(2))
        self.addCleanup(first.kill)
        self.addCleanup(second.kill)
        certificate, key = identity
        security = f"Basic256Sha256,SignAndEncrypt,{certificate},{key},{plant_identity[0]}"
        process = await self.command(security, *plant_identity)
        first.start()
        async with Reader(self.served, security) as served:
            async with Reader(self.plant, security) as plant:
                await self.check_faults(first, plant, served)
                # A stand-in serves before the sensor has failed often enough to be reported.
                printed = await printed_until(process, " failed float_2: ")
                first.kill()
            # Nothing serves it, nor what stands, as nobody says that it stands.
            self.assertIsNone((await served.until(SERVED, "Bad")).Value.Value)
            await served.until(VALVE, "Bad")
            second.start()
            await served.until(SERVED, "UncertainSubstituteValue", 5.0)
        async with Reader(self.plant, security) as plant:
            await plant.until(HEALED, "UncertainSubstituteValue", 5.0)
            process.send_signal(signal.SIGTERM)
            await plant.until(HEALED, "BadOutOfService")
        rest, problems = (it.decode() for it in await process.communicate())
        printed += rest
        self.assertEqual(process.returncode, 0, problems)
        for expected in ("the page is at http", " failed float_1: ", " failed float_2: ", " disconnected: ", " connected: "):
            self.assertIn(expected, printed)
        self.assertIn("Tank.Plain takes no status code and no time stamp", problems)

    async def check_faults(self, tank: Plant, plant: Reader, served: Reader) -> None:
        healed = await plant.until(HEALED, "Good", 5.0)
        age = datetime.now(timezone.utc) - healed.SourceTimestamp
        self.assertLess(abs(age), timedelta(seconds=30))
        await plant.until_text(HEALED + ".Quality", "Good")
        await plant.until_text(HEALED + ".Source", "float_1")

        tank.order("float_1 2.5")
        await plant.until(HEALED, "UncertainSubstituteValue", 5.0)
        await plant.until_text(HEALED + ".Source", "float_2")
        # It says itself that it is broken.
        tank.order("float_2 BadSensorFailure")
        await served.until_text(SERVED + ".Source", "float_3")
        await served.until(SERVED, "UncertainSubstituteValue", 5.0)
        lower, upper = [(await served.read(f"{SERVED}.{it}")).Value.Value for it in ("Lower", "Upper")]
        self.assertTrue(4.9 < lower < upper < 5.1, (lower, upper))

        # It does not change, and is read again and again.
        # Its bounds end at the range, 0 to 100 %: the middle of what is left is half of the error.
        await served.until(VALVE, "Good", 0.25)
        tank.order("valve 40")
        await served.until(VALVE, "Good", 40.0)
        # A variable that takes values alone.
        await plant.until(PLAIN, "Good", 40.0)


if __name__ == "__main__":
    unittest.main()
