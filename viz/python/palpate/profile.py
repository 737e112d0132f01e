"""How fast and how exact this machine is, and machines side by side.

A profile is measured by the program ``palpate`` in a process of its own, since it counts the time of the
processor of the whole process.
"""

from __future__ import annotations

import html
import json
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _errors
from ._core import _palpate, path_text
from ._live import Path as AnyPath
from ._program import run_program
from ._tables import Table

__all__ = ["Comparison", "Profile", "compare", "load", "measure"]

_TIMES = ("samples", "min_ms", "q25_ms", "median_ms", "q75_ms", "p95_ms", "p99_ms", "max_ms")
_SIZE = ("reading", "width_px", "height_px")


def _row(figure: dict[str, Any], names: Sequence[str]) -> list[Any]:
    return [figure[name] for name in names]


def _times(distribution: dict[str, Any]) -> list[Any]:
    return _row(distribution, _TIMES)


@dataclass(frozen=True, eq=False)
class Profile:
    """Speed, error and memory of one device.

    Each table has the columns of the CSV file of its name that ``palpate profile`` writes: times in ms (of
    ``samples`` runs the smallest, quartiles, median, 95 and 99 % and the largest), memory in bytes, rates in
    GB/s of 1e9 bytes.  ``reading`` is the way from an image to a surface (``shading``, ``photometric``,
    ``elastic``).
    """

    complete: bool
    """False: it was ended before all was measured."""
    machine: dict[str, Any] = field(repr=False)
    """Its device, driver, processor, system and the date."""
    frames: Table = field(repr=False)
    """Whole frames at each size: latency, processor's time, frames_per_s with three in flight, memory."""
    stages: Table = field(repr=False)
    """Each stage of a frame on the GPU: time, dispatches, bytes, rate, and its fraction of the memory's ceiling."""
    growth: Table = field(repr=False)
    """time = constant x pixels^exponent, with the exponent's standard error (0: of two sizes)."""
    solvers: Table = field(repr=False)
    """Error of the surface's solvers against exact surfaces (relative, 1) and their time; ``on_front``: nothing else is both faster and better."""
    outputs: Table = field(repr=False)
    """What a frame costs when outputs are left out, over that of the full frame (``cpu_ratio``)."""
    live: Table = field(repr=False)
    """How old a measurement and a picture are when a simulated camera sets the pace."""
    rates: Table = field(repr=False)
    """Fast cameras, nothing drawn: how many frames went unmeasured, how old the rest became, and ``frames_per_s`` where each is measured."""
    threads: Table = field(repr=False)
    """From photon to picture: each part of each thread's work on a frame of a live run, ``busy``: share of its time."""
    ceiling: Table = field(repr=False)
    """Memory bandwidth of work that does nothing else, by the size of its buffer."""
    skipped: Table = field(repr=False)
    """What did not fit into the time or the memory, and why."""
    json: str = field(repr=False)
    """The text of ``profile.json``."""
    text: str = field(repr=False)
    """All tables for a person."""

    def save(self, file: AnyPath) -> None:
        """Writes a ``profile.json``, which :func:`load` and ``palpate profile --compare`` read."""
        try:
            Path(file).write_text(self.json, encoding="utf-8")
        except OSError as failure:
            raise _errors.OutputError(f"a file '{os.fspath(file)}'", str(failure.strerror), "a folder that can be written to") from None

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        shown = (self.frames, self.stages, self.solvers)
        return f"<b>{html.escape(self.machine['device'])}</b>" + "".join(table._repr_html_() for table in shown)


def _profile(text: str, described: str) -> Profile:
    found = json.loads(text)
    clock = found["ceiling"]["clock"]
    frames: list[list[Any]] = []
    stages: list[list[Any]] = []
    for size in found["sizes"]:
        here = _row(size, _SIZE)
        frames.append([*here, *_times(size["latency"]), *_row(size, ("cpu_ms", "frames_per_s", "memory_bytes", "setup_ms"))])
        for stage in size["stages"]:
            moved = _row(stage, ("dispatches", "read_bytes", "written_bytes", "GB_per_s", "ceiling_fraction"))
            stages.append([*here, stage["stage"], *_times(stage["time"]), clock, *moved])
    growth = ("reading", "stage", "from_px", "sizes", "exponent", "exponent_standard_error")
    solver = ("width_px", "height_px", "truth", "solver", "where", "relative_rms_error", "peak_to_valley_error")
    output = (*_SIZE, "outputs", "touched_fraction")
    cost = ("cpu_ms", "cpu_ratio", "cpu_ratio_q25", "cpu_ratio_q75", "memory_bytes")
    scene = ("scene", "width_px", "height_px", "rate_Hz")
    part = ("thread", "step", "part")
    paced = (*_SIZE, "rate_Hz", "frames", "dropped_before_engine", "dropped_before_display")
    return Profile(
        complete=found["complete"],
        machine=found["machine"],
        frames=Table("Whole frame", (*_SIZE, *_TIMES, "cpu_ms", "frames_per_s", "memory_bytes", "setup_ms"), frames),
        stages=Table(
            "Stages",
            (*_SIZE, "stage", *_TIMES, "clock", "dispatches", "read_bytes", "written_bytes", "rate_GB_per_s", "ceiling_fraction"),
            stages,
        ),
        growth=Table("Growth", growth, [_row(g, growth) for g in found["growth"]]),
        solvers=Table(
            "Surface: error against run time",
            (*solver, *_TIMES, "cpu_ms", "on_front"),
            [[*_row(s, solver), *_times(s["time"]), s["cpu_ms"], s["on_front"]] for s in found["solvers"]],
        ),
        outputs=Table(
            "What leaving out saves",
            (*output, *_TIMES, *cost),
            [[*_row(o, output), *_times(o["time"]), *_row(o, cost)] for o in found["outputs"]],
        ),
        live=Table(
            "Live: age of measurement and picture",
            (*paced, "until", *_TIMES),
            [
                [*_row(one, paced), until, *_times(one[times])]
                for one in found["live"]
                for until, times in (("measured", "to_measured"), ("drawn", "to_picture"))
            ],
        ),
        rates=Table(
            "Fast cameras: every frame to numbers",
            (*scene, "frames", "dropped_before_engine", *_TIMES, "frames_per_s"),
            [
                [*_row(one, scene), one["frames"], one["dropped_before_engine"], *_times(one["to_measured"]), one["frames_per_s"]]
                for one in found.get("rates", [])
            ],
        ),
        threads=Table(
            "From photon to picture: the work of each thread",
            (*scene, *part, *_TIMES, "ms_per_turn", "busy"),
            [
                [*_row(one, scene), *_row(p, part), *_times(p["time"]), p["ms_per_turn"], p["busy"]]
                for one in found.get("photon", [])
                for p in one["parts"]
            ],
        ),
        ceiling=Table(
            "Memory ceiling",
            ("buffer_bytes", "copy_GB_per_s", "kernel_GB_per_s"),
            [_row(p, ("buffer_bytes", "copy_GB_per_s", "stream_GB_per_s")) for p in found["ceiling"]["points"]],
        ),
        skipped=Table("Not measured", ("what", "why"), [_row(s, ("what", "why")) for s in found["skipped"]]),
        json=text,
        text=described.rstrip(),
    )


def load(file: AnyPath) -> Profile:
    """A profile that ``palpate profile`` or :meth:`Profile.save` has written.

    Args:
        file: its ``profile.json``, or the folder that holds it.
    """
    path = Path(path_text(file, "file"))
    return _profile(*_palpate.profile_load(path / "profile.json" if path.is_dir() else path))


def _listed(sizes: Sequence[tuple[int, int]]) -> str:
    try:
        return ",".join(f"{width}x{height}" for width, height in sizes)
    except (TypeError, ValueError):
        raise _errors.ArgumentError("sizes as (width, height) in px", repr(sizes)[:80], "sizes=[(640, 480)]") from None


def measure(
    *,
    sizes: str | Sequence[tuple[int, int]] | None = None,
    quick: bool = False,
    budget_s: float | None = None,
    device: str = "",
    out: AnyPath | None = None,
) -> Profile:
    """Speed, error and memory of this machine; three minutes, or 20 s.

    It waits for the program without the GIL; Ctrl-C ends both.

    Args:
        sizes: frames as ``[(640, 480), (1392, 1042)]`` or ``"640x480,1392x1042"``, px; by default 160 x 120 to
            8192 x 8192.
        quick: three small sizes in 20 s.
        budget_s: time, about, 1 to 86400; what does not fit is in ``skipped``.
        device: as of :func:`palpate.open`.
        out: folder for profile.json, CSV files, plots and report.html.
    """
    if budget_s is not None and not 1 <= budget_s <= 86400:
        raise _errors.ArgumentError("budget_s from 1 to 86400", str(budget_s), "180, or quick=True for 20 s")
    with tempfile.TemporaryDirectory(prefix="palpate-profile-") as scratch:
        folder = Path(scratch) / "out" if out is None else Path(out)
        words = ["profile", "--out", str(folder), "--quiet"]
        if sizes is not None:
            listed = sizes if isinstance(sizes, str) else _listed(sizes)
            words += ["--sizes", listed]
        if quick:
            words.append("--quick")
        if budget_s is not None:
            words += ["--budget", str(budget_s)]
        if device:
            words += ["--device", device]
        run_program(words, "a profile of this machine")
        return load(folder)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Machines side by side, the first of them A."""

    names: tuple[str, ...]
    """Letter and device of each."""
    figures: Table = field(repr=False)
    """One row a figure and machine: ``what``, ``reading_or_truth``, ``size_px``, ``unit``, ``machine``, ``value``,
    ``ratio_to_a`` and the range in which the quartiles of both put it (``ratio_low``, ``ratio_high``)."""
    frame_ratio: NDArray[np.float64]
    """A frame's time over that on A: geometric mean over sizes and readings; NaN: none in common."""
    frame_ratio_spread: NDArray[np.float64]
    """Its standard error, as a factor."""
    notes: tuple[str, ...]
    """What limits the comparison: other versions, sizes of some only, ..."""
    text: str = field(repr=False)

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        notes = "".join(f"<li>{html.escape(note)}</li>" for note in self.notes)
        return self.figures._repr_html_() + (f"<ul>{notes}</ul>" if notes else "")


def compare(*profiles: Profile | AnyPath) -> Comparison:
    """Profiles of two or more machines side by side; nothing is measured.

    Args:
        profiles: each a :class:`Profile`, a ``profile.json`` or the folder that holds one; the first is A.
    """
    if len(profiles) < 2:
        raise _errors.ArgumentError("two profiles or more", str(len(profiles)), 'compare("a/profile.json", "b/profile.json")')
    texts = [(one if isinstance(one, Profile) else load(one)).json for one in profiles]
    answer, described = _palpate.profile_compare(texts)
    found = json.loads(answer)
    names = tuple(machine["name"] for machine in found["machines"])
    rows = [
        [f["what"], f["reading_or_truth"], f["size_px"], f["unit"], name, v["value"], v["ratio"], v["ratio_low"], v["ratio_high"]]
        for f in found["figures"]
        for name, v in zip(names, f["values"])
        if v is not None
    ]
    columns = ("what", "reading_or_truth", "size_px", "unit", "machine", "value", "ratio_to_a", "ratio_low", "ratio_high")
    return Comparison(
        names=names,
        figures=Table("Side by side", columns, rows),
        frame_ratio=np.array([m["frame_ratio"] for m in found["machines"]], dtype=np.float64),
        frame_ratio_spread=np.array([m["frame_ratio_spread"] for m in found["machines"]], dtype=np.float64),
        notes=tuple(found["notes"]),
        text=described.rstrip(),
    )
