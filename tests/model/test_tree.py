"""What a tree says of its segments: on random trees, and on models in the plane, in space, of OpenSim, with loads."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import dynakin
from dynakin.model.calibration.declared import with_loads
from dynakin.model.opensim.from_core import from_core
from dynakin.model.opensim.read import read_osim
from dynakin.model.opensim.spec import to_spec
from dynakin.settings.subject import CarriedLoad
from dynakin.simulation.trial import simulate
from dynakin.tree import Tree

WHO = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")


@st.composite
def trees(draw: st.DrawFn) -> Tree:
    """Of up to 12 segments, their branches in any order, with one root or several."""
    numbers = [draw(st.integers(-1, k - 1)) for k in range(draw(st.integers(1, 12)))]
    return Tree.numbered([f"s{k}" for k in range(len(numbers))], numbers)


def agrees(tree: Tree, chosen: set[str]) -> None:
    """All that a tree says follows from who hangs on whom."""
    names = list(tree.parents)
    assert [names[k] if k >= 0 else "" for k in tree.numbers] == [
        p if p in names else "" for p in tree.parents.values()
    ]
    assert Tree.numbered(names, tree.numbers).numbers == tree.numbers
    assert all(k < number for number, k in enumerate(tree.numbers))
    for name in names:
        up, below = tree.up(name), tree.below(name)
        assert up[0] == name and up[-1] in tree.roots
        assert all(tree.parents[one] == other and tree.adjacent(one, other) for one, other in pairwise(up))
        assert below == [other for other in names if other != name and name in tree.up(other)]
        assert (name in tree.ends) == (not below)
        assert tree.nearest(name, chosen) == next((each for each in up if each in chosen), "")
        first = [other for other in below if other in chosen and not chosen.intersection(tree.up(other)[1:]) & {*below}]
        assert sorted(tree.next_below(name, chosen)) == sorted(first)
    assert sorted(tree.up(*chosen)) == sorted({each for name in chosen for each in tree.up(name)})
    assert tree.below(*chosen) == [name for name in names if chosen.intersection(tree.up(name)[1:])]


@given(trees(), st.data())
def test_a_tree_agrees_with_itself(tree: Tree, data: st.DataObject) -> None:
    agrees(tree, data.draw(st.sets(st.sampled_from(list(tree.parents)))))


@pytest.mark.parametrize("name", ["sagittal7", "fullbody"])
def test_of_a_model_with_loads(name: str) -> None:
    calibrated = dynakin.load_model(name, subject=WHO, markers="opencap").calibrate(
        simulate(name, "squat", 1, 5.0).recording
    )
    hung = [calibrated.spec.segments[0].name, *calibrated.feet.values()]
    loads = [CarriedLoad(segment=on, mass_kg=1.0, place_m=(0.0, 0.1, 0.0), name=f"on {on}") for on in hung]
    tree = with_loads(calibrated, loads).tree
    agrees(tree, {marker.segment for marker in calibrated.spec.markers})
    assert tree.below(*hung)[-len(loads) :] == [load.name for load in loads]


def test_of_an_opensim_model_and_one_with_massless_bodies_between(data_dir: Path) -> None:
    source = read_osim(data_dir / "opencap_subject4" / "optimized_scale_and_markers.osim")
    whole, chains = source.tree, from_core(to_spec(source, {})).tree
    assert len(chains.parents) > len(whole.parents)
    for tree in (whole, chains):
        agrees(tree, {"calcn_r", "calcn_l", "torso"})
        assert (tree.roots, tree.below("calcn_r"), tree.nearest("toes_l", ["calcn_l"])) == (
            ["pelvis"],
            ["toes_r"],
            "calcn_l",
        )
    for name in whole.parents:
        assert [each for each in chains.up(name) if each in whole.parents] == whole.up(name)
