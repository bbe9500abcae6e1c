"""Where LAPACK is: in the library that scipy brings, found without the rest of scipy.

``import scipy.linalg`` loads 180 modules, 17 MB, none of which a daemon needs. The one extension
that offers LAPACK to others (scipy.linalg.cython_lapack) is a file of its own that needs none of
them either, so it is loaded by itself. Where that does not work, the whole package is imported.
"""

from __future__ import annotations

import ctypes
import importlib
import sys
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from types import ModuleType

PACKAGE = "scipy.linalg"
NAME = f"{PACKAGE}.cython_lapack"


def cython_lapack() -> ModuleType:
    """scipy.linalg.cython_lapack."""
    if PACKAGE in sys.modules:
        return importlib.import_module(NAME)
    return _alone() or importlib.import_module(NAME)


def address(module: ModuleType, name: str) -> int:
    """Where a routine begins that a Cython module offers to others."""
    capsule = module.__pyx_capi__[name]
    name_of = ctypes.pythonapi.PyCapsule_GetName
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    pointer_of = ctypes.pythonapi.PyCapsule_GetPointer
    pointer_of.restype = ctypes.c_void_p
    pointer_of.argtypes = [ctypes.py_object, ctypes.c_char_p]
    return int(pointer_of(capsule, name_of(capsule)))


def _alone() -> ModuleType | None:
    """Without its package; None where it is not to be had so."""
    scipy = find_spec("scipy")
    folders = (scipy and scipy.submodule_search_locations) or []
    spec = PathFinder.find_spec(NAME, [f"{folder}/linalg" for folder in folders])
    if spec is None or spec.loader is None:
        return None
    try:
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
    except ImportError:
        return None
    return module if hasattr(module, "__pyx_capi__") else None
