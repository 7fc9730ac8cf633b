"""The door of the room: one Detector for every library."""

from __future__ import annotations

from collections.abc import Sequence

from olivevib.arrays import Grey
from olivevib.detection.bend import Wrapped
from olivevib.detection.detection import Detection, Reader
from olivevib.detection.follow import Follower
from olivevib.detection.foreign import ForeignReader
from olivevib.detection.paper import PaperReader
from olivevib.detection.settings import DetectionSettings
from olivevib.detection.template_reader import TemplateReader
from olivevib.marker import MarkerLibrary


class Detector:
    """Finds the markers of one library in grey images; not to be shared between threads.

    library: the paper's layout ("olive"), or a foreign family read through OpenCV.
    settings: the paper's parameters, and ``mode``; foreign families know no parameters.
    wrapped: which markers are wrapped round a branch (default mode of the paper's layout).
    """

    def __init__(
        self,
        library: MarkerLibrary,
        settings: DetectionSettings | None = None,
        wrapped: Sequence[Wrapped] = (),
    ) -> None:
        self.library = library
        self.settings = settings or DetectionSettings()
        if library.family != "olive":
            self._reader: Reader = ForeignReader(library)
        elif self.settings.mode == "paper":
            self._reader = PaperReader(library, self.settings)
        else:
            self._reader = TemplateReader(library, self.settings, wrapped)

    def detect(self, grey: Grey) -> list[Detection]:
        """All markers in ``grey`` (H, W) uint8, sorted by id; ValueError for other arrays."""
        if grey.ndim != 2 or grey.dtype != "uint8":
            raise ValueError(f"need a grey image (H, W) uint8, got {grey.shape} {grey.dtype}")
        return self._reader.detect(grey)

    def follower(self) -> Follower | None:
        """What follows its markers from frame to frame; None where each frame is read by itself."""
        reader = self._reader
        return Follower(reader) if isinstance(reader, TemplateReader | ForeignReader) else None

    def mirrored_ids(self, grey: Grey) -> tuple[int, ...]:
        """Ids seen as in a mirror: the recording is mirrored. Foreign families cannot tell: ()."""
        if isinstance(self._reader, PaperReader | TemplateReader):
            return self._reader.mirrored_ids(grey)
        return ()
