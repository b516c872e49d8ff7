"""A TCP server in a run: others watch it, set inputs, answer M functions and command it, line by line.

`hub` moves bytes and knows no robot, `requests` says what a line may ask, `attendant` does it in the
run, between two windows of ticks, `robots` knows which robot is meant.
"""

from viapoint.serving.attendant import Attendant
from viapoint.serving.hub import Hub

__all__ = ["Attendant", "Hub"]
