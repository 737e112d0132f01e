"""One map larger than the pad, from Python."""

import json
import subprocess

import numpy as np
import palpate as pp
import pytest

SLIDE = "synthetic:object?shape=relief&path=drag&reach_mm=12&speed_mm_s=12&seconds=1.6&size=320x240&rate=30&depth_mm=0.3"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("map")
    return pp.map(SLIDE, out=folder / "python"), folder


def test_it_is_the_program_s_map(made, program):
    found, folder = made
    subprocess.run([program, "map", SLIDE, "--out", folder / "program", "--quiet"], check=True, capture_output=True)
    assert found.report == json.loads((folder / "program" / "map.json").read_text())
    assert found.report == json.loads((folder / "python" / "map.json").read_text())
    largest = found.pieces[0]
    for name, array in (("map", largest.height_mm), ("map_error", largest.error_mm), ("coverage", largest.coverage)):
        assert array.dtype == np.float32 and not array.flags.writeable
        for other in ("program", "python"):
            assert np.array_equal(array, np.load(folder / other / f"{name}.npy"), equal_nan=True), name


def test_arrays_axes_and_places(made):
    found, _ = made
    assert found.complete and found.frames_lost == 0 and found.warning == ""
    assert "loops" in dir(found) and found.loops >= 0
    largest = found.pieces[0]
    rows, columns = largest.height_mm.shape
    assert largest.x_mm.shape == (columns,) and largest.y_mm.shape == (rows,)
    assert np.allclose(np.diff(largest.x_mm), largest.report["pitch_mm"])
    assert largest.x_mm[-1] - largest.x_mm[0] > 20, "wider than the pad"
    seen = np.isfinite(largest.height_mm)
    assert np.isclose(largest.covered_mm2, seen.sum() * largest.report["pitch_mm"] ** 2, rtol=1e-4)
    assert np.array_equal(seen, largest.coverage > 0)
    # The first key frame has the map's axes, and places are rigid motions.
    assert np.allclose(largest.poses[0], np.eye(4), atol=1e-6)
    turns = largest.poses[:, :3, :3]
    assert np.allclose(turns @ turns.transpose(0, 2, 1), np.eye(3), atol=1e-9)
    assert len(largest.frames) == len(largest.poses) == len(largest.place_sd_mm) >= 3
    assert np.ptp(largest.poses[:, 0, 3]) > 8
    with pytest.raises(AttributeError, match="loops"):
        found.nonsense


def test_what_gives_no_map_and_what_is_refused(tmp_path):
    smooth = pp.map("synthetic:object?shape=ball&seconds=0.5&size=320x240&rate=20", frames=20)
    assert smooth.frames_by_surface.get("ball", 0) > 0
    assert smooth.complete
    nothing = pp.map("synthetic:still?mode=gel&size=160x120&rate=20", frames=4)
    assert nothing.pieces == () and nothing.frames_without_contact == 4
    for wrong, word in (
        ({"pitch_mm": -1.0}, "pitch_mm"), ({"links": 0}, "links"), ({"key_overlap": 0.1}, "key_overlap"),
        ({"most_keys": 1}, "most_keys"), ({"contact_share": float("nan")}, "contact_share"),
    ):
        with pytest.raises(pp.ArgumentError, match=word):
            pp.map(SLIDE, **wrong)
    with pytest.raises(pp.InputError, match="nowhere"):
        pp.map(tmp_path / "nowhere.avi")
