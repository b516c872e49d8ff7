"""docs/server.md names every request and every key that is told."""

from __future__ import annotations

import re

import numpy as np
from doc_pages import DOCS, read_page

import viapoint as via
from viapoint.serving.monitor import monitors
from viapoint.serving.requests import REQUESTS

PAGE = read_page(DOCS / "server.md")
WORDS = set(re.findall(r"[\w-]+", " ".join(re.findall(r"`([^`]+)`", "\n".join(PAGE.prose())))))


def test_every_request_is_listed_as_it_is() -> None:
    listed = {row[0].strip("`"): row[1:] for row in PAGE.table_rows() if len(row) == 3}
    listed.pop("request", None)
    assert listed == {
        name: [", ".join(f"`{key}`: {value.must_be}" for key, value in spec.values.items()), spec.doc]
        for name, spec in REQUESTS.items()
    }


def test_every_key_of_the_monitor_is_named() -> None:
    session = via.Session(via.default_cell(), via.compile_text("WAIT 0.1"))
    told = monitors(session, next(session.run()), np.arange(1).tolist())
    assert set(told[0]) <= WORDS
