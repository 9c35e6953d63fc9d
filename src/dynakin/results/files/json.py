"""``parameters.json`` and ``metrics.json``: plain JSON with a schema version, `null` where a number is not defined."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dynakin.absent import with_nulls
from dynakin.results.estimate import Estimate
from dynakin.results.measures.metrics import SCHEMA_VERSION


def write_parameters(estimate: Estimate, path: Path) -> None:
    """Every length, marker position and inertial parameter with its standard deviation, start, table and bounds."""
    _write(
        path,
        {
            "schema_version": SCHEMA_VERSION,
            "model": estimate.model_name,
            "parameters": [asdict(parameter) for parameter in estimate.parameters],
        },
    )


def write_metrics(metrics: dict[str, Any], path: Path) -> None:
    """The figures of `dynakin.results.measures.metrics.compute_metrics`."""
    _write(path, metrics)


def _write(path: Path, content: dict[str, Any]) -> None:
    text = json.dumps(with_nulls(content), indent=2, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8", newline="\n")
