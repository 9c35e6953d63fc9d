"""What goes wrong (or not) in the trials of `verdicts.py`, and what is given in those of `given.py`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from known_truth import MASS_KG, Spec

FROM_S = {"gait": 1.0, "squat": 1.0, "sagittal": 4.0}
"""When two markers exchange their names."""

TROUBLES: dict[str, dict[str, Any]] = {
    "good": {},
    "noise settings x5": {"noise": 5.0},
    "noise settings x0.2": {"noise": 0.2},
    "soft tissue x2.5": {"sensors": {"soft_tissue": 2.5}},
    "soft tissue x0.2": {"sensors": {"soft_tissue": 0.2}},
    "cameras 3 mm": {"sensors": {"marker_sd_m": 0.003}},
    "markers low-passed at 12 Hz": {"altered": {"low-passed": 12.0}},
    "markers misplaced 10 mm": {"sensors": {"misplacement_sd_m": 0.01, "hip_regression_sd_m": 0.01}},
    "a marker put on again 30 mm off": {"altered": {"off": 0.03}},
    "two markers exchange names": {"altered": {"exchanged": 0.0}},
    "a plate reads 10 % too much": {"altered": {"plate gain": 1.1}},
    "mass 10 % too large": {"told": {"mass_kg": 1.1 * MASS_KG}},
    "plates 30 ms late": {"sensors": {"plate_lag_s": 0.03}},
}
"""Changes of a good trial, as keywords of `Spec`."""


def troubled(name: str, motion: str, seed: int) -> Spec:
    changes = dict(TROUBLES[name])
    if "exchanged" in changes.get("altered", {}):
        changes["altered"] = {"exchanged": FROM_S[motion]}
    return Spec(motion, seed, **changes)


@dataclass(frozen=True)
class Given:
    """What a laboratory gives, apart from the base case: a factor and its level, and keywords of `Spec`."""

    factor: str
    level: str
    changes: dict[str, Any] = field(default_factory=dict)


GIVEN: dict[str, Given] = {
    "base": Given("base case", "full set, 0.5 mm, two plates or more, standing trial, mass"),
    "half": Given("markers", "half of the set", {"altered": {"half": 1.0}}),
    "clinical": Given("markers", "clinical (Plug-in Gait)", {"markers": "plug-in-gait"}),
    "0.2 mm": Given("cameras' noise", "0.2 mm", {"sensors": {"marker_sd_m": 0.0002}}),
    "2 mm": Given("cameras' noise", "2 mm", {"sensors": {"marker_sd_m": 0.002}}),
    "one plate": Given("plates", "one", {"altered": {"one plate": 1.0}}),
    "no plates": Given("plates", "none", {"altered": {"no plates": 1.0}}),
    "no static": Given("standing trial", "none", {"static": False}),
    "no mass": Given("mass", "not known", {"told": {"mass_kg": None}}),
    "worst": Given(
        "all of these",
        "clinical, 2 mm, no plates, no standing trial, no mass",
        {
            "markers": "plug-in-gait",
            "sensors": {"marker_sd_m": 0.002},
            "altered": {"no plates": 1.0},
            "static": False,
            "told": {"mass_kg": None},
        },
    ),
}


def given(name: str, motion: str, seed: int) -> Spec:
    return Spec(motion, seed, **GIVEN[name].changes)
