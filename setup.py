"""Build of the optional compiled core; everything else stands in pyproject.toml.

Without a compiler, or without Cython, the installation goes on and the numpy twin does the work.
"""

import sys

from setuptools import Extension, setup


def compiled_core() -> list[Extension]:
    """The extension, or nothing where Cython is missing."""
    try:
        from Cython.Build import cythonize
    except ImportError:
        print("viapoint: no Cython, the compiled core is left out", file=sys.stderr)
        return []
    strict = [] if sys.platform == "win32" else ["-O3", "-ffp-contract=off"]
    folder = "src/viapoint/runtime/timing/"
    core = Extension(
        "viapoint.runtime.timing._core",
        [folder + "_core.pyx"],
        depends=[folder + "_core.pyx", folder + "_loops.h"],
        extra_compile_args=strict,
    )
    (built,) = cythonize([core], quiet=True)
    built.optional = True  # a failing compiler is a warning; cythonize does not hand this on
    return [built]


setup(ext_modules=compiled_core())
