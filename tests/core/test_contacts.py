"""Moments with the contacts' wrenches: no residual, least change, derivatives and deviations; the loads of joints."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.bindings import _core
from support.core.bridge import close, filter_of, model_of
from support.core.contact_cases import CASES, Drawn, conditioned, distribution
from support.core.differences import BLOCKS, central_differences, compare
from support.core.random_models import (
    FEET,
    ROOT,
    floating_model,
    prior_sd,
    random_state,
    settings,
    trial,
    with_contacts,
)
from support.oracle.state import Layout, unpack

MODELS = [floating_model(seed) for seed in range(6)]
NONE, MEASURED, UNMEASURED, SHARED = range(4)
BOTH = (MEASURED, MEASURED)


def covariances(rng, feet=2):
    root = rng.normal(size=(feet, 6, 6))
    return root @ root.transpose(0, 2, 1) * 20.0 + np.diag([25.0, 25.0, 100.0, 4.0, 4.0, 4.0])


def joint(each):
    """(6 C, 6 C) of independent covariances (C, 6, 6)."""
    out = np.zeros((len(each), 6, len(each), 6))
    for k, R in enumerate(each):
        out[k, :, k] = R
    return out.reshape(6 * len(each), -1)


def loads_of(wrench, covariance, contact=BOTH):
    return _core.ContactLoads(
        list(FEET[: len(wrench)]),
        np.ascontiguousarray(wrench[None]),
        np.ascontiguousarray(joint(covariance)[None]),
        np.array([contact], np.uint8),
    )


def external_of(spec, wrenches):
    names = [s.name for s in spec.segments]
    out = np.zeros((len(names), 6))
    for name, wrench in zip(FEET, wrenches, strict=False):
        out[names.index(name)] = wrench
    return out


def drawn(spec, seed):
    """A state, wrenches that do not fit it, and how sure they are."""
    rng = np.random.default_rng(seed)
    model, layout = model_of(spec), Layout(spec)
    x = random_state(layout, rng)
    return model, layout, x, rng.normal(size=(2, 6)) * 200.0, covariances(rng)


def root_rows(spec):
    return [k for k, c in enumerate(spec.coordinates) if c.name in ROOT]


def behind(spec, foot):
    """Names of the coordinates between the ground and a foot."""
    segments, found, name = {s.name: s for s in spec.segments}, set(), foot
    while name != "ground":
        found |= {axis.coordinate for axis in segments[name].axes}
        name = segments[name].parent
    return np.array([c.name in found for c in spec.coordinates])


@pytest.mark.parametrize("spec", MODELS, ids=lambda s: s.name)
def test_nothing_is_left_at_the_root_and_moments_equal_pinocchios(spec):
    from support.oracle import pinocchio_tree

    for seed in range(3):
        model, layout, x, wrench, covariance = drawn(spec, seed)
        found = _core.contact_moments(model, x, loads_of(wrench, covariance))
        scale = np.abs(_core.wrench(model, x)).max()
        assert np.abs(found["moments"][root_rows(spec)]).max() < 1e-12 * scale
        assert np.abs(found["remainder"]).max() < 1e-12 * scale
        close(found["foot_wrench"].sum(axis=0), _core.wrench(model, x), 1e-13)
        close(found["foot_wrench"], wrench + found["foot_adjustment"], 1e-13)
        assert not found["moment_source"].any()
        external = external_of(spec, found["foot_wrench"])
        expected = pinocchio_tree.solve(spec, unpack(layout, x), external)
        close(found["moments"], expected["moments"], 1e-9)


@pytest.mark.parametrize("spec", MODELS[:3], ids=lambda s: s.name)
def test_the_change_is_the_least_weighted_one(spec):
    """No other change with the same sum is smaller in the metric of the covariances."""
    model, _, x, wrench, covariance = drawn(spec, 5)
    change = _core.contact_moments(model, x, loads_of(wrench, covariance))["foot_adjustment"]

    def cost(u):
        return sum(v @ np.linalg.solve(R, v) for v, R in zip(u, covariance, strict=True))

    rng = np.random.default_rng(6)
    for size in (1e-3, 1.0, 100.0):
        step = rng.normal(size=6) * size
        assert cost(change + np.array([step, -step])) > cost(change)
    first = np.linalg.solve(covariance[0], change[0])  # the multipliers are those of one common equality
    close(first, np.linalg.solve(covariance[1], change[1]), 1e-9)


def test_a_sure_plate_is_not_changed():
    model, _, x, wrench, covariance = drawn(MODELS[0], 7)
    covariance[0] *= 1e-12
    found = _core.contact_moments(model, x, loads_of(wrench, covariance))
    close(found["foot_wrench"][0], wrench[0], 1e-9)
    close(found["foot_wrench"][1], _core.wrench(model, x) - wrench[0], 1e-9)


def test_errors_of_the_plates_are_found_by_a_certain_state():
    """True wrenches that the state needs, one foot wrong and as unsure as that, the other sure."""
    model, _, x, _, covariance = drawn(MODELS[1], 8)
    rng = np.random.default_rng(9)
    left = rng.normal(size=6) * 100.0
    true = np.array([left, _core.wrench(model, x) - left])
    error = rng.normal(size=6) * 20.0
    covariance[0] *= 1e-14
    found = _core.contact_moments(model, x, loads_of(true + np.array([0 * error, error]), covariance))
    close(found["foot_adjustment"][1], -error, 1e-9)
    close(found["foot_wrench"], true, 1e-9)


@pytest.mark.parametrize("spec", MODELS[:3], ids=lambda s: s.name)
def test_one_unmeasured_contact_is_derived_from_the_motion(spec):
    """Its prior is wide, so that it takes what is missing; the plate's is not changed by more than it is unsure."""
    model, _, x, wrench, covariance = drawn(spec, 10)
    covariance[1] *= 1e9
    found = _core.contact_moments(model, x, loads_of(wrench, covariance, (MEASURED, UNMEASURED)))
    close(found["foot_wrench"][0], wrench[0], 1e-6)
    close(found["foot_wrench"][1], _core.wrench(model, x) - wrench[0], 1e-6)
    np.testing.assert_array_equal(found["moment_source"], behind(spec, FEET[1]).astype(int))
    close(found["moments"], _core.joint_moments(model, x, external_of(spec, found["foot_wrench"])), 1e-13)
    assert np.abs(found["moments"][root_rows(spec)]).max() < 1e-9
    same = _core.contact_moments(model, x, loads_of(wrench, covariance))  # the code tells the source, not the numbers
    np.testing.assert_array_equal(same["moments"], found["moments"])


def test_of_several_unmeasured_contacts_the_prior_divides_what_the_motion_needs():
    spec = MODELS[2]
    model, _, x, wrench, covariance = drawn(spec, 11)
    found = _core.contact_moments(model, x, loads_of(wrench, covariance, (UNMEASURED, UNMEASURED)), 0, np.eye(len(x)))
    divided = behind(spec, FEET[0]) | behind(spec, FEET[1])
    np.testing.assert_array_equal(found["moment_source"], np.where(divided, 2, 0))
    close(found["foot_wrench"].sum(axis=0), _core.wrench(model, x), 1e-13)
    assert np.isfinite(found["moments"]).all() and np.isfinite(found["moments_sd"]).all()
    assert (found["foot_wrench_sd"] > 0.0).all() and np.abs(found["remainder"]).max() < 1e-9
    np.testing.assert_array_equal(found["moments"][~divided], _core.joint_moments(model, x)[~divided])


@pytest.mark.parametrize(
    ("contact", "left", "right"),
    [
        ((MEASURED, MEASURED), 0, 0),
        ((NONE, MEASURED), 0, 0),
        ((UNMEASURED, MEASURED), 1, 0),
        ((MEASURED, UNMEASURED), 0, 1),
        ((UNMEASURED, NONE), 1, 0),
        ((UNMEASURED, UNMEASURED), 2, 2),
        ((SHARED, SHARED), 2, 2),
        ((SHARED, UNMEASURED), 2, 1),
        ((NONE, NONE), 0, 0),
    ],
)
def test_sources_are_those_of_the_worst_contact_behind(contact, left, right):
    spec = MODELS[1]
    model, _, x, wrench, covariance = drawn(spec, 11)
    source = _core.contact_moments(model, x, loads_of(wrench, covariance, contact))["moment_source"]
    expected = np.maximum(left * behind(spec, FEET[0]), right * behind(spec, FEET[1]))
    np.testing.assert_array_equal(source, expected)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("seed", range(3))
def test_equals_the_slow_distribution(name, seed):
    """Joint covariance, contacts' states, a residual on the root: all against one dense Gaussian."""
    d = Drawn.of(MODELS[seed], 40 + seed, CASES[name])
    found = _core.contact_moments(d.model, d.x, d.loads)
    wrenches, remainder = distribution(d, d.x)
    close(found["foot_wrench"], wrenches, 1e-10)
    close(found["foot_adjustment"], np.where(d.touches[:, None], wrenches - d.wrench, 0.0), 1e-10)
    close(found["remainder"], remainder, 1e-10)
    if not d.touches.any():
        close(remainder, _core.wrench(d.model, d.x), 1e-13)
        return
    close(found["foot_wrench"], conditioned(d, d.x)[0], 1e-8)
    external = np.zeros((len(d.spec.segments), 6))
    for name_, w in zip(d.segments, wrenches, strict=True):
        external[d.model.segment_names.index(name_)] += w
    close(found["moments"], _core.joint_moments(d.model, d.x, external), 1e-10)
    root = root_rows(d.spec)
    assert np.abs(found["moments"][root]).max() < 1e-9 * np.abs(wrenches).max()
    if d.touches[-1]:  # the residual acts on the root: without it the root's moments are its own
        external[0] -= wrenches[-1]
        left = _core.joint_moments(d.model, d.x, external)[root]
        close(left[:3], wrenches[-1][:3], 1e-10)  # ROOT's first three are translations along the ground's axes


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("seed", range(3))
def test_derivatives_with_contacts_states_equal_differences(name, seed):
    """All columns: a contact's own states, and those of one that nothing touches."""
    d = Drawn.of(MODELS[seed], 50 + seed, CASES[name])
    jacobian = _core.contact_moments(d.model, d.x, d.loads, jacobian=True)["jacobian"]
    differences = central_differences(lambda z: _core.contact_moments(d.model, z, d.loads)["moments"], d.x)
    size = max(1.0, np.abs(_core.joint_moments(d.model, d.x)).max())
    layout = Layout(d.spec)
    for block in BLOCKS:
        b = layout.block(block)
        compare(block, jacobian[:, b], differences[:, b], 2e-6, size)
    own = jacobian[:, layout.block("contacts")].reshape(len(jacobian), 2, 6)
    np.testing.assert_array_equal(np.abs(own).max(axis=(0, 2)) > 0.0, d.matters)


@pytest.mark.parametrize("name", CASES)
def test_deviations_with_contacts_states_equal_the_dense_formula(name):
    d = Drawn.of(MODELS[4], 60, CASES[name])
    rng = np.random.default_rng(61)
    root = rng.normal(size=(d.x.size, d.x.size)) * 0.01
    P, n = root @ root.T, d.x.size
    contacts = Layout(d.spec).block("contacts")
    P[contacts] *= 20.0
    P[:, contacts] *= 20.0

    def outputs(z):
        found = _core.contact_moments(d.model, z[:n], d.loads_with(z[n:].reshape(-1, 6)))
        return np.concatenate([found["moments"], found["foot_wrench"].ravel()])

    J = central_differences(outputs, np.concatenate([d.x, d.wrench.ravel()]))
    total = np.zeros((len(J.T), len(J.T)))
    total[:n, :n], total[n:, n:] = P, d.covariance
    expected = np.sqrt(np.diag(J @ total @ J.T).clip(0.0))
    found = _core.contact_moments(d.model, d.x, d.loads, 0, P)
    sd = np.concatenate([found["moments_sd"], found["foot_wrench_sd"].ravel()])
    np.testing.assert_allclose(sd, expected, rtol=1e-5, atol=1e-6 * expected.max())


@pytest.mark.parametrize("name", CASES)
def test_of_a_certain_state_only_what_the_sum_leaves_free_is_unsure(name):
    d = Drawn.of(MODELS[2], 62, CASES[name])
    found = _core.contact_moments(d.model, d.x, d.loads, 0, np.zeros((d.x.size, d.x.size)))
    expected = np.sqrt(np.diag(conditioned(d, d.x)[1]).clip(0.0)).reshape(3, 6) if d.touches.any() else np.zeros((3, 6))
    np.testing.assert_allclose(found["foot_wrench_sd"], expected, rtol=1e-6, atol=1e-4)


def test_in_flight_the_remainder_is_told():
    spec = MODELS[3]
    model, _, x, wrench, covariance = drawn(spec, 12)
    found = _core.contact_moments(model, x, loads_of(wrench, covariance, (NONE, NONE)))
    close(found["remainder"], _core.wrench(model, x), 1e-13)
    assert not found["foot_wrench"].any() and not found["moment_source"].any()
    np.testing.assert_array_equal(found["moments"], _core.joint_moments(model, x))


@pytest.mark.parametrize("contact", [BOTH, (MEASURED, NONE), (UNMEASURED, MEASURED), (NONE, NONE)])
@pytest.mark.parametrize("spec", MODELS[:4], ids=lambda s: s.name)
def test_derivatives_equal_differences(spec, contact):
    model, layout, x, wrench, covariance = drawn(spec, 13)
    loads = loads_of(wrench, covariance, contact)
    jacobian = _core.contact_moments(model, x, loads, jacobian=True)["jacobian"]
    differences = central_differences(lambda z: _core.contact_moments(model, z, loads)["moments"], x)
    size = max(1.0, np.abs(_core.joint_moments(model, x)).max())
    for name in BLOCKS:
        b = layout.block(name)
        compare(name, jacobian[:, b], differences[:, b], 2e-6, size)
    if contact != (NONE, NONE):
        assert np.abs(jacobian[root_rows(spec)]).max() < 1e-9 * np.abs(jacobian).max()


@pytest.mark.parametrize("contact", [BOTH, (MEASURED, UNMEASURED), (MEASURED, NONE)])
def test_deviations_equal_those_of_the_joint_covariance(contact):
    """By central differences w.r.t. the state and each measured wrench; their errors are independent."""
    model, _, x, wrench, covariance = drawn(MODELS[4], 14)
    rng = np.random.default_rng(15)
    root = rng.normal(size=(len(x), len(x))) * 0.01
    P = root @ root.T

    def outputs(z):
        w = z[len(x) :].reshape(2, 6)
        found = _core.contact_moments(model, z[: len(x)], loads_of(w, covariance, contact))
        return np.concatenate([found["moments"], found["foot_wrench"].ravel()])

    z = np.concatenate([x, wrench.ravel()])
    J = central_differences(outputs, z)
    total = np.zeros((len(z), len(z)))
    total[: len(x), : len(x)] = P
    for i, R in enumerate(covariance):
        here = slice(len(x) + 6 * i, len(x) + 6 * i + 6)
        total[here, here] = R
    expected = np.sqrt(np.diag(J @ total @ J.T).clip(0.0))
    found = _core.contact_moments(model, x, loads_of(wrench, covariance, contact), 0, P)
    sd = np.concatenate([found["moments_sd"], found["foot_wrench_sd"].ravel()])
    np.testing.assert_allclose(sd, expected, rtol=1e-5, atol=1e-6 * expected.max())


def test_what_splits_the_feet_is_independent_of_their_sum():
    """Why the filter may use the sum before: the errors that survive the adjustment do not know it (section 15)."""
    rng = np.random.default_rng(16)
    R = covariances(rng)
    S = R.sum(axis=0)
    share = np.array([np.linalg.solve(S, r).T for r in R])
    for i in range(2):
        # cov(e_i - A_i sum e, sum e) = R_i - A_i S
        close(R[i] - share[i] @ S, np.zeros((6, 6)), 1e-12)


@pytest.mark.parametrize("contact", [BOTH, (MEASURED, UNMEASURED)])
def test_deviations_are_those_of_many_trials(contact):
    """The filter takes the plates' sum, the moments the same plates by foot: nothing is counted twice."""
    spec = MODELS[1]
    model, layout = model_of(spec), Layout(spec)
    rng = np.random.default_rng(23)
    start = random_state(layout, rng)
    spread = 0.02 * prior_sd(layout)  # small, so that tangents do
    split, R = rng.normal(size=6) * 50.0, covariances(rng) * 0.05
    chosen = quiet_settings(spec) | {"total_mass": None, "marker_variance": np.full(len(spec.markers), 1e-8)}
    chosen |= {"wrench_covariance": R.sum(axis=0), "reference_point": np.zeros(3)}
    roots = np.linalg.cholesky(R)
    errors, sds = [], []
    for _ in range(300):
        truth = start + spread * rng.normal(size=layout.size)
        feet = np.array([split, _core.wrench(model, truth) - split])
        plates = feet + (roots @ rng.normal(size=(2, 6, 1)))[..., 0]
        markers = _core.marker_positions(model, truth) + 1e-4 * rng.normal(size=(len(spec.markers), 3))
        f = filter_of(spec, chosen, start, np.diag(spread**2))
        f.update(markers, plates.sum(axis=0) if contact == BOTH else np.full(6, np.nan))
        found = _core.contact_moments(model, f.state, loads_of(plates, R, contact), 0, f.covariance)
        expected = _core.joint_moments(model, truth, external_of(spec, feet))
        errors.append(np.concatenate([found["moments"] - expected, (found["foot_wrench"] - feet).ravel()]))
        sds.append(np.concatenate([found["moments_sd"], found["foot_wrench_sd"].ravel()]))
    mean_square, variance = np.mean(np.square(errors), axis=0), np.mean(np.square(sds), axis=0)
    seen = np.sqrt(variance) > 1e-6
    assert seen.sum() > 20
    ratio = mean_square[seen] / variance[seen]
    assert ratio.min() > 0.7 and ratio.max() < 1.35  # chi-square over 300 draws: 1 +- 0.08


@pytest.mark.parametrize("contact", [(UNMEASURED, UNMEASURED), (MEASURED, UNMEASURED)])
def test_deviations_with_contacts_states_are_those_of_many_trials(contact):
    """The filter takes the total with its white errors and the states' effects, the moments take both again by foot:
    drawn from the prior, the error's mean square is the variance that is reported."""
    spec = with_contacts(MODELS[1], FEET)
    model, layout = model_of(spec), Layout(spec)
    rng = np.random.default_rng(27)
    start = random_state(layout, rng)
    states = layout.block("contacts")
    start[states] = 0.0
    spread = 0.02 * prior_sd(layout)
    spread[states] = 1.0
    R, effects = covariances(rng) * 0.05, np.zeros((6, 12))
    for k in range(2):
        if contact[k] == UNMEASURED:
            effects[:, 6 * k : 6 * k + 6] = rng.normal(size=(6, 6)) * 20.0
    chosen = quiet_settings(spec) | {"total_mass": None, "marker_variance": np.full(len(spec.markers), 1e-8)}
    roots = np.linalg.cholesky(R)
    fixed = rng.normal(size=6) * 50.0
    errors, sds = [], []
    for _ in range(300):
        truth = start + spread * rng.normal(size=layout.size)
        unknown = np.stack([effects[:, :6] @ truth[states][:6], effects[:, 6:] @ truth[states][6:]])
        white = (roots @ rng.normal(size=(2, 6, 1)))[..., 0]
        # what is expected: the feet's wrenches less what states and white errors are
        feet = np.array([fixed, _core.wrench(model, truth) - fixed])
        expected = feet - unknown + white
        loads = _core.ContactLoads(
            list(FEET), expected[None], joint(R)[None], np.array([contact], np.uint8), effects[None]
        )
        markers = _core.marker_positions(model, truth) + 1e-4 * rng.normal(size=(len(spec.markers), 3))
        f = filter_of(spec, chosen, start, np.diag(spread**2))
        f.update(markers, expected.sum(axis=0), R.sum(axis=0), effects)
        found = _core.contact_moments(model, f.state, loads, 0, f.covariance)
        moments = _core.joint_moments(model, truth, external_of(spec, feet))
        errors.append(np.concatenate([found["moments"] - moments, (found["foot_wrench"] - feet).ravel()]))
        sds.append(np.concatenate([found["moments_sd"], found["foot_wrench_sd"].ravel()]))
    mean_square, variance = np.mean(np.square(errors), axis=0), np.mean(np.square(sds), axis=0)
    seen = np.sqrt(variance) > 1e-6
    assert seen.sum() > 20
    ratio = mean_square[seen] / variance[seen]
    assert ratio.min() > 0.7 and ratio.max() < 1.35  # chi-square over 300 draws: 1 +- 0.08


def feet_trial(spec, frames, seed):
    data = trial(spec, seed, frames, gaps=False)
    rng = np.random.default_rng(seed)
    wrench = np.stack([0.4 * data.wrench, 0.6 * data.wrench], axis=1) + rng.normal(size=(frames, 2, 6))
    covariance = np.stack([joint(covariances(rng)) for _ in range(frames)])
    contact = rng.choice(4, size=(frames, 2)).astype(np.uint8)
    contact[: frames // 2] = MEASURED
    return data, _core.ContactLoads(list(FEET), wrench, covariance, contact, data.given.get("wrench_effects"))


def quiet_settings(spec):
    chosen = settings(spec, 20, bounds=False)
    return chosen | {"constraint": "none"}


@pytest.mark.parametrize("spec", [MODELS[5], with_contacts(MODELS[5], FEET)], ids=lambda s: s.name)
def test_a_run_reports_the_same_frame_by_frame(spec):
    model = model_of(spec)
    data, loads = feet_trial(spec, 14, 21)
    out = data.run(filter_of(spec, quiet_settings(spec), data.x0, data.P0).run, output_sd=True, feet=loads)
    plain = data.run(filter_of(spec, quiet_settings(spec), data.x0, data.P0).run, output_sd=True)
    stepped = filter_of(spec, quiet_settings(spec), data.x0, data.P0)
    for name in (
        "state",
        "state_sd",
        "wrench_sd",
        "markers_estimated",
        "nis",
    ):  # how the wrench is measured is given apart
        np.testing.assert_array_equal(out[name], plain[name])
    for k in range(len(data.time)):
        if k:
            stepped.predict(data.time[k] - data.time[k - 1])
        stepped.update(*data.at(k))
        one = _core.contact_moments(model, stepped.state, loads, k, stepped.covariance)
        for name in ("moments", "moments_sd", "foot_wrench", "foot_wrench_sd", "foot_adjustment", "remainder"):
            np.testing.assert_allclose(out[name][k], one[name], rtol=1e-9, atol=1e-9, err_msg=name)
        np.testing.assert_array_equal(out["moment_source"][k], one["moment_source"])
    half = len(data.time) // 2
    assert np.abs(out["moments"][:half, root_rows(spec)]).max() < 1e-9


@pytest.mark.parametrize("spec", [MODELS[5], with_contacts(MODELS[5], FEET)], ids=lambda s: s.name)
def test_a_smoothed_run_reports_the_smoothed_state(spec):
    model = model_of(spec)
    data, loads = feet_trial(spec, 14, 22)
    out = data.run(filter_of(spec, quiet_settings(spec), data.x0, data.P0).run_smoothed, feet=loads)
    for k in range(len(data.time)):
        one = _core.contact_moments(model, out["smoothed_state"][k], loads, k)
        for name in ("moments", "foot_wrench", "foot_adjustment", "remainder"):
            np.testing.assert_allclose(out[f"smoothed_{name}"][k], one[name], rtol=1e-9, atol=1e-9, err_msg=name)
    assert np.isfinite(out["smoothed_moments_sd"][:7]).all() and out["smoothed_foot_wrench_sd"].shape == (14, 2, 6)


@pytest.mark.parametrize("spec", MODELS[:4], ids=lambda s: s.name)
def test_joint_loads_and_mass_centre_equal_pinocchios(spec):
    from support.oracle import pinocchio_tree

    model, layout, x, wrench, covariance = drawn(spec, 17)
    feet = _core.contact_moments(model, x, loads_of(wrench, covariance))["foot_wrench"]
    found = _core.whole_body(model, x[None], list(FEET), feet[None])
    expected = pinocchio_tree.solve(spec, unpack(layout, x), external_of(spec, feet))
    force, moment = expected["loads"][:, :3], expected["loads"][:, 3:]
    close(found["joint_loads"][0, :, :3], force, 1e-9)
    close(found["joint_loads"][0, :, 3:], moment - np.cross(expected["origins"], force), 1e-9)
    assert np.abs(found["joint_loads"][0, 0]).max() < 1e-9
    for name in ("mass_centre", "mass_centre_velocity"):
        close(found[name][0], expected[name], 1e-11)
    np.testing.assert_array_equal(found["joint_centres"][0], _core.segment_poses(model, x)[1])
    np.testing.assert_array_equal(found["orientations"][0], _core.segment_poses(model, x)[0])
    assert found["mass"][0] == _core.total_mass(model, x)


def moved(layout, x, dt):
    """x a time later at constant acceleration of the coordinates."""
    out, q, qd, qdd = x.copy(), *(layout.block(name) for name in ("coordinates", "speeds", "accelerations"))
    out[q] += dt * x[qd] + dt**2 / 2 * x[qdd]
    out[qd] += dt * x[qdd]
    return out


@pytest.mark.parametrize("spec", MODELS[:4], ids=lambda s: s.name)
def test_powers_are_the_rate_of_mechanical_energy(spec):
    """Joints and feet together: sum of moment times speed, and of each foot's wrench times its motion."""
    from support.oracle import pinocchio_tree

    model, layout, x, wrench, covariance = drawn(spec, 18)
    found = _core.contact_moments(model, x, loads_of(wrench, covariance))
    speeds = _core.coordinates(model, x)[1]
    joints = found["moments"] @ speeds
    bare = _core.joint_moments(model, x) @ speeds  # the feet's power is what taking their wrenches off the joints costs
    feet = bare - joints
    h = 1e-5
    energy = [pinocchio_tree.solve(spec, unpack(layout, moved(layout, x, dt)))["energy"] for dt in (-h, h)]
    assert joints + feet == pytest.approx(float(energy[1] - energy[0]) / (2 * h), rel=1e-6, abs=1e-3)
    direct = foot_power(model, layout, x, found["foot_wrench"])
    assert feet == pytest.approx(direct, rel=1e-6, abs=1e-3)


def foot_power(model, layout, x, wrenches):
    """Power of the feet's wrenches by differenced poses."""
    h, total = 1e-6, 0.0
    (R0, p0), (R1, p1) = (_core.segment_poses(model, moved(layout, x, dt)) for dt in (-h, h))
    R, p = _core.segment_poses(model, x)
    for name, w in zip(FEET, wrenches, strict=True):
        i = model.segment_names.index(name)
        v = (p1[i] - p0[i]) / (2 * h)
        spin = (R1[i] - R0[i]) / (2 * h) @ R[i].T
        omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        total += w[:3] @ v + (w[3:] - np.cross(p[i], w[:3])) @ omega
    return total


@pytest.mark.parametrize("spec", MODELS[:3], ids=lambda s: s.name)
def test_the_mass_centre_falls_as_the_forces_say(spec):
    model, layout, x, wrench, covariance = drawn(spec, 19)
    h = 1e-5
    later, before = (_core.whole_body(model, moved(layout, x, dt)[None]) for dt in (h, -h))
    velocity = (later["mass_centre"] - before["mass_centre"])[0] / (2 * h)
    now = _core.whole_body(model, x[None])
    close(now["mass_centre_velocity"][0], velocity, 1e-6)
    acceleration = (later["mass_centre_velocity"] - before["mass_centre_velocity"])[0] / (2 * h)
    feet = _core.contact_moments(model, x, loads_of(wrench, covariance))["foot_wrench"]
    mass = now["mass"][0]
    close(mass * acceleration, feet[:, :3].sum(axis=0) + mass * np.asarray(spec.gravity), 1e-6)


def test_bad_input_is_told():
    spec = MODELS[0]
    model, _, x, wrench, covariance = drawn(spec, 1)
    good, one = loads_of(wrench, covariance), np.ones((1, 1), np.uint8)
    both, R = np.ones((1, 2), np.uint8), joint(covariance)[None]
    with pytest.raises(ValueError, match=r"no segment 'paw', expected one of root, left_0"):
        _core.contact_moments(model, x, _core.ContactLoads(["paw"], wrench[None, :1], covariance[None, 0], one))
    with pytest.raises(ValueError, match=r"covariance: expected \(1, 12, 12\)"):
        _core.ContactLoads(list(FEET), wrench[None], covariance[None, 0], both)
    with pytest.raises(ValueError, match=r"effects: expected \(1, 6, 12\) or fewer columns"):
        _core.ContactLoads(list(FEET), wrench[None], R, both, np.zeros((1, 6, 7)))
    with pytest.raises(ValueError, match="found 7"):
        _core.ContactLoads(list(FEET), wrench[None], R, np.full((1, 2), 7, np.uint8))
    with pytest.raises(ValueError, match="frame: 1, expected less than 1"):
        _core.contact_moments(model, x, good, 1)
    with pytest.raises(ValueError, match="frame 0: the covariance of the sum"):
        _core.contact_moments(model, x, loads_of(wrench, -covariance))
    states = model_of(with_contacts(spec, FEET))
    with pytest.raises(ValueError, match="effects of the states of 0 contacts, expected 2"):
        _core.contact_moments(states, states.initial_state(), good)
    data = trial(spec, 3, 5, gaps=False)
    f = filter_of(spec, quiet_settings(spec), data.x0, data.P0)
    with pytest.raises(ValueError, match="loads of 1 frames, expected 5"):
        f.run(data.time, data.markers, data.wrench, feet=good)
    with pytest.raises(ValueError, match="wrench model: not finite"):
        f.update(data.markers[0], data.wrench[0], np.full((6, 6), np.nan))


def test_several_contacts_of_one_segment_push_it_together():
    model, _, x, wrench, covariance = drawn(MODELS[0], 1)
    twice = _core.ContactLoads([FEET[0]] * 2, wrench[None], joint(covariance)[None], np.ones((1, 2), np.uint8))
    found = _core.contact_moments(model, x, twice)
    external = external_of(MODELS[0], found["foot_wrench"].sum(axis=0, keepdims=True))
    close(found["moments"], _core.joint_moments(model, x, external), 1e-13)
