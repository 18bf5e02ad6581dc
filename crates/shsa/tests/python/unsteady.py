"""A sensor of one speed that breaks in many ways, or a consumer of the need; neither knows anything of shsa.

The argument is a JSON object:

    {"port": N, "topic": NAME, "rate": HZ, "stamped": BOOL, "qos": N}      a sensor
    {"port": N, "need": NAME}                                              a consumer

The speed is a function of a clock that never steps, the same for every process of the machine (`speed`). A reading tells in its
last decimals when it was measured, so that whoever reads a value knows how old it is and what was true then.

A sensor obeys lines of JSON, {"fault": KIND, "amount": N}; a KIND holds until the next one:

    none                  it measures and publishes
    bias, drift           it is off by AMOUNT, by AMOUNT more each second
    freeze                it says the same reading again and again
    clock                 its stamps are off by AMOUNT seconds
    twice                 it publishes every message AMOUNT times more
    garbage               it publishes AMOUNT payloads that are none after every message
    hold                  it keeps its messages, and publishes all of them at once when it is told something else
    stop                  it publishes nothing

A consumer answers {"values": true} with {"values": [[at, value, quality, lag], ..], "now": AT}, then forgets them. The lag is what
the broker takes at that time for a message of the consumer to itself, so that a slow machine is not taken for an old value.
"""

import json
import random
import sys
import threading
import time

import paho.mqtt.client as mqtt

lock = threading.Lock()

# As in crates/shsa/tests/chaos/sequences/truth.rs.
PERIOD, LOW, SLOPE = 60.0, 10.0, 2.0


def speed(at):
    """Up and down again, by 2 m/s each second."""
    phase = at % PERIOD
    return LOW + SLOPE * min(phase, PERIOD - phase)


def say(**what):
    with lock:
        print(json.dumps(what), flush=True)


def client(port):
    made = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, protocol=mqtt.MQTTv5)
    made.reconnect_delay_set(0.1, 0.2)
    made.max_queued_messages_set(0)
    made.connect_async("127.0.0.1", port, keepalive=10)
    return made


class Sensor:
    def __init__(self, order):
        self.order, self.fault, self.since, self.held = order, ("none", 0), 0.0, []
        self.frozen, self.source = None, random.Random(order["topic"])
        self.client = client(order["port"])
        self.client.loop_start()
        threading.Thread(target=self.measure_on, daemon=True).start()

    def measure_on(self):
        period = 1 / self.order["rate"]
        due = time.monotonic()
        while True:
            time.sleep(max(0.0, due - time.monotonic()))
            # After a pause it measures now, and not what it has missed.
            due = max(due + period, time.monotonic())
            self.measure()

    def measure(self):
        kind, amount = self.fault
        at = time.monotonic()
        off = {"bias": amount, "drift": amount * (at - self.since)}.get(kind, 0.0)
        reading = round(speed(at) + off, 2) + (int(at * 1000) % 100_000) * 1e-7
        if kind == "freeze":
            self.frozen = reading = self.frozen or reading
        else:
            self.frozen = None
        message = {"value": reading}
        if self.order["stamped"]:
            message["at"] = time.time() + (amount if kind == "clock" else 0.0)
        payload = json.dumps(message)
        if kind == "hold":
            self.held.append(payload)
        elif kind != "stop":
            held, self.held = self.held, []
            for one in held + [payload] * (1 + (int(amount) if kind == "twice" else 0)):
                self.publish(one)
        for _ in range(int(amount) if kind == "garbage" else 0):
            self.publish(rubbish(self.source))

    def publish(self, payload):
        if self.client.is_connected():
            self.client.publish(self.order["topic"], payload, qos=self.order["qos"])

    def obey(self, order):
        self.since = time.monotonic()
        self.fault = (order["fault"], order.get("amount", 0))


def rubbish(source):
    """Never a number that a sensor could give."""
    return source.choice(
        [
            b"\xff" + source.randbytes(source.randrange(100)),
            b'{"value": 1',
            b'{"value": 1e999}',
            b'{"value": null, "at": 1}',
            b'{"at": "now"}',
            b"[" * source.randrange(1, 2000),
            b"",
        ]
    )


class Consumer:
    def __init__(self, order):
        self.seen, subscribed = [], threading.Event()
        self.need, self.waiting, self.beat_at = order["need"], [], time.monotonic()
        self.client = client(order["port"])
        self.client.on_connect = lambda made, *_: made.subscribe([(self.need, 0), ("metronome", 0)])
        self.client.on_subscribe = lambda *_: subscribed.set()
        self.client.on_message = self.on_message
        self.client.loop_start()
        assert subscribed.wait(20)
        self.pacemaker = client(order["port"])
        self.pacemaker.loop_start()
        threading.Thread(target=self.beat, daemon=True).start()

    def beat(self):
        while True:
            time.sleep(0.05)
            if self.pacemaker.is_connected():
                self.pacemaker.publish("metronome", json.dumps(time.monotonic()), qos=0)

    def on_message(self, made, _, message):
        now = time.monotonic()
        if message.topic != self.need:
            self.beat_at = float(message.payload)
            for value in self.waiting:
                # The beats before and after it say how slow the broker is; after an outage only the later one.
                value[3] = min(value[3], now - self.beat_at)
            self.seen, self.waiting = self.seen + self.waiting, []
            return
        beside = dict(getattr(message.properties, "UserProperty", []) or [])
        self.waiting.append([now, float(message.payload), beside.get("quality"), now - self.beat_at])

    def obey(self, order):
        seen, self.seen = self.seen, []
        say(values=seen, now=time.monotonic())


def main():
    order = json.loads(sys.argv[1])
    role = Consumer(order) if "need" in order else Sensor(order)
    say(ready=True)
    for line in sys.stdin:
        role.obey(json.loads(line))
        say(done=True)


main()
