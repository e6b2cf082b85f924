"""Feature points found from the shape of a face alone."""

from cloning.detect.detect import DETECTORS, Detection, detect_points

__all__ = ["DETECTORS", "Detection", "detect_points"]
