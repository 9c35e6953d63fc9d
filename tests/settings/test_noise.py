"""Noise settings: the presets' numbers, copies with changes, and files of one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import tomli_w

import dynakin
from dynakin.errors import ConfigError
from dynakin.filter.build import estimator_of
from dynakin.settings import presets
from dynakin.settings.effect import check_effect, check_noise
from dynakin.settings.model import Priors
from dynakin.settings.noise import Noise
from dynakin.settings.settings import Settings
from dynakin.settings.strict import Strict
from dynakin.studies.tuning.settings import check_setting
from dynakin.validation.case import case_of

# Every number that a preset had before it became, or ceased to be, the default.
DEFAULT: dict[str, Any] = {
    "coordinate_variance": 0.0,
    "speed_variance": 0.0,
    "residual_force_sd_n": 12.0,
    "residual_moment_sd_nm": 4.0,
    "acceleration_variance": 0.0,
    "length_variance": 0.0,
    "marker_place_variance_m2": 0.0,
    "inertia_variance": 0.0,
    "jerk_density_rad2_s5": 60.0,
    "translation_jerk_density_m2_s5": 10.0,
    "floating_jerk_density_rad2_s5": 30000.0,
    "floating_translation_jerk_density_m2_s5": 1000.0,
    "length_drift_density_m2_s": 3e-06,
    "length_skin_fraction": 0.6,
    "systematic_scale": 1.0,
    "soft_tissue_sd_fraction": 0.5,
    "soft_tissue_least_sd_m": 0.002,
    "soft_tissue_time_s": 6.0,
    "floating_soft_tissue_time_s": 0.15,
    "following_skin_fraction": 1.0,
    "marker_sd_m": 0.0007,
    "marker_variance_scale": 1.0,
    "marker_variance_m2": {},
    "force_variance_n2": 36.0,
    "moment_variance_n2_m2": 4.0,
    "reference_point_m": "auto",
    "plate_force_sd_n": 5.0,
    "plate_moment_sd_nm": 2.0,
    "plate_time_s": 30.0,
    "plate_load_tolerance": 0.15,
    "plate_delay_sd_s": 0.02,
    "total_mass_variance_kg2": 0.25,
    "total_mass_use": "prior",
    "marker_gate": 1e-09,
    "wrench_gate": 1e-09,
    "recover": True,
    "blind_s": 0.2,
    "unseen_sd": 0.5,
    "iterate_beyond_sd": 0.2,
    "adapt": None,
    "variance_scale": 1.0,
    "jerk_scale": {},
    "constraint": "projection",
}
PAPER: dict[str, Any] = {
    "coordinate_variance": 1000.0,
    "speed_variance": 100.0,
    "residual_force_sd_n": 0.0,
    "residual_moment_sd_nm": 0.0,
    "acceleration_variance": 1000.0,
    "length_variance": 0.0,
    "marker_place_variance_m2": 0.0001,
    "inertia_variance": 0.0,
    "jerk_density_rad2_s5": 0.0,
    "translation_jerk_density_m2_s5": 0.0,
    "floating_jerk_density_rad2_s5": None,
    "floating_translation_jerk_density_m2_s5": None,
    "length_drift_density_m2_s": 0.0,
    "length_skin_fraction": 0.0,
    "systematic_scale": 0.0,
    "soft_tissue_sd_fraction": 0.0,
    "soft_tissue_least_sd_m": 0.0,
    "soft_tissue_time_s": 1.0,
    "floating_soft_tissue_time_s": None,
    "following_skin_fraction": 0.0,
    "marker_sd_m": None,
    "marker_variance_scale": 1.0,
    "marker_variance_m2": {},
    "force_variance_n2": 0.1,
    "moment_variance_n2_m2": 0.1,
    "reference_point_m": [0.0, 0.0, 0.0],
    "plate_force_sd_n": 0.0,
    "plate_moment_sd_nm": 0.0,
    "plate_time_s": 1.0,
    "plate_load_tolerance": None,
    "plate_delay_sd_s": 0.0,
    "total_mass_variance_kg2": 0.0001,
    "total_mass_use": "frame",
    "marker_gate": 0.0,
    "wrench_gate": 0.0,
    "recover": False,
    "blind_s": 0.2,
    "unseen_sd": None,
    "iterate_beyond_sd": None,
    "adapt": False,
    "variance_scale": 1.0,
    "jerk_scale": {},
    "constraint": "gain",
}


def test_presets_have_the_numbers_that_they_had() -> None:
    assert presets.default().model_dump(mode="json") == DEFAULT
    assert presets.paper().model_dump(mode="json") == PAPER
    assert dynakin.Noise() == dynakin.presets.default()


def test_a_copy_with_changes_is_checked() -> None:
    noise = Noise()
    assert (
        noise.changed(jerk_density_rad2_s5=1.0).jerk_density_rad2_s5 == 1.0
        and noise.changed(jerk_density_rad2_s5=1.0).length_drift_density_m2_s == noise.length_drift_density_m2_s
    )
    assert noise.changed() == noise
    for changes, words in (
        ({"jerk_density_rad2_s5": -1.0}, ["noise", "jerk_density_rad2_s5", "-1.0"]),
        (
            {"jrek_density_rad2_s5": 1.0},
            ["noise", "'jrek_density_rad2_s5'", "did you mean 'jerk_density_rad2_s5'"],
        ),
        ({"constraint": "projected"}, ["noise", "constraint", "projection"]),
    ):
        with pytest.raises(ConfigError) as error:
            noise.changed(**changes)
        assert all(word in error.value.message for word in words) and "\n" not in error.value.message


def test_a_written_preset_is_read_back(tmp_path: Path) -> None:
    for base, make in presets.PRESETS.items():
        noise = make().changed(speed_variance=12.5, marker_variance_m2={"RKNE": 1e-4})
        presets.write_preset(tmp_path / "own.toml", noise, base, ["mine"])
        assert presets.preset(str(tmp_path / "own.toml")) == noise.changed(adapt=False)  # a file fixes the noise
    (tmp_path / "asked.toml").write_text("[noise]\nadapt = true\n")
    assert presets.preset(str(tmp_path / "asked.toml")).adapt
    (tmp_path / "wrong.toml").write_text('base = "papers"\n')
    with pytest.raises(ConfigError, match=r"wrong\.toml: base: preset 'papers'"):
        presets.preset(str(tmp_path / "wrong.toml"))
    (tmp_path / "wrong.toml").write_text("[noise]\nself = 1.0\n")
    with pytest.raises(ConfigError, match=r"wrong\.toml: noise: unknown key 'self'"):
        presets.preset(str(tmp_path / "wrong.toml"))


def test_a_file_of_notepad_begins_with_a_mark(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text("[noise]\nspeed_variance = 12.5\n", encoding="utf-8-sig")
    assert presets.preset(str(tmp_path / "own.toml")).speed_variance == 12.5


@pytest.mark.parametrize("schema", [Noise, Priors])
def test_an_old_name_is_refused_by_the_new_one(schema: type[Strict], tmp_path: Path) -> None:
    assert set(schema.renamed.values()) <= set(schema.model_fields)
    assert not set(schema.renamed) & set(schema.model_fields)
    for old, new in schema.renamed.items():
        with pytest.raises(ConfigError) as error:
            schema().changed(**{old: 1.0})
        assert f"{old!r} is now called {new!r}" in error.value.message and "\n" not in error.value.message


def test_an_old_name_is_refused_in_files_and_by_tune(tmp_path: Path) -> None:
    keys = {"trial": "a.trc", "model": "squat7", "output": "out"}
    for table, old, new in (("noise", "force", "force_variance_n2"), ("priors", "marker_m", "marker_sd_m")):
        with pytest.raises(ConfigError) as error:
            Settings.of(keys | {table: {old: 1.0}}, "run.toml")
        assert error.value.message == f"run.toml: {table}: {old!r} is now called {new!r}"
    (tmp_path / "old.toml").write_text("[noise]\njerk = 1.0\n")
    with pytest.raises(ConfigError, match=r"old\.toml: noise: 'jerk' is now called 'jerk_density_rad2_s5'"):
        presets.preset(str(tmp_path / "old.toml"))
    with pytest.raises(ConfigError, match="setting 'plate_force' is now called 'plate_force_sd_n'"):
        check_setting("plate_force")


@pytest.mark.parametrize("preset", ["default", "own.toml"])
def test_the_configuration_of_a_run_is_a_preset_with_the_scales_it_found(
    preset: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("own.toml").write_text("[noise]\nmarker_sd_m = 0.002\nadapt = true\n")
    used = {"variance_scale": 0.2, "jerk_scale": {"knees": 1.5}}
    content = {"preset": preset, "noise": {"unseen_sd": 0.4}, "noise_used": used}
    Path("config.toml").write_text(tomli_w.dumps(content))
    found = presets.preset("config.toml")
    assert (found.variance_scale, found.jerk_scale, found.unseen_sd) == (0.2, {"knees": 1.5}, 0.4)
    assert found.marker_sd_m == (0.002 if preset == "own.toml" else Noise().marker_sd_m)
    assert not found.calibrates(True)


def test_scales_that_are_given_are_not_calibrated_again() -> None:
    assert Noise().calibrates(True) and not Noise().calibrates(False)
    assert not Noise(variance_scale=0.2).calibrates(True) and not Noise(jerk_scale={"knees": 2.0}).calibrates(True)
    assert Noise(variance_scale=0.2, adapt=True).calibrates(False)


@pytest.mark.parametrize(
    ("floating", "noise", "said"),
    [
        (True, {"force_variance_n2": 1.0}, "'force_variance_n2' has no effect on a model that is fixed nowhere"),
        (True, {"jerk_density_rad2_s5": 5.0}, "expected 'floating_jerk_density_rad2_s5'"),
        (True, {"jerk_density_rad2_s5": 60.0, "plate_force_sd_n": 3.0}, ""),  # the preset's own; one that has an effect
        (True, {"jerk_density_rad2_s5": 5.0, "floating_jerk_density_rad2_s5": None}, ""),
        (False, {"floating_jerk_density_rad2_s5": 5.0}, "expected 'jerk_density_rad2_s5'"),
        (False, {"residual_force_sd_n": 5.0}, "fixed in the ground, expected 'force_variance_n2'"),
        (False, {"jerk_scale": {"hips": 2.0}}, "'jerk_scale' has no effect on a model that is fixed in the ground"),
        (False, {"force_variance_n2": 1.0}, ""),
    ],
)
def test_a_key_that_does_nothing_with_the_model_is_refused(floating: bool, noise: dict[str, Any], said: str) -> None:
    settings = Settings(trial=Path("x.trc"), output=Path("o"), noise=noise)
    if not said:
        check_noise(settings, floating)
        return
    with pytest.raises(ConfigError) as error:
        check_noise(settings, floating)
    assert said in error.value.message


def test_all_commands_refuse_it() -> None:
    settings = Settings(model="fullbody", mass_kg=70.0, noise={"force_variance_n2": 1.0})
    for make in (estimator_of, case_of):
        with pytest.raises(ConfigError, match="has no effect on a model that is fixed nowhere"):
            make(settings)


def test_the_grid_refuses_it_too() -> None:
    with pytest.raises(ConfigError, match="'force_variance_n2' has no effect on a model that is fixed nowhere"):
        check_effect(["force_variance_n2"], presets.default(), [True])


def test_an_outputs_configuration_lists_keys_without_effect() -> None:
    """It repeats its run after a default has changed as well."""
    settings = Settings(trial=Path("x.trc"), output=Path("o"), noise={"force_variance_n2": 30.0}, versions={"x": "1"})
    check_noise(settings, True)
