"""The words below each figure of a trial's page."""

from __future__ import annotations

SCENE = (
    "Both cameras with what they see, and the path of each marker (numbers are marker ids)."
    " Coordinates are those of the left camera: x to the right, y down, z away from it."
)
MOTION = (
    "Displacement of each marker from its mean position, while any marker was located. One scale a"
    " row; a gap is a gap, with a"
    " bar at the bottom where the marker was not located; circles are doubtful samples; grey:"
    " start-up, shut-down and decay."
)
FITTED = (
    " Drawn only where the fitted motion holds: before and after it, frames of cameras out of step"
    " would show false depth."
)
CLOSE = (
    "{length} s of the markers that move most: dots are {each}, the thin grey curve is the"
    " fitted line where its frequency is known."
)
ORBITS = (
    "Path about the mean position in three projections, all on one scale of ± {reach} mm."
    " Dots: {each}, evenly"
    " chosen in long records. Thick: the ellipse of the dominant line."
)
SPECTROGRAM = (
    "Displacement of the markers that move most, the powers of their axes added: the darker, the"
    " stronger (dB below the strongest). Dashed: the strongest frequency of each second. Sway"
    " (below {sway} Hz) and what a window of a second smears above it are left out. Dotted"
    " uprights: limits of the phases."
)
FOLDED = " Frequencies are as sampled: above half the frame rate they fold."
TRUE = (
    " Frequencies are those of the fitted motion: they do not fold. It runs at one speed, or at one"
    " that changes slowly, because that is how it was fitted."
)
RATIOS = (
    "How much of the motion of the reference, marker {reference}, arrives at each marker: ratio of"
    " the amplitudes of the dominant line in the same phase. (The reference is the marker of"
    " vibration.reference in trial.toml, else the first whose place is the trunk, else the first of"
    " all.) Diamond: all axes together with one standard deviation; open symbols: single axes."
    " Holds whatever the true frequency is."
)
DECAY = (
    "Free decay of the markers that begin largest, along their axis of largest motion. Dots: single"
    " frames; full: the fit, its three axes with one pole; dashed: its envelope. Frequencies are as"
    " sampled."
)
SIGMA_MAP = (
    "Where this pair measures well, seen from above at the markers' median height: lines of equal"
    " standard deviation of one position, for the image noise of this trial. Dots: the markers;"
    " grey: not seen by both cameras."
)
DISTANCES = (
    "Distances between markers. On one rigid body they should not change: what remains there is"
    " the error of the whole chain. Left: standard deviation of every pair, darker squares vary"
    " more. Right: the steadiest and the least steady pairs and some between."
)
FREQUENCY = (
    "Dominant line of each marker. Filled: known. Open: a candidate; the pictures alone cannot"
    " tell it from the others (per cent: how likely, where that can be said). White ground: below"
    " half the frame rate."
)
AMPLITUDE = (
    "Amplitude spectrum (peak) of the displacement. Triangle: the fitted amplitude of the dominant"
    " line."
)
FLOOR = (
    " Dashed: that line, as this frame rate shows it. Dotted: noise floor, the median of what was"
    " measured away from the line."
)
NO_FLOOR = (
    " Dashed: that line, at its frequency. No noise floor is drawn: the curve is of a fitted"
    " motion, which holds sway, the line and its harmonics and nothing else. What stands between"
    " is the skirt of the window, no measured noise, and other lines would not show. What the fit"
    " may be wrong by is the ± of the amplitude in the table of markers; the axis ends at a tenth"
    " of the smallest of them."
)
NO_FLOOR_AGAIN = " Of the fitted motion, so without a noise floor: see the amplitude spectrum."
ACCELERATION = (
    "Amplitude spectrum (peak) of the acceleration, the powers of the three axes added. Dashed: the"
    " dominant line. Made as the amplitude spectrum of the displacement."
)
PSD = (
    "Power spectral density of the displacement, the powers of the three axes added. Dashed: the"
    " dominant line."
)
SEEN = "State of every sample: full height means located; the thinner, the less is known."
OUTSIDE = (
    " In 3-D, before {start} s and after {end} s all is flagged: there the fitted motion does not"
    " hold, because the machine starts, stops or stands; positions are those of single frames and"
    " enter no figure of the steady phase."
)
SIGMA = (
    "How well one position is known: median (symbol) and the middle 90 % of the frames (bar)."
    " Depth (z) is weaker than x and y by about the distance over the baseline."
)
RESIDUALS = "What the calibration leaves over at each board point, as needles."
HOLDOUT = "Known distances of the board, measured on frames that the calibration never saw."
SENSOR = (
    "the displacement that the accelerometer predicts at the camera's own instants, and what the"
    " camera saw. Left: the stretch that moves most; right: the difference over the whole record."
)
