"""A Zenoh client that knows nothing of shsa: does what it is told on standard input, says what it sees.

One JSON object a line. It ends with its standard input.

    {"put": KEY, "text": TEXT | "hex": HEX, "attachment": HEX, "encoding": TEXT, "times": N}
    {"get": SELECTOR, "text": TEXT}
    {"subscribe": KEY}  {"token": KEY}  {"drop_token": KEY}  {"watch": KEY}
"""

import json
import sys
import threading

import zenoh

lock = threading.Lock()


def say(**what):
    with lock:
        print(json.dumps(what), flush=True)


def heard(sample):
    beside = None if sample.attachment is None else sample.attachment.to_bytes().hex()
    payload = sample.payload.to_bytes()
    content = {"hex": payload.hex()} if len(payload) < 4096 else {"length": len(payload)}
    say(key=str(sample.key_expr), attachment=beside, encoding=str(sample.encoding), **content)


def present(sample):
    say(token=str(sample.key_expr), alive=sample.kind == zenoh.SampleKind.PUT)


def put(session, order):
    payload = bytes.fromhex(order["hex"]) if "hex" in order else order["text"].encode()
    beside = bytes.fromhex(order["attachment"]) if "attachment" in order else None
    encoding = zenoh.Encoding(order["encoding"]) if "encoding" in order else None
    publisher = session.declare_publisher(order["put"], congestion_control=zenoh.CongestionControl.BLOCK)
    for _ in range(order.get("times", 1)):
        publisher.put(payload, attachment=beside, encoding=encoding)
    publisher.undeclare()


def get(session, order):
    payload = order["text"].encode() if "text" in order else None
    replies = [reply.ok for reply in session.get(order["get"], payload=payload, timeout=10) if reply.ok is not None]
    if not replies:
        say(reply=None)
    for reply in replies:
        say(reply=str(reply.key_expr), text=reply.payload.to_bytes().decode())


def main():
    config = zenoh.Config()
    for key, value in json.loads(sys.argv[1]).items():
        config.insert_json5(key, json.dumps(value))
    kept, tokens = [], {}
    with zenoh.open(config) as session:
        say(ready=str(session.zid()))
        for line in sys.stdin:
            order = json.loads(line)
            if "put" in order:
                put(session, order)
            elif "get" in order:
                get(session, order)
            elif "subscribe" in order:
                kept.append(session.declare_subscriber(order["subscribe"], heard))
            elif "watch" in order:
                watcher = session.liveliness().declare_subscriber(order["watch"], present, history=True)
                kept.append(watcher)
            elif "token" in order:
                tokens[order["token"]] = session.liveliness().declare_token(order["token"])
            elif "drop_token" in order:
                tokens.pop(order["drop_token"]).undeclare()
            say(done=next(iter(order)))


main()
