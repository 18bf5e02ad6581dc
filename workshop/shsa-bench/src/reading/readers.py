"""Reads a recording with the usual reader of its format in Python and prints how many seconds that takes: the least of several
rounds, imports left out. Which packages that are, the imports say; `pip install mcap mcap-ros1-support mcap-ros2-support
mcap-protobuf-support rosbags pyulog pymavlink pynmea2 python-can cantools asammdf pyarrow pandas`.

    python3 readers.py ROUNDS FILE [TOPIC ..]
"""

import json
import sys
import time
from pathlib import Path


def mcap(path, topics):
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory as Protobuf
    from mcap_ros1.decoder import DecoderFactory as Ros1
    from mcap_ros2.decoder import DecoderFactory as Ros2

    def read():
        with open(path, "rb") as file:
            reader = make_reader(file, decoder_factories=[Protobuf(), Ros1(), Ros2()])
            for schema, channel, message in reader.iter_messages(topics=topics or None):
                if channel.message_encoding == "json":
                    json.loads(message.data)
                else:
                    next_decoder(reader, schema, channel)(message.data)

    decoders = {}

    def next_decoder(reader, schema, channel):
        if channel.id not in decoders:
            found = (it.decoder_for(channel.message_encoding, schema) for it in reader._decoder_factories)
            decoders[channel.id] = next(it for it in found if it)
        return decoders[channel.id]

    return read


def rosbag2(path, topics):
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)

    def read():
        with AnyReader([path], default_typestore=store) as reader:
            wanted = [it for it in reader.connections if not topics or it.topic in topics]
            for connection, _, raw in reader.messages(connections=wanted):
                reader.deserialize(raw, connection.msgtype)

    return read


def ulog(path, topics):
    from pyulog import ULog

    names = [topic.split("[")[0] for topic in topics]
    return lambda: ULog(str(path), names or None)


def dataflash(path, topics):
    from pymavlink import mavutil

    names = [topic.split("[")[0] for topic in topics]

    def read():
        log = mavutil.mavlink_connection(str(path))
        while log.recv_match(type=names or None) is not None:
            pass

    return read


def nmea(path, _topics):
    import pynmea2

    def read():
        for line in open(path, errors="replace"):
            try:
                pynmea2.parse(line.strip())
            except (pynmea2.ParseError, ValueError, AttributeError):
                pass

    return read


def lines(path, _topics):
    from datetime import datetime

    def read():
        for line in open(path):
            delta = json.loads(line)
            for update in delta.get("updates", []):
                if "timestamp" in update:
                    datetime.fromisoformat(update["timestamp"])
                for value in update.get("values", []):
                    value.get("path"), value.get("value")

    return read


def influx(path, _topics):
    def number(text):
        try:
            return float(text.rstrip("iu"))
        except ValueError:
            return text

    def read():
        for line in open(path):
            if not line.startswith("#"):
                point, moment = line.rsplit(" ", 1)
                tags, fields = point.replace("\\ ", "\0").split(" ", 1)
                dict(tag.split("=") for tag in tags.split(",")[1:])
                {name: number(text) for name, _, text in (field.partition("=") for field in fields.split(","))}
                int(moment)

    return read


def can(path, _topics):
    import can as python_can
    import cantools

    databases = [cantools.database.load_file(it, strict=False) for it in path.parent.glob("*.dbc")]

    def read():
        for message in python_can.LogReader(str(path)):
            for database in databases:
                try:
                    database.decode_message(message.arbitration_id, message.data, allow_truncated=True)
                except (KeyError, ValueError):
                    pass

    return read


def mdf(path, _topics):
    from asammdf import MDF

    def read():
        with MDF(path) as file:
            for group in range(len(file.groups)):
                for channel in file.groups[group].channels:
                    file.get(channel.name, group=group)

    return read


def parquet(path, _topics):
    import pyarrow.parquet

    return lambda: pyarrow.parquet.read_table(path)


def table(path, _topics):
    import pandas

    separator = r"\s+" if path.suffix == ".txt" else None

    def read():
        frame = pandas.read_csv(path, sep=separator, engine="python" if separator is None else "c", header=0)
        texts = [name for name in frame if pandas.api.types.is_string_dtype(frame[name])]
        for name in texts[:1]:
            pandas.to_datetime(frame[name], errors="coerce")

    return read


READERS = {
    ".mcap": mcap, ".db3": rosbag2, ".ulg": ulog, ".bin": dataflash, ".nmea": nmea, ".jsonl": lines, ".lp": influx,
    ".asc": can, ".blf": can, ".mf4": mdf, ".MF4": mdf, ".parquet": parquet, ".csv": table, ".txt": table,
}
BY_FOLDER = {"rosbag2": rosbag2, "can": can, "nmea": nmea, "dataflash": dataflash}


def main():
    rounds, path, topics = int(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:]
    reader = BY_FOLDER.get(path.parent.name) or READERS[path.suffix]
    read, seconds = reader(path, topics), []
    for _ in range(rounds):
        begin = time.perf_counter()
        read()
        seconds.append(time.perf_counter() - begin)
    print(min(seconds))


main()
