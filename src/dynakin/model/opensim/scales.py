"""Scale parameters: one a body, dimensionless, 1 as the file has it; both sides share one by default."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from dynakin.errors import ModelError
from dynakin.model.opensim.description import OpenSimModel
from dynakin.settings.strict import nearest

PREFIX = "scale_"
_SIDES = (("_r", "_l"), ("_right", "_left"), ("r_", "l_"), ("right_", "left_"), ("_R", "_L"), ("R_", "L_"))


def without_side(name: str, names: Iterable[str]) -> str:
    """The name without its side where its mirror image is there too ("femur_r" with "femur_l": "femur")."""
    there = set(names)
    for pair in _SIDES:
        for own, other in (pair, pair[::-1]):
            if own.startswith("_") and name.endswith(own) and name.removesuffix(own) + other in there:
                return name.removesuffix(own)
            if own.endswith("_") and name.startswith(own) and other + name.removeprefix(own) in there:
                return name.removeprefix(own)
    return name


def scale_names(
    model: OpenSimModel, bodies: Sequence[str] | str | None = "all", *, share: bool = True
) -> dict[str, str]:
    """The scale parameter of each body that has one.

    Args:
        bodies: which bodies are scaled: "all", some names, or None for none of them.
        share: whether mirrored bodies (femur_r, femur_l) have one parameter.

    Raises:
        ModelError: a name that is no body of the model.
    """
    known = [body.name for body in model.bodies]
    if bodies is None or bodies == "all":
        chosen: Sequence[str] = known if bodies == "all" else []
    elif isinstance(bodies, str):
        raise ModelError(f"scale is {bodies!r}, expected 'all', a list of bodies or none")
    else:
        chosen = bodies
    for name in chosen:
        if name not in known:
            raise ModelError(
                f"{model.path}: scale: no body {name!r}{nearest(name, known)}; expected some of {', '.join(known)}"
            )
    return {name: PREFIX + (without_side(name, known) if share else name) for name in chosen}
