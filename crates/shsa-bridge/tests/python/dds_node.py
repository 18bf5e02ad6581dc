"""A node of ROS 2 over DDS that knows nothing of shsa: cyclonedds, with types under the names that ROS 2 gives them.

Orders come as lines of JSON, what is heard goes out as lines of JSON; it ends with its standard input.

    {"publish": TOPIC, "type": TYPE, "set": {PATH: VALUE}, "stamp": NS, "reliable": true}
    {"subscribe": TOPIC, "type": TYPE, "get": PATH, "reliable": true}   {"list": true}
"""

import json
import os
import sys
import threading

given = json.loads(sys.argv[1])
discovery = "" if given["multicast"] else (
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='localhost'/></Peers></Discovery>")
os.environ["CYCLONEDDS_URI"] = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
    f"<AllowMulticast>{str(given['multicast']).lower()}</AllowMulticast></General>{discovery}</Domain></CycloneDDS>")

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import Listener
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from dds_types import TYPES

lock = threading.Lock()


def say(**what):
    with lock:
        print(json.dumps(what), flush=True)


def qos(order):
    """The settings of ROS 2's defaults, or those of its sensor data."""
    reliable = Policy.Reliability.Reliable(duration(milliseconds=100))
    reliability = reliable if order.get("reliable", True) else Policy.Reliability.BestEffort
    return Qos(reliability, Policy.Durability.Volatile, Policy.History.KeepLast(10),
               Policy.DataRepresentation(use_cdrv0_representation=True))


def look(where, path):
    for step in path.split("."):
        where = where[int(step)] if step.isdigit() else getattr(where, step)
    return where


def assign(where, path, value):
    way, _, last = path.rpartition(".")
    setattr(look(where, way) if way else where, last, value)


class Heard(Listener):
    def __init__(self, topic, path):
        super().__init__()
        self.topic, self.path = topic, path

    def on_data_available(self, reader):
        for sample in reader.take(64):
            info = sample.sample_info
            if not info.valid_data:
                continue
            writer = reader.get_matched_publication_data(info.publication_handle)
            header = getattr(sample, "header", None)
            say(heard=self.topic, value=look(sample, self.path), stamp=info.source_timestamp,
                gid=writer.key.bytes.hex() if writer else None, header=header and header.stamp.sec)


class Node:
    def __init__(self, domain):
        self.participant, self.kept, self.writers = DomainParticipant(domain), [], {}

    def topic(self, name, kind):
        return Topic(self.participant, "rt/" + name.lstrip("/"), TYPES[kind])

    def publish(self, order):
        topic, kind = order["publish"], order["type"]
        if (topic, kind) not in self.writers:
            self.writers[topic, kind] = DataWriter(self.participant, self.topic(topic, kind), qos=qos(order))
        message = TYPES[kind]()
        for path, value in order.get("set", {}).items():
            assign(message, path, value)
        self.writers[topic, kind].write(message, timestamp=order.get("stamp"))

    def subscribe(self, order):
        topic, kind = order["subscribe"], order["type"]
        listener = Heard(topic, order["get"])
        self.kept += [listener, DataReader(self.participant, self.topic(topic, kind), qos=qos(order), listener=listener)]

    def list(self):
        """The topics of others."""
        found = []
        for kind, builtin in [("publisher", BuiltinTopicDcpsPublication), ("subscription", BuiltinTopicDcpsSubscription)]:
            for sample in BuiltinDataReader(self.participant, builtin).take(256):
                if sample.sample_info.valid_data and sample.participant_key != self.participant.guid:
                    found.append([kind, sample.topic_name, sample.type_name])
        say(listed=found)


def main():
    node = Node(given["domain"])
    say(ready=str(node.participant.guid))
    for line in sys.stdin:
        order = json.loads(line)
        if "publish" in order:
            node.publish(order)
        elif "subscribe" in order:
            node.subscribe(order)
        elif "list" in order:
            node.list()
        say(done=next(iter(order)))


main()
