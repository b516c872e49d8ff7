"""Signals, M flags, and the scenario that plays the outside world in a simulation."""

from viapoint.runtime.signals.bank import SignalBank
from viapoint.runtime.signals.belts import Belt
from viapoint.runtime.signals.loading import ScenarioError, load_scenario, parse_scenario
from viapoint.runtime.signals.parts import PartQueues
from viapoint.runtime.signals.scenario import (
    Answer,
    BeltScript,
    Change,
    CorrectionScript,
    MFlag,
    Scenario,
    Timed,
)
from viapoint.runtime.signals.world import SignalWorld

__all__ = [
    "Answer",
    "Belt",
    "BeltScript",
    "Change",
    "CorrectionScript",
    "MFlag",
    "PartQueues",
    "Scenario",
    "ScenarioError",
    "SignalBank",
    "SignalWorld",
    "Timed",
    "load_scenario",
    "parse_scenario",
]
