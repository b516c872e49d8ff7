"""Set points at their time on a clock, on a stock operating system."""

from viapoint.realtime.schedule import Punctuality, Schedule
from viapoint.realtime.sender import Sender, SenderError

__all__ = ["Punctuality", "Schedule", "Sender", "SenderError"]
