"""Positioning from a scenario of a few lines."""

from collections.abc import Callable
from pathlib import Path

from stickslip.records import Positioning
from stickslip.tasks import position, write_json

Run = Callable[..., Positioning]

AXIS = "mass = 150.0\ncoulomb_friction = 100.0\nviscous_friction = 700.0\nstatic_friction = 130.0"
ARM = (
    "mass = 1.0\nload_mass = 1.0\nstiffness = 1.0\ncoulomb_friction = 0.15\n"
    "viscous_friction = 0.1\nstatic_friction = 0.18"
)


def positioned(
    folder: Path,
    method: str = "",
    settings: str = "",
    *,
    axis: str,
    task: str,
    guess: str = "",
    sensors: str = "",
    limit: float,
    learned: Positioning | None = None,
) -> Positioning:
    """Return the result of a scenario with these lines in its tables, resumed from another's."""
    if learned is not None:
        write_json(learned.learned.to_dict(), folder / "learned.json")
        guess = f"{guess}\nlearned = 'learned.json'"
    if method:
        settings = f"method = '{method}'\n{settings}"
    path = folder / "a_task.toml"
    path.write_text(
        f"[axis]\n{axis}\n[task]\n{task}\n[sensors]\n{sensors}\n[guess]\n{guess}\n"
        f"[controller]\neffort_limit = {limit}\n{settings}\n"
    )
    return position(path)
