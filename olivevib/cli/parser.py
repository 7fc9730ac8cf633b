"""The verbs and their options; only argparse is loaded here, so that --help is instant."""

from __future__ import annotations

import argparse
from typing import Any

from olivevib import __version__
from olivevib.cli.arguments import Parser

STAGE_VERBS = {
    "calibrate": "both lenses and the pair from recordings of a board -> rig.toml",
    "track": "every marker through both videos -> tracks.h5",
    "reconstruct": "the 3-D paths with their sigma -> trajectory.h5",
    "analyse": "displacement, velocity, acceleration, spectra -> vibration.h5",
    "compare": "optical against accelerometer -> comparison.h5",
}
EXPORTS = ("csv", "txt", "h5", "dxf", "step", "iges", "ply", "uff", "c3d", "trc", "mat", "parquet")
EXAMPLES = """\
a trial from two videos and two recordings of the calibration board:
  olivevib new T04 --left left.mkv --right right.mkv --size 60 --ids 1-8 \\
      --calibration-left board_left.mkv --calibration-right board_right.mkv \\
      --board coded:5x5,pitch=60,size=44
  olivevib run T04
  olivevib show T04
  olivevib report T04
exit codes: 0 done, 1 failed, 2 wrong use, 3 done with quality warnings, 130 cancelled
"""


def build_parser() -> argparse.ArgumentParser:
    """The whole command line."""
    parser = Parser(
        prog="olivevib",
        description="Measure the vibration of a shaken olive tree with two webcams.\n"
        "olivevib alone opens the app on the workspace here.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"olivevib {__version__}")
    _common(parser)
    parser.set_defaults(verb="home:app", quiet=False, debug=False)
    verbs = parser.add_subparsers(title="verbs", metavar="VERB")
    _prepare_verbs(verbs)
    _marker_verbs(verbs)
    _stage_verbs(verbs)
    _result_verbs(verbs)
    _other_verbs(verbs)
    return parser


def _add(verbs: Any, name: str, function: str, help_: str, more: str = "") -> Any:
    parser = verbs.add_parser(
        name,
        help=help_,
        description=f"{help_[0].upper()}{help_[1:]}.",
        epilog=more,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    _common(parser)
    parser.set_defaults(verb=function)
    return parser


def _common(parser: Any) -> None:
    """The options that every verb knows, before or after its name."""
    absent = argparse.SUPPRESS
    parser.add_argument(
        "-q", "--quiet", action="store_true", default=absent, help="errors only on stderr"
    )
    parser.add_argument(
        "--debug", action="store_true", default=absent, help="show a traceback on errors"
    )


def _prepare_verbs(verbs: Any) -> None:
    init = _add(verbs, "init", "prepare:init", "make a workspace: trials/ reports/ markers/")
    init.add_argument("dir", nargs="?", default=".", metavar="DIR")
    _capture_verb(verbs)
    new = _add(verbs, "new", "prepare:new", "make a trial from two recordings", _NEW_MORE)
    new.add_argument("trial", metavar="TRIAL", help="a folder, or a name under trials/")
    new.add_argument("--left", required=True, metavar="FILE", help="recording of the left camera")
    new.add_argument("--right", required=True, metavar="FILE", help="recording of the right camera")
    new.add_argument("--calibration-left", metavar="PATH", help="video or folder of stills")
    new.add_argument("--calibration-right", metavar="PATH", help="video or folder of stills")
    new.add_argument("--board", metavar="SPEC", help="the calibration board (see below)")
    new.add_argument("--rig", metavar="FILE", help="rig.toml of an earlier calibration")
    new.add_argument("--markers", metavar="LIB", default="olive49", help="marker library")
    new.add_argument("--size", metavar="MM[,ID:MM]", help="outer side of the dark square; odd ones")
    new.add_argument("--ids", metavar="1,2,5-9", help="the markers on the tree (default: all)")
    new.add_argument("--shutter", choices=("rolling", "global"), help="how the sensors read out")
    new.add_argument("--row-time", metavar="US[,US]", help="microseconds per sensor row, signed")
    new.add_argument("--exposure", type=float, metavar="MS", help="exposure time of both cameras")
    new.add_argument("--band", metavar="5-45", help="where the shaker's frequency may lie, Hz")
    new.add_argument("--left-stamps", metavar="FILE", help="time stamps, one a frame")
    new.add_argument("--right-stamps", metavar="FILE", help="time stamps, one a frame")
    _sensor_options(new)
    new.add_argument("--preset", metavar="NAME", help="how it is read (olivevib preset)")
    new.add_argument("--link", action="store_true", help="leave the recordings where they are")
    _set_option(new)
    archive = _add(
        verbs, "archive", "prepare:archive", "leave a trial out of lists, or take it back"
    )
    archive.add_argument("trials", nargs="+", metavar="TRIAL")
    archive.add_argument("--undo", action="store_true", help="take it back into lists")
    preset = _add(verbs, "preset", "prepare:preset", "keep how an accelerometer file is read")
    preset.add_argument("trial", metavar="TRIAL", help="its [[accelerometers]] say how")
    preset.add_argument("name", metavar="NAME", help="becomes presets/NAME.toml")
    preset.add_argument("--sensor", type=int, default=1, metavar="N", help="which one (1)")


def _sensor_options(new: argparse.ArgumentParser) -> None:
    """Each option again for each sensor, in the same order; - where one is not said."""
    for name, value, help_ in (
        ("", "FILE", "what the logger wrote; again for each sensor"),
        ("-marker", "ID", "where it was fixed; in the sensors' order, - for none"),
        ("-axes", "x,y,z", "which of its axes are x, y, z, such as x,-z,y"),
        ("-lever", "X,Y,Z", "where it sat: mm from the marker's centre, right, down, inwards"),
    ):
        option = f"--accelerometer{name}"
        new.add_argument(option, action="append", default=[], metavar=value, help=help_)


def _capture_verb(verbs: Any) -> None:
    help_ = "record a trial with two cameras at this computer"
    parser = _add(verbs, "capture", "capture:capture", help_, _CAPTURE_MORE)
    parser.add_argument("trial", metavar="TRIAL", help="a folder, or a name under trials/")
    parser.add_argument("--left", required=True, metavar="DEVICE", help="the left camera")
    parser.add_argument("--right", required=True, metavar="DEVICE", help="the right camera")
    parser.add_argument("--seconds", type=float, metavar="S", help="length (default: to Ctrl-C)")
    parser.add_argument("--size", metavar="WxH", help="picture size, such as 1280x720")
    parser.add_argument("--fps", type=float, metavar="N", help="frames a second")
    parser.add_argument(
        "--exposure", type=float, metavar="MS", help="fixed, with the focus (Linux)"
    )
    parser.add_argument("--board", metavar="SPEC", help="record the calibration board instead")
    parser.add_argument("--markers", metavar="LIB", default="olive49", help="marker library")
    parser.add_argument("--ids", metavar="1,2,5-9", help="the markers on the tree")
    parser.add_argument("--marker-size", type=float, metavar="MM", help=_SIZE)
    parser.add_argument("--band", metavar="5-45", help="where the shaker's frequency may lie, Hz")
    parser.add_argument("--no-preview", action="store_true", help="decode nothing while recording")
    parser.add_argument(
        "--wait", action="store_true", help="run the cameras until Enter, then record"
    )


_CAPTURE_MORE = """\
cameras: a number or part of the name as olivevib doctor lists them, /dev/video0, the http://
address of an MJPEG stream, a named pipe of JPEG pictures; to rehearse: the file of a recording,
a folder of JPEG stills, simulated:demo, pattern:
The board goes into TRIAL/calibration, before or after the tree. What the camera sends is recorded
as it is, with a side-car of time stamps and checksums.
"""
_NEW_MORE = """\
boards (columns x rows, mm):
  coded:5x5,pitch=60,size=44[,first=1]       charuco:4x5,square=54,marker=40.5,dict=DICT_4X4_1000
  chessboard:9x6,square=25 (inner corners)   arucogrid:5x7,size=40,gap=10,dict=DICT_6X6_250
  a charuco board may end with ,inverted (white on black) and ,legacy
libraries: olive49 (the default), a library's TOML file, aruco:DICT_4X4_1000, apriltag:36h11
"""


def _marker_verbs(verbs: Any) -> None:
    parser = _add(verbs, "markers", "markers:list_", "libraries of markers, and printing them")
    kinds = parser.add_subparsers(title="what", metavar="WHAT")
    _add(kinds, "list", "markers:list_", "the libraries that can be named")
    show = _add(kinds, "show", "markers:show", "markers as they look, in the terminal")
    show.add_argument("id", nargs="*", metavar="ID", help="such as 1 2 5-9 (default: all)")
    show.add_argument("--ids", metavar="1,2,5-9")
    draw = _add(kinds, "draw", "markers:draw", "one marker with its quiet zone, as PNG")
    draw.add_argument("id", type=int, metavar="ID")
    draw.add_argument("--module-px", type=int, default=20, metavar="N", help="pixels a module")
    sheet = _add(kinds, "sheet", "markers:sheet", "markers at exact size, as PDF or SVG")
    sheet.add_argument("--ids", metavar="1-24", help="which ones (default: all)")
    sheet.add_argument("--size", type=float, required=True, metavar="MM", help=_SIZE)
    sheet.add_argument("--paper", default="A4", help="A4, A3, letter, …; A4-landscape")
    board = _add(kinds, "board", "markers:board", "a calibration board, as PDF or SVG", _NEW_MORE)
    board.add_argument("--board", required=True, metavar="SPEC", help="see below")
    board.add_argument("--paper", default="A3", help="A4, A3, letter, …; A4-landscape")
    check = _add(kinds, "check", "markers:check", "prove the distances between the codes")
    generate = _add(kinds, "generate", "markers:generate", "draw a new library of codes")
    generate.add_argument("--distance", type=int, required=True, metavar="D", help=_DISTANCE)
    generate.add_argument("--mirrors", action="store_true", help="keep it to mirror images too")
    generate.add_argument("--seed", type=int, default=1, metavar="N")
    generate.add_argument("--code", type=int, default=7, metavar="N", help="modules a side (7)")
    generate.add_argument("-o", dest="output", metavar="FILE.toml")
    for kind in (show, draw, sheet, board, check):
        kind.add_argument("--library", default="olive49", metavar="LIB", help="name or TOML file")
    for kind in (draw, sheet, board):
        kind.add_argument("-o", dest="output", required=True, metavar="FILE")


_SIZE = "outer side of the dark square, mm"
_DISTANCE = "modules in which any two codes differ at least (18: safe, 12: many codes)"


def _stage_verbs(verbs: Any) -> None:
    for name, help_ in STAGE_VERBS.items():
        stage = _add(verbs, name, "stages:one", help_)
        stage.add_argument("trials", nargs="+", metavar="TRIAL")
        stage.add_argument("--paper", action="store_true", help="as the paper of 2011 does it")
        if name == "calibrate":
            look = stage.add_mutually_exclusive_group()
            look.add_argument("--preview", action="store_true", help=_PREVIEW)
            look.add_argument("--sigma", action="store_true", help=_SIGMA_MAP)
            _live_options(stage)
        _set_option(stage)
        stage.set_defaults(stage=name)
    run = _add(verbs, "run", "stages:run", "every stage that is missing or stale, in order")
    run.add_argument("trials", nargs="+", metavar="TRIAL")
    _set_option(run)
    batch = _add(verbs, "batch", "batch:batch", "run and report many trials, in parallel", _BATCH)
    batch.add_argument("trials", nargs="+", metavar="TRIAL", help="trials, or folders of trials")
    where = batch.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, metavar="N", help="processes here (default: cores)")
    where.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster instead")
    batch.add_argument("--json", action="store_true", help="results as JSON, for programs")


def _live_options(parser: Any) -> None:
    live = parser.add_argument_group("--preview on running cameras (recorded into TRIAL)")
    live.add_argument("--left", metavar="DEVICE", help="the left camera, as in olivevib capture")
    live.add_argument("--right", metavar="DEVICE", help="the right camera")
    live.add_argument("--board", metavar="SPEC", help="default: the board of the trial")
    live.add_argument("--seconds", type=float, metavar="S", help="length (default: to enough)")
    live.add_argument("--size", metavar="WxH", help="picture size, such as 1280x720")
    live.add_argument("--fps", type=float, metavar="N", help="frames a second")
    live.add_argument("--exposure", type=float, metavar="MS", help="fixed, with the focus (Linux)")
    live.add_argument(
        "--markers", metavar="LIB", default="olive49", help="library of a coded board"
    )
    live.add_argument("--wait", action="store_true", help="record only after Enter")


_PREVIEW = "what the board covers, and what to show next: of recordings, or of running cameras"
_SIGMA_MAP = "only print the sigma to expect over the working volume, from rig.toml (CSV)"
_BATCH = """\
prints a line a trial: its name and the hash of its results, equal wherever it was measured.
What is done is skipped; the same command goes on after Ctrl-C, a kill or a power cut.
a cluster on this machine: dask scheduler --host 127.0.0.1
                           dask worker tcp://127.0.0.1:8786 --nworkers 2 --nthreads 1
"""


def _set_option(parser: Any) -> None:
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a setting in trial.toml first, e.g. detection.fill=0.7",
    )


_REPORT = """\
Several trials also give season.html and its table season.csv (a row a marker and phase), in DIR or
in the current folder.
"""


def _result_verbs(verbs: Any) -> None:
    show = _add(verbs, "show", "results:show", "state and headline numbers of a trial")
    show.add_argument(
        "trial", nargs="?", metavar="TRIAL", help="without: all trials here, a line each"
    )
    show.add_argument("--json", action="store_true", help="everything, for programs")
    report = _add(verbs, "report", "results:report", "one self-contained page a trial", _REPORT)
    report.add_argument("trials", nargs="+", metavar="TRIAL", help="trials, or folders of trials")
    report.add_argument("-o", dest="output", metavar="DIR", help="where the pages go")
    report.add_argument("--pdf", action="store_true", help="also as PDF (needs olivevib[pdf])")
    report.add_argument("--figures", action="store_true", help="also each figure as an SVG file")
    report.add_argument("--season", action="store_true", help="only the page over all trials")
    report.add_argument("--archived", action="store_true", help="archived trials in it too")
    report.add_argument("--parquet", action="store_true", help="the season's table also as Parquet")
    export = _add(verbs, "export", "results:export", "the 3-D paths for other programs")
    export.add_argument("trial", metavar="TRIAL")
    export.add_argument("--to", required=True, choices=EXPORTS, help="format")
    export.add_argument("-o", dest="output", metavar="FILE", help="a file, or - for stdout")
    export.add_argument("--markers", metavar="1,2", help="only these ids")
    check = _add(verbs, "check", "results:check", "integrity of everything in a trial")
    check.add_argument("trial", metavar="TRIAL")


_STUDY = """\
without a NAME: the list. Prints tables, and keeps them with charts: NAME.md, NAME.json, NAME-*.svg.
exit code 3: measured, and something that is asked for was not reached.
"""


def _study_verbs(verbs: Any) -> None:
    kinds = {
        "paper": "the experiments of the paper of 2011, reproduced",
        "benchmark": "speed and accuracy beside other libraries, in one run",
    }
    for name, help_ in kinds.items():
        study = _add(verbs, name, f"studies:{name}", help_, _STUDY)
        study.add_argument("name", nargs="?", metavar="NAME", help="which one")
        study.add_argument("--effort", type=float, default=1.0, metavar="X", help=_EFFORT)
        study.add_argument("--seed", type=int, default=1, metavar="N")
        study.add_argument("--json", action="store_true", help="for programs")
        study.add_argument("-o", dest="output", metavar="DIR", help=f"default: reports/{name}")


_EFFORT = "times the number of samples that the goals ask for (0.05: a first look)"
_LAMP = """\
Let an LED flash at a known frequency, such as 500 Hz (no multiple of half the frame rate), through
paper right before the lens, with an exposure of less than half a flash. Record some seconds with
olivevib capture. Stripes must travel over the picture.
Without --led: a trial whose calibration board was waved in a video; the row times that it showed.
"""


_SERVE = """\
needs the package textual-serve: pip install textual-serve. Whoever reaches the port can do in the
workspace whatever the app can; without --host only this computer does.
"""


def _plan_verb(verbs: Any) -> None:
    help_ = "what these cameras can measure, before the trial"
    parser = _add(verbs, "plan", "plan:plan", help_, _PLAN_MORE)
    numbers = (
        ("--fps", 30.0, "N", "frames a second"),
        ("--readout", None, "MS", "from the first row to the last; 0: global shutter"),
        ("--offset", None, "MS", "how much later the right camera exposes; 0: in step"),
        ("--marker", 60.0, "MM", _SIZE),
        ("--distance", 1400.0, "MM", "from the cameras to the tree"),
        ("--frequency", None, "HZ", "of the machine (default: the whole band)"),
        ("--amplitude", 3.0, "MM", "peak displacement that is expected (3)"),
        ("--exposure", 2.0, "MS", "exposure time (2)"),
        ("--focal-px", 950.0, "PX", "focal length in pixels (950)"),
        ("--baseline", 420.0, "MM", "distance between the cameras (420)"),
        ("--seconds", 10.0, "S", "length of steady shaking (10)"),
    )
    for name, default, unit, more in numbers:
        parser.add_argument(name, type=float, default=default, metavar=unit, help=more)
    parser.add_argument("--rows", type=int, default=720, metavar="N", help="picture height (720)")
    parser.add_argument("--band", metavar="5-45", help="where the shaker's frequency may lie, Hz")
    parser.add_argument("--json", action="store_true", help="everything, for programs")


_PLAN_MORE = """\
statuses: direct (no alias exists), confirmable (sampling times will decide), ambiguous (candidates
will remain), blind (no amplitude). What is not given counts as unknown, never as good.
"""


def _other_verbs(verbs: Any) -> None:
    demo = _add(verbs, "demo", "simulated:demo", "a simulated trial, measured, against its truth")
    demo.add_argument("dir", nargs="?", metavar="DIR", help="a new folder (default: demo)")
    demo.add_argument("--seconds", type=float, metavar="S", help="length of the recording")
    demo.add_argument("--seed", type=int, default=1, metavar="N")
    demo.add_argument(
        "--beyond", action="store_true", help="25 Hz with rolling shutters: above the frame rate"
    )
    simulate = _add(verbs, "simulate", "simulated:simulate", "record a scenario with known truth")
    simulate.add_argument("dir", nargs="?", metavar="DIR", help="a new trial folder")
    simulate.add_argument("--scenario", metavar="NAME", help="see --list")
    simulate.add_argument("--seed", type=int, default=1, metavar="N")
    simulate.add_argument("--list", action="store_true", help="name and describe the scenarios")
    help_ = "a camera's row time from a lamp, or from a waved board"
    rowtime = _add(verbs, "rowtime", "row_time:row_time", help_, _LAMP)
    rowtime.add_argument(
        "file", metavar="FILE", help="a recording of the lamp; without --led: TRIAL"
    )
    rowtime.add_argument("--led", type=float, metavar="HZ", help="flashes a second")
    rowtime.add_argument("--camera", metavar="NAME", help="whose it is, where the file cannot say")
    _plan_verb(verbs)
    _study_verbs(verbs)
    serve = _add(verbs, "serve", "serve:serve", "the app in a browser", _SERVE)
    serve.add_argument("--host", default="127.0.0.1", metavar="NAME", help="default: 127.0.0.1")
    serve.add_argument("--port", type=int, default=8000, metavar="N", help="default: 8000")
    doctor = _add(verbs, "doctor", "doctor:doctor", "what works on this machine")
    doctor.add_argument("--json", action="store_true", help="for programs")
