"""The module as a package: what importing does, stubs, versions."""

import inspect
import re
import shutil
import subprocess
import sys
from pathlib import Path

import palpate as pp
from palpate._core import _palpate
import pytest

PACKAGE = Path(pp.__file__).parent
HEAVY = re.compile(r"opencv|libmpi|glfw|libX11|vulkan|libav|hdf5|_palpate", re.I)


def libraries(python, code):
    done = python(code + "; print(__import__('pathlib').Path('/proc/self/maps').read_text())")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return {line.split("/")[-1] for line in done.stdout.splitlines() if ".so" in line}


def test_import_loads_nothing(python):
    assert not [name for name in libraries(python, "import palpate") if HEAVY.search(name)]


def test_use_loads_no_window_and_no_mpi(python):
    code = "import palpate; next(palpate.open('synthetic:press?size=64x48'))"
    names = libraries(python, code)
    assert any("_palpate" in name for name in names)
    assert not [name for name in names if re.search(r"libmpi|glfw|imgui|hdf5|libavcodec", name)]


def test_numerics_open_no_device(python):
    code = "import palpate as pp, numpy as np; pp.ThinPlate(np.eye(3)[:, :2]).fit(np.zeros(3)); pp.optics.stack([1, 1.4, 1])"
    assert not [name for name in libraries(python, code) if re.search("lvp|lavapipe|swiftshader|nvidia", name)]


def test_every_name_is_there():
    for name in pp.__all__:
        assert getattr(pp, name) is not None
    assert set(pp.__all__) == set(dir(pp))
    with pytest.raises(AttributeError, match="no attribute 'opne'"):
        pp.opne
    assert re.fullmatch(r"\d+\.\d+\.\d+", pp.__version__)


def stubs(module, *options):
    done = subprocess.run(
        [sys.executable, "-m", *module, *options], cwd=PACKAGE.parent, capture_output=True, text=True, timeout=800
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_stubs_are_true(tmp_path):
    pytest.importorskip("mypy")
    allowed = Path(__file__).parent / "stubtest_allowed.txt"
    stubs(["mypy.stubtest"], "--concise", "--ignore-unused-allowlist", "--allowlist", allowed, "palpate")


def test_types_are_strict(tmp_path):
    pytest.importorskip("mypy")
    stubs(["mypy"], "--strict", "--cache-dir", tmp_path, "palpate")


def test_every_public_function_says_what_it_does():
    for name in ("open", "measure", "integrate", "match", "modulus", "setup"):
        assert len(getattr(pp, name).__doc__) > 100, name


def test_development_mode_is_silent(python):
    code = """
import numpy as np, palpate as pp
with pp.open('synthetic:press?size=64x48', drop=False) as s:
    for t in s:
        t.depth_mm, t.image, t.contacts, str(t), t.wrench
unclosed = pp.open('synthetic:press?size=64x48')
next(unclosed)
pp.measure('synthetic:press?size=64x48', frames=3)
pp.integrate(np.zeros((8, 8)), np.zeros((8, 8)))
"""
    done = python(code)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def copy_of_package(tmp_path):
    copy = tmp_path / "palpate"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    return copy


def run_copy(tmp_path, code):
    return subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env={"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True)


def test_another_version_is_refused(tmp_path):
    init = copy_of_package(tmp_path) / "__init__.py"
    init.write_text(init.read_text().replace(f'"{pp.__version__}"', '"9.8.7"'))
    done = run_copy(tmp_path, "import palpate; print(palpate.__version__); palpate.open")
    assert done.stdout == "9.8.7\n"
    assert f"VersionError: wanted the compiled part of palpate 9.8.7; found that of {pp.__version__}; try" in done.stderr


def test_a_missing_compiled_part_is_told(tmp_path):
    for file in copy_of_package(tmp_path).glob("_palpate*.so"):
        file.unlink()
    code = """
import palpate
try:
    palpate.open
except ImportError as error:
    assert isinstance(error, palpate.VersionError)
    print(error)
"""
    done = run_copy(tmp_path, code)
    assert done.stdout.startswith("wanted the compiled part of palpate; found "), done.stderr


def test_settings_of_a_run_are_those_of_the_program():
    known = dict(_palpate.run_settings())
    own = {
        pp.open: {"source", "drop", "keep", "record", "trace", "device", "seed"},
        pp.measure: {"source", "keep", "out", "trace", "device", "seed"},
        pp.record: {"source", "folder", "trace", "device", "seed"},
    }
    for function, others in own.items():
        assert set(inspect.signature(function).parameters) - others <= set(known), function
    assert known["frames"] == "End after that many frames"
