"""Two recordings read at the same time do not disturb each other."""

from concurrent.futures import ThreadPoolExecutor

import pytest
from small_videos import index_of, make_video

from olivevib.files.video import Video


def indices(path) -> list[int]:
    """What each delivered frame says in its pixels; -1 where it counts as damaged."""
    with Video.open(path) as video:
        return [-1 if f.grey is None else index_of(f.grey) for f in video.frames()]


@pytest.mark.parametrize("codec", ["mjpeg", "libx264"])
def test_videos_read_in_two_threads_keep_all_their_frames(tmp_path, codec):
    paths = [make_video(tmp_path / f"{side}.mkv", codec, frames=200) for side in "ab"]
    with ThreadPoolExecutor(2) as pool:
        for _ in range(4):
            for found in pool.map(indices, paths):
                assert found == list(range(200))
