"""A sensor that knows nothing of shsa: publishes its value in a rhythm, and obeys nobody but its own way of being silenced.

The argument is a JSON object:

    {"bus": "mqtt" | "zenoh" | "ros2", "port": N, "name": NAME, "user": NAME, "password": TEXT, "topic": NAME,
     "text": "{\"speed\": VALUE}", "period": SECONDS, "obeys": NAME}

On Zenoh it answers queries at `obeys`, whose payload is `silence` or `publish`; on ROS 2 `obeys` is a service of type
std_srvs/srv/SetBool, and its messages are geometry_msgs/msg/TwistStamped. Orders come as lines of JSON; it ends with its
standard input.

    {"value": NUMBER}   {"who": true}
"""

import json
import os
import sys
import threading
import time

os.environ.setdefault("GIT_PYTHON_REFRESH", "quiet")

lock = threading.Lock()


def say(**what):
    with lock:
        print(json.dumps(what), flush=True)


class Mqtt:
    """A client that comes back by itself when it is thrown out."""

    def __init__(self, order, is_on):
        import paho.mqtt.client as mqtt

        self.client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, client_id=order["name"], protocol=mqtt.MQTTv5)
        self.client.reconnect_delay_set(0.1, 0.3)
        if "user" in order:
            self.client.username_pw_set(order["user"], order["password"])
        connected = threading.Event()
        self.client.on_connect = lambda *_: connected.set()
        self.topic, self.text = order["topic"], order["text"]
        self.client.connect("127.0.0.1", order["port"], keepalive=60)
        self.client.loop_start()
        assert connected.wait(20)

    def publish(self, value):
        if self.client.is_connected():
            self.client.publish(self.topic, self.text.replace("VALUE", f"{value:.3f}"), qos=0)


class Zenoh:
    """A session at a router, and who answers there."""

    def __init__(self, order, is_on):
        import zenoh

        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{order['port']}"]))
        self.session, self.text = zenoh.open(config), order["text"]
        self.publisher = self.session.declare_publisher(order["topic"], express=True)
        if "obeys" in order:

            def answer(query):
                word = query.payload.to_bytes().decode()
                if word not in ("silence", "publish"):
                    return query.reply_err(f"no such word: {word}")
                (is_on.set if word == "publish" else is_on.clear)()
                query.reply(order["obeys"], f"ok, {word}")

            self.queryable = self.session.declare_queryable(order["obeys"], answer)

    def publish(self, value):
        self.publisher.put(self.text.replace("VALUE", f"{value:.3f}"))


class Ros2:
    """A node of rmw_zenoh; the service is that of zenoh_ros2_sdk."""

    TYPE = "geometry_msgs/msg/TwistStamped"

    def __init__(self, order, is_on):
        os.environ["ZENOH_CONFIG_OVERRIDE"] = "scouting/multicast/enabled=false"
        from rosbags.typesys import Stores, get_typestore
        from zenoh_ros2_sdk.attachment import Attachment
        from zenoh_ros2_sdk.keyexpr import topic_keyexpr
        from zenoh_ros2_sdk.service_server import ROS2ServiceServer
        from zenoh_ros2_sdk.session import ZenohSession
        from zenoh_ros2_sdk.utils import ros2_to_dds_type

        self.store, self.attachment, self.sequence = get_typestore(Stores.ROS2_JAZZY), Attachment, 0
        session = ZenohSession.get_instance("127.0.0.1", order["port"]).session
        key = topic_keyexpr(0, order["topic"], ros2_to_dds_type(self.TYPE), self.store.hash_rihs01(self.TYPE))
        self.publisher, self.id = session.declare_publisher(key), os.urandom(16)
        if "obeys" in order:

            def answer(request):
                (is_on.set if request.data else is_on.clear)()
                return self.server.response_msg_class(success=True, message="as you say")

            self.server = ROS2ServiceServer(
                order["obeys"], "std_srvs/srv/SetBool", answer, request_definition="bool data",
                response_definition="bool success\nstring message", domain_id=0, router_port=order["port"])

    def publish(self, value):
        types, now = self.store.types, time.time_ns()
        vector = types["geometry_msgs/msg/Vector3"]
        stamp = types["builtin_interfaces/msg/Time"](sec=now // 10**9, nanosec=now % 10**9)
        message = types[self.TYPE](
            header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="front axle"),
            twist=types["geometry_msgs/msg/Twist"](linear=vector(x=value, y=0.25, z=0.0), angular=vector(x=0.0, y=0.0, z=0.0)),
        )
        self.sequence += 1
        beside = self.attachment(self.sequence, now, self.id).to_bytes()
        self.publisher.put(bytes(self.store.serialize_cdr(message, self.TYPE)), attachment=beside)


def main():
    order = json.loads(sys.argv[1])
    is_on = threading.Event()
    is_on.set()
    sensor = {"mqtt": Mqtt, "zenoh": Zenoh, "ros2": Ros2}[order["bus"]](order, is_on)
    state = {"value": 10.0}

    def publish():
        while True:
            if is_on.is_set():
                sensor.publish(state["value"])
            time.sleep(order["period"])

    threading.Thread(target=publish, daemon=True).start()
    say(ready=True)
    for line in sys.stdin:
        given = json.loads(line)
        if "value" in given:
            state["value"] = given["value"]
        elif "who" in given:
            say(pid=os.getpid())
        say(done=next(iter(given)))
    os._exit(0)


main()
