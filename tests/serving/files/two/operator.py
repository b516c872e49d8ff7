"""A real client of two robots: brings each what it waits for, and prints what it was told.

Nothing of viapoint: a socket and lines of JSON.
"""

import json
import socket
import sys

ANSWERS = {
    (1, "DI3"): {"do": "set", "signal": "DI3", "value": True},
    (1, "the reset of M7"): {"do": "reset_m", "index": 7, "robot": "left"},
    (2, "$lot > 2"): {"do": "variable", "name": "lot", "value": 5},
    (2, "the reset of M7"): {"do": "reset_m", "index": 7, "robot": 2},
}

with socket.create_connection(("127.0.0.1", int(sys.argv[1])), 30) as connection:
    stream = connection.makefile("r", encoding="utf-8", newline="\n")

    def ask(**request):
        connection.sendall(
            json.dumps(request).encode() + b"\n"
        )  # a text stream that is written forgets lines

    hello = json.loads(stream.readline())["hello"]
    print([(each["robot"], each["name"], each["program"]) for each in hello["robots"]])
    ask(do="subscribe", monitor_hz=10, events=True)
    ask(do="start")
    monitors = {1: 0, 2: 0}
    for line in stream:
        told = json.loads(line)
        assert told.get("ok", True), told
        if "monitor" in told:
            monitors[told["monitor"]["robot"]] += 1
        elif "standing" in told:
            standing = told["standing"]
            print("robot", standing["robot"], "stands for", standing.get("for", "nothing"))
            answer = ANSWERS.pop((standing["robot"], standing.get("for")), None)
            if answer is not None:
                ask(**answer)
        elif "end" in told:
            print("monitors", *monitors.values())
            print(told["end"]["status"])
            break
