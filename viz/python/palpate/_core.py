"""The compiled part, of the version that these files are."""

from __future__ import annotations

from pathlib import Path

from . import __version__
from ._errors import VersionError

try:
    from . import _palpate as _palpate
except ImportError as failure:
    _remedy = "installing all of python3-palpate, or building it for this Python"
    raise VersionError("the compiled part of palpate", str(failure), _remedy) from failure

if _palpate.version != __version__:
    raise VersionError(
        f"the compiled part of palpate {__version__}",
        f"that of {_palpate.version}",
        "installing both from one package, or building them again",
    )

# What needs many libraries (videos, data sets) lies beside the program: in a build's folder, or installed.
_here = Path(__file__).resolve().parent
for _folder in (_here.parents[1] / "lib" / "palpate", _here.parents[2] / "palpate"):
    _palpate.add_module_folder(_folder)
