"""The six parameters of the paper, under its names, and which detector reads its markers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DetectionSettings:
    """Extraction, classification and tracking parameters (paper, section 3).

    fill: Δfill, least share of its bounding rectangle that a location bar fills.
    pos: Δpos, largest distance of two bars' centroids in lengths of the longer bar.
    angle_deg: Δangle, smallest angle between the axes of neighbouring bars, degrees.
    conf: Δconf, largest share of unmatched modules of the code area.
    scale: Δscale, how much a location rectangle exceeds the marker's last bounding box.
    marker: Δmarker, how many markers a frame must show; 0: all that were seen so far.
    mode: "default" fits the drawn marker to the image; "paper" is the paper's algorithm as printed,
    which alone uses the first four parameters.
    paper_centre: take the mean of the cornerstones as the centre, as the paper does (biased).
    """

    fill: float = 0.6
    pos: float = 1.4
    angle_deg: float = 15.0
    conf: float = 2 / 49
    scale: float = 1.6
    marker: int = 0
    mode: str = "default"
    paper_centre: bool = False

    def __post_init__(self) -> None:
        ranges = {"fill": (0.0, 1.0), "pos": (0.1, 10.0), "angle_deg": (0.0, 90.0)}
        ranges |= {"conf": (0.0, 0.5), "scale": (1.0, 10.0), "marker": (0, 10_000)}
        if self.mode not in ("default", "paper"):
            raise ValueError(f'mode must be "default" or "paper", got {self.mode!r}')
        for name, (low, high) in ranges.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"{name} must lie in {low} … {high}, got {value}")
