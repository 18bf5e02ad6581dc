"""Recordings as the compiled part takes them: paths, or a table in Parquet."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Union

if TYPE_CHECKING:
    import pandas
    import pyarrow

Path = Union[str, "os.PathLike[str]"]
Table = Union["pandas.DataFrame", "pyarrow.Table"]
Recordings = Union[Path, Sequence[Path], Table, Mapping[str, Any]]
"""Files and folders of any format that ``shsa replay`` reads; or a table, whose columns are the sources of signals, with a column of
times (``time``: seconds, or moments), which in a data frame may be the index; or a dictionary of such columns, or of several tables
by their names: the column ``speed`` of the table ``gnss`` is the source ``gnss#speed``."""


@contextmanager
def given(recordings: Recordings) -> Iterator[list[str] | bytes]:
    """Recordings for the compiled part. Tables are read as files of Parquet would be."""
    if isinstance(recordings, (str, os.PathLike)):
        yield [os.fspath(recordings)]
    elif isinstance(recordings, Sequence):
        yield [os.fspath(path) for path in recordings]
    elif isinstance(recordings, Mapping) and all(_is_table(one) for one in recordings.values()):
        with TemporaryDirectory(prefix="shsa-") as folder:
            for name, table in recordings.items():
                (pathlib.Path(folder) / f"{name}.parquet").write_bytes(_parquet(table))
            yield [folder]
    else:
        yield _parquet(recordings)


@contextmanager
def in_files(recordings: Recordings) -> Iterator[list[str]]:
    """Recordings as files. A table is one of Parquet."""
    with given(recordings) as read:
        if isinstance(read, list):
            yield read
            return
        with TemporaryDirectory(prefix="shsa-") as folder:
            file = pathlib.Path(folder) / "table.parquet"
            file.write_bytes(read)
            yield [os.fspath(file)]


def _is_table(recordings: Any) -> bool:
    return hasattr(recordings, "columns")


def _parquet(recordings: Table | Mapping[str, Any]) -> bytes:
    import pyarrow
    import pyarrow.parquet

    sink = pyarrow.BufferOutputStream()
    # What is read once is not worth being packed.
    pyarrow.parquet.write_table(_table(recordings), sink, compression="none", use_dictionary=False)
    return bytes(sink.getvalue().to_pybytes())


def _table(recordings: Table | Mapping[str, Any]) -> pyarrow.Table:
    import pyarrow

    if isinstance(recordings, pyarrow.Table):
        table = recordings
    elif isinstance(recordings, Mapping):
        table = pyarrow.table(dict(recordings))
    else:
        table = pyarrow.Table.from_pandas(_with_times(recordings), preserve_index=False)
    return table.rename_columns([_named(field) for field in table.schema])


def _with_times(frame: pandas.DataFrame) -> pandas.DataFrame:
    """The frame with its index as a column of times, unless it has one; numbers of rows count last."""
    import pandas

    if "time" in frame.columns:
        return frame
    if isinstance(frame.index, pandas.RangeIndex):
        return frame if "t_s" in frame.columns else frame.assign(t_s=frame.index)
    return frame.rename_axis("time").reset_index()


def _named(field: pyarrow.Field) -> str:
    """The name of a column; that of numbers of seconds says so."""
    from pyarrow import types

    is_number = types.is_floating(field.type) or types.is_integer(field.type)
    return "time_s" if field.name == "time" and is_number else str(field.name)
