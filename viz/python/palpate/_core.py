"""The compiled part, of the version that these files are."""

from __future__ import annotations

import functools
import numbers
import os
import re
import types
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from . import __version__
from ._errors import ArgumentError, VersionError

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

_ARGUMENT = re.compile(r"(\w+): ((?:[^,\[(]|\[(?:[^\[\]]|\[[^\]]*\])*\])+)")
_KINDS = {"float": "a number", "int": "a whole number of at least 0", "str": "a text", "bool": "True or False", "os.PathLike": "a path"}
_LIST = re.compile(r"List\[(\w+)(?:\[(\d+)\])?\]")


def _wanted(kind: str, value: object) -> str | None:
    """What an argument of a kind is to be; None: the value is such a one, or the kind is another."""
    optional = re.fullmatch(r"Optional\[(.*)\]", kind)
    if optional:
        inner = None if value is None else _wanted(optional.group(1), value)
        return None if inner is None else inner + ", or None"
    listed = _LIST.fullmatch(kind)
    if listed and listed.group(1) in _KINDS:
        try:
            items = list(value)  # type: ignore[call-overload]
        except TypeError:
            items = [None]
        length = listed.group(2)
        fits = (length is None or len(items) == int(length)) and all(_wanted(listed.group(1), one) is None for one in items)
        return None if fits else f"a list{' of ' + length if length else ''}, each {_KINDS[listed.group(1)]}"
    fits = {
        "float": isinstance(value, numbers.Real) and not isinstance(value, bool),
        "int": isinstance(value, numbers.Integral) and int(value) >= 0,
        "str": isinstance(value, str),
        "bool": isinstance(value, bool),
        "os.PathLike": isinstance(value, (str, os.PathLike)),
    }.get(kind, True)
    return None if fits else _KINDS[kind]


def _refusal(failure: TypeError, name: str, given: tuple[object, ...]) -> Exception:
    """Names the argument that does not fit a compiled function."""
    said = str(failure)
    if "incompatible function arguments" not in said:
        return failure
    signature = re.search(r"1\. \((.*)\) -> ", said)
    for (argument, kind), value in zip(_ARGUMENT.findall(signature.group(1)) if signature else [], given):
        wanted = _wanted(kind.strip(), value)
        if wanted:
            return ArgumentError(f"{argument} as {wanted}", repr(value)[:80], "help() of the function, which lists its arguments")
    return ArgumentError(f"the arguments of {name}", ", ".join(type(one).__name__ for one in given), "help() of the function, which lists its arguments")


def _checked(function: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        try:
            return function(*given, **named)
        except TypeError as failure:
            if isinstance(failure, ArgumentError):
                raise
            raise _refusal(failure, function.__name__, given) from None

    return call


for _name, _function in list(vars(_palpate).items()):
    if isinstance(_function, types.BuiltinFunctionType):
        setattr(_palpate, _name, _checked(_function))


def path_text(path: object, name: str) -> str:
    """A path as a text; what is none is refused by its name."""
    if isinstance(path, (str, os.PathLike)):
        return os.fspath(path)
    raise ArgumentError(f"{name} as a path", repr(path)[:80], "a text or a pathlib.Path")


def shape_words(shape: str, others: Mapping[str | os.PathLike[str], str] | None) -> list[str]:
    """What ``--shape`` takes: the recording's own shape, and further recordings with theirs."""
    return [shape] * bool(shape) + [f"{path_text(path, 'other_shapes')}={one}" for path, one in (others or {}).items()]


# What needs many libraries (videos, data sets) lies next to the program: in a build's folder, or installed.
_here = Path(__file__).resolve().parent
for _folder in (_here.parents[1] / "lib" / "palpate", _here.parents[2] / "palpate"):
    _palpate.add_module_folder(_folder)
