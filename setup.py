"""Build of the optional compiled modules; everything else stands in pyproject.toml.

Without a compiler, or without Cython, the installation goes on and the numpy twin does the work.
"""

import sys
from pathlib import Path

from setuptools import Extension, setup


def compiled_modules() -> list[Extension]:
    """Every `_name.pyx` of the runtime, or nothing where Cython is missing."""
    try:
        from Cython.Build import cythonize
    except ImportError:
        print("viapoint: no Cython, the compiled modules are left out", file=sys.stderr)
        return []
    strict = [] if sys.platform == "win32" else ["-O3", "-ffp-contract=off"]
    modules = [
        Extension(
            ".".join(source.relative_to("src").with_suffix("").parts),
            [str(source)],
            depends=[str(source), *headers(source)],
            extra_compile_args=strict,
        )
        for source in sorted(Path("src/viapoint/runtime").rglob("_*.pyx"))
    ]
    built: list[Extension] = cythonize(modules, quiet=True)
    for module in built:
        module.optional = True  # a failing compiler is a warning; cythonize does not hand this on
    return built


def headers(source: Path) -> list[str]:
    """What a module may include: headers beside it, and those of the whole runtime."""
    found = {*source.parent.glob("_*.h"), *Path("src/viapoint/runtime").glob("_*.h")}
    return sorted(str(header) for header in found)


setup(ext_modules=compiled_modules())
