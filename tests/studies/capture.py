"""Long runs of the recorder: what it loses in ten minutes, in fifty kills, with flipped bytes.

    python tests/studies/capture.py loss --fps 30 --seconds 600 [--preview]
    python tests/studies/capture.py kill --times 50
    python tests/studies/capture.py flips --times 200
    python tests/studies/capture.py million
    python tests/studies/capture.py vanish --times 5
    python tests/studies/capture.py full        (needs the right to mount a small tmpfs)

Each prints one line a measurement. The cameras are MJPEG servers on 127.0.0.1 in processes of
their own; every picture carries its number, and the server writes down what it sent.
"""

from __future__ import annotations

import argparse
import itertools
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from capture_cameras import MjpegServer, Plan, jpeg, number_of, numbered

from olivevib.files.capture import CameraFacts, Controls, Recording, Shot, read_sidecar, sidecar_of
from olivevib.files.capture.verify import verify
from olivevib.files.packets import scan_video
from olivevib.files.video import Video

CLI = [sys.executable, "-m", "olivevib"]
FACTS = CameraFacts("study", "study", "", "http", "mjpeg", "", (128, 96), 30.0, "header")


def serve(arguments):
    """A camera: prints its address, writes number and checksum of every frame sent to a file."""
    size = tuple(int(v) for v in arguments.size.split("x"))
    pictures = [jpeg(size, seed=k, quality=80) for k in range(6)]
    if arguments.preview:
        pictures = shaken_tree()
    server = MjpegServer(Plan(fps=arguments.fps, pictures=pictures))
    print(server.address, len(pictures[0]), flush=True)
    told = 0
    with Path(arguments.log).open("w", buffering=1) as log:
        while True:
            time.sleep(0.002)
            new = server.sent[told:]
            told += len(new)
            log.writelines(f"{number} {crc}\n" for number, crc in new)


def shaken_tree():
    """Pictures of the demo's eight markers, for the preview to find."""
    from olivevib.simulation import Renderer, build, frames_of, scenario
    from olivevib.simulation.recording import jpeg as coded

    stage = build(scenario("demo"), 1)
    renderer, exposed = Renderer(stage.tree, "left"), frames_of(stage, "left").exposed_s
    return [coded(renderer.frame(n, float(exposed[n])), 90) for n in range(120, 126)]


class Cameras:
    """Two servers in processes of their own."""

    def __init__(self, folder, fps, size, preview=False):
        self.logs = [folder / f"{side}.log" for side in ("left", "right")]
        command = [sys.executable, __file__, "serve", "--fps", str(fps)]
        command += ["--preview"] if preview else []
        self._processes = [
            subprocess.Popen(
                [*command, "--size", size, "--log", str(log)], stdout=subprocess.PIPE, text=True
            )
            for log in self.logs
        ]
        told = [p.stdout.readline().split() for p in self._processes]
        self.addresses = [words[0] for words in told]
        self.bytes_a_frame = int(told[0][1])

    def sent(self):
        """What each camera has sent: number -> checksum."""
        return [_read_log(log) for log in self.logs]

    def stop_left(self, how):
        """Kill or stop the left camera's process."""
        self._processes[0].send_signal(how)

    def close(self):
        for process in self._processes:
            process.kill()
            process.wait()


def _read_log(log):
    lines = log.read_text().split("\n")[:-1]
    return dict(tuple(map(int, line.split())) for line in lines)


def recorder(cameras, trial, *options):
    command = [*CLI, "capture", str(trial), "--left", cameras.addresses[0]]
    command += ["--right", cameras.addresses[1], *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def cpu_s(pid):
    """Processor time of a process so far, s."""
    words = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def recorded(video):
    """Number and checksum of every frame in a recording, and its stamps in µs."""
    from olivevib.files.container import open_container
    from olivevib.files.packets import Packets

    container, stream = open_container(video)
    with container:
        found = [(bytes(p), p.pts) for p, _ in Packets(video, container, stream)]
    return [(number_of(d), zlib.crc32(d)) for d, _ in found], [int(s) for _, s in found]


def loss(arguments):
    """Drops, bit identity, stamps and processor time of a long recording."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cameras = Cameras(folder, arguments.fps, "1280x720", arguments.preview)
        options = ["--seconds", str(arguments.seconds)]
        options += [] if arguments.preview else ["--no-preview"]
        process = recorder(cameras, folder / "T", *options)
        while not (folder / "T" / "right.nut").exists():
            time.sleep(0.05)
        began, busy = time.monotonic(), cpu_s(process.pid)
        time.sleep(arguments.seconds - 2)
        share = (cpu_s(process.pid) - busy) / (time.monotonic() - began)
        out, narration = process.communicate()
        sent = cameras.sent()
        cameras.close()
        print(f"exit {process.returncode}: {out.strip()}")
        print(f"processor: {share:.1%} of a core; {cameras.bytes_a_frame} bytes a picture")
        for side, was in zip(("left", "right"), sent, strict=True):
            _compare(folder / "T" / f"{side}.nut", side, was, arguments.fps)
        if process.returncode not in (0, 3):
            print(narration)


def _compare(video, side, was, fps):
    frames, stamps_us = recorded(video)
    numbers = [n for n, _ in frames]
    gaps = sum(b - a - 1 for a, b in itertools.pairwise(numbers))
    altered = sum(was[n] != crc for n, crc in frames)
    first = numbers[0]
    ideal = np.array(
        [round((5000 + n / fps) * 1e6) - round((5000 + first / fps) * 1e6) for n in numbers]
    )
    error = np.abs(np.array(stamps_us) - stamps_us[0] - ideal).max()
    print(
        f"{side}: {len(frames)} frames, {gaps} lost between first and last, {altered} altered, "
        f"stamps off by {error} us at most; {verify(video).words}"
    )


def kill(arguments):
    """kill -9 at random moments: frames lost, and whether the recordings open."""
    rng = random.Random(arguments.seed)
    lost, torn, unusable = [], 0, 0
    for trial in range(arguments.times):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            cameras = Cameras(folder, 30, "1280x720")
            process = recorder(cameras, folder / "T", "--no-preview")
            while not (folder / "T" / "right.nut").exists():
                time.sleep(0.02)
            time.sleep(rng.uniform(0.3, 2.0))
            before = [max(was) for was in cameras.sent()]
            process.send_signal(signal.SIGKILL)
            process.communicate()
            cameras.close()
            for side, last in zip(("left", "right"), before, strict=True):
                video = folder / "T" / f"{side}.nut"
                try:
                    with Video.open(video) as opened:
                        sound = [f.index for f in opened.frames() if f.grey is not None]
                    whole = [n for n, _ in recorded(video)[0]][: len(sound)]
                    lost.append(max(0, last - whole[-1]))
                    torn += scan_video(video).frames - len(sound)
                    stamps = read_sidecar(sidecar_of(video))
                    unusable += len(stamps.lines) < len(sound)
                except Exception as error:
                    unusable += 1
                    print(f"kill {trial} {side}: {error!r}")
            new = ["--left", str(folder / "T/left.nut"), "--right", str(folder / "T/right.nut")]
            new += ["--left-stamps", str(folder / "T/left.stamps.csv")]
            new += ["--right-stamps", str(folder / "T/right.stamps.csv")]
            made = subprocess.run(
                [*CLI, "new", str(folder / "N"), *new], capture_output=True, check=False
            )
            unusable += made.returncode != 0
            if made.returncode:
                print(made.stderr.decode())
    worst = max(lost)
    print(
        f"{arguments.times} kills, {len(lost)} recordings: frames lost a camera {worst} at most, "
        f"{sum(lost)} in all; {torn} torn at the end; {unusable} that would not open"
    )


def _small_recording(video, frames, pictures):
    recording = Recording(video, FACTS, 0)
    for k in range(frames):
        data = numbered(pictures[k % len(pictures)], k)
        recording.append(Shot(data, k * 10_000_000, k * 10_000_000), k * 10_000_000, Controls())
    recording.close()


def flips(arguments):
    """40 flipped bytes, many times: is every altered frame named, and nothing else."""
    rng = np.random.default_rng(arguments.seed)
    named = altered = false = 0
    with tempfile.TemporaryDirectory() as name:
        video = Path(name) / "left.nut"
        pictures = [jpeg((640, 360), seed=k) for k in range(5)]
        _small_recording(video, 300, pictures)
        data = np.frombuffer(video.read_bytes(), np.uint8)
        places = _payloads(video)
        for _ in range(arguments.times):
            at = rng.choice(data.size, 40, replace=False)
            broken = data.copy()
            broken[at] ^= rng.integers(1, 256, 40, dtype=np.uint8)
            video.write_bytes(broken.tobytes())
            truly = {k for k, (a, b) in enumerate(places) if ((at >= a) & (at < b)).any()}
            between = any(not any(a <= x < b for a, b in places) for x in at)
            told = verify(video)
            suspects = set(told.suspects) | ({told.in_flight} - {None})
            altered += len(truly)
            named += len(truly & suspects)
            false += 0 if between else len(suspects - truly)
    print(
        f"{arguments.times} times 40 flipped bytes: {named} of {altered} altered frames named, "
        f"{false} others named where no byte between frames was hit"
    )


def _payloads(video):
    from olivevib.files.container import open_container
    from olivevib.files.packets import Packets

    container, stream = open_container(video)
    with container:
        out = []
        data = video.read_bytes()
        for packet, _ in Packets(video, container, stream):
            at = data.index(bytes(packet), max(0, packet.pos))
            out.append((at, at + packet.size))
        return out


def million(arguments):
    """A million sound frames: no false alarm."""
    with tempfile.TemporaryDirectory() as name:
        video = Path(name) / "left.nut"
        tiny = jpeg((16, 16), seed=1, quality=30)
        began = time.monotonic()
        _small_recording(video, 1_000_000, [tiny])
        wrote = time.monotonic() - began
        told = verify(video)
        print(f"{told.frames} frames written in {wrote:.0f} s: {told.words}; whole: {told.whole}")


def vanish(arguments):
    """How soon the file of a camera is closed that dies (kill) or falls silent (stop)."""
    from olivevib.pipeline.capture import CapturePlan, capture

    for how in (signal.SIGKILL, signal.SIGSTOP):
        closed, others = [], []
        for _ in range(arguments.times):
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                cameras = Cameras(folder, 30, "1280x720")
                seen = {}

                def watch(state, cameras=cameras, seen=seen, how=how):
                    if state.elapsed_s > 1 and "end" not in seen:
                        seen["end"] = time.monotonic_ns()
                        cameras.stop_left(how)
                    if state.cameras["left"].gone and "closed" not in seen:
                        seen["closed"] = time.monotonic_ns()

                plan = CapturePlan(*cameras.addresses, seconds=4, preview=False)
                capture(folder / "T", plan, watch)
                cameras.close()
                numbers = [n for n, _ in recorded(folder / "T" / "right.nut")[0]]
                closed.append((seen["closed"] - seen["end"]) * 1e-9)
                others.append(numbers[-1] - numbers[0] + 1 - len(numbers))
        worst = max(closed)
        print(f"{how.name}: file closed within {worst:.2f} s at most; other camera lost {others}")


def full(arguments):
    """A small tmpfs that fills while two cameras record, with and without the reserve."""
    script = Path(__file__).resolve()
    with tempfile.TemporaryDirectory() as name:
        inner = f"mount -t tmpfs -o size=40m tmpfs {name} && {sys.executable} {script} full-inside"
        subprocess.run(["unshare", "-rm", "sh", "-c", f"{inner} --folder {name}"], check=True)


def full_inside(arguments):
    from olivevib.errors import InputError
    from olivevib.pipeline.capture import CapturePlan, capture

    folder = Path(arguments.folder)
    pictures = [jpeg((1280, 720), seed=k, quality=80) for k in range(4)]
    for reserve in (10_000_000, 0):
        trial = folder / f"T{reserve}"
        told = Plan(fps=60, pictures=pictures)
        with MjpegServer(told) as left, MjpegServer(told) as right:
            plan = CapturePlan(left.address, right.address, seconds=60, preview=False)
            captured = capture(trial, replace(plan, reserve_bytes=reserve))
        free = shutil.disk_usage(folder).free
        print(f"reserve {reserve}: {captured.error.what if captured.error else 'no error'}")
        assert isinstance(captured.error, InputError)
        for side in ("left", "right"):
            told = verify(trial / f"{side}.nut")
            print(f"  {side}: {told.words}; free {free / 1e6:.1f} MB")
        shutil.rmtree(trial)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=sorted(STUDIES))
    parser.add_argument("--fps", type=float, default=30.0)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--log", default="")
    parser.add_argument("--folder", default="")
    parser.add_argument("--preview", action="store_true")
    arguments = parser.parse_args()
    STUDIES[arguments.what](arguments)


STUDIES = {
    "serve": serve,
    "loss": loss,
    "kill": kill,
    "flips": flips,
    "million": million,
    "vanish": vanish,
    "full": full,
    "full-inside": full_inside,
}

if __name__ == "__main__":
    main()
