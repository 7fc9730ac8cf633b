"""Boards, closed form, joint refinement and quality of the stereo calibration."""
