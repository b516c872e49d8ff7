"""What the commands print, word for word; one golden file per command line."""

from __future__ import annotations

import pytest

LINES = {
    "unknown-command": "chekc part.via",
    "unknown-option": "run part.via --overide 50",
    "bad-format": "check part.via --format jsn",
    "missing-file-name": "dis",
    "too-many": "explain E201 E202",
    "check": "check part.via",
    "check-json": "check part.via --format json",
    "check-wrong": "check wrong.via part.via",
    "check-wrong-json": "check wrong.via --format json",
    "check-missing": "check none.via",
    "check-encoding": "check latin.via",
    "dis": "dis part.via",
    "dis-wrong": "dis wrong.via",
    "explain": "explain e201",
    "explain-unknown": "explain E2O1",
    "robots": "robots",
    "fk": "fk --robot frigeni6 10 20 -30 40 50 -6e1",
    "fk-singular": "fk --robot frigeni6 0 0 0 0 0 0 --tool 380 0 0 0 0 0",
    "fk-outside": "fk --robot frigeni6 200 0 0 0 10 0",
    "fk-count": "fk --robot frigeni6 1 2 3",
    "fk-robot": "fk --robot frigeni 1 2 3 4 5 6",
    "calibrate-tool": "calibrate tool touched.csv",
    "calibrate-tool-json": "calibrate tool touched.csv --format json",
    "calibrate-tool-joints": "calibrate tool joints.csv --robot frigeni6",
    "calibrate-frame": "calibrate frame corners.csv",
    "calibrate-frame-xxy": "calibrate frame corners.csv --xxy --format json",
    "calibrate-wrong-row": "calibrate tool corners.csv",
    "calibrate-no-table": "calibrate tool part.via",
    "calibrate-missing": "calibrate frame none.csv",
    "calibrate-few": "calibrate frame touched.csv",
    "calibrate-usage": "calibrate tool touched.csv --xxy",
    "identify-usage": "identify part.mcap",
    "identify-robot": "identify touched.csv --robot frigeni",
    "identify-columns": "identify touched.csv --robot frigeni6",
    "identify-missing": "identify none.mcap --robot frigeni6",
    "identify-program": "identify part.via --robot frigeni6",
    "ik": "ik --robot frigeni6 1500 1000 2000 10 20 30",
    "ik-far": "ik --robot frigeni6 9000 0 0 0 0 0",
    "ik-word": "ik --robot frigeni6 1500 x 0 0 0 0",
}


@pytest.mark.parametrize("name", LINES)
def test_prints(name: str, cli, check_golden) -> None:
    line = LINES[name]
    transcript = cli(*line.split()).transcript
    said = transcript.partition("\nusage:")[0]  # how argparse breaks its usage lines differs by version
    check_golden(f"cli/{name}.txt", f"$ viapoint {line}\n{said}")
