"""A car and a consumer of its speed, which know nothing of shsa: plays a recording in real time, breaks a sensor, and
writes down what arrives under the name of the need.

The argument is a JSON object:

    {"bus": "mqtt" | "zenoh" | "ros2" | "ros2-dds", "port": N, "data": FOLDER, "skip": SECONDS, "seconds": SECONDS, "need": NAME,
     "fault": {"topic": NAME, "column": NAME, "kind": "stop" | "bias", "amount": NUMBER, "at": SECONDS}}

It says when the car drives: {"ready": true}. A line of its input ends the drive before its time. The answer at the end is an
object, too: the values and the statuses, each with its time in seconds from the beginning.
"""

import csv
import json
import os
import sys
import threading
import time

TOPICS = ["wheel_speed", "gnss_ublox", "gyro", "steering_angle"]
# As nodes of ROS 2 tell these columns: topic, type, field.
MESSAGES = {
    **{f"wheel_{n}": (f"/wheel_{n}/twist", "geometry_msgs/msg/TwistStamped", "twist.linear.x") for n in range(1, 5)},
    "speed": ("/gnss/twist", "geometry_msgs/msg/TwistWithCovarianceStamped", "twist.twist.linear.x"),
    "gyro_z": ("/imu", "sensor_msgs/msg/Imu", "angular_velocity.z"),
    "steering_angle": ("/steering_angle", "std_msgs/msg/Float64", "data"),
}


class Mqtt:
    """Two clients: one publishes, one listens."""

    def __init__(self, port):
        import paho.mqtt.client as mqtt

        self.clients = [mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, protocol=mqtt.MQTTv5) for _ in range(2)]
        for client in self.clients:
            client.connect("127.0.0.1", port, keepalive=10)
            client.loop_start()

    def publish(self, topic, text):
        self.clients[0].publish(topic, text, qos=0)

    def subscribe(self, topics, heard):
        def on_message(client, userdata, message):
            properties = dict(getattr(message.properties, "UserProperty", []) or [])
            heard(message.topic, message.payload.decode(), properties.get("quality"))

        subscribed = threading.Event()
        self.clients[1].on_message = on_message
        self.clients[1].on_subscribe = lambda *_: subscribed.set()
        self.clients[1].subscribe([(topic, 0) for topic in topics])
        assert subscribed.wait(20)

    def close(self):
        for client in self.clients:
            client.disconnect()
            client.loop_stop()


class Zenoh:
    """Two sessions that connect to a router: one publishes, one listens."""

    def __init__(self, port):
        import zenoh

        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
        self.sessions = [zenoh.open(config) for _ in range(2)]
        self.publishers, self.subscribers = {}, []

    def publish(self, topic, text):
        if topic not in self.publishers:
            self.publishers[topic] = self.sessions[0].declare_publisher(topic, express=True)
        self.publishers[topic].put(text)

    def subscribe(self, topics, heard):
        def on_sample(sample):
            beside = sample.attachment and json.loads(sample.attachment.to_bytes())
            heard(str(sample.key_expr), sample.payload.to_bytes().decode(), (beside or {}).get("quality"))

        for topic in topics:
            self.subscribers.append(self.sessions[1].declare_subscriber(topic.strip("/").replace("#", "**"), on_sample))

    def close(self):
        for session in self.sessions:
            session.close()


class Ros2(Zenoh):
    """Nodes that speak rmw_zenoh; messages are those of `rosbags`, names and attachments those of `zenoh_ros2_sdk`."""

    def __init__(self, port):
        os.environ.setdefault("GIT_PYTHON_REFRESH", "quiet")
        super().__init__(port)
        from rosbags.typesys import Stores, get_typestore
        from zenoh_ros2_sdk.attachment import Attachment
        from zenoh_ros2_sdk.keyexpr import topic_keyexpr
        from zenoh_ros2_sdk.utils import ros2_to_dds_type

        self.store, self.attachment = get_typestore(Stores.ROS2_JAZZY), Attachment
        self.key = lambda topic, name: topic_keyexpr(0, topic, ros2_to_dds_type(name), self.store.hash_rihs01(name))
        self.sent, self.messages = 0, {}

    def message(self, name):
        """A message of zeros that is filled in again and again."""
        from numpy import zeros
        from rosbags.interfaces import Nodetype

        def default(desc):
            kind, inner = desc
            if kind == Nodetype.NAME:
                return make(inner)
            if kind == Nodetype.BASE:
                return "" if inner[0] == "string" else 0
            return zeros(inner[1] if kind == Nodetype.ARRAY else 0)

        def make(name):
            return self.store.types[name](**{field: default(desc) for field, desc in self.store.fielddefs[name][1]})

        return self.messages.setdefault(name, make(name))

    def put(self, topic, name, content):
        if topic not in self.publishers:
            self.publishers[topic] = self.sessions[0].declare_publisher(self.key(topic, name), express=True)
        self.sent += 1
        beside = self.attachment(self.sent, time.time_ns(), bytes(range(1, 17))).to_bytes()
        self.publishers[topic].put(bytes(self.store.serialize_cdr(content, name)), attachment=beside)

    def publish(self, topic, text):
        for column, value in json.loads(text).items():
            if column not in MESSAGES:
                continue
            path, name, field = MESSAGES[column]
            content = where = self.message(name)
            if hasattr(content, "header"):
                now = time.time_ns()
                object.__setattr__(content.header.stamp, "sec", now // 10**9)
                object.__setattr__(content.header.stamp, "nanosec", now % 10**9)
            *way, last = field.split(".")
            for step in way:
                where = getattr(where, step)
            object.__setattr__(where, last, value)
            self.put(path, name, content)

    def subscribe(self, topics, heard):
        for topic in topics:
            name = "std_msgs/msg/Float64" if topic == topics[0] else "std_msgs/msg/String"
            key = self.key(topic.replace("#", "**"), name)

            def on_sample(sample, name=name):
                content = self.store.deserialize_cdr(sample.payload.to_bytes(), name)
                # DOMAIN/TOPIC/TYPE/HASH
                topic = str(sample.key_expr).split("/", 1)[1].rsplit("/", 2)[0]
                heard(topic, str(content.data), None)

            self.subscribers.append(self.sessions[1].declare_subscriber(key, on_sample))


class Dds:
    """Nodes that speak DDS on the loopback interface: cyclonedds. Each message is new in full, as its types are mutable."""

    def __init__(self, _port):
        interface = "<Interfaces><NetworkInterface name='lo'/></Interfaces>"
        os.environ["CYCLONEDDS_URI"] = f"<CycloneDDS><Domain><General>{interface}</General></Domain></CycloneDDS>"
        sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../../../shsa-bridge/tests/python"))
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.qos import Policy, Qos
        from cyclonedds.util import duration
        from dds_types import TYPES

        self.types, self.participants = TYPES, [DomainParticipant(0) for _ in range(2)]
        self.qos = Qos(Policy.Reliability.Reliable(duration(milliseconds=100)), Policy.History.KeepLast(10),
                       Policy.DataRepresentation(use_cdrv0_representation=True))
        self.writers, self.kept = {}, []

    def topic(self, participant, name, kind):
        from cyclonedds.topic import Topic

        return Topic(participant, "rt/" + name.lstrip("/"), self.types[kind])

    def publish(self, _topic, text):
        from cyclonedds.pub import DataWriter

        for column, value in json.loads(text).items():
            if column not in MESSAGES:
                continue
            path, name, field = MESSAGES[column]
            if path not in self.writers:
                topic = self.topic(self.participants[0], path, name)
                self.writers[path] = DataWriter(self.participants[0], topic, qos=self.qos)
            content = where = self.types[name]()
            if hasattr(content, "header"):
                content.header.stamp.sec, content.header.stamp.nanosec = divmod(time.time_ns(), 10**9)
            *way, last = field.split(".")
            for step in way:
                where = getattr(where, step)
            setattr(where, last, value)
            self.writers[path].write(content)

    def subscribe(self, topics, heard):
        from cyclonedds.core import Listener
        from cyclonedds.sub import DataReader

        class Heard(Listener):
            def __init__(self, topic):
                super().__init__()
                self.topic = topic

            def on_data_available(self, reader):
                for content in reader.take(64):
                    if content.sample_info.valid_data:
                        heard(self.topic, str(content.data), None)

        # DDS has no patterns: the name of the instance is known.
        for topic, name in [(topics[0], "std_msgs/msg/Float64"), ("shsa/shsa/need/speed", "std_msgs/msg/String")]:
            listener, topic = Heard(topic), self.topic(self.participants[1], topic, name)
            self.kept += [listener, DataReader(self.participants[1], topic, qos=self.qos, listener=listener)]

    def close(self):
        self.kept.clear()


def rows(folder, topic, skip, seconds):
    """The rows of a topic with their times from the beginning, columns without their units."""
    with open(f"{folder}/{topic}.csv", newline="") as file:
        for row in csv.DictReader(file):
            at = float(row.pop("t [s]")) - skip
            if 0 <= at < seconds:
                yield at, topic, {name.split(" [")[0]: float(value) for name, value in row.items()}


def broken(topic, columns, at, fault):
    """The columns as the broken sensor gives them; None where it gives nothing."""
    if not fault or topic != fault["topic"] or at < fault["at"]:
        return columns
    if fault["kind"] == "stop":
        rest = {name: value for name, value in columns.items() if name != fault["column"]}
        return rest if topic == "wheel_speed" else None
    return {**columns, fault["column"]: columns[fault["column"]] + fault["amount"]}


def main():
    order = json.loads(sys.argv[1])
    bus = {"mqtt": Mqtt, "zenoh": Zenoh, "ros2": Ros2, "ros2-dds": Dds}[order["bus"]](order["port"])
    values, statuses = [], []
    start = time.monotonic()

    def heard(topic, text, quality):
        now = time.monotonic() - start
        if topic.strip("/") == order["need"].strip("/"):
            values.append([now, float(text), quality])
        else:
            statuses.append([now, json.loads(text)])

    bus.subscribe([order["need"], "shsa/+/need/#" if order["bus"] == "mqtt" else "shsa/*/need/#"], heard)
    recording = sorted(
        (row for topic in TOPICS for row in rows(order["data"], topic, order["skip"], order["seconds"])),
        key=lambda row: row[0],
    )
    time.sleep(0.5)
    is_over = threading.Event()
    threading.Thread(target=lambda: sys.stdin.readline() and is_over.set(), daemon=True).start()
    print(json.dumps({"ready": True}), flush=True)
    start = time.monotonic()
    for at, topic, columns in recording:
        left = at - (time.monotonic() - start)
        if is_over.wait(max(left, 0)):
            break
        columns = broken(topic, columns, at, order.get("fault"))
        if columns is not None:
            bus.publish(topic, json.dumps(columns))
    time.sleep(0.5)
    bus.close()
    print(json.dumps({"values": values, "statuses": statuses}), flush=True)
    print(json.dumps({"done": True}), flush=True)


main()
