"""A node of ROS 2 over rmw_zenoh that knows nothing of shsa.

Messages and hashes of types are those of `rosbags`, keys, attachments and the graph those of `zenoh_ros2_sdk`. Orders come
as lines of JSON, what is heard goes out as lines of JSON; it ends with its standard input.

    {"publish": TOPIC, "type": TYPE, "set": {PATH: VALUE}, "stamp": NS, "times": N}
    {"subscribe": TOPIC, "type": TYPE, "get": PATH}   {"list": true}   {"hashes": true}
"""

import json
import os
import sys
import threading

os.environ.setdefault("GIT_PYTHON_REFRESH", "quiet")

import zenoh
from rosbags.typesys import Stores, get_typestore
from rosbags.interfaces import Nodetype
import numpy
from zenoh_ros2_sdk.attachment import Attachment
from zenoh_ros2_sdk.discovery import _parse_liveliness_keyexpr
from zenoh_ros2_sdk.entity import EndpointEntity, EntityKind, NodeEntity
from zenoh_ros2_sdk.keyexpr import endpoint_liveliness_keyexpr, node_liveliness_keyexpr, topic_keyexpr
from zenoh_ros2_sdk.qos import DEFAULT_QOS_PROFILE, QosProfile
from zenoh_ros2_sdk.utils import dds_to_ros_type, ros2_to_dds_type

store = get_typestore(Stores.ROS2_JAZZY)
lock = threading.Lock()


def say(**what):
    with lock:
        print(json.dumps(what), flush=True)


def default(desc):
    """A value of a field's type: zeros, empty texts, empty lists."""
    kind, inner = desc
    if kind == Nodetype.BASE:
        return "" if inner[0] == "string" else False if inner[0] == "bool" else 0
    if kind == Nodetype.NAME:
        return message(inner)
    (element, count) = inner
    count = count if kind == Nodetype.ARRAY else 0
    if element[0] == Nodetype.BASE and element[1][0] != "string":
        return numpy.zeros(count, dtype=element[1][0].replace("byte", "uint8").replace("char", "uint8"))
    return [default(element) for _ in range(count)]


def message(name):
    return store.types[name](**{field: default(desc) for field, desc in store.fielddefs[name][1]})


def assign(where, path, value):
    *way, last = path.split(".")
    for step in way:
        where = where[int(step)] if step.isdigit() else getattr(where, step)
    if isinstance(getattr(where, last), numpy.ndarray):
        value = numpy.array(value, dtype=getattr(where, last).dtype)
    object.__setattr__(where, last, value)


def look(where, path):
    for step in path.split("."):
        where = where[int(step)] if step.isdigit() else getattr(where, step)
    return where.tolist() if isinstance(where, numpy.ndarray) else where


class Node:
    def __init__(self, session, domain):
        self.session, self.domain, self.kept, self.publishers = session, domain, [], {}
        self.node = NodeEntity(domain, str(session.zid()), 0, "stranger")
        self.declare(node_liveliness_keyexpr(self.node))

    def declare(self, token):
        self.kept.append(self.session.liveliness().declare_token(token))

    def endpoint(self, kind, topic, name):
        dds, digest = ros2_to_dds_type(name), store.hash_rihs01(name)
        qos = DEFAULT_QOS_PROFILE.encode()
        self.declare(endpoint_liveliness_keyexpr(
            EndpointEntity(self.node, len(self.kept), kind, topic, dds, digest, qos)))
        return topic_keyexpr(self.domain, topic, dds, digest)

    def publish(self, order):
        topic, name = order["publish"], order["type"]
        if topic not in self.publishers:
            key = self.endpoint(EntityKind.PUBLISHER, topic, name)
            self.publishers[topic] = self.session.declare_publisher(key)
        content = message(name)
        for path, value in order.get("set", {}).items():
            assign(content, path, value)
        beside = Attachment(1, order.get("stamp", 0), bytes(range(1, 17))).to_bytes()
        payload = bytes(store.serialize_cdr(content, name))
        for _ in range(order.get("times", 1)):
            self.publishers[topic].put(payload, attachment=beside)

    def subscribe(self, order):
        topic, name, path = order["subscribe"], order["type"], order["get"]

        def heard(sample):
            beside = Attachment.from_bytes(sample.attachment.to_bytes())
            content = store.deserialize_cdr(sample.payload.to_bytes(), name)
            say(heard=topic, value=look(content, path), sequence=beside.sequence_id,
                stamp=beside.timestamp_ns, gid=beside.gid.hex(),
                header=look(content, "header.stamp.sec") if hasattr(content, "header") else None)

        key = self.endpoint(EntityKind.SUBSCRIPTION, topic, name)
        self.kept.append(self.session.declare_subscriber(key, heard))

    def list(self):
        found = []
        for reply in self.session.liveliness().get(f"@ros2_lv/{self.domain}/**", timeout=2.0):
            parsed = _parse_liveliness_keyexpr(str(reply.ok.key_expr))
            if parsed is not None:
                QosProfile.decode(parsed["qos"])
                found.append([parsed["kind"], parsed["node_namespace" if "node_namespace" in parsed else "namespace"],
                              parsed["node_name"], parsed["qualified_name"], dds_to_ros_type(parsed["dds_type"]),
                              parsed["type_hash"]])
        say(listed=found)


def main():
    given = json.loads(sys.argv[1])
    config = zenoh.Config()
    for key, value in given["zenoh"].items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config) as session:
        node = Node(session, given["domain"])
        say(ready=str(session.zid()))
        for line in sys.stdin:
            order = json.loads(line)
            if "publish" in order:
                node.publish(order)
            elif "subscribe" in order:
                node.subscribe(order)
            elif "list" in order:
                node.list()
            elif "hashes" in order:
                say(hashes={name: store.hash_rihs01(name) for name in store.fielddefs if "/msg/" in name})
            say(done=next(iter(order)))


main()
