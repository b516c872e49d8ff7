"""The version of the installed package, and of what a recording should name."""

from __future__ import annotations

NAMED = ("viapoint", "numpy", "ruckig", "foxglove-sdk", "mcap")


def version(package: str = "viapoint") -> str:
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as installed

    try:
        return installed(package)
    except PackageNotFoundError:
        return "unknown"


def versions() -> dict[str, str]:
    """Of viapoint and the packages that a result depends on."""
    return {name: version(name) for name in NAMED}
