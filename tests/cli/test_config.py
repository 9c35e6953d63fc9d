"""The configuration: one definition for file and command line."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import typer

from dynakin.cli.app import main
from dynakin.cli.options import _contacts
from dynakin.errors import ConfigError
from dynakin.pipeline.stages import configure
from dynakin.settings import presets
from dynakin.settings.model import Bounds, Priors
from dynakin.settings.noise import Noise
from dynakin.settings.settings import RECORDED, Settings, read_keys
from dynakin.settings.template import config_template

REQUIRED = {"trial": "squat.c3d", "model": "squat7", "output": "out"}


def _config(**keys: Any) -> Settings:
    return Settings.of(REQUIRED | keys, "run.toml")


def test_printed_configuration_is_valid_as_it_stands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["print-config"]) == 0
    path = tmp_path / "run.toml"
    path.write_text(capsys.readouterr().out)
    config = Settings.of(read_keys(path), str(path))
    assert config.trial == tmp_path / "squat.c3d"
    assert config.noise_settings() == presets.default()


def test_every_key_is_printed_with_its_default_and_a_comment() -> None:
    text = config_template()
    everything = re.sub(r"^#(?=\w)", "", text, flags=re.MULTILINE)
    content = tomllib.loads(everything)
    assert set(content) == set(Settings.model_fields) - set(RECORDED)
    config = Settings.of(content, "template")
    assert config.noise == presets.default().model_dump(mode="json", exclude_none=True)
    assert config.priors == Priors() and config.bounds == Bounds()
    for key in ("markers", "table", "side", "vertical", "forward", "preset"):
        assert content[key] == Settings.model_fields[key].default
    for schema in (Settings, Noise, Priors, Bounds):
        assert all(field.description for field in schema.model_fields.values())


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"masskg": 70.0}, ["'masskg'", "did you mean 'mass_kg'"]),
        ({"noise": {"foce_variance_n2": 1.0}}, ["noise", "'foce_variance_n2'", "did you mean 'force_variance_n2'"]),
        ({"priors": {"marker_sd": 0.01}}, ["priors", "'marker_sd'", "did you mean 'marker_sd_m'"]),
        ({"bounds": {"mass_fraction": -1.0}}, ["bounds", "mass_fraction"]),
        ({"noise": {"force_variance_n2": -1.0}}, ["noise", "force_variance_n2"]),
        ({"preset": "papers"}, ["papers", "paper"]),
        ({"side": "middle"}, ["side", "middle"]),
        ({"sex": "other"}, ["sex", "other"]),
        ({"mass_kg": 0}, ["mass_kg"]),
        ({"mass_kg": "heavy"}, ["mass_kg", "heavy"]),
        ({"height_m": 175.0}, ["height_m", "175"]),
    ],
)
def test_wrong_keys_and_values_are_named_with_the_file(keys: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(ConfigError) as error:
        _config(**keys)
    for word in ["run.toml", *words]:
        assert word in error.value.message
    assert "\n" not in error.value.message


def test_noise_changes_single_values_of_the_preset() -> None:
    noise = _config(noise={"force_variance_n2": 25.0, "marker_variance_m2": {"RKNE": 1e-4}}).noise_settings()
    assert noise.force_variance_n2 == 25.0 and noise.marker_variance_m2 == {"RKNE": 1e-4}
    assert noise.moment_variance_n2_m2 == presets.default().moment_variance_n2_m2


def test_the_papers_settings_are_printed_too() -> None:
    content = tomllib.loads(re.sub(r"^#(?=\w)", "", config_template("paper"), flags=re.MULTILINE))
    assert Settings.of(content, "template").noise_settings() == presets.paper()


def test_command_line_wins_over_the_file(tmp_path: Path) -> None:
    path = tmp_path / "run.toml"
    path.write_text('trial = "a.trc"\nforces = "/far/b.mot"\nmodel = "squat7"\noutput = "out"\nmass_kg = 70.0\n')
    config = configure(path, {"mass_kg": 80.0, "output": Path("elsewhere")})
    assert config.mass_kg == 80.0
    assert config.model == "squat7"
    assert config.trial == tmp_path / "a.trc"
    assert config.forces == Path("/far/b.mot")
    assert config.output == Path("elsewhere")


def test_an_option_of_a_table_leaves_its_other_keys(tmp_path: Path) -> None:
    path = tmp_path / "run.toml"
    path.write_text('trial = "a.trc"\noutput = "out"\n[opensim]\nscale_masses = false\n')
    config = configure(path, {"opensim": {"marker_places": "kept"}}, options=True)
    assert (config.opensim.marker_places, config.opensim.scale_masses) == ("kept", False)
    assert configure(path, {}).opensim.marker_places == "calibrated"


def test_a_model_file_beside_the_configuration_is_found(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("")
    path = tmp_path / "run.toml"
    path.write_text('model = "mine.toml"\nmarkers = "opencap"\n')
    assert read_keys(path) == {"model": str(tmp_path / "mine.toml"), "markers": "opencap"}


def test_what_is_not_toml_is_refused_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "run.toml"
    path.write_text('trial = "a.trc"\nmodel = \n')
    with pytest.raises(ConfigError, match=r"run\.toml.*line 2"):
        read_keys(path)
    with pytest.raises(ConfigError, match="cannot be read"):
        read_keys(tmp_path / "none.toml")


def test_configuration_as_used_can_be_read_again() -> None:
    used = _config(mass_kg=70.0, forward=[0.0, 1.0, 0.0], noise={"force_variance_n2": 4.0}).as_used()
    assert Path(used["trial"]).is_absolute()
    again = Settings.of({key: value for key, value in used.items() if value is not None}, "config.toml")
    assert again.as_used() == used


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["run", "--side", "middle"], "run: --side: Input should be"),
        (["run", "--estimate", "length"], "run: --estimate[0]: Input should be"),
        (["tune", "fit", "--side", "middle"], "tune fit: --side: Input should be"),
        (["compare", "--sex", "other"], "compare: --sex: Input should be"),
        (["check", "--sex", "other"], "run: --sex: Input should be"),
        (
            ["run", "--marker-places", "kep"],
            "run: --marker-places: Input should be 'calibrated' or 'kept', found 'kep'",
        ),
    ],
)
def test_a_wrong_value_is_named_by_its_option(
    words: list[str], expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = 2 if words[0] == "tune" else 1
    others = [] if words[0] == "check" else ["--model", "squat7", "-o", str(tmp_path / "out")]
    assert main([*words[:command], "none.trc", *words[command:], *others]) == 2
    assert expected in capsys.readouterr().err


def test_a_wrong_value_of_the_file_is_named_by_its_key(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.toml"
    path.write_text('trial = "a.trc"\nmodel = "squat7"\noutput = "out"\nside = "middle"\n')
    assert main(["run", str(path), "--mass", "70"]) == 2
    assert "run.toml: side: Input should be" in capsys.readouterr().err


def test_options_are_the_settings_themselves(capsys: pytest.CaptureFixture[str]) -> None:
    """Every command that has an option of a setting says of it what the setting says of itself."""
    meaning = Settings.model_fields["plate_filter_hz"].description
    assert meaning is not None
    for command in (["run"], ["compare"], ["tune", "grid"], ["tune", "fit"]):
        assert main([*command, "--help"]) == 0
        assert meaning in " ".join(capsys.readouterr().out.split())


def test_functional_trials_in_file_and_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Their paths are relative to the configuration, absolute in an output's; a joint that there is not is named."""
    path = tmp_path / "run.toml"
    path.write_text('trial = "a.c3d"\nmodel = "fullbody"\noutput = "out"\n[functional]\nhip_r = "hip.c3d"\n')
    config = Settings.of(read_keys(path), str(path))
    assert config.functional == {"hip_r": tmp_path / "hip.c3d"}
    assert Settings.of(config.as_used(), "again").functional == config.functional
    words = ["run", "a.c3d", "-o", str(tmp_path / "out")]
    for given, said in (
        ("hip_right=hip.c3d", "hip_r"),
        ("hip_r", "JOINT=FILE"),
        ("hip_r=nowhere.c3d", "nowhere.c3d"),
    ):
        assert main([*words, "--model", "fullbody", "--functional", given]) == 2
        error = capsys.readouterr().err.strip()
        assert said in error and error.count("\n") == 0


@pytest.mark.parametrize("text", [
    "seat,rail=hand_r", '"seat", {name = "rail", segment = "hand_r"}',
])  # fmt: skip
def test_contacts_are_given_as_an_option_or_as_a_configuration_has_them(text: str) -> None:
    assert _contacts(text) == ["seat", {"name": "rail", "segment": "hand_r"}]


def test_braces_that_are_no_table_are_refused_with_the_form_that_works() -> None:
    with pytest.raises(typer.BadParameter, match="expected names with commas: seat,rail=hand_r"):
        _contacts("{rail}")
