"""Sittings of lines at random: nothing that is typed raises, no tick is missing, every limit is kept."""

from __future__ import annotations

import numpy as np
import pytest
from repl_sittings import Sitting

LINES = (
    """
MJ P1 F60|ML P2 F400|ML P3 R20|ML P4|MJ P6|HOME F80|T 1|T 0
ML X=1600 Y=0 Z=1500 A=0 B=90 C=0|ML X=99999|ML P77|ML P1 R10 \\|ML P2 R30 \\|MS P2 \\
MS P3 \\|MC P3 Q4 F200|IF DI3|ELSE|ENDIF|SET DO1|RESET DO1|WAIT 0.1|WAIT DI 3|M 5|M 7|A:
GOTO A 2|B:|END|SUB B|SUB DROP|SUB LOOP||IF DO1|:load part.via|:run|:run for 0.7
:run for 2.3|:step|:step 2|:step 3|:back|:back 2|:break 6|:break 4 if DO1
:break DROP if NOT DI3|:break off|:break off 6|:break|:x|:override 50|:override 100
:override 0|:override -50|:halt|:continue|:continue for 0.3|:continue for 1|:stop|:estop
:reset|:jog J2 -5|:jog Z -30|:jog tool X 20|:jog A 5|:jog frame 1 Y 15|:time 0.2|:time
:jog X+ for 0.3|:jog tool B- at 40|:jog J3+
:teach P9|:points|:teach P9 joints|:io|:io DI3 on|:io DI3 off|:io M7 off|:io M5 off
:force DO1 on|:force DO1 free|:force free|:status|:list|:trace|:trace 5|:help
""".strip()
    .replace("\n", "|")
    .split("|")
)

COUNT = 30


@pytest.mark.parametrize("seed", [50, 69, 1, 2, 3, 4])
def test_sitting_at_random(seed: int, sitting: Sitting) -> None:
    rng = np.random.default_rng(seed)
    typed = [LINES[k] for k in rng.integers(0, len(LINES), COUNT)]
    reproducer = "\n".join(typed)
    sitting.enter(*typed)
    sitting.console.close()
    windows, cell = list(sitting.console.windows), sitting.console.session.cell
    tick = 0
    for window in windows:
        assert window.first_tick == tick, reproducer
        tick += len(window)
    joints = np.concatenate([window.joints for window in windows])
    limits = cell.robot.limits
    harder = cell.emergency_deceleration_factor if ":estop" in typed else 1.0
    speed = np.diff(joints, axis=0) / cell.tick
    acceleration = np.diff(speed, axis=0) / cell.tick
    jerk = np.diff(acceleration, axis=0) / cell.tick
    assert (np.abs(speed) <= limits.speed * (1.0 + 1e-9)).all(), reproducer
    assert (np.abs(acceleration) <= limits.acceleration * harder * (1.0 + 1e-6)).all(), reproducer
    assert (np.abs(jerk) <= limits.jerk * harder * 1.05).all(), reproducer
