"""Scenes with known truth, written as a technician would record them."""

from olivevib.simulation.accelerometer import Sensor
from olivevib.simulation.boards import board_planar
from olivevib.simulation.motion import Decay, Lap, Motion, Phases, Release, Shake, Sway
from olivevib.simulation.planar import Planar, from_modules, marker_planar
from olivevib.simulation.render import Renderer
from olivevib.simulation.scenarios import SCENARIOS, Scenario, scenario
from olivevib.simulation.scene import Body, Camera, Clock, Optics, Scene, seen_at
from olivevib.simulation.staging import Marker, Stage, build
from olivevib.simulation.surroundings import Dapple, Leaf, Limb, Surroundings
from olivevib.simulation.trial_writer import SimulatedTrial, simulate
from olivevib.simulation.truth import Frames, View, frames_of, view_of

__all__ = [
    "SCENARIOS",
    "Body",
    "Camera",
    "Clock",
    "Dapple",
    "Decay",
    "Frames",
    "Lap",
    "Leaf",
    "Limb",
    "Marker",
    "Motion",
    "Optics",
    "Phases",
    "Planar",
    "Release",
    "Renderer",
    "Scenario",
    "Scene",
    "Sensor",
    "Shake",
    "SimulatedTrial",
    "Stage",
    "Surroundings",
    "Sway",
    "View",
    "board_planar",
    "build",
    "frames_of",
    "from_modules",
    "marker_planar",
    "scenario",
    "seen_at",
    "simulate",
    "view_of",
]
