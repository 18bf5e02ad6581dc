"""Edge nodes and a consumer of Sparkplug B that know nothing of shsa: they do what they are told on standard input, and say
what they see. Payloads are encoded and decoded here, by the definition in the specification (6.4).

One JSON object a line. It ends with its standard input.

    {"connect": "GROUP/NODE", "bd_seq": N, "answers": BOOL}   an edge node, with its will; it may answer requests for births
    {"birth": [METRIC, ..], "node": .., "device": ..}   NBIRTH or DBIRTH; a node's begins its sequence
    {"data": [METRIC, ..], "node": .., "device": ..}    NDATA or DDATA
    {"death": "GROUP/NODE", "device": ..}           DDEATH; without a device NDEATH and the end of the connection
    {"cut": "GROUP/NODE"}                           the connection ends without a word
    {"skip": "GROUP/NODE"}                          a sequence number is left out
    {"command": "GROUP/NODE", "metrics": [METRIC]}  NCMD
    {"raw": TOPIC, "hex": HEX, "retain": BOOL}      any message
    {"follow": TOPIC}                               the consumer subscribes
    {"play": METRIC, "node": .., "device": .., "period": S}   data again and again
    {"set": NAME, "value": V}                       the value of a metric that is played
    {"sent": NAME}                                  the times of what was played, milliseconds

A METRIC has a name or an alias, a type, a value, and may have null, historical, quality, timestamp, untyped.
"""

import json
import struct
import sys
import threading
import time

import paho.mqtt.client as mqtt

TYPES = {"Int8": 1, "Int16": 2, "Int32": 3, "Int64": 4, "UInt64": 8, "Float": 9, "Double": 10, "Boolean": 11, "String": 12}
lock = threading.Lock()


def say(**what):
    with lock:
        print(json.dumps(what), flush=True)


# The encoding of Protocol Buffers.

def varint(number):
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes(out) + bytes([number])


def whole(field, number):
    return varint(field << 3) + varint(number)


def chunk(field, content):
    return varint(field << 3 | 2) + varint(len(content)) + content


def fields(message):
    at = 0

    def number():
        nonlocal at
        value, shift = 0, 0
        while True:
            byte = message[at]
            at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    while at < len(message):
        tag = number()
        kind = tag & 7
        if kind == 0:
            yield tag >> 3, number()
            continue
        size = {1: 8, 5: 4}.get(kind) or number()
        yield tag >> 3, bytes(message[at:at + size])
        at += size


# Payloads.

def metric(given):
    kind = TYPES[given.get("type", "Double")]
    out = b""
    if "name" in given:
        out += chunk(1, given["name"].encode())
    if "alias" in given:
        out += whole(2, given["alias"])
    out += whole(3, given.get("timestamp", int(time.time() * 1000)))
    if not given.get("untyped"):
        out += whole(4, kind)
    if given.get("historical"):
        out += whole(5, 1)
    if given.get("null"):
        out += whole(7, 1)
    if "quality" in given:
        value = whole(1, 3) + whole(3, given["quality"])
        out += chunk(9, chunk(1, b"Quality") + chunk(2, value))
    value = given.get("value")
    if value is None:
        return out
    if kind in (1, 2, 3):
        return out + whole(10, value & 0xFFFFFFFF)
    if kind in (4, 8):
        return out + whole(11, value & 0xFFFFFFFFFFFFFFFF)
    if kind == 9:
        return out + varint(12 << 3 | 5) + struct.pack("<f", value)
    if kind == 10:
        return out + varint(13 << 3 | 1) + struct.pack("<d", value)
    return out + (whole(14, int(value)) if kind == 11 else chunk(15, value.encode()))


def payload(metrics, seq=None):
    out = whole(1, int(time.time() * 1000))
    for given in metrics:
        out += chunk(2, metric(given))
    return out if seq is None else out + whole(3, seq)


def value_of(number, content):
    if number == 12 and isinstance(content, bytes):
        return struct.unpack("<f", content)[0]
    if number == 13:
        return struct.unpack("<d", content)[0]
    if number == 14:
        return bool(content)
    if number == 15:
        return content.decode()
    if number == 16:
        return [it[0] for it in struct.iter_unpack("<d", content)]
    return content


def property_of(content):
    """The type and the value of a property."""
    kind, value = None, None
    for number, inner in fields(content):
        if number == 1:
            kind = inner
        elif number in (3, 4):
            value = inner
        elif number == 6:
            value = struct.unpack("<d", inner)[0]
        elif number == 8:
            value = inner.decode()
    return {"type": kind, "value": value}


def decoded_metric(content):
    said = {}
    keys, values = [], []
    for number, inner in fields(content):
        if number == 1:
            said["name"] = inner.decode()
        elif number in (2, 3, 4):
            said[{2: "alias", 3: "timestamp", 4: "datatype"}[number]] = inner
        elif number == 7:
            said["null"] = bool(inner)
        elif number == 9:
            for part, it in fields(inner):
                (keys if part == 1 else values).append(it)
        elif number >= 10:
            said["value"] = value_of(number, inner)
    assert len(keys) == len(values)
    said["properties"] = {key.decode(): property_of(value) for key, value in zip(keys, values)}
    return said


def decoded(content):
    said = {"metrics": []}
    for number, inner in fields(content):
        if number == 1:
            said["timestamp"] = inner
        elif number == 2:
            said["metrics"].append(decoded_metric(inner))
        elif number == 3:
            said["seq"] = inner
    return said


# Clients.

def client(port, name, will=None):
    made = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, client_id=name, protocol=mqtt.MQTTv311)
    ready = threading.Event()
    made.on_connect = lambda *_: ready.set()
    if will:
        made.will_set(*will, qos=1, retain=False)
    made.connect("127.0.0.1", port, keepalive=5)
    made.loop_start()
    assert ready.wait(20)
    return made


def subscribe(made, topic, heard):
    done = threading.Event()
    made.on_subscribe = lambda *_: done.set()
    made.message_callback_add(topic, heard)
    made.subscribe(topic, 1)
    assert done.wait(20)


class Node:
    def __init__(self, port, name, bd_seq, answers):
        self.name, self.answers = name, answers
        self.group, self.node = name.split("/")
        self.bd_seq = {"name": "bdSeq", "type": "UInt64", "value": bd_seq}
        self.seq, self.births, self.is_gone = 0, {}, False
        self.turn = threading.RLock()
        self.client = client(port, f"edge-{name}", (self.topic("NDEATH"), payload([self.bd_seq])))
        subscribe(self.client, self.topic("NCMD"), self.heard)

    def heard(self, made, userdata, message):
        command = decoded(message.payload)
        say(command=self.name, payload=command, qos=message.qos, retain=bool(message.retain))
        is_rebirth = any(it.get("name") == "Node Control/Rebirth" and it.get("value") for it in command["metrics"])
        if is_rebirth and self.answers and self.births:
            with self.turn:
                for device, metrics in sorted(self.births.items(), key=lambda it: it[0] or ""):
                    self.birth(metrics, device, waits=False)

    def topic(self, kind, device=None):
        topic = f"spBv1.0/{self.group}/{kind}/{self.node}"
        return topic if device is None else f"{topic}/{device}"

    def send(self, kind, metrics, device=None, waits=True):
        with self.turn:
            sent = self.client.publish(self.topic(kind, device), payload(metrics, self.seq), 0)
            self.seq = (self.seq + 1) % 256
        if waits:
            sent.wait_for_publish(20)

    def birth(self, metrics, device, waits=True):
        self.births[device] = metrics
        metrics = [{**it, "value": played.get(it["name"], it.get("value"))} for it in metrics]
        with self.turn:
            if device is None:
                self.seq = 0
                rebirth = {"name": "Node Control/Rebirth", "type": "Boolean", "value": False}
                return self.send("NBIRTH", [self.bd_seq, rebirth, *metrics], None, waits)
            self.send("DBIRTH", metrics, device, waits)

    def play(self, given, device, period):
        name = given["name"]
        while not self.is_gone:
            now = int(time.time() * 1000)
            sent = times.setdefault(name, [])
            # Values change a bit: consumers get what has changed.
            value = played[name] + len(sent) % 2
            self.send("NDATA" if device is None else "DDATA", [{**given, "value": value, "timestamp": now}], device, False)
            sent.append(now)
            time.sleep(period)

    def death(self, device):
        if device is not None:
            return self.send("DDEATH", [], device)
        self.is_gone = True
        self.client.publish(self.topic("NDEATH"), payload([self.bd_seq]), 1).wait_for_publish(20)
        self.client.disconnect()
        self.client.loop_stop()

    def cut(self):
        self.is_gone = True
        self.client.loop_stop()
        self.client.socket().close()


# The present values of what is played, and the times at which it was sent, by name.
played, times = {}, {}


def heard(made, userdata, message):
    about = {"topic": message.topic, "qos": message.qos, "retain": bool(message.retain), "time": time.time()}
    if message.topic.startswith("spBv1.0/") and not message.topic.startswith("spBv1.0/STATE/"):
        try:
            return say(**about, payload=decoded(message.payload))
        except (IndexError, ValueError, struct.error):
            return say(garbage=message.topic)
    say(**about, text=message.payload.decode())


def main():
    port = json.loads(sys.argv[1])["port"]
    consumer = client(port, "consumer")
    nodes = {}
    say(ready=True)
    for line in sys.stdin:
        order = json.loads(line)
        done = next(iter(order))
        device = order.get("device")
        if done == "connect":
            nodes[order["connect"]] = Node(port, order["connect"], order["bd_seq"], order.get("answers", False))
        elif done == "birth":
            nodes[order["node"]].birth(order["birth"], device)
        elif done == "data":
            nodes[order["node"]].send("NDATA" if device is None else "DDATA", order["data"], device)
        elif done == "death":
            nodes[order["death"]].death(device)
        elif done == "cut":
            nodes[order["cut"]].cut()
        elif done == "skip":
            nodes[order["skip"]].seq = (nodes[order["skip"]].seq + 1) % 256
        elif done == "command":
            group, node = order["command"].split("/")
            consumer.publish(f"spBv1.0/{group}/NCMD/{node}", payload(order["metrics"]), 0).wait_for_publish(20)
        elif done == "raw":
            content = bytes.fromhex(order["hex"])
            consumer.publish(order["raw"], content, 1, order.get("retain", False)).wait_for_publish(20)
        elif done == "play":
            played.setdefault(order["play"]["name"], order["play"]["value"])
            arguments = (order["play"], device, order["period"])
            threading.Thread(target=nodes[order["node"]].play, args=arguments, daemon=True).start()
        elif done == "set":
            played[order["set"]] = order["value"]
        elif done == "sent":
            say(times=times[order["sent"]])
        elif done == "follow":
            subscribe(consumer, order["follow"], heard)
        say(done=done)


main()
