"""What may be loaded by when: named modules, not seconds, which a busy machine would make false."""

import subprocess
import sys

import pytest

from dynakin.cli.simulate import _MODELS, _MOTIONS, _PLATES
from dynakin.simulation.bodies.registry import BODIES
from dynakin.simulation.motions.registry import MOTIONS, MOTIONS_IN_SPACE
from dynakin.simulation.support import PLATES

DRAWING = ("matplotlib", "jinja2")
STATISTICS = ("scipy.signal", "scipy.stats")  # the slowest parts of SciPy
TABLES = ("xarray", "pandas")
FILES = ("ezc3d", "netCDF4", "joblib")
CORE = ("dynakin.bindings._core",)
SEARCHES = ("scipy.optimize", "scipy.spatial", "scipy.ndimage")
NUMBERS = ("numpy", "scipy")

LOADED = "import sys; print(*sys.modules)"
NAMES = ("run", "live", "demo", "compare", "batch", "identify", "simulate", "check", "model", "tune", "markers")


def loaded(program: str) -> set[str]:
    """Modules that are loaded once ``program`` has run, in a process of its own."""
    done = subprocess.run([sys.executable, "-c", f"{program}\n{LOADED}"], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


@pytest.mark.parametrize(
    ("program", "forbidden"),
    [
        ("import dynakin", (*DRAWING, *STATISTICS, *TABLES, *FILES, *CORE, *NUMBERS, "pydantic", "rich")),
        ("import dynakin; dynakin.presets", (*DRAWING, *STATISTICS, *TABLES, *FILES, *CORE, *NUMBERS)),
        ("import dynakin; dynakin.read", (*DRAWING, *STATISTICS, *TABLES, *FILES, *CORE, "scipy.optimize")),
        ("import dynakin; dynakin.Estimator", (*DRAWING, *STATISTICS, *TABLES, *FILES, *SEARCHES)),
        ("import dynakin; dynakin.run", (*DRAWING, *STATISTICS, *TABLES, *FILES, *SEARCHES)),
        ("import dynakin; dynakin.Result", (*DRAWING, *STATISTICS, *FILES, "dynakin.simulation.trial")),
        ("import dynakin.cli.prepared, dynakin.validation.case", (*DRAWING, *STATISTICS, *TABLES, *FILES, *SEARCHES)),
        ("import dynakin.cli.prepared, dynakin.cli.summary, dynakin.report.page", ("matplotlib", *STATISTICS, *FILES)),
    ],
)
def test_heavy_libraries_are_loaded_only_where_they_are_used(program: str, forbidden: tuple[str, ...]) -> None:
    assert not loaded(program) & set(forbidden)


def test_the_help_of_every_command_loads_nothing_that_computes() -> None:
    calls = "\n".join(f"app(['{name}', '--help'], standalone_mode=False)" for name in NAMES)
    found = loaded(f"from dynakin.cli.app import app\napp(['--help'], standalone_mode=False)\n{calls}")
    assert not found & {*DRAWING, *STATISTICS, *TABLES, *FILES, *CORE, *NUMBERS}
    layers = {name.split(".")[1] for name in found if name.startswith("dynakin.")}
    assert layers <= {
        "cli",
        "settings",
        "errors",
        "files",
        "messages",
        "units",
        "elements",
        "arrays",
        "progress",
        "lazy",
    }


def test_the_names_in_the_help_of_simulate_are_those_that_it_knows() -> None:
    def words(text: str) -> list[str]:
        return text.replace(" or ", ", ").split(", ")

    planar, _, spatial = _MOTIONS.removesuffix(")").partition(" (fullbody: ")
    assert words(_MODELS) == list(BODIES)
    assert (words(planar), words(spatial)) == (list(MOTIONS), list(MOTIONS_IN_SPACE))
    assert words(_PLATES) == list(PLATES)
