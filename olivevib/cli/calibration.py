"""Looks at a calibration that change nothing: live guidance, and the sigma over the volume."""

from __future__ import annotations

from typing import TYPE_CHECKING

from olivevib.cli.console import Console

if TYPE_CHECKING:
    from olivevib.calibration.guidance import Guidance
    from olivevib.trial import Trial


def preview(trial: Trial, console: Console) -> int:
    """What the board recordings cover so far and what to show next; 3 where it is not enough."""
    from olivevib.pipeline.preview import picture
    from olivevib.pipeline.preview import preview as go_through

    told = ""

    def show(guidance: Guidance, at: float) -> None:
        nonlocal told
        if guidance.advice != told:
            told = guidance.advice
            console.say(f"  {at:6.1f}: {guidance.pairs} common views; {told}")

    last = go_through(trial, show, console.tick)
    for side, share in last.cells.items():
        print(f"{side} camera: board in {share:.0%} of the picture")
        print("\n".join(f"  {line}" for line in picture(last, side)))
    still = f", never with its {', '.join(last.still)} side nearer" if last.still else ""
    print(
        f"{last.pairs} common views, {last.tilts} of 4 tilts{still}, "
        f"far over near {last.far_to_near:.1f}"
    )
    print(last.advice)
    return 0 if last.enough else 3


def sigma(trial: Trial, console: Console) -> int:
    """The sigma of a marker over the working volume as CSV; needs a rig with covariance."""
    from olivevib.pipeline.sigma import expected_sigma, sigma_csv

    found = expected_sigma(trial)
    print(sigma_csv(found), end="")
    console.say(
        f"{len(found.xyz_mm)} points that both cameras see, in the left camera's frame; frame: "
        "fresh in every frame, rig: the same in all frames, length200: of 200 mm across, from the "
        "rig."
    )
    return 0
