"""Build of the optional compiled core; everything else stands in pyproject.toml."""

from setuptools import setup

setup()
