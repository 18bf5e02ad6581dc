"""Results as tables: the columns are where the compiled part has written them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas
    import pyarrow

    from . import _shsa


def arrow(table: _shsa.Table) -> pyarrow.Table:
    """A table of Arrow over the memory of a table; nothing is copied."""
    import pyarrow

    memory, rows, columns = table
    whole = pyarrow.py_buffer(memory)
    kinds = {
        "time": pyarrow.timestamp("ns", "UTC"),
        "number": pyarrow.float64(),
        "whole": pyarrow.int64(),
        "text": pyarrow.string(),
    }

    def part(place: tuple[int, int]) -> pyarrow.Buffer:
        return whole.slice(place[0], place[1] - place[0])

    arrays = []
    for _, kind, missing, (validity, offsets, values), offset_width in columns:
        is_there = part(validity) if missing else None
        buffers = [is_there, part(offsets), part(values)] if kind == "text" else [is_there, part(values)]
        of = pyarrow.large_string() if kind == "text" and offset_width == 8 else kinds[kind]
        arrays.append(pyarrow.Array.from_buffers(of, rows, buffers, null_count=missing))
    return pyarrow.Table.from_arrays(arrays, names=[column[0] for column in columns])


def data_frame(table: pyarrow.Table, *, copy: bool) -> pandas.DataFrame:
    """A table as a data frame. Without ``copy``, numbers and times without missing values stay where they are, and can only be read."""
    return table.to_pandas(split_blocks=not copy)
