"""Movements that would identify more, and why none would, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.elements import element
from dynakin.identification.observability.element_words import INERTIA, inertia_words, is_planar
from dynakin.identification.observability.excitation import Bench, Excitation
from dynakin.results.measures.posterior import KNOWN, NOTHING
from dynakin.results.naming import listed, sentence, words

GAIN = 1.25
"""Least factor on a standard deviation that is worth saying: a third of the variance."""
REPEATED = 0.15
"""Part by which least squares along the trial's own motion may miss the deviation that the trial ended with."""
STILL_DEG = 5.0
"""A segment that turns by less over the trial does not move: soft tissue alone makes it seem to turn that far."""


def gains_of(
    names: Sequence[str], ended: Array, now: Array, tried: Sequence[Excitation], shares: Mapping[str, float]
) -> dict[str, dict[str, float]]:
    """Factors by which the standard deviation of what is not known yet would shrink, by motion.

    Args:
        ended: (n,) standard deviations that the trial ended with. now: (n,) those of its own motion, by least squares;
            what the two disagree on depends on the path that the estimate took, and nothing is promised of it.
        shares: posterior over prior of each constant.

    Returns:
        Motion -> name -> factor, where it is at least `GAIN`; each name under its best motion only, best first.
    """
    found: dict[str, dict[str, float]] = {}
    for k, name in enumerate(names):
        if not name.startswith(("inertia/", "length/")) or shares.get(name, 0.0) <= KNOWN or not tried:
            continue
        if abs(now[k] / ended[k] - 1.0) > REPEATED:
            continue
        best = max(tried, key=lambda e: now[k] / e.sd[k])
        factor = float(now[k] / best.sd[k])
        if factor >= GAIN:
            found.setdefault(best.name, {})[name] = factor
    return {motion: dict(sorted(gains.items(), key=lambda item: -item[1])) for motion, gains in found.items()}


def advice_in_words(
    bench: Bench,
    tried: Sequence[Excitation] | None,
    gains: Mapping[str, Mapping[str, float]],
    shares: Mapping[str, float],
    alone: frozenset[str],
) -> list[str]:
    """Sentences: each motion that would identify more, then what none identifies and why.

    Args:
        tried: None where no motion was.
    """
    planar = is_planar([name for name in shares if name.startswith("inertia/")])
    said = []
    for excitation in tried or ():
        if excitation.name in gains:
            parts = [f"{_called(n, planar)} {f:.1f} times" for n, f in gains[excitation.name].items()]
            on_top = "" if excitation.name == "faster" else " on top of this movement"
            said.append(f"{sentence(excitation.words)}{on_top} would shrink standard deviations: {listed(parts, 6)}.")
    gained = {name for found in gains.values() for name in found}
    silent = [n for n, share in shares.items() if n.startswith("inertia/") and share >= NOTHING and n not in gained]
    sentences, rest = _still(bench, silent)
    said += sentences
    said += _silence(rest, alone, planar, bool(tried))
    if tried is None:
        return [*said, "Movements that would help are found by: dynakin model MODEL --identifiability --trial FILE."]
    motions = [words(e.name) for e in tried if e.name != "faster"]
    left_out = [words(n) for n in bench.coordinates if n not in bench.grounded and words(n) not in motions]
    if all(name in bench.grounded for name in bench.coordinates):
        said.append("No movement could be tried: all that the markers show would move the feet.")
    if left_out:
        said.append(
            f"Not tried, because even ± 5 deg on top would take a joint to its limit or the person off balance: "
            f"{listed(left_out)}."
        )
    return said


def _still(bench: Bench, silent: list[str]) -> tuple[list[str], list[str]]:
    """A sentence on each segment that does not move, and the numbers of all others."""
    said = []
    turned = turns(bench)
    still = {s for s, deg in turned.items() if deg < STILL_DEG and any(element(n).owner == s for n in silent)}
    for segment in sorted(still, key=list(turned).index):
        numbers = [INERTIA[element(n).number] for n in silent if element(n).owner == segment]
        stands = segment in bench.standing
        why = "and no movement that leaves it there can identify them" if stands else "it would have to"
        said.append(
            f"The data say nothing about the {words(segment)}'s {listed(numbers, 10)}: it does not move (it turns by "
            f"{turned[segment]:.1f} deg), {why}."
        )
    return said, [n for n in silent if element(n).owner not in still]


def _silence(silent: list[str], alone: frozenset[str], planar: bool, tried: bool) -> list[str]:
    """The other numbers that neither the trial nor any motion identifies, by the reason."""
    said = []
    sums = [n for n in silent if n not in alone]
    weak = [n for n in silent if n in alone]
    if sums:
        names = listed([_called(n, planar) for n in sums], 20)
        said.append(
            f"The data say nothing about {names} by themselves, and no movement can: a mass at a joint may belong to "
            "either neighbour, so only sums with what they carry (base parameters) act on the ground."
        )
    if weak and tried:
        names = listed([_called(n, planar) for n in weak], 20)
        said.append(f"The data say nothing about {names}, and none of the movements tried would help much.")
    return said


def turns(bench: Bench) -> dict[str, float]:
    """Angle (deg) between the two orientations of each segment that are furthest from the first one and from that."""
    R = np.stack([_core.segment_poses(bench.measured.core, x)[0] for x in bench.states(bench.trial)])
    names = [segment.name for segment in bench.measured.initial.spec.segments]
    found = {}
    for k, name in enumerate(names):
        path = R[:, k]
        furthest = path[int(np.argmax(_angle(path, path[0])))]
        found[name] = float(np.degrees(_angle(path, furthest).max()))
    return found


def _angle(path: Array, reference: Array) -> Array:
    """Angle (T,) rad of rotations (T, 3, 3) against one (3, 3)."""
    trace = np.einsum("tij,ij->t", path, reference)
    return np.asarray(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)))


def _called(name: str, planar: bool) -> str:
    if name.startswith("length/"):
        return f"{words(element(name).owner)} length"
    return inertia_words(name, planar=planar)
