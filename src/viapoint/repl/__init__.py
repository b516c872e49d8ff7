"""The prompt: statements are executed as they are typed, commands with a colon stand beside them."""

from viapoint.repl.console import Complaint, Console

__all__ = ["Complaint", "Console"]
