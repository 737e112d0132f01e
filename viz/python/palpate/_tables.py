"""Tables: columns by name, one row a figure."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Table"]


def _cell(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


class Table(Mapping[str, NDArray[Any]]):
    """Columns of equal length by their names, which end in their units; read-only.

    Numbers are float64 or int64 (NaN: not known), texts are objects.
    """

    title: str

    def __init__(self, title: str, names: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
        self.title = title
        self._columns: dict[str, NDArray[Any]] = {}
        for i, name in enumerate(names):
            cells = [np.nan if row[i] is None else row[i] for row in rows]
            column = np.array(cells, dtype=object if any(isinstance(c, str) for c in cells) else None)
            column.flags.writeable = False
            self._columns[name] = column

    @property
    def columns(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(self._columns)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self._columns.values()), ()))

    def where(self, **wanted: Any) -> Table:
        """The rows whose columns have these values: ``profile.stages.where(reading="shading", width_px=640)``."""
        for name in wanted:
            self[name]  # a name that there is none of raises
        rows = zip(*(column.tolist() for column in self._columns.values()))
        named = [dict(zip(self._columns, row)) for row in rows]
        kept = [list(row.values()) for row in named if all(row[name] == value for name, value in wanted.items())]
        return Table(self.title, self.columns, kept)

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._columns:
            raise KeyError(f"{name!r}; there are {', '.join(self)}")
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __repr__(self) -> str:
        return f"<palpate table {self.title!r}, {self.rows} rows: {', '.join(self)}>"

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{html.escape(name)}</th>" for name in self)
        rows = zip(*(column.tolist() for column in self._columns.values()))
        body = "".join("<tr>" + "".join(f"<td>{html.escape(_cell(c))}</td>" for c in row) + "</tr>" for row in rows)
        return f"<b>{html.escape(self.title)}</b><table><tr>{head}</tr>{body}</table>"
