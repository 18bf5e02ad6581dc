"""Reads a table of Parquet with pyarrow, and prints its types and its rows as one JSON object.

The argument is the path of the file. Times are nanoseconds.
"""

import json
import sys

import pyarrow
import pyarrow.parquet

table = pyarrow.parquet.read_table(sys.argv[1])
types = {field.name: str(field.type) for field in table.schema}
for at, field in enumerate(table.schema):
    if pyarrow.types.is_timestamp(field.type):
        table = table.set_column(at, field.name, table.column(at).cast(pyarrow.int64()))
print(json.dumps({"types": types, "rows": table.to_pylist()}))
