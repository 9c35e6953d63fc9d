"""Models that are fixed nowhere have settings of their own: these can be varied, and the idle ones are not."""

from __future__ import annotations

import pytest

import dynakin
from dynakin.errors import ConfigError
from dynakin.filter.estimator import Estimator
from dynakin.settings import presets
from dynakin.simulation.trial import simulate
from dynakin.studies.engine.pools import open_pool
from dynakin.studies.tuning.fit import Fitter, usual_names
from dynakin.studies.tuning.grid import axis, run_grid
from dynakin.studies.tuning.score import Shared
from dynakin.studies.tuning.settings import value_of
from dynakin.studies.tuning.trial import prepare

FLOATING = ("floating_jerk_density_rad2_s5", "floating_translation_jerk_density_m2_s5", "floating_soft_tissue_time_s")
FIXED = ("jerk_density_rad2_s5", "translation_jerk_density_m2_s5", "soft_tissue_time_s")


@pytest.fixture(scope="module")
def body() -> Shared:
    recording = simulate("fullbody", "squat", 3, 5.0, 12.5).recording
    model = dynakin.load_model("fullbody", dynakin.Subject(mass_kg=70.0, height_m=1.75))
    return Shared((prepare(recording, Estimator(model, presets.default())),), presets.default())


def figure(shared: Shared, name: str) -> list[float]:
    """The likelihood with two values of a setting."""
    value = value_of(shared.base, name)
    with open_pool("threads", 1) as pool:
        grid = run_grid(shared, [axis(name, value, 3.0 * value, 2)], pool)
    return [cell["nll"] for cell in grid.cells]


@pytest.mark.parametrize("name", FLOATING)
def test_settings_of_a_floating_model_can_be_varied(body: Shared, name: str) -> None:
    first, second = figure(body, name)
    assert first is not None and second is not None and abs(first - second) > 1e-6


def test_each_kind_of_model_is_fitted_by_what_has_an_effect_on_it(default: Shared, body: Shared) -> None:
    fixed, floating = (usual_names(shared.base, shared.floating) for shared in (default, body))
    assert set(FIXED) <= set(fixed) and not set(FLOATING) & set(fixed)
    assert set(FLOATING) <= set(floating) and not set(FIXED) & set(floating)
    assert set(FIXED) | set(FLOATING) <= set(usual_names(default.base, (True, False)))
    # where the preset has none of their own, the usual ones hold for floating models too
    assert set(FIXED) <= set(usual_names(default.base.model_copy(update=dict.fromkeys(FLOATING)), (True,)))


def test_a_setting_that_is_not_given_starts_as_the_usual_one() -> None:
    noise = presets.default()
    assert (
        value_of(noise.changed(floating_jerk_density_rad2_s5=None), "floating_jerk_density_rad2_s5")
        == noise.jerk_density_rad2_s5
    )


@pytest.mark.parametrize("pair", zip(FIXED, FLOATING, strict=True))
def test_a_setting_without_effect_is_refused(default: Shared, body: Shared, pair: tuple[str, str]) -> None:
    for shared, idle, other in ((body, *pair), (default, *reversed(pair))):
        with open_pool("threads", 1) as pool:
            with pytest.raises(ConfigError, match=f"'{idle}' has no effect on a model .* expected '{other}'"):
                Fitter(shared, (idle,), pool)
            with pytest.raises(ConfigError, match=f"'{idle}' has no effect"):
                run_grid(shared, [axis(idle, 1.0, 10.0, 2)], pool)
