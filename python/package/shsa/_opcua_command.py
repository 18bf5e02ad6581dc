"""``python -m shsa.opcua``: a plant healed from the command line."""

from __future__ import annotations

import argparse
import asyncio
import logging
import os
import pathlib
import signal
import sys
from collections.abc import Sequence
from datetime import datetime, timezone
from typing import Any

import shsa
from shsa import opcua

from ._errors import ShsaError
from ._opcua_values import STAMPS

PRINTED_EVERY_S = 0.2

HELP = """\
Subscribes to the nodes that the signals of MODEL name, finds faulty ones, and writes each need to its node, with status code
and time stamp. User and password come from SHSA_OPCUA_USER and SHSA_OPCUA_PASSWORD. Ends in order at SIGTERM and SIGINT."""


def arguments() -> argparse.ArgumentParser:
    """The arguments of the command."""
    parser = argparse.ArgumentParser("python -m shsa.opcua", description=HELP)
    add = parser.add_argument
    add("model", help="the model, YAML or JSON")
    add("url", help="the server, such as opc.tcp://127.0.0.1:4840")
    add("--map", metavar="FILE", help='nodes by names, as JSON: {"signals": {SIGNAL: NODE}, "needs": {NEED: NODE}}')
    add("--serve", metavar="URL", help="serve the needs as variables there, too, such as opc.tcp://127.0.0.1:4841")
    add("--serve-certificate", metavar="FILE", help="encrypt all connections to --serve; with --serve-key")
    add("--serve-key", metavar="FILE")
    security = "POLICY,MODE,CERTIFICATE,KEY[,SERVER_CERTIFICATE]"
    add("--security", metavar=security, help="such as Basic256Sha256,SignAndEncrypt,shsa.der,shsa.pem,plant.der")
    add("--application-uri", default="urn:shsa", metavar="URI", help="as in the certificate; default urn:shsa")
    add("--insecure", action="store_true", help="allow other machines without certificates")
    add("--stamps", choices=STAMPS, default="source", help="whose clock is right; default source")
    add("--take-uncertain", action="store_true", help="uncertain measurements are observations")
    add("--retry", type=float, default=10.0, metavar="SECONDS", help="the longest pause before it connects again; default 10")
    add("--http", metavar="ADDRESS", help="serve the live page there, such as 127.0.0.1:7410")
    add("--state", metavar="FOLDER", help="keep verdicts and orders there")
    add("--name", default="shsa", help="the name of the run; default shsa")
    return parser


def link(given: argparse.Namespace) -> opcua.Link:
    """The link that the arguments ask for. Raises `ShsaError` and `OSError`."""
    nodes: dict[str, str] = {}
    outputs: opcua.Outputs = {}
    if given.map is not None:
        nodes, outputs = opcua.read_map(pathlib.Path(given.map).read_text(encoding="utf-8"), given.map)
    environment = os.environ.get
    access = opcua.Access(
        environment("SHSA_OPCUA_USER"),
        environment("SHSA_OPCUA_PASSWORD"),
        given.security,
        given.application_uri,
        given.insecure,
    )
    serve = given.serve and opcua.Serve(given.serve, given.serve_certificate, given.serve_key, given.insecure)
    return opcua.Link(
        shsa.Model.load(given.model),
        given.url,
        nodes=nodes,
        outputs=outputs,
        serve=serve,
        access=access,
        stamps=given.stamps,
        take_uncertain=given.take_uncertain,
        retry_s=given.retry,
        name=given.name,
        http=given.http,
        state=given.state,
    )


async def heal(healed: opcua.Link) -> None:
    """Runs a link until a signal, and prints its decisions."""
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, healed.stop)
    printer: asyncio.Task[None] | None = None

    def started(run: shsa.Runtime) -> None:
        nonlocal printer
        if run.address is not None:
            print(f"the page is at {run.address}", flush=True)
        printer = loop.create_task(print_all(run))

    await healed.run(started)
    if printer is not None:
        printer.cancel()


async def print_all(run: shsa.Runtime) -> None:
    """Prints decisions as they come."""
    while True:
        for event in run.events():
            print(line(event), flush=True)
        await asyncio.sleep(PRINTED_EVERY_S)


def line(event: dict[str, Any]) -> str:
    """A decision in one line."""
    now = datetime.now(timezone.utc).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    named = event.get("signal") or event.get("variable")
    return " ".join(str(it) for it in (now, event["kind"], named) if it) + f": {event['because']}"


def main(words: Sequence[str] | None = None) -> None:
    """The command: exit status 0 at its end by a signal, 2 for what cannot be done."""
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    # Each lost connection is a decision of the run, without a trace.
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)
    try:
        asyncio.run(heal(link(arguments().parse_args(words))))
    except (ShsaError, OSError) as error:
        print(f"shsa.opcua: {error}", file=sys.stderr)
        sys.exit(2)
