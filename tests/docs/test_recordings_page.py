"""docs/recordings.md names every topic, schema, field, column, attachment and metadata key."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from doc_pages import DOCS, read_page

from viapoint.cli import main
from viapoint.runtime.recording.mcapfile import Attachment, Message, Metadata, read_items
from viapoint.runtime.recording.recorder import _topics
from viapoint.runtime.recording.schemas import AXES, COLUMNS, FIRST_TICK, JSON_SCHEMAS

PAGE = read_page(DOCS / "recordings.md")
NAMED = set(re.findall(r"`([^`]+)`", "\n".join(PAGE.prose())))


@pytest.fixture(scope="module")
def items(tmp_path_factory: pytest.TempPathFactory) -> list[object]:
    """What a recording with a scenario holds."""
    folder = tmp_path_factory.mktemp("recording")
    (folder / "part.via").write_text("MJ P5 F60\nSET DO1\n")
    (folder / "scenario.toml").write_text("seed = 3\n")
    recording = folder / "run.mcap"
    scenario = str(folder / "scenario.toml")
    command = ["run", str(folder / "part.via"), "--scenario", scenario, "--record", str(recording)]
    assert main([*command, "--format", "json"]) == 0
    return list(read_items(recording))


def test_every_topic_with_its_schema() -> None:
    rows = {row[0].strip("`"): row for row in PAGE.table_rows() if row[0].startswith("`/") and len(row) == 4}
    declared = {topic.name: (topic.schema, topic.message_encoding) for topic in _topics(ros=True)}
    assert {name: (row[1].strip("`"), row[2]) for name, row in rows.items()} == declared


def test_every_field_of_the_trace() -> None:
    assert {FIRST_TICK, AXES} == {1, 2}
    assert {column.name for column in COLUMNS} | {"first_tick", "axes"} <= NAMED


@pytest.mark.parametrize("schema", ["viapoint.Signal", "viapoint.ProgramState"])
def test_every_key_of_the_json_topics(schema: str) -> None:
    assert set(json.loads(JSON_SCHEMAS[schema])["properties"]) <= NAMED


def test_every_attachment_and_metadata_key(items: list[object]) -> None:
    attached = {item.name.partition("/")[0] for item in items if isinstance(item, Attachment)}
    assert attached == {name.partition("/")[0] for name in NAMED if re.match(r"\w+/[\w.]+$", name)} - {
        "sensor_msgs"
    }
    metadata = [item for item in items if isinstance(item, Metadata)]
    assert {"viapoint", "result"} == {item.name for item in metadata}
    assert {key for item in metadata for key in item.entries} <= NAMED


def test_every_written_topic_is_declared_on_the_page(items: list[object]) -> None:
    assert {item.topic for item in items if isinstance(item, Message)} <= NAMED


def test_every_column_of_the_export(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("part.via").write_text("MJ P5 F60\n")
    assert main(["run", "part.via", "--max-time", "0.002", "--record", "run.mcap"]) == 0
    capsys.readouterr()
    assert main(["export", "run.mcap", "-o", "-"]) == 0
    columns = capsys.readouterr().out.splitlines()[0].split(",")
    assert {re.sub(r"^(a?j)\d$", r"\g<1>1", column) for column in columns} <= NAMED
