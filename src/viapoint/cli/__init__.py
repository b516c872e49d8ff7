"""The command line: arguments in, exit code out. What a command does stands in one module per group.

Exit codes: 0 good, 1 a program or motion error, 2 wrong usage; 130 stopped by Ctrl-C, 141 the reader
of the output went away. Everything heavy is imported by the command that needs it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from viapoint.cli.failures import Refusal, UsageError

FAILED, WRONG_USAGE, INTERRUPTED, BROKEN_PIPE = 1, 2, 130, 141
REPORT_AT = "the issue tracker named in README.md"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line, without the program's name; the exit code. Never raises."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = _dispatch(words)
        sys.stdout.flush()
    except BrokenPipeError:
        # The interpreter flushes once more at exit; give it a place where that cannot fail.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        return _internal(error, words)
    return code


def _dispatch(words: list[str]) -> int:
    from viapoint.cli.arguments import parse

    try:
        try:
            chosen = parse(words)
        except SystemExit:  # --help and --version have printed
            return 0
        code: int = chosen.run(chosen)
        return code
    except UsageError as error:
        print(f"viapoint: {error}", file=sys.stderr)
        if error.usage:
            print(error.usage, file=sys.stderr)
        return WRONG_USAGE
    except Refusal as error:
        _explain_refusal(error)
        return FAILED


def _explain_refusal(error: Refusal) -> None:
    if error.diagnostics:
        from viapoint.language.render import render

        print(render(error.diagnostics, colour=sys.stderr.isatty()), end="\n\n", file=sys.stderr)
    print(f"viapoint: {error}", file=sys.stderr)


def _internal(error: Exception, words: list[str]) -> int:
    """The last resort: one line instead of a traceback; `VIAPOINT_DEBUG=1` shows the traceback too."""
    where = error.__traceback__
    while where is not None and where.tb_next is not None:
        where = where.tb_next
    place = f" ({os.path.basename(where.tb_frame.f_code.co_filename)}:{where.tb_lineno})" if where else ""
    text = " ".join(str(error).split())
    print(
        f"viapoint: internal error: {type(error).__name__}: {text}{place}; please report this line, the "
        f"program and the cell to {REPORT_AT}. Command: viapoint {' '.join(words)}",
        file=sys.stderr,
    )
    if os.environ.get("VIAPOINT_DEBUG"):
        import traceback

        traceback.print_exception(error)
    return FAILED
