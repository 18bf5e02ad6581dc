"""An MQTT client that knows nothing of shsa: does what it is told on standard input, says what it sees.

One JSON object a line. It ends with its standard input.

    {"publish": TOPIC, "text": TEXT | "hex": HEX, "qos": N, "retain": BOOL, "properties": {NAME: TEXT}, "times": N,
     "response": TOPIC, "correlation": HEX}
    {"subscribe": TOPIC, "qos": N}
"""

import json
import sys
import threading

import paho.mqtt.client as mqtt
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

lock = threading.Lock()


def say(**what):
    with lock:
        print(json.dumps(what), flush=True)


def heard(client, userdata, message):
    properties = dict(getattr(message.properties, "UserProperty", [])) if message.properties else {}
    correlation = getattr(message.properties, "CorrelationData", b"") if message.properties else b""
    expiry = getattr(message.properties, "MessageExpiryInterval", None) if message.properties else None
    payload = message.payload
    content = {"hex": payload.hex()} if len(payload) < 4096 else {"length": len(payload)}
    say(topic=message.topic, retain=bool(message.retain), properties=properties,
        correlation=correlation.hex(), expiry=expiry, **content)


def publish(client, order, version):
    payload = bytes.fromhex(order["hex"]) if "hex" in order else order["text"].encode()
    properties = None
    if version == 5:
        properties = Properties(PacketTypes.PUBLISH)
        properties.UserProperty = list(order.get("properties", {}).items())
        if "response" in order:
            properties.ResponseTopic = order["response"]
        if "correlation" in order:
            properties.CorrelationData = bytes.fromhex(order["correlation"])
    for _ in range(order.get("times", 1)):
        sent = client.publish(order["publish"], payload, order.get("qos", 1), order.get("retain", False), properties)
    sent.wait_for_publish(20)


def main():
    argument = json.loads(sys.argv[1])
    version = argument.get("version", 5)
    protocol = mqtt.MQTTv5 if version == 5 else mqtt.MQTTv311
    client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, client_id=argument["name"], protocol=protocol)
    client.max_inflight_messages_set(100)
    client.reconnect_delay_set(0.1, 1)
    if "user" in argument:
        client.username_pw_set(argument["user"], argument["password"])
    connected, subscribed = threading.Event(), threading.Event()
    client.on_connect = lambda *_: connected.set()
    client.on_subscribe = lambda *_: subscribed.set()
    client.on_message = heard
    client.connect("127.0.0.1", argument["port"], keepalive=5)
    client.loop_start()
    assert connected.wait(20)
    say(ready=True)
    for line in sys.stdin:
        order = json.loads(line)
        if "publish" in order:
            publish(client, order, version)
        elif "subscribe" in order:
            subscribed.clear()
            client.subscribe(order["subscribe"], order.get("qos", 1))
            assert subscribed.wait(20)
        say(done=next(iter(order)))
    client.disconnect()
    client.loop_stop()


main()
