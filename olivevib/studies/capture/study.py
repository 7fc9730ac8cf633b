"""The study ``olivevib benchmark capture`` from its parts: goals, table, facts."""

from __future__ import annotations

import math
import signal

from olivevib.progress import Tick
from olivevib.studies.capture.damage import Flips, Full, flips, full_disk, sound_frames
from olivevib.studies.capture.lamp import row_time_error
from olivevib.studies.capture.losses import Kills, Run, Vanished, kills, long_run, vanish
from olivevib.studies.study import Effort, Goal, Study, Table

TEN_MINUTES = 600.0
LEAST_S = 4.0
RUNS = ((30.0, False, 1.0), (30.0, True, 0.1), (60.0, False, 0.1), (120.0, False, 0.1))
MILLION = 1_000_000


def run(effort: Effort, tick: Tick) -> Study:
    """Two MJPEG cameras on 127.0.0.1: long runs, kills, vanishing cameras, a full disk, flips."""
    runs = []
    for number, (fps, preview, part) in enumerate(RUNS):
        tick(number, len(RUNS) + 5, f"two cameras at {fps:g} frames/s")
        seconds = max(LEAST_S, TEN_MINUTES * part * effort.share)
        runs.append(long_run(fps, seconds, preview=preview))
    tick(4, 9, "kill -9 of the recorder")
    killed = kills(effort, effort.count(50))
    tick(5, 9, "cameras that go away")
    gone = [vanish(how) for how in (signal.SIGKILL, signal.SIGSTOP) for _ in range(effort.count(5))]
    tick(6, 9, "a full disk")
    full = full_disk()
    tick(7, 9, "flipped bytes")
    flipped = flips(effort, effort.count(200))
    counted, whole = sound_frames(effort.count(MILLION, 2000), tick)
    lamp = [row_time_error(effort, sign * 0.027) for sign in (1.0, -1.0)]
    goals = (
        *_run_goals(runs),
        _kill_goal(killed),
        _gone_goal(gone),
        _full_goal(full),
        _flip_goal(flipped, counted, whole),
        _lamp_goal(lamp),
    )
    facts = (
        ("cameras", "MJPEG over HTTP on 127.0.0.1, 1280 x 720, each in a process of its own"),
        ("effort", f"{effort.share:g} of ten minutes, 50 kills, 200 damages, a million frames"),
    )
    return Study("capture", "Capture that loses nothing", (_run_table(runs),), (), goals, facts)


def _run_table(runs: list[Run]) -> Table:
    columns = ("frames/s", "seconds", "preview", "frames", "lost", "altered", "stamps off, us",
               "share of a core")  # fmt: skip
    rows = tuple(
        (r.fps, r.seconds, "yes" if r.preview else "no", sum(k.frames for k in r.kept),
         sum(k.lost for k in r.kept), sum(k.altered for k in r.kept),
         max(k.stamp_us for k in r.kept), round(r.core_share, 4))
        for r in runs
    )  # fmt: skip
    return Table("Recordings", columns, rows, "frames, lost, altered: of both cameras together")


def _run_goals(runs: list[Run]) -> tuple[Goal, ...]:
    lost = sum(k.lost for r in runs for k in r.kept)
    altered = sum(k.altered for r in runs for k in r.kept)
    frames = sum(k.frames for r in runs for k in r.kept)
    stamp = max(k.stamp_us for r in runs for k in r.kept)
    plain, watched = runs[0].core_share, runs[1].core_share
    words = f"{lost} drops, {altered} altered of {frames} frames"
    sound = not (lost or altered)
    light = plain < 0.1 if math.isfinite(plain) else None
    bearable = watched < 0.5 if math.isfinite(watched) else None
    return (
        Goal("2 x 720p30, also 60 and 120 fps", "0 drops, bit-identical", words, sound),
        Goal("stored stamps", "within 1 us", f"{stamp:.0f} us", stamp <= 1),
        Goal("without preview", "< 10 % of a core", f"{plain:.1%}", light),
        Goal("with preview", "< 50 % of a core", f"{watched:.1%}", bearable),
    )


def _kill_goal(killed: Kills) -> Goal:
    words = f"{killed.worst_lost} at most in {killed.times} kills, {killed.unusable} files unusable"
    reached = killed.worst_lost <= 1 and not killed.unusable
    return Goal("kill -9 of the recorder", "at most 1 frame a camera, all open", words, reached)


def _gone_goal(gone: list[Vanished]) -> Goal:
    slowest, lost = max(g.closed_s for g in gone), sum(g.other_lost for g in gone)
    words = f"{slowest:.2f} s at most of {len(gone)}, the other camera lost {lost}"
    return Goal(
        "a source vanishes", "closed < 1 s, other unaffected", words, slowest < 1 and not lost
    )


def _full_goal(full: Full | None) -> Goal:
    asked = "message, everything readable"
    if full is None:
        return Goal("a full disk", asked, "not measured: no right to mount a small disk here", None)
    words = full.said.split(":")[0] if full.said else "no message"
    words += "; both recordings whole" if full.usable else "; a recording is not whole"
    return Goal("a full disk", asked, words, bool(full.said) and full.usable)


def _flip_goal(flipped: Flips, counted: int, whole: bool) -> Goal:
    false = flipped.false_alarms + (0 if whole else 1)
    words = (
        f"{flipped.named} of {flipped.altered} altered frames named in {flipped.times} damages, "
        f"{false} false alarms in {counted} sound frames"
    )
    reached = flipped.named == flipped.altered and not false
    return Goal("40 flipped bytes", "every altered frame named, 0 false alarms", words, reached)


def _lamp_goal(errors: list[float]) -> Goal:
    worst = max(abs(e) for e in errors)
    words = f"{worst:.3%} at most (down- and upward)"
    return Goal("row time from a lamp, 27 ms readout", "within 1 %", words, worst < 0.01)
