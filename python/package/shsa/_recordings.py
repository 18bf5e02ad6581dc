"""Recordings as the compiled part takes them: paths, or a table in Parquet."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Union

if TYPE_CHECKING:
    import pandas
    import pyarrow

Path = Union[str, "os.PathLike[str]"]
Recordings = Union[Path, Sequence[Path], "pandas.DataFrame", "pyarrow.Table", Mapping[str, Any]]
"""Files and folders of any format that ``shsa replay`` reads; or a table, whose columns are the sources of signals, with a column of
times (``time``: seconds, or moments), which in a data frame may be the index."""


def given(recordings: Recordings) -> list[str] | bytes:
    """Recordings for the compiled part. A table is read as a file of Parquet would be."""
    if isinstance(recordings, (str, os.PathLike)):
        return [os.fspath(recordings)]
    if isinstance(recordings, Sequence):
        return [os.fspath(path) for path in recordings]
    import pyarrow
    import pyarrow.parquet

    sink = pyarrow.BufferOutputStream()
    # What is read once is not worth being packed.
    pyarrow.parquet.write_table(_table(recordings), sink, compression="none", use_dictionary=False)
    return bytes(sink.getvalue().to_pybytes())


def _table(recordings: pandas.DataFrame | pyarrow.Table | Mapping[str, Any]) -> pyarrow.Table:
    import pyarrow

    if isinstance(recordings, pyarrow.Table):
        table = recordings
    elif isinstance(recordings, Mapping):
        table = pyarrow.table(dict(recordings))
    else:
        frame = recordings
        if "time" not in frame.columns:
            frame = frame.rename_axis("time").reset_index()
        table = pyarrow.Table.from_pandas(frame, preserve_index=False)
    return table.rename_columns([_named(field) for field in table.schema])


def _named(field: pyarrow.Field) -> str:
    """The name of a column; that of numbers of seconds says so."""
    from pyarrow import types

    is_number = types.is_floating(field.type) or types.is_integer(field.type)
    return "time_s" if field.name == "time" and is_number else str(field.name)
