"""What a model's measurements can identify at all, whoever moves and however."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dynakin.blas import one_blas_thread
from dynakin.filter.tracker import Tracker
from dynakin.identification.observability.base import base_of, identified_alone, in_no_base_parameter
from dynakin.identification.observability.element_words import base_words, gauges_in_words, inertia_words, is_planar
from dynakin.identification.observability.gauges import Gauges, gauges_of
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.results.naming import listed
from dynakin.validation.reference.base_parameters import BaseParameters


@dataclass(frozen=True, eq=False)
class Structure:
    """Base parameters and gauges of a model, by random motion within the joints' limits.

    Attributes:
        base: base parameters. base_in_words: each as the sum that it is.
        in_none: inertial numbers that are in no base parameter. alone: those that some motion identifies by themselves.
        gauges, gauges_in_words: what no measurement sees; the words put the skin's displacements together.
    """

    base: BaseParameters
    base_in_words: tuple[str, ...]
    in_none: tuple[str, ...]
    alone: frozenset[str]
    gauges: Gauges
    gauges_in_words: tuple[str, ...]

    def in_words(self) -> list[str]:
        """Rank and what is in none of the base parameters, a sentence each."""
        base, planar = self.base, is_planar(self.base.over)
        said = [
            f"{base.rank} of {len(base.over)} inertial numbers, as sums (base parameters), can be identified from the "
            f"ground reaction; condition number {base.condition:.2g} over random motion, each number in units of its "
            "prior standard deviation."
        ]
        if self.in_none:
            names = [inertia_words(name, planar=planar) for name in self.in_none]
            said.append(f"In no base parameter, so without any effect on the ground reaction: {listed(names, 20)}.")
        else:
            said.append("Every inertial number is in some base parameter.")
        return said

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "rank": self.base.rank,
            "of": len(self.base.over),
            "condition": self.base.condition,
            "in_none": list(self.in_none),
            "gauges": {
                "count": len(self.gauges.found),
                "words": list(self.gauges_in_words),
                "directions": [gauge.direction for gauge in self.gauges.found],
            },
        }


@one_blas_thread
def structure_of(tracker: Tracker) -> Structure:
    """Base parameters and gauges of a tracker's model."""
    measured = MeasuredModel.of(tracker)
    spec, base, gauges = measured.initial.spec, base_of(measured), gauges_of(measured)
    return Structure(
        base,
        tuple(base_words(base, spec)),
        tuple(in_no_base_parameter(base, measured)),
        frozenset(identified_alone(base, measured)),
        gauges,
        tuple(gauges_in_words(gauges.found, spec)),
    )
