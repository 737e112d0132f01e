"""Recordings in the formats of other programs, from Python: what the command writes."""

import json
import os

import numpy as np
import palpate as pp
import pytest

SCENE = "synthetic:press?mode=gel&size=96x80&rate=20"


@pytest.fixture(scope="module")
def sessions(tmp_path_factory):
    """A folder of two sessions."""
    folder = tmp_path_factory.mktemp("sessions")
    for name in ("a", "b"):
        pp.record(SCENE, folder / name, frames=24)
    return folder


def test_a_session_becomes_an_episode(sessions, tmp_path):
    h5py = pytest.importorskip("h5py", reason="NOT CHECKED: no h5py here")
    done = pp.export(sessions / "a", hdf5=tmp_path / "a.h5")
    assert done.files == (tmp_path / "a.h5",) and done.there == ()
    run = pp.measure(sessions / "a", solver="live")  # as it was recorded
    with h5py.File(tmp_path / "a.h5") as episode:
        assert episode["frames/image"].shape == (24, 80, 96, 3)
        assert np.allclose(episode["touch/time_s"][:], run["time_s"], atol=1e-6)
        depth = episode["touch/depth_max_mm"][:]
        assert np.isfinite(depth).sum() > 8
        assert np.allclose(depth, run["depth_max_mm"], rtol=1e-3, atol=1e-4, equal_nan=True)
        assert episode["touch/depth_max_mm"].attrs["unit"] == "mm"


def test_a_folder_of_sessions_goes_on_where_it_stopped(sessions, tmp_path):
    first = pp.export(sessions, hdf5=tmp_path / "out")
    assert first.files == (tmp_path / "out" / "a.h5", tmp_path / "out" / "b.h5")
    os.remove(first.files[1])
    again = pp.export([sessions / "a", sessions / "b"], hdf5=tmp_path / "out")
    assert (again.files, again.there) == (first.files[1:], first.files[:1])


def test_a_session_becomes_an_mcap_file(sessions, tmp_path):
    done = pp.export(sessions / "a", mcap=tmp_path / "bag", hdf5=tmp_path / "a.h5", frames="0:12")
    assert [file.name for file in done.files] == ["recording.mcap", "metadata.yaml", "a.h5"]
    assert all(file.stat().st_size > 100 for file in done.files)
    assert done.files[0].read_bytes()[:8] == b"\x89MCAP0\r\n"
    text = done.files[1].read_text()
    assert "/depth\n" in text and "message_count: 12\n" in text
    larger = pp.export(sessions / "a", mcap=tmp_path / "cloud", cloud=True, frames="0:12").files[0]
    assert larger.stat().st_size > done.files[0].stat().st_size
    assert json.loads((tmp_path / "bag" / "summary.json").read_text())["frames"] == 12


def test_two_fingers_become_one_episode(tmp_path):
    h5py = pytest.importorskip("h5py", reason="NOT CHECKED: no h5py here")
    sides = [f"synthetic:grip?size=96x80&rate=20&weight_N=0.6&skew_ms=5&side={side}" for side in ("left", "right")]
    pp.record_pair(*sides, tmp_path / "all" / "grip", frames=40)
    (tmp_path / "all" / "grip" / "log").mkdir()
    lines = ["0\ttime_s,fz_N", *(f"0\t{7 + k / 20},{min(k / 20, 1)}" for k in range(40))]
    (tmp_path / "all" / "grip" / "log" / "robot.lines").write_text("\n".join(lines) + "\n")
    done = pp.export(tmp_path / "all", hdf5=tmp_path / "out")
    assert done.files == (tmp_path / "out" / "grip.h5",)
    with pp.open_pair(tmp_path / "all" / "grip", drop=False) as stream:
        rows = list(stream)
    with h5py.File(done.files[0]) as episode:
        assert np.allclose(episode["pair/time_s"][:], [row.time_s for row in rows], atol=1e-6)
        assert np.allclose(episode["left/touch/time_s"][:] + 0.0025, episode["pair/time_s"][:], atol=2e-6)
        assert np.allclose(episode["right/frames/time_s"][:] - 0.0025, episode["pair/time_s"][:], atol=2e-6)
        force = [float(row.grip.grip_force_N) for row in rows]
        assert np.allclose(episode["pair/grip_force_N"][:], force, atol=1e-4, equal_nan=True)
        assert episode["pair/grip_force_state"].asstr()[-1] == rows[-1].grip.grip_force_N.state == "valid"
        assert episode["pair/load_z_N"].attrs["unit"] == "N"
        both = (episode["left/touch/force_N"][:] + episode["right/touch/force_N"][:]) / 2
        assert np.allclose(both, force, atol=1e-4, equal_nan=True)
        assert len(episode["robot/fz_N"]) == len(episode["robot/time_s"]) > 30


def test_a_sensor_in_memory_counts(sessions, tmp_path):
    sensor = pp.measure(sessions / "a", frames=1).sensor
    other = pp.Sensor.from_text(sensor.text.replace(sensor.name, "another gel"))
    done = pp.export(SCENE, sensor=other, mcap=tmp_path / "bag", frames="0:3")
    assert "/another_gel/image\n" in done.files[1].read_text()


def test_what_is_wrong_is_said(sessions, tmp_path):
    with pytest.raises(pp.ArgumentError, match="mcap=FOLDER or hdf5=FILE"):
        pp.export(sessions / "a")
    with pytest.raises(pp.ArgumentError, match="one recording at least"):
        pp.export([], hdf5=tmp_path / "x.h5")
    with pytest.raises(pp.ArgumentError, match="becomes a file in it"):
        pp.export(sessions, hdf5=tmp_path / "x.h5")
    with pytest.raises(pp.ArgumentError, match="mcap with cloud"):
        pp.export(sessions / "a", hdf5=tmp_path / "x.h5", cloud=True)
    with pytest.raises(pp.InputError):
        pp.export(tmp_path / "nothing", hdf5=tmp_path / "x.h5")
    assert not (tmp_path / "x.h5").exists()
