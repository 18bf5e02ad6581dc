"""Sensors of one speed, and a consumer of it, which know nothing of shsa: they publish until they are told to do worse, and
write down what arrives under the name of the need.

The argument is a JSON object:

    {"bus": "mqtt" | "zenoh", "address": HOST, "port": N, "signals": [NAME, ..], "topic": PREFIX, "rate": HZ, "need": NAME}

Orders come as one JSON object a line; each is answered with {"done": ..}, some with more. Times are seconds of a clock that
never steps, the same for every process of the machine.

    {"fault": NAME, "kind": "stop" | "bias" | "none", "amount": N}   answers {"at": when it can be seen first}
    {"now": true}                                                    answers {"at": now}
    {"values": true}          answers {"values": [[at, value, quality, publisher, stamp_ns, wall_ns], ..]}, then forgets them
    {"burst": TOPIC, "count": N}            numbers from 0 on, which the broker has confirmed when it is done
    {"garbage": [TOPIC, ..], "count": N, "rate": HZ, "seed": N}
    {"flood": TOPIC, "rate": HZ, "seconds": S}                       answers {"sent": N, "seconds": S}
"""

import json
import math
import random
import select
import socket
import struct
import sys
import threading
import time

lock = threading.Lock()


def say(**what):
    with lock:
        print(json.dumps(what), flush=True)


class Mqtt:
    """Two clients: one publishes, one listens. Both come back by themselves."""

    def __init__(self, order, heard):
        import paho.mqtt.client as mqtt

        self.place = (order["address"], order["port"])
        self.clients = [mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, protocol=mqtt.MQTTv5) for _ in range(2)]
        subscribed = threading.Event()

        def on_message(client, userdata, message):
            beside = dict(getattr(message.properties, "UserProperty", []) or [])
            heard(message.payload, beside)

        self.clients[1].on_message = on_message
        self.clients[1].on_connect = lambda client, *_: client.subscribe(order["need"], qos=0)
        self.clients[1].on_subscribe = lambda *_: subscribed.set()
        for client in self.clients:
            client.max_inflight_messages_set(1000)
            client.max_queued_messages_set(0)
            client.reconnect_delay_set(0.1, 0.2)
            client.connect(*self.place, keepalive=10)
            client.loop_start()
        assert subscribed.wait(20)

    def publish(self, topic, payload):
        if self.clients[0].is_connected():
            self.clients[0].publish(topic, payload, qos=0)

    def confirmed(self, topic, payloads):
        sent = [self.clients[0].publish(topic, payload, qos=1) for payload in payloads]
        for one in sent:
            one.wait_for_publish(20)

    def flood(self, topic, rate, seconds):
        """MQTT 3.1.1 as bytes, many messages at once: no client library is as quick."""
        def text(value):
            return struct.pack("!H", len(value)) + value.encode()

        hello = text("MQTT") + bytes([4, 2, 0, 0]) + text("flood")
        with socket.create_connection(self.place) as wire:
            wire.sendall(bytes([0x10, len(hello)]) + hello)
            assert wire.recv(4)[3] == 0
            each = rate // 200

            def batch():
                message = text(topic) + json.dumps({"value": 10.0, "at": time.time()}).encode()
                return (bytes([0x30, len(message)]) + message) * each

            sent = each * paced(200, seconds, lambda: wire.sendall(batch()))
            # A broker that is behind loses what it has not read when the connection ends: its answer to a ping comes after all of that.
            wire.sendall(bytes([0xC0, 0]))
            assert wire.recv(2, socket.MSG_WAITALL) == bytes([0xD0, 0])
            return sent


class Zenoh:
    """Two sessions that connect to a router: one publishes, one listens."""

    def __init__(self, order, heard):
        import zenoh

        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("connect/endpoints", json.dumps([f"tcp/{order['address']}:{order['port']}"]))
        self.sessions = [zenoh.open(config) for _ in range(2)]
        self.publishers = {}

        def on_sample(sample):
            heard(sample.payload.to_bytes(), json.loads(sample.attachment.to_bytes()) if sample.attachment else {})

        self.subscriber = self.sessions[1].declare_subscriber(order["need"], on_sample)

    def publish(self, topic, payload):
        if topic not in self.publishers:
            self.publishers[topic] = self.sessions[0].declare_publisher(topic, express=True)
        self.publishers[topic].put(payload)


def paced(rate, seconds, act):
    """Acts so often a second, catching up when it is late; how often it has acted."""
    start, count = time.monotonic(), 0
    while count < rate * seconds:
        left = start + count / rate - time.monotonic()
        if left > 0:
            # Not `time.sleep`, which waits for a moment: libfaketime confuses its clock with another one.
            select.select([], [], [], left)
        act()
        count += 1
    return count


class Plant:
    def __init__(self, order):
        self.order, self.faults, self.seen = order, {}, []
        self.first_bad = {}
        self.bus = {"mqtt": Mqtt, "zenoh": Zenoh}[order["bus"]](order, self.heard)
        threading.Thread(target=paced, args=(order["rate"], math.inf, self.measure), daemon=True).start()

    def heard(self, payload, beside):
        stamp = int(beside.get("stamp_ns", 0))
        what = [float(payload), beside.get("quality"), beside.get("publisher"), stamp, time.time_ns()]
        self.seen.append([time.monotonic(), *what])

    def measure(self):
        """Every sensor measures once."""
        speed = 10 + 0.3 * math.sin(time.monotonic() / 3)
        for name in self.order["signals"]:
            kind, amount = self.faults.get(name, ("none", 0))
            if kind != "none":
                self.first_bad.setdefault(name, time.monotonic())
            if kind != "stop":
                value = speed + amount if kind == "bias" else speed
                payload = json.dumps({"value": value, "at": time.time()})
                self.bus.publish(f"{self.order['topic']}/{name}", payload)

    def obey(self, order):
        if "fault" in order:
            name = order["fault"]
            self.first_bad.pop(name, None)
            self.faults[name] = (order["kind"], order.get("amount", 0))
            while order["kind"] != "none" and name not in self.first_bad:
                time.sleep(0.001)
            say(at=self.first_bad.get(name, time.monotonic()))
        elif "now" in order:
            say(at=time.monotonic())
        elif "values" in order:
            seen, self.seen = self.seen, []
            say(values=seen)
        elif "burst" in order:
            numbers = range(order["count"])
            self.bus.confirmed(order["burst"], [json.dumps({"value": number, "at": time.time()}) for number in numbers])
        elif "garbage" in order:
            self.garbage(order)
        elif "flood" in order:
            start = time.monotonic()
            sent = self.bus.flood(order["flood"], order["rate"], order["seconds"])
            say(sent=sent, seconds=time.monotonic() - start)

    def garbage(self, order):
        source, topics = random.Random(order["seed"]), order["garbage"]
        count = iter(range(order["count"]))

        def hundred():
            for _ in range(100):
                self.bus.publish(topics[next(count) % len(topics)], rubbish(source))

        paced(order["rate"] / 100, order["count"] / order["rate"], hundred)


def rubbish(source):
    """What a broken program may publish; never a number that a sensor could give."""
    good = json.dumps({"value": source.uniform(9, 11), "at": time.time()}).encode()
    kind = source.randrange(8)
    if kind == 0:
        return b"\xff" + source.randbytes(source.randrange(200))
    if kind == 1:
        return good[: source.randrange(len(good) - 1)]
    if kind == 2:
        return b'{"value": 1e' + str(source.randrange(400, 10**9)).encode() + b"}"
    if kind == 3:
        return b'{"value": ' + b"9" * source.randrange(310, 2000) + b"}"
    if kind == 4:
        return b'{"value": ' + b"[" * source.randrange(1, 4000)
    if kind == 5:
        return b'{"value": "\xc3\x28\xa0\xa1"}'
    if kind == 6:
        return b'{"value": ' + source.choice([b"null", b'"fast"', b"NaN", b"{}", b"[]", b"-"]) + b"}"
    return b'{"value": {"value": ' * source.randrange(1, 1000) + b"1" + b"}}" * 1000


def main():
    plant = Plant(json.loads(sys.argv[1]))
    say(ready=True)
    for line in sys.stdin:
        order = json.loads(line)
        plant.obey(order)
        say(done=next(iter(order)))


main()
