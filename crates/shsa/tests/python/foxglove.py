"""Follows a run over the WebSocket protocol of Foxglove as a viewer does, and says what came as one JSON object.

The argument is a JSON object: {"address": ADDRESS, "protocol": NAME, "origin": ORIGIN or null}.
"""

import json
import struct
import sys

from websockets.exceptions import InvalidHandshake
from websockets.sync.client import connect

# Nothing here depends on how fast the machine is: this bounds the wait for what never comes.
PATIENCE_S = 120
# One channel of each kind.
WANTED = ["/shsa/signals/lidar/scan", "/shsa/verdicts/lidar/scan", "/shsa/graph", "/shsa/decisions", "/shsa/log", "/shsa/journal"]


def is_wanted(topic):
    return topic in WANTED or topic.startswith(("/shsa/needs/", "/shsa/ways/"))


def follow(address, protocol, origin):
    topics, schemas, subscribed, seen = {}, {}, {}, {}
    with connect(f"ws://{address}/", subprotocols=[protocol], origin=origin, max_size=None) as viewer:
        assert viewer.subprotocol == protocol, viewer.subprotocol
        info = json.loads(viewer.recv(PATIENCE_S))
        assert info["op"] == "serverInfo", info
        while len(seen) < len(WANTED) + 2:
            message = viewer.recv(PATIENCE_S)
            if isinstance(message, bytes):
                opcode, subscription, time = struct.unpack_from("<BIQ", message)
                assert opcode == 1 and time > 0, message
                topic = subscribed[subscription]
                seen["/".join(topic.split("/")[:3])] = json.loads(message[13:])
                continue
            news = json.loads(message)
            assert news["op"] == "advertise", news
            for channel in news["channels"]:
                assert channel["encoding"] == "json" and channel["schemaEncoding"] == "jsonschema", channel
                topic = channel["topic"]
                topics[topic] = channel["id"]
                schemas[channel["schemaName"]] = json.loads(channel["schema"])["title"]
                if is_wanted(topic):
                    subscription = 100 + channel["id"]
                    subscribed[subscription] = topic
                    asked = {"op": "subscribe", "subscriptions": [{"id": subscription, "channelId": channel["id"]}]}
                    viewer.send(json.dumps(asked))
    assert all(name == title for name, title in schemas.items()), schemas
    return {"name": info["name"], "schemas": sorted(schemas), "seen": seen}


def main(address, protocol, origin=None):
    try:
        print(json.dumps(follow(address, protocol, origin)))
    except InvalidHandshake as refused:
        print(json.dumps({"refused": refused.response.status_code}))


main(**json.loads(sys.argv[1]))
