"""A real client: lets the robot begin, answers what it waits for, and prints what it was told.

Nothing of viapoint: a socket and lines of JSON.
"""

import json
import socket
import sys

with socket.create_connection(("127.0.0.1", int(sys.argv[1])), 30) as connection:
    stream = connection.makefile("r", encoding="utf-8", newline="\n")

    def ask(**request):
        connection.sendall(
            json.dumps(request).encode() + b"\n"
        )  # a text stream that is written forgets lines

    print(json.loads(stream.readline())["hello"]["program"])
    ask(id="s", do="subscribe", monitor_hz=10, events=True)
    ask(do="start")
    monitors = 0
    for line in stream:
        told = json.loads(line)
        assert told.get("ok", True), told
        if "monitor" in told:
            monitors += 1
        elif "standing" in told:
            awaited = told["standing"]["for"]
            print("standing for", awaited)
            if awaited == "DI3":
                ask(do="set", signal="DI3", value=True)
            else:
                ask(do="reset_m", index=7)
        elif "end" in told:
            print("monitors", monitors)
            print(told["end"]["status"])
            break
