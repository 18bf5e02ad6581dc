"""Reads a file of MCAP with the Python library of the format, by its index, and prints what is in it as one JSON object.

The argument is the path of the file.
"""

import json
import sys

from mcap.reader import make_reader

with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True)
    counts = {}
    for schema, channel, message in reader.iter_messages():
        json.loads(message.data)
        assert schema.encoding == "jsonschema" and json.loads(schema.data), channel.topic
        counts[channel.topic] = counts.get(channel.topic, 0) + 1
    stated = reader.get_summary().statistics.message_count
    attached = [attachment.name for attachment in reader.iter_attachments()]
print(json.dumps({"counts": counts, "stated": stated, "attached": attached}))
