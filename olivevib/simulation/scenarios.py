"""Named scenarios: what is recorded, by which cameras, in which light."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from olivevib.errors import UsageError
from olivevib.simulation.accelerometer import Sensor
from olivevib.simulation.motion import Phases
from olivevib.simulation.scene import Clock, Optics
from olivevib.simulation.surroundings import Dapple


@dataclass(frozen=True)
class Shaking:
    """A trunk shaker: forced orbit of trunk and branches, sway, and branches that swing on."""

    f_hz: float
    phases: Phases
    trunk_mm: float = 3.5  # peak of the trunk's orbit along its long axis
    harmonic: float = 0.0  # second harmonic, share of the first
    rotation_rad: float = 0.004
    sway_mm: float = 2.0
    decay_mm: float = 5.0  # free vibration of branches after shut-down


@dataclass(frozen=True)
class Release:
    """A branch pulled aside by a rope that is cut."""

    f_hz: float = 3.1
    damping: float = 0.04
    held_mm: float = 24.0
    start_s: float = 1.5


@dataclass(frozen=True)
class ToyCars:
    """Two cars on closed tracks, pushed by hand (paper, 6.3)."""

    lap_s: float = 7.0


@dataclass(frozen=True)
class Still:
    """Nothing moves: what noise alone gives."""


@dataclass(frozen=True)
class MarkerPlan:
    """Which markers hang on the tree; sizes and tilts are drawn between the two values."""

    library: str = "olive49"
    ids: tuple[int, ...] = (1, 2, 3, 4, 5, 6, 7, 8)
    size_mm: tuple[float, float] = (60.0, 90.0)
    tilt_deg: tuple[float, float] = (0.0, 40.0)
    distance_mm: float = 1400.0


@dataclass(frozen=True)
class BoardPlan:
    """How the calibration board is recorded: held still for stills, or waved before the video."""

    spec: str = "coded:5x5,pitch=60,size=44"
    views: int = 60
    video_fps: float | None = 10.0  # None: stills
    distance_mm: tuple[float, float] = (800.0, 1150.0)


@dataclass(frozen=True)
class CameraPlan:
    """The pair of cameras: lens, place, light, clocks, and how long a sensor row takes."""

    size_px: tuple[int, int] = (1280, 720)
    focal_px: float = 950.0
    baseline_mm: float = 420.0
    optics: Optics = field(default_factory=Optics)
    left: Clock = field(default_factory=Clock)
    right: Clock = field(default_factory=Clock)
    row_time_s: tuple[float, float] = (0.0, 0.0)  # 0: global shutter
    row_times_told: bool = True  # to the technician, who writes them into the trial


@dataclass(frozen=True)
class LightPlan:
    """Leaves behind and before the markers, uneven and moving light."""

    leaves: int = 900
    blur_px: float = 2.0
    front_leaves: int = 0  # a marker
    gradient: float = 0.0
    dapple: Dapple | None = None


@dataclass(frozen=True)
class Encoding:
    """How the files are compressed (JPEG quality); stills are .png or .jpg."""

    video_quality: int = 90
    still_quality: int = 95
    still_suffix: str = ".png"


@dataclass(frozen=True)
class Scenario:
    """One simulated trial; ``title`` is its line in ``olivevib simulate --list``."""

    name: str
    title: str
    seconds: float
    what: Shaking | Release | ToyCars | Still
    band_hz: tuple[float, float] | None
    markers: MarkerPlan = MarkerPlan()
    board: BoardPlan = BoardPlan()
    cameras: CameraPlan = CameraPlan()
    light: LightPlan = LightPlan()
    encoding: Encoding = Encoding()
    sensor: Sensor | None = None

    @property
    def frames(self) -> int:
        """Frames that each camera exposes, dropped ones included."""
        return round(self.seconds * self.cameras.left.fps)

    def lasting(self, seconds: float) -> Scenario:
        """The same scenario over another length; a shaker stops as long before the end."""
        what = self.what
        if isinstance(what, Shaking):
            stop = what.phases.stop_s + seconds - self.seconds
            if stop < what.phases.start_s + what.phases.rise_s + 0.5:
                raise UsageError(
                    f"{seconds:g} s are too short for the scenario {self.name}",
                    "less than half a second of steady shaking would be left",
                    f"take {seconds + what.phases.steady_s[0] + 0.5 - stop:.1f} s or more",
                )
            what = replace(what, phases=replace(what.phases, stop_s=stop))
        return replace(self, seconds=seconds, what=what)


DEMO = Scenario(
    "demo",
    "eight markers on a shaken tree, 12 Hz, cameras in step, global shutter, 10 s",
    10.0,
    Shaking(12.07, Phases(1.5, 0.9, 8.3, 0.4)),
    (5.0, 14.0),
    sensor=Sensor(marker=3),
)

SAMPLE = Scenario(
    "sample",
    "six ArUco markers on a shaken tree, 11.3 Hz, cameras in step, global shutter, 3 s, small",
    3.0,
    Shaking(11.3, Phases(0.4, 0.35, 2.55, 0.2), sway_mm=0.6, decay_mm=2.0),
    (5.0, 14.0),
    markers=MarkerPlan("aruco:DICT_4X4_50", (1, 2, 3, 4, 5, 6), (66.0, 74.0), (0.0, 35.0)),
    board=BoardPlan("charuco:7x5,square=50,marker=35,dict=DICT_5X5_50", 14, None, (800.0, 1250.0)),
    cameras=CameraPlan(optics=Optics(read_noise_dn=0.8, shot_noise_dn=0.002)),
    light=LightPlan(leaves=600, blur_px=5.0),
    encoding=Encoding(video_quality=75, still_quality=85, still_suffix=".jpg"),
    sensor=Sensor(marker=2, rate_hz=500.0),
)

BEYOND_SHAKING = Shaking(25.0, Phases(1.5, 0.9, 8.3, 0.4), trunk_mm=3.0, harmonic=0.12, sway_mm=4.0)
BEYOND = replace(
    DEMO,
    name="beyond",
    title="the same tree at 25 Hz: rolling shutters, cameras 9 ms apart, second harmonic",
    what=BEYOND_SHAKING,
    band_hz=(5.0, 45.0),
    board=BoardPlan(views=30, video_fps=None),
    cameras=CameraPlan(right=Clock(offset_s=0.009, drift_ppm=12.0), row_time_s=(27.8e-6, 26.9e-6)),
)

IN_STEP = replace(
    BEYOND,
    name="beyond-in-step",
    title="the same at 25 Hz, global shutters, cameras in step: nothing can tell the frequency",
    cameras=CameraPlan(),
)

NEAR_THE_RATE = replace(
    BEYOND,
    name="beyond-blind",
    title="the same at 28.6 Hz, rolling shutters, cameras in step: it looks like sway",
    what=replace(BEYOND_SHAKING, f_hz=28.6),
    cameras=CameraPlan(row_time_s=(27.8e-6, 26.9e-6)),
)

WAVED = replace(
    BEYOND,
    name="beyond-waved",
    title="the same at 25 Hz, 9 ms apart, board waved in a video: it tells the row times",
    board=BoardPlan(views=150, video_fps=30.0),
    cameras=replace(BEYOND.cameras, row_times_told=False),
)

RELEASE = replace(
    DEMO,
    name="release",
    title="a branch is pulled aside and let go: free decay at 3.1 Hz, 4 % damping, 8 s",
    seconds=8.0,
    what=Release(),
    band_hz=(1.0, 14.0),
)

TOY_CARS = replace(
    DEMO,
    name="toy-cars",
    title="two toy cars on closed tracks (paper, 6.3): rolling shutters, cameras 2 ms apart, 10 s",
    what=ToyCars(),
    band_hz=None,
    markers=MarkerPlan(ids=(4, 6), size_mm=(85.0, 85.0)),
    cameras=CameraPlan(right=Clock(offset_s=0.002), row_time_s=(27.8e-6, 26.9e-6)),
    light=LightPlan(leaves=200, blur_px=6.0),
    sensor=None,
)

STILL = replace(
    DEMO,
    name="still",
    title="nothing moves: the noise floor of the whole measurement, 5 s",
    seconds=5.0,
    what=Still(),
    sensor=None,
)

DAPPLED = replace(
    DEMO,
    name="dappled",
    title="the demo's tree under a moving crown: shadows wander over the markers, 6 s",
    seconds=6.0,
    what=Shaking(12.07, Phases(0.8, 0.8, 4.8, 0.4)),
    light=LightPlan(gradient=0.25, dapple=Dapple()),
)

LEAVES = replace(
    DEMO,
    name="leaves",
    title="the demo's tree with leaves that sway before the markers and cover parts of them, 6 s",
    seconds=6.0,
    what=Shaking(12.07, Phases(0.8, 0.8, 4.8, 0.4)),
    light=LightPlan(leaves=1800, front_leaves=2),
)

ROUGH = replace(
    DEMO,
    name="rough",
    title="the demo's tree through poor webcams: jitter, lost frames, gamma, strong MJPEG, 6 s",
    seconds=6.0,
    what=Shaking(12.07, Phases(0.8, 0.8, 4.8, 0.4)),
    cameras=CameraPlan(
        optics=Optics(psf_px=0.9, read_noise_dn=2.5, shot_noise_dn=0.03, gamma=1.6),
        left=Clock(jitter_s=0.004, drop_fraction=0.05),
        right=Clock(offset_s=0.0005, drift_ppm=25.0, jitter_s=0.004, drop_fraction=0.05),
    ),
    encoding=Encoding(video_quality=70),
)

SCENARIOS: tuple[Scenario, ...] = (
    *(DEMO, BEYOND, IN_STEP, NEAR_THE_RATE, WAVED, SAMPLE),
    *(RELEASE, TOY_CARS, STILL, DAPPLED, LEAVES, ROUGH),
)


def scenario(name: str) -> Scenario:
    """The scenario of that name; UsageError with the nearest names otherwise."""
    import difflib

    names = [s.name for s in SCENARIOS]
    if name in names:
        return SCENARIOS[names.index(name)]
    near = difflib.get_close_matches(name, names, 1)
    raise UsageError(
        f"there is no scenario {name!r}",
        f"known: {', '.join(names)}",
        f"did you mean {near[0]}?" if near else "olivevib simulate --list describes each",
    )
