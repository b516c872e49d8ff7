"""Random programs of every kind of motion: limits, geometry and ends, against independent kinematics."""

from __future__ import annotations

import pytest
from program_checks import assert_keeps_all
from programs_at_random import Arm, random_program

from session_runs import run

SEEDS = range(64)


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_program_keeps_limits_and_path(seed: int, arm: Arm) -> None:
    program = random_program(seed)
    done = run(program.text, max_time=60.0)
    assert_keeps_all(
        done, program, arm, f"seed {seed}, {done.status} {done.session.failure}:\n{program.text}"
    )


def test_most_random_programs_can_be_run() -> None:
    seeds = SEEDS[::4]
    refused = [seed for seed in seeds if run(random_program(seed).text, max_time=0.0).code is not None]
    assert len(refused) < len(seeds) // 3, refused
