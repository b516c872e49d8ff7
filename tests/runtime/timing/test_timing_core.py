"""The compiled core and its numpy twin: the same laws, bit for bit; and the choice between them."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from timing_curves import limits, random_waves, steps

from viapoint.runtime import core
from viapoint.runtime.timing import core as numerics
from viapoint.runtime.timing import extend, plan


@pytest.mark.parametrize("seed", range(6))
def test_twin_and_core_give_the_same_laws(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    if core.built("timing._core") is None:
        assert numerics.chosen() is numerics.TWIN
        return
    print(f"seed {seed}")
    curve, lim = random_waves(seed, 5, 1.0), limits(5, 2.0, 9.0, (90.0, 400.0, 1e5)[seed % 3])
    lim = replace(lim, deceleration=None if seed % 2 else np.linspace(5.0, 12.0, 5))
    bound = steps([0.3, 0.7], [0.9, 0.2, 0.6])
    laws = []
    for name in ("python", "compiled"):
        monkeypatch.setattr(core, "asked", name)
        law = plan(curve, lim, bound, s_start=0.0, s_end=0.6, tick=1e-3)
        laws += [law, extend(law, curve, lim, bound, s_end=1.0, tick=1e-3, commit_time=0.2)]
    for twin, compiled in zip(laws[:2], laws[2:], strict=True):
        assert twin is not None
        assert compiled is not None
        t = np.arange(0.0, twin.t_end + 0.01, 1e-3)
        assert np.array_equal(twin.at(t), compiled.at(t))
        assert twin.quality == compiled.quality


def test_the_choice(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(core, "asked", "python")
    assert numerics.chosen().name == "python"
    monkeypatch.setattr(core, "asked", "fortran")
    with pytest.raises(ValueError, match="must be auto, python or compiled"):
        numerics.chosen()
    monkeypatch.setattr(core, "asked", "compiled")
    with pytest.raises(ValueError, match="not built"):
        core.chosen("timing._not_there")


@pytest.mark.parametrize(("word", "shown"), [("python", "python"), ("fortran", "not 'fortran'")])
def test_the_environment_is_asked(word: str, shown: str) -> None:
    code = "from viapoint.runtime.timing.core import chosen; print(chosen().name)"
    environment = os.environ | {core.VARIABLE: word}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert shown in done.stdout + done.stderr
